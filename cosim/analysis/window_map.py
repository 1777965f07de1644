"""What a start determines, from one communication point to another: the linear map of an algorithm's memory.

A run is determined by the vector z at a communication point: states, sampled states and held outputs (`values`), and
where inputs are extrapolated the connected outputs at the two points before, as deviations from the present ones
(`earlier`). All else at the point follows from z by an exchange. On linearised FMUs z is a matrix times z one pattern
of ticks before, plus what the source adds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.stability import OneStep
from hfsa.cosim.linear.cycle import Replace

_ROUNDING = 1e-6
"""Relative difference between two powers of the map above which z does not hold all of the memory."""


@dataclass(frozen=True, eq=False)
class StartMap:
    """Linear map of z over one pattern of ticks, without the source.

    Attributes:
        values: full names of the first members of z; the others are `earlier`, row by row.
        matrix: (n, n).
        steps: communication steps of the pattern.
    """

    values: tuple[str, ...]
    matrix: NDArray[np.float64]
    steps: int

    def weighted(self, first: int, weights: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the weighted sum of the maps over `first`, `first` + 1, ... patterns, (n, n)."""
        one = np.eye(len(self.matrix))
        total = np.zeros_like(self.matrix)
        for weight in weights[::-1]:
            total = self.matrix @ total + weight * one
        return np.linalg.matrix_power(self.matrix, first) @ total


def start_map(one: OneStep) -> StartMap | None:
    """Return the map of z; `None` where an algorithm has more memory than z."""
    layout = one.layout
    names = {f"{c}.{n}": layout.place[c, n] for c, block in layout.blocks.items() for n in block.values}
    places, bus = np.array([*names.values()], dtype=int), layout.bus_places
    past = layout.past[:2] if layout.past.size else np.zeros((0, 0), dtype=int)
    n, m = len(places), past.size
    start = np.zeros((layout.size, n + m))
    start[places, np.arange(n)] = 1.0
    for action in layout.wiring.exchange():
        operation = layout.exchange(action)
        assert isinstance(operation, Replace)
        before = start[operation.columns]
        start[operation.rows] = before if operation.matrix is None else operation.matrix @ before
    for k, row in enumerate(past):
        start[row] = start[bus]
        start[row, n + k * len(bus) + np.arange(len(bus))] += 1.0

    def read(whole: np.ndarray) -> np.ndarray:
        """Return the rows of z among those of the whole vector."""
        return np.vstack([whole[places], *(whole[row] - whole[bus] for row in past)])

    once = one.transition @ start
    matrix, twice = read(once), read(one.transition @ once)
    size = np.abs(matrix) @ np.abs(matrix) + np.abs(twice)
    if np.any(np.abs(twice - matrix @ matrix) > _ROUNDING * np.maximum(size, 1e-300)):
        return None
    return StartMap(tuple(names), matrix, one.steps)
