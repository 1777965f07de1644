"""Schemes for algorithms that step instances one by one, from the order of their actions.

held(order)              # inputs are constant over a step
extrapolated(order, 1)   # inputs follow straight lines through their last values; 2: parabolas
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
    """Return the scheme of an order of steps with inputs extrapolated by polynomials of a degree, 1 or 2."""

    def scheme(instances: Mapping[str, Instance], system: System) -> Scheme:
        """The scheme on one system."""
        wiring = Wiring(system, instances)
        extrapolation = Extrapolation(wiring, degree)
        warnings = unable(instances, extrapolation.unable)
        return Scheme(wiring, list(order(wiring, extrapolation)), list(wiring.exchange()), extrapolation, warnings)

    return scheme


def unable(instances: Mapping[str, Instance], names: list[str]) -> dict[str, str]:
    """Return a warning for each instance whose FMU accepts no input derivatives, by name."""
    return {
        name: f"{name}: {instances[name].fmu.description.file.name} takes no derivatives of its inputs, which are held "
        "instead"
        for name in names
    }
