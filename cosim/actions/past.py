"""Bus values at the last communication points, and their polynomial extrapolation."""

from collections.abc import Iterator
from ctypes import c_size_t

import numpy as np


class Past:
    """History of up to three communication points, latest first: (time [s], bus (n,)) of each.

    Attributes:
        times, points: storage for three points, (3,) and (3, n); the first `known` are valid.
    """

    def __init__(self, n: int):
        self.times, self.points, self.known = np.zeros(3), np.zeros((3, n)), c_size_t(0)

    def __len__(self) -> int:
        return self.known.value

    def __iter__(self) -> Iterator[tuple[float, np.ndarray]]:
        return ((float(self.times[i]), self.points[i].copy()) for i in range(len(self)))

    def clear(self) -> None:
        """Remove all points."""
        self.known.value = 0

    def take(self, time: float, bus: np.ndarray) -> None:
        """Add a point."""
        self.times[1:], self.points[1:] = self.times[:2].copy(), self.points[:2].copy()
        self.times[0], self.points[0] = time, bus
        self.known.value = min(len(self) + 1, 3)

    def predicted(self, time: float) -> np.ndarray:
        """Return the bus values at a time [s], by the polynomial through the points."""
        result = np.zeros(self.points.shape[1])
        for i in range(len(self)):
            weight = 1.0
            for j in range(len(self)):
                if j != i:
                    weight *= (time - self.times[j]) / (self.times[i] - self.times[j])
            result += weight * self.points[i]
        return result
