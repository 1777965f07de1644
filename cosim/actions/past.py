"""Bus values at the last communication points, and their polynomial extrapolation."""

from collections.abc import Iterator

import numpy as np


class Past:
    """History of up to three communication points, latest first: (time [s], bus (n,)) of each.

    Attributes:
        times, points: storage for three points, (3,) and (3, n); the first `known` (1,) are valid.
    """

    def __init__(self, n: int):
        self.times, self.points, self.known = np.zeros(3), np.zeros((3, n)), np.zeros(1, np.uintp)

    def __len__(self) -> int:
        return self.known.item()

    def __iter__(self) -> Iterator[tuple[float, np.ndarray]]:
        return ((float(self.times[i]), self.points[i].copy()) for i in range(len(self)))

    def clear(self) -> None:
        """Remove all points."""
        self.known[0] = 0

    def take(self, time: float, bus: np.ndarray) -> None:
        """Add a point."""
        self.times[1:], self.points[1:] = self.times[:2].copy(), self.points[:2].copy()
        self.times[0], self.points[0] = time, bus
        if len(self) < 3:
            self.known[0] += 1

    def predicted(self, time: float) -> np.ndarray:
        """Return the bus values at a time [s], by the polynomial through the points."""
        result, known = np.zeros(self.points.shape[1]), len(self)
        for i in range(known):
            weight = 1.0
            for j in range(known):
                if j != i:
                    weight *= (time - self.times[j]) / (self.times[i] - self.times[j])
            result += weight * self.points[i]
        return result
