"""Stability map in HDF5: fastest growth of a scene over one or two of its arguments.

/         title created tool tool_version git_commit command python platform format_version status
/system   name of the scene and of the axes
/map      the axes: dimension scales; growth [1/s], stable (true or false), verified (1 a simulation agrees, 0 it
          differs, -1 none) over them; algorithm step_size [s] (attributes)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.results import hdf5
from hfsa.cosim.results.hdf5 import Node
from hfsa.cosim.results.records import SystemRecord
from hfsa.cosim.results.store import Store, reading
from hfsa.cosim.systems.notebook import drawn_by, summarized, summary

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GEOMETRIC = 10.0
"""Ratio of the ends of an axis from which its points are spaced geometrically."""


@dataclass(frozen=True)
class Axis:
    """Argument of a scene and its values, (n,), in the unit of the argument."""

    name: str
    values: NDArray[np.float64]


@dataclass(frozen=True)
class StabilityMap:
    """Stability over one or two axes; arrays have the shape of the axes.

    Attributes:
        growth: growth rate of the fastest mode that counts [1/s], NaN where the scene cannot be built.
        stable: whether every mode that counts decays and the fixed-point iteration converges; false where not built.
        verified: 1 where a simulation agrees, 0 where it differs, -1 without simulation or where the mode is too slow.
        messages: reasons why points could not be built, each once.
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
        """Whether the scene can be built, at each point."""
        return ~np.isnan(self.growth)

    @property
    def agreement(self) -> tuple[int, int]:
        """Number of points at which a simulation agrees, and of points simulated."""
        return int((self.verified == 1).sum()), int((self.verified >= 0).sum())

    def plot(self) -> "Figure":
        """Return the figure of the map."""
        return drawn_by("stability_map", "stability_map_figure")(self, self.scene)

    @summarized
    def _repr_html_(self) -> str:
        """Return the axes, and how much of them is stable."""
        agree, simulated = self.agreement
        facts = {
            "algorithm": self.algorithm,
            "step": f"{self.step_size:.4g} s",
            "stable": f"{int(self.stable.sum())} of {int(self.built.sum())} points",
            "simulations that agree": f"{agree} of {simulated}",
        }
        rows = [
            (axis.name, f"{axis.values.min():.4g}", f"{axis.values.max():.4g}", len(axis.values)) for axis in self.axes
        ]
        return summary(f"stability of {self.scene}", facts, ["axis", ">from", ">to", ">points"], rows)


def write_stability_map(path: Path, found: StabilityMap, title: str, force: bool = False) -> None:
    """Write a map, completely or not at all; `force` replaces a results file of hfsa. `ResultsError` on failure."""
    words = ", ".join([found.scene, *(axis.name for axis in found.axes)])
    store = Store.create(path, SystemRecord(title, words), lambda file: _fill(file, found), force)
    hdf5.set_status(store.file, hdf5.COMPLETE)
    store.close()


def read_stability_map(path: Path) -> StabilityMap:
    """Read a map, without the reasons why points could not be built; `ResultsError` where the file holds none."""
    with reading(path) as file:
        group = file["map"]
        growth = group["growth"]
        names = [str(scale[0].name).rpartition("/")[2] for scale in growth.dims]
        return StabilityMap(
            hdf5.text(file.attrs["title"]),
            hdf5.text(group.attrs["algorithm"]),
            float(group.attrs["step_size"]),
            [Axis(name, group[name][:]) for name in names],
            growth[:],
            group["stable"][:].astype(bool),
            group["verified"][:],
            (),
        )


def _fill(file: Node, found: StabilityMap) -> None:
    """Write the axes, growth rates, stability and verification of a map."""
    group = file.create_group("map")
    names = [axis.name for axis in found.axes]
    for axis in found.axes:
        hdf5.create_scale(group, axis.name, axis.values)
    hdf5.create_dataset(group, "growth", names, np.nan, float, "1/s")[...] = found.growth
    stable = hdf5.create_dataset(group, "stable", names, 0, np.int8)
    stable[...] = found.stable
    stable.attrs["dtype"] = "bool"  # so that xarray reads it as bool
    hdf5.create_dataset(group, "verified", names, -1, np.int8)[...] = found.verified
    group.attrs["algorithm"], group.attrs["step_size"] = found.algorithm, found.step_size
