"""Expectation of a measured point: the response that the linearised FMUs predict, and how far it may be off.

A response that leaves it is no small-signal response: the system is nonlinear at this amplitude, or has dynamics that
its directional derivatives do not show, or a part of the response comes later than the settled point. A response that
is zero or noise is awaited, unless the expectation is zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

_LINEAR = 1e-6
"""Harmonic distortion below which a response is that of a linear system."""


@dataclass(frozen=True)
class Expectation:
    """Expected responses of the outputs to one input at one frequency; arrays have shape (outputs,).

    Attributes:
        response: output per input, exactly 0 where it is so by symmetry.
        allowed: largest relative error of a measured response.
        step_error: what the communication steps may add to it, infinite where that is not known.
        scale: size that errors are relative to, at least that of the response.
        is_exact: whether the derivatives are known to be those of the FMUs, as of ours: a response with harmonics that
            is off is then that of a nonlinear system, and is no disagreement.
    """

    response: NDArray[np.complex128]
    allowed: float
    step_error: NDArray[np.float64]
    scale: NDArray[np.float64]
    is_exact: bool = False

    def of_steps(self, response: NDArray[np.complex128]) -> Self:
        """Return the expectation of the response that the stepped system is predicted to have, (outputs,)."""
        found = np.where(self.rests, 0.0, response)
        return replace(self, response=found, step_error=np.zeros(len(found)))

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
        return np.where(found > self.allowed + self.step_error, found, 0.0)

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
        if not found[worst] or (self.is_exact and distortion > _LINEAR):
            return ""
        return (
            f"{outputs[worst]} is {100 * found[worst]:.3g} % off the linear response, {abs(self.response[worst]):.4g} "
            f"(distortion {100 * distortion:.2g} %): nonlinear, late, or not what its derivatives are of; compare a "
            "smaller --amplitude, a longer --settling-time-min"
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
    """Return why outputs, (n,), have not settled after a simulated time [s].

    `remaining` is the relative transient of each, `silent` whether it is zero or noise where a response is awaited.
    """
    if np.any(silent):
        return (
            f"{outputs[int(np.argmax(silent))]} has not responded after {simulated:.3g} s: its gain is zero or noise; "
            "it does not follow this input, or its dead time is longer than --settling-time"
        )
    worst = int(np.argmax(np.nan_to_num(remaining, nan=np.inf)))
    return (
        f"{outputs[worst]} has not settled after {simulated:.3g} s: its transient or drift is still "
        f"{remaining[worst]:.2g} of its gain, expected {tolerance:g} or less"
    )
