"""Schemes whose instances step one by one: what an algorithm's order of steps needs around it.

held(order)              # inputs stay what they are over a step
extrapolated(order, 1)   # inputs move on lines through what they were; 2: on parabolas (`actions/extrapolation.py`)
"""

from collections.abc import Callable, Iterator, Mapping

from hfsa.cosim.actions.extrapolation import Extrapolation
from hfsa.cosim.actions.schedule import Action
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.masters.algorithm import Scheme
from hfsa.cosim.systems.system import System

MakeScheme = Callable[[Mapping[str, Instance], System], Scheme]


def held(order: Callable[[Wiring], Iterator[Action]]) -> MakeScheme:
    """Return the scheme of an order of steps with inputs held."""

    def scheme(instances: Mapping[str, Instance], system: System) -> Scheme:
        """The scheme on one system."""
        wiring = Wiring(system, instances)
        return Scheme(wiring, list(order(wiring)), list(wiring.exchange()))

    return scheme


def extrapolated(order: Callable[[Wiring, Extrapolation], Iterator[Action]], degree: int) -> MakeScheme:
    """Return the scheme of an order of steps with inputs on polynomials of a degree, 1 or 2."""

    def scheme(instances: Mapping[str, Instance], system: System) -> Scheme:
        """The scheme on one system."""
        wiring = Wiring(system, instances)
        extrapolation = Extrapolation(wiring, degree)
        warnings = unable(instances, extrapolation.unable)
        return Scheme(wiring, list(order(wiring, extrapolation)), list(wiring.exchange()), extrapolation, warnings)

    return scheme


def unable(instances: Mapping[str, Instance], names: list[str]) -> dict[str, str]:
    """Return a warning for each instance whose FMU takes no derivatives of its inputs, by name."""
    return {
        name: f"{name}: {instances[name].fmu.description.file.name} takes no derivatives of its inputs, which are held "
        "instead"
        for name in names
    }
