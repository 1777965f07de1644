"""Readings of a lock-in amplifier, window after window, without the drift of what it measures.

readings = Readings(lock_in, outputs=3)
readings.begin(samples=1000, turn=2 * np.pi * 1e-3)
readings.take()                                # after each window
readings.gains, readings.doubt                 # of all windows so far, and of the last one
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.signals.drift import Drift, of_sine
from hfsa.cosim.signals.frequency_response import LONGEST_MEMORY

_PARTS = (
    "gain[{}].real",
    "harmonic[{}].second.real",
    "harmonic[{}].third.real",
    "gain[{}].imaginary",
    "harmonic[{}].second.imaginary",
    "harmonic[{}].third.imaginary",
    "mean[{}]",
)


class Readings:
    """Readings of an amplifier of a number of outputs.

    Attributes:
        amplitudes: complex amplitudes of the fundamental and its second and third harmonic, (windows, 3, outputs).
        doubts: error of those of the last window due to a drift, (3, outputs).
    """

    def __init__(self, lock_in: Instance, outputs: int):
        self._lock_in = lock_in
        self._results = lock_in.handle([part.format(i) for part in _PARTS for i in range(1, outputs + 1)])
        self._windows = lock_in.handle(["windows"])
        self._outputs = outputs
        self.begin(1, 0.0)

    def begin(self, samples: int, turn: float) -> None:
        """Forget all readings; windows have a number of samples, and the source a phase per sample [rad]."""
        self._samples, self._turn, self._number = samples, turn, 0
        self._means = np.zeros((0, self._outputs))
        self._amplitudes = self.amplitudes = np.zeros((0, 3, self._outputs), complex)
        self.doubts = np.zeros((3, self._outputs))

    def take(self, window: int) -> None:
        """Read the results of window number 1, 2, ...; `RuntimeError` where it is not the amplifier's last one."""
        done = self._lock_in.get(self._windows)[0]
        if done != window:
            raise RuntimeError(f"{self._lock_in.name} has completed {done:g} windows, expected {window}")
        *parts, mean = self._lock_in.get(self._results).reshape(len(_PARTS), -1)
        amplitudes = np.array(parts[:3]) + 1j * np.array(parts[3:])
        recent = slice(1 - LONGEST_MEMORY, None)
        if window != self._number + 1:  # windows of a ramp or of a wait are not read
            recent = slice(0, 0)
        self._number = window
        self._means = np.array([*self._means[recent], mean])
        self._amplitudes = np.array([*self._amplitudes[recent], amplitudes])
        self.amplitudes = self._amplitudes
        if len(self._means) > 1:
            first = window - len(self._means)
            self.amplitudes, self.doubts = self._drift.removed(self._means, self._amplitudes, first)

    @property
    def gains(self) -> NDArray[np.complex128]:
        """Complex amplitudes of the fundamental, (windows, outputs)."""
        return self.amplitudes[:, 0]

    @property
    def doubt(self) -> NDArray[np.float64]:
        """Error of the last gains due to a drift, (outputs,)."""
        return self.doubts[0]

    @property
    def harmonics(self) -> NDArray[np.float64]:
        """Amplitudes of the second and the third harmonic of the last window, (2, outputs)."""
        return np.abs(self.amplitudes[-1, 1:])

    @property
    def mean(self) -> NDArray[np.float64]:
        """Means over the last window, (outputs,)."""
        return self._means[-1]

    @property
    def _drift(self) -> Drift:
        """The drift of windows of this length; most runs on a steady state end before they need it."""
        return _drift_of(self._samples, self._turn)


@lru_cache(maxsize=32)
def _drift_of(samples: int, turn: float) -> Drift:
    """Return `of_sine`, computed once for each frequency."""
    return of_sine(samples, turn)
