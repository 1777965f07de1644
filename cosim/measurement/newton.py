"""Periodic state of a nonlinear system under a sine, by Newton's method on the map of one window.

    orbit = Orbit(linear, nominal, turn, steps)
    z = z + orbit.correction(z, states)        # states at `orbit.samples` steps of a run that started with z

A run that starts with the state z, the source at phase 0, comes back to phase 0 after some periods. With P(z) the state
there, the periodic state, harmonics included, is the fixed point P(z) = z. Newton's method with a constant Jacobian
(the chord method) takes that of the linearised cycle, M, in place of P':

    (1 - M) dz = P(z) - z

Phase 0 falls between communication points, and P is the trigonometric interpolation (`signals/periodic.py`) of seven
states that follow the window; M is the same sum of powers of the one-step matrix. The interpolation is exact for three
harmonics, and so for a linear system, whose predicted steady state stays as it is.

An error shrinks from step to step by the factor rho((1 - M)^-1 (P' - M)). Where P' has one real eigenvalue above 1, as
the middle branch of a fold has, det(1 - P') and det(1 - M) differ in sign and that factor is above 1: the method does
not converge to a branch that such a mode leaves.
"""

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.window_map import StartMap
from hfsa.cosim.signals.periodic import closing_weights

SAMPLES = 7
"""States that are sampled after a window: as many as three harmonics and a mean take."""

MOST_CORRECTIONS = 20
"""Corrections after which Newton's method is given up."""

CONTRACTION = 0.5
"""Largest factor of the error from one correction to the next; a run that settles by itself costs less then."""

_LARGEST_WEIGHTS = 100.0
"""Largest sum of the weights' magnitudes: samples whose phases are too close to whole turns apart tell nothing."""


class Orbit:
    """The map of a window of `steps` steps of a system, linearised about its equilibrium.

    `linear` is the linear map of the state, `nominal` holds the nominal sizes of its members, `turn` is the phase of
    the source per step [rad].

    Attributes:
        samples: numbers of steps after which the state is sampled: whole patterns of ticks, from `steps` on.
        is_known: whether the samples determine the state at phase 0.
    """

    def __init__(self, linear: StartMap, nominal: NDArray[np.float64], turn: float, steps: int):
        first = math.ceil(steps / linear.steps)
        self.samples = [(first + k) * linear.steps for k in range(SAMPLES)]
        self._linear, self._nominal, self._first = linear, nominal, first
        self._weights = closing_weights(turn * np.array(self.samples))
        self.is_known = bool(np.sum(np.abs(self._weights)) < _LARGEST_WEIGHTS)

    @cached_property
    def _inverse(self) -> np.ndarray:
        """(1 - M)^-1 of members divided by their nominal sizes, which differ by many orders of magnitude."""
        nominal = self._nominal
        closing = self._linear.weighted(self._first, self._weights)
        return np.linalg.inv(np.eye(len(nominal)) - closing * nominal / nominal[:, None])

    def closed(self, states: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
        """Return the state at phase 0 from the sampled states, (n,)."""
        return self._weights @ np.array(states)

    def correction(self, start: NDArray[np.float64], states: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
        """Return dz for the state that a run started with, (n,), from the states sampled in that run."""
        return self._nominal * (self._inverse @ ((self.closed(states) - start) / self._nominal))
