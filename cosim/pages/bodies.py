"""Machines that move in a run, how much their displacements are magnified, and what frames leave out of the motion."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.figures.drawing import Panel
from hfsa.cosim.pages.thinning import lost_motion
from hfsa.cosim.results.recorded import Recorded

FRAMES = 1500
"""Number of rows at most whose motion is drawn."""
_SHOWN = 0.12
"""Largest displacement as drawn, relative to the size of its body."""
_COARSE = 0.1
"""Lost motion, relative to the range of a signal, from which on it is told."""


@dataclass(frozen=True)
class Body:
    """A machine that moves: where it is in the scene, its panel, and the displacements of its layers.

    Attributes:
        name: name of its instance.
        panel: the body where all signals are zero.
        displacements: by layer (rows, points, axes) in the unit of the panel; `None` for one that stands still.
        signals: the signals that move it, (rows,) each.
    """

    name: str
    panel: Panel
    displacements: Sequence[NDArray[np.float64] | None]
    signals: Sequence[NDArray[np.float64]]

    @property
    def magnification(self) -> float:
        """Factor of its displacements that makes them visible: 1, 2 or 5 times a power of ten."""
        pairs = zip(self.panel.layers, self.displacements, strict=True)
        drawn = [(layer.points, shift) for layer, shift in pairs if layer.cells.size]
        largest = max((float(np.abs(shift).max()) for _, shift in drawn if shift is not None), default=0.0)
        size = float(np.ptp(np.vstack([points for points, _ in drawn]), axis=0).max())
        return one_two_five(_SHOWN * size / largest) if 0 < largest < math.inf else 1.0


def left_out(recorded: Recorded, bodies: Sequence[Body], kept: NDArray[np.int64]) -> list[str]:
    """Return sentences on what the frames of a page do not show."""
    if len(kept) == len(recorded.at) or not bodies:
        return []
    lost = max(lost_motion(recorded.at, body.signals, kept) for body in bodies)
    words = f"the motion is drawn at {len(kept)} of {len(recorded.at)} points in time"
    if lost > _COARSE:
        words += f", between which it changes by {100 * lost:.0f} % of its range; --from and --to choose a stretch"
    return [words]


def one_two_five(value: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is no larger than a value above 0."""
    power = 10.0 ** math.floor(math.log10(value))
    return power * max(step for step in (1.0, 2.0, 5.0) if step * power <= value * (1 + 1e-9))
