"""Plan of a sweep: the linear response of its scene, and its frequencies, spaced along that response.

draft = draft_plan(assembly, inputs, outputs, scene, request)       # with a dense grid
theory = theory_of(assembly, draft, request, warn)
dense = theory.response(draft.frequency)
plan = dataclasses.replace(draft, frequency=frequencies(draft, dense, request))
"""

import contextlib
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.experiments.setup import Warn
from hfsa.cosim.experiments.sweep_request import EVEN, SweepRequest
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.measurement.sweep import LinearSweep, linear, plan_sweep
from hfsa.cosim.results.files import Plan, Theory
from hfsa.cosim.signals import excitation
from hfsa.cosim.signals.frequency_response import negligible
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene

# number of frequencies of the dense grid, and of the theoretical line
_DENSE, _LINE = 5000, 1000


def draft_plan(assembly: Assembly, inputs: list[str], outputs: list[str], scene: Scene, request: SweepRequest) -> Plan:
    """Return the plan with a dense logarithmic grid of frequencies."""
    with usage_errors():
        frequency = excitation.logarithmic(*request.band(scene), _DENSE)
        return plan_sweep(assembly, inputs, outputs, frequency, scene.amplitude, request.settings(scene))


def theory_of(assembly: Assembly, draft: Plan, request: SweepRequest, warn: Warn) -> LinearSweep | None:
    """Return the linearised system; `None`, with a warning, for a stepped sweep of a system without derivatives."""
    try:
        found = linear(assembly, draft)
    except StructureError as error:
        if request.method == "linear":
            raise
        warn(f"there is no linear response to compare with: {error}")
        if not request.settling_time_min and not request.settling_periods:
            warn(
                "a response that comes after a point has settled is not seen; --settling-time-min waits for a dead time"
            )
        return None
    if found.growth and request.method == "linear":
        warn(f"the system is unstable: a mode grows by {found.growth:.3g} 1/s, so its response cannot be measured")
    return found


def frequencies(draft: Plan, dense: NDArray[np.complex128] | None, request: SweepRequest) -> NDArray[np.float64]:
    """Return the frequencies in the requested spacing; logarithmic where there is no linear response."""
    points = request.points or (_LINE if request.method == "linear" else 40)
    if len(draft.frequency) == 1 and request.points not in (None, 1):
        raise StructureError(
            f"--points {points}: from {draft.frequency[0]:g} to {draft.frequency[0]:g} Hz there is one"
        )
    with usage_errors():
        spaced = EVEN.get(request.grid, excitation.logarithmic if dense is None else None)
        if spaced is not None:
            return spaced(draft.frequency[0], draft.frequency[-1], points)
        assert dense is not None
        return _along(draft, dense, points)


def theoretical(theory: LinearSweep, draft: Plan, dense: NDArray[np.complex128]) -> Theory:
    """Return the linear response as a line through the band, to compare points with."""
    frequency = _along(draft, dense, _LINE)
    return Theory(frequency, theory.response(frequency))


def _along(draft: Plan, dense: NDArray[np.complex128], points: int) -> NDArray[np.float64]:
    """Return frequencies spaced along the entries of the response that are not zero by symmetry."""
    units, amplitudes = [signal.unit for signal in draft.outputs], [signal.amplitude for signal in draft.inputs]
    return excitation.along_response(draft.frequency, dense[:, ~negligible(dense, units, amplitudes)], points)


@contextlib.contextmanager
def usage_errors() -> Iterator[None]:
    """Raise `StructureError` in place of `ValueError`: the request cannot be measured."""
    try:
        yield
    except ValueError as error:
        raise StructureError(str(error)) from error
