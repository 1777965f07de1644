"""Iterative coupling: all instances repeat a step together until their inputs at its end equal the outputs.

The correction of the guess is in `actions/iterated.py`.
"""

from collections.abc import Mapping
from functools import partial

from hfsa.cosim.actions.iterated import IteratedStep
from hfsa.cosim.actions.schedule import discrete_first
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.linear.cycle import interface_jacobian
from hfsa.cosim.masters.algorithm import Algorithm, Scheme
from hfsa.cosim.masters.schemes import unable
from hfsa.cosim.masters.stepped import stepped
from hfsa.cosim.systems.system import System


def scheme(method: str, instances: Mapping[str, Instance], system: System) -> Scheme:
    """Return the scheme of a method, `fixed_point` or `quasi_newton`, on one system."""
    wiring = Wiring(system, instances)
    iterated = IteratedStep(wiring, method, partial(interface_jacobian, wiring))
    step = [*discrete_first(wiring), iterated]
    return Scheme(wiring, step, list(wiring.exchange()), iterated, unable(instances, iterated.unable))


FIXED_POINT = Algorithm(
    "fixed_point",
    "all instances step until inputs and outputs agree at the step's end, each pass from the last one's outputs",
    rank=80,
    inputs="iterated",
    order=2,
    scheme=partial(scheme, "fixed_point"),
    make=stepped,
)
QUASI_NEWTON = Algorithm(
    "quasi_newton",
    "all instances step until inputs and outputs agree at the step's end, by Newton's method on linearised FMUs",
    rank=90,
    inputs="iterated",
    order=2,
    scheme=partial(scheme, "quasi_newton"),
    make=stepped,
    is_candidate=True,
    is_advised=True,
)
ALGORITHMS = (FIXED_POINT, QUASI_NEWTON)
