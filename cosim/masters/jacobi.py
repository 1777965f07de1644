"""Jacobi: all instances step with the outputs of the communication point, in any order or at once.

With `_linear` and `_quadratic` inputs extrapolate the outputs of the last communication points.
"""

from collections.abc import Iterator

from hfsa.cosim.actions.extrapolation import Extrapolation
from hfsa.cosim.actions.schedule import Action, discrete_first
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.masters.algorithm import Algorithm
from hfsa.cosim.masters.schemes import extrapolated, held
from hfsa.cosim.masters.stepped import stepped


def jacobi(wiring: Wiring) -> Iterator[Action]:
    """Yield the actions of a step with held inputs."""
    yield from discrete_first(wiring)
    yield from wiring.continuous


def jacobi_extrapolated(wiring: Wiring, extrapolation: Extrapolation) -> Iterator[Action]:
    """Yield the actions of a step with extrapolated inputs."""
    yield from discrete_first(wiring)
    yield extrapolation.history
    for stepper in wiring.continuous:
        yield from extrapolation.of(stepper.instance)
        yield stepper


_WORDS = "all instances step with the outputs of the communication point"

ALGORITHMS = (
    Algorithm(
        "jacobi",
        f"{_WORDS}; inputs are held",
        rank=20,
        inputs="held",
        order=1,
        scheme=held(jacobi),
        make=stepped,
    ),
    Algorithm(
        "jacobi_linear",
        f"{_WORDS}; inputs move on straight lines",
        rank=60,
        inputs="extrapolated",
        order=2,
        scheme=extrapolated(jacobi_extrapolated, 1),
        make=stepped,
    ),
    Algorithm(
        "jacobi_quadratic",
        f"{_WORDS}; inputs move on parabolas",
        rank=70,
        inputs="extrapolated",
        order=3,
        scheme=extrapolated(jacobi_extrapolated, 2),
        make=stepped,
    ),
)
