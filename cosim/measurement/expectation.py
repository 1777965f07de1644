"""Expectation of a measured point: the response that the linearised FMUs predict, and how far it may be off.

A response that leaves it is no small-signal response: the system is nonlinear at this amplitude, or the measurement or the
linearised FMUs are wrong. A response that is not there is awaited unless the expectation is zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Expectation:
    """Expected responses, output per input, and their largest errors relative to a scale; all have shape (outputs,).

    An error is infinite where the response is not known well enough to be compared. `scale` is the size that errors are
    relative to, at least that of the response.
    """

    response: NDArray[np.complex128]
    error: NDArray[np.float64]
    scale: NDArray[np.float64]

    @property
    def rests(self) -> NDArray[np.bool_]:
        """Whether each output is expected to rest."""
        return self.response == 0

    def disagreement(self, response: NDArray[np.complex128], floor: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the errors of a measured response relative to the scale, 0 where they are allowed, (outputs,).

        Responses below `floor`, (outputs,), are noise.
        """
        size = np.maximum(self.scale, np.abs(response))
        is_heard = np.maximum(np.abs(response), np.abs(self.response)) > floor
        found = np.divide(np.abs(response - self.response), size, out=np.zeros(len(size)), where=is_heard)
        return np.where(found > self.error, found, 0.0)

    def sentence(
        self,
        outputs: Sequence[str],
        response: NDArray[np.complex128],
        floor: NDArray[np.float64],
        distortion: float,
    ) -> str:
        """Return a sentence on the largest disagreement of a measured response; empty where there is none.

        `distortion` is the largest harmonic distortion of the outputs.
        """
        found = self.disagreement(response, floor)
        worst = int(np.argmax(found))
        if not found[worst]:
            return ""
        return (
            f"{outputs[worst]} is off the linear response by {100 * found[worst]:.3g} %, expected "
            f"{100 * self.error[worst]:.2g} % or less (|H| {abs(response[worst]):.4g} measured, "
            f"{abs(self.response[worst]):.4g} expected, harmonic distortion {100 * distortion:.2g} %): the system is "
            "nonlinear at this amplitude, or has dynamics that its directional derivatives do not show, or has not "
            "settled; compare a smaller --amplitude and a longer --settling-time-min"
        )


def relative(values: NDArray[np.float64], scale: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values over a scale, (n,): infinite over a scale of 0, and 0 where the value is 0 too."""
    values = np.broadcast_to(values, scale.shape)
    return np.divide(values, scale, out=np.where(values == 0, 0.0, np.inf), where=scale > 0)


def unsettled(
    outputs: Sequence[str],
    remaining: NDArray[np.float64],
    silent: NDArray[np.bool_],
    tolerance: float,
    simulated: float,
) -> str:
    """Return why outputs have not settled after a simulated time [s]: their remaining transients, relative, and silence."""
    if np.any(silent):
        return (
            f"{outputs[int(np.argmax(silent))]} has not responded after {simulated:.3g} s: its gain is zero or noise; it "
            "does not follow this input, or its dead time is longer than --settling-time"
        )
    worst = int(np.argmax(np.nan_to_num(remaining, nan=np.inf)))
    return (
        f"{outputs[worst]} has not settled after {simulated:.3g} s: its transient or drift is still "
        f"{remaining[worst]:.2g} of its gain, expected {tolerance:g} or less"
    )
