"""Gauss-Seidel: instances step one after the other, each with the newest outputs of those before it.

With `_linear` and `_quadratic` inputs move over a step: an input ends at the newest output of a source that has stepped
already, and extrapolates the output of a source that has not.
"""

from collections.abc import Iterator

from hfsa.cosim.actions.extrapolation import Extrapolation
from hfsa.cosim.actions.schedule import Action, discrete_first
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.masters.algorithm import Algorithm
from hfsa.cosim.masters.schemes import extrapolated, held
from hfsa.cosim.masters.stepped import stepped


def gauss_seidel(wiring: Wiring) -> Iterator[Action]:
    """Yield the actions of a step with held inputs."""
    yield from discrete_first(wiring)
    waiting = [stepper.instance for stepper in wiring.continuous]
    for stepper in wiring.continuous:
        waiting.remove(stepper.instance)
        yield stepper
        for group in stepper.groups:
            yield group
            yield from (transfer for transfer in group.transfers if transfer.target in waiting)


def gauss_seidel_extrapolated(wiring: Wiring, extrapolation: Extrapolation) -> Iterator[Action]:
    """Yield the actions of a step with moving inputs."""
    yield from discrete_first(wiring)
    yield extrapolation.history
    waiting, stepped = [stepper.instance for stepper in wiring.continuous], []
    for stepper in wiring.continuous:
        waiting.remove(stepper.instance)
        yield from extrapolation.of(stepper.instance, stepped)
        yield stepper
        stepped.append(stepper.instance)
        for group in stepper.groups:
            if any(transfer.target in waiting for transfer in group.transfers):
                yield group
                yield from (t for t in group.transfers if t.target in waiting and t.target in extrapolation.unable)


_WORDS = "instances step one after the other, with the newest outputs of those before"

ALGORITHMS = (
    Algorithm(
        "gauss_seidel",
        f"{_WORDS}; inputs are held",
        rank=10,
        inputs="held",
        order=1,
        scheme=held(gauss_seidel),
        make=stepped,
        is_ordered=True,
        is_candidate=True,
        is_advised=True,
    ),
    Algorithm(
        "gauss_seidel_linear",
        f"{_WORDS}; inputs move on straight lines",
        rank=40,
        inputs="extrapolated",
        order=2,
        scheme=extrapolated(gauss_seidel_extrapolated, 1),
        make=stepped,
        is_ordered=True,
        is_candidate=True,
        is_advised=True,
    ),
    Algorithm(
        "gauss_seidel_quadratic",
        f"{_WORDS}; inputs move on parabolas",
        rank=50,
        inputs="extrapolated",
        order=3,
        scheme=extrapolated(gauss_seidel_extrapolated, 2),
        make=stepped,
        is_ordered=True,
        is_candidate=True,
    ),
)
