"""Expected responses of the points of a sweep, from the linearised FMUs, to compare the measured ones with.

    expected = expectations(plan, Theory(linear, draft, dense, is_foreign), starts, scene, settled_to=1e-3)
    expected["reference.command.position[3]"][k]           # that of the input at frequency k

Where the steady state of the stepped system is predicted, its response contains the effect of the communication steps.
Elsewhere it is the exact response, and the predicted error of the steps is allowed in addition.
"""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.steady_start import SteadyStart
from hfsa.cosim.masters.algorithms import LIMITED
from hfsa.cosim.measurement.expectation import Expectation
from hfsa.cosim.measurement.multisine import Run
from hfsa.cosim.measurement.sweep import LinearSweep
from hfsa.cosim.results.files import Plan
from hfsa.cosim.signals.frequency_response import largest_of_unit, negligible
from hfsa.cosim.signals.response_scale import Scale
from hfsa.cosim.systems.scene import Scene

_COUNTED = 1e-2
"""Size of an output, relative to the largest in the same unit, from which on its error counts by itself."""


@dataclasses.dataclass(frozen=True)
class Theory:
    """The linear response of a system, and its values at the frequencies of a dense draft of the plan.

    `is_foreign` is whether an FMU of another maker is among those that were linearised.
    """

    linear: LinearSweep
    draft: Plan
    dense: NDArray[np.complex128]
    is_foreign: bool

    def scaled(self, frequency: NDArray[np.float64]) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
        """Return the responses at frequencies [Hz], exactly 0 where they are so by symmetry, and the scale of errors.

        Both have shape (frequencies, outputs, inputs). Antiresonances have the scale of what surrounds them.
        """
        exact, own = self.linear.response(frequency), np.abs(self.dense)
        scale = np.abs(exact)
        if len(own) > 1:
            scale = Scale(self.draft.frequency, own).at(frequency, exact)
        units = [signal.unit for signal in self.draft.outputs]
        of_unit = np.array([[largest_of_unit(column, units) for column in row.T] for row in np.abs(exact)])
        zero = negligible(self.dense, units, [signal.amplitude for signal in self.draft.inputs])
        scale = np.maximum(np.where(zero, 0.0, scale), _COUNTED * of_unit.transpose(0, 2, 1))
        return np.where(zero, 0.0, exact), scale


def with_expectations(runs: Sequence[Run], plan: Plan, expected: Mapping[str, Sequence[Expectation]]) -> list[Run]:
    """Return the runs of a multisine with the expectations at their lines, at the places of the plan."""
    found = []
    for run in runs:
        driven, row = [], 0
        for one in run.driven:
            own = [expected[plan.inputs[one.input].name][k] for k in one.places]
            if run.start is not None and run.start.gain is not None:
                predicted = run.start.gain[row : row + len(own)] / one.wave.gain[:, None]
                own = [e.of_steps(response) for e, response in zip(own, predicted, strict=True)]
            row += len(own)
            driven.append(dataclasses.replace(one, expected=tuple(own)))
        found.append(dataclasses.replace(run, driven=tuple(driven)))
    return found


def expectations(
    plan: Plan, theory: Theory, starts: Mapping[str, Sequence[SteadyStart]], scene: Scene, settled_to: float
) -> dict[str, list[Expectation]]:
    """Return the expected responses by input, at the frequencies of a plan.

    A measured response may be off by the tolerances of the scene and of settling together, both relative.
    """
    exact, scale = theory.scaled(plan.frequency)
    unknown = np.inf if scene.algorithm in LIMITED else 0.0
    of_steps = np.full(exact.shape, unknown) if plan.step_error is None else np.nan_to_num(plan.step_error, nan=0.0)
    found: dict[str, list[Expectation]] = {}
    for i, signal in enumerate(plan.inputs):
        found[signal.name] = []
        for k in range(len(plan.frequency)):
            one = Expectation(
                exact[k, :, i], scene.tolerance + settled_to, of_steps[k, :, i], scale[k, :, i], not theory.is_foreign
            )
            start = starts[signal.name][k] if signal.name in starts else None
            if start is not None and start.gain is not None:
                one = one.of_steps(start.gain / signal.amplitude)
            found[signal.name].append(one)
    return found
