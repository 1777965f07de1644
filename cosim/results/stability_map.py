"""Writes a stability map in HDF5.

/         title created tool tool_version git_commit command python platform format_version status
/system   the scene, as words
/map      the axes: dimension scales; growth [1/s], stable (true or false), verified (1 a simulation agrees, 0 it does
          not, -1 none) over them; algorithm step_size [s] (attributes)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.results import hdf5
from hfsa.cosim.results.hdf5 import Node
from hfsa.cosim.results.records import SystemRecord

GEOMETRIC = 10.0
"""Ratio of an axis' ends from which its points are evenly spaced by ratio."""


@dataclass(frozen=True)
class Axis:
    """An argument and its values, (n,), in the argument's unit."""

    name: str
    values: NDArray[np.float64]


@dataclass(frozen=True)
class StabilityMap:
    """What was found over one or two axes, arrays of their shape.

    Attributes:
        growth: of the fastest mode that counts [1/s], NaN where the scene cannot be built.
        stable: whether no mode that counts grows, and the passes of a fixed point lead to it; false where not built.
        verified: 1 where a simulation agrees, 0 where it does not, -1 where there was none or the mode is too slow.
        messages: why points could not be built, each once.
    """

    scene: str
    algorithm: str
    step_size: float
    axes: Sequence[Axis]
    growth: NDArray[np.float64]
    stable: NDArray[np.bool_]
    verified: NDArray[np.int8]
    messages: Sequence[str]

    @property
    def built(self) -> NDArray[np.bool_]:
        """Where the scene can be built."""
        return ~np.isnan(self.growth)

    @property
    def agreement(self) -> tuple[int, int]:
        """Points at which a simulation agrees, and points that were simulated."""
        return int((self.verified == 1).sum()), int((self.verified >= 0).sum())


def write_stability_map(path: Path, found: StabilityMap, title: str, force: bool = False) -> None:
    """Write a map, complete or not at all, with `force` in place of a results file; `ResultsError` where that fails."""
    words = ", ".join([found.scene, *(axis.name for axis in found.axes)])
    store = hdf5.Store.create(path, SystemRecord(title, words), lambda file: _fill(file, found), force)
    hdf5.set_status(store.file, hdf5.COMPLETE)
    store.close()


def _fill(file: Node, found: StabilityMap) -> None:
    """Write a map's axes, growths and verdicts."""
    group = file.create_group("map")
    names = [axis.name for axis in found.axes]
    for axis in found.axes:
        hdf5.create_scale(group, axis.name, axis.values)
    hdf5.create_dataset(group, "growth", names, np.nan, float, "1/s")[...] = found.growth
    stable = hdf5.create_dataset(group, "stable", names, 0, np.int8)
    stable[...] = found.stable
    stable.attrs["dtype"] = "bool"  # so xarray reads it as what it is
    hdf5.create_dataset(group, "verified", names, -1, np.int8)[...] = found.verified
    group.attrs["algorithm"], group.attrs["step_size"] = found.algorithm, found.step_size
