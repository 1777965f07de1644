"""Frequency responses of a sweep, read from its results file."""

import contextlib
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.results import hdf5
from hfsa.cosim.results.hdf5 import Node
from hfsa.cosim.results.records import ResultsError, Signal, Theory
from hfsa.cosim.results.store import reading
from hfsa.cosim.results.sweep_file import COMPUTED, DOWN, HARMONICS, is_downward
from hfsa.cosim.signals.prefixes import readable
from hfsa.cosim.systems.names import nearest
from hfsa.cosim.systems.notebook import drawn_by, summarized, summary

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from xarray import Dataset


@dataclass(frozen=True)
class Downward:
    """Downward sweep of a file that follows branches: arrays as those of the upward sweep in `Bode`, and `branches`.

    Attributes:
        branches: flags of `signals/branches.py`, (frequencies, inputs): jumps of both sweeps, and where they differ.
    """

    response: NDArray[np.complex128]
    harmonic_distortion: NDArray[np.float64]
    remaining_transient: NDArray[np.float64]
    status: NDArray[np.int8]
    wall_time: NDArray[np.float64]
    message: NDArray[np.object_]
    steps: NDArray[np.int64]
    harmonics: NDArray[np.float64]
    branches: NDArray[np.int8]


@dataclass(frozen=True)
class Bode:
    """Frequency responses of a sweep: arrays over (frequency, output, input), and the axes.

    Attributes:
        frequency: shape (frequencies,) [Hz].
        outputs, inputs: full names with units, the inputs with their amplitudes.
        response: complex, output per input; NaN where a point is pending or failed.
        harmonics: mean, with its sign, and amplitudes of the first to third harmonic, output per input, shape
            (frequencies, 4, outputs, inputs); NaN where the method does not measure them.
        step_error: relative error due to the communication steps, NaN where it is unknown or the response is zero.
        status: `Status` as int8, shape (frequencies, inputs), like `wall_time` [s], `message`, and the number of
            communication `steps`, 0 where it is unknown.
        attributes: attributes of the file.
        settings: settings of the measurement.
        theory: linear response to compare a measured one with, if known.
        marks: published frequencies [Hz] by source, from the scene.
        downward: the downward sweep where branches were followed; the other arrays are then the upward one.
    """

    path: Path
    frequency: NDArray[np.float64]
    outputs: tuple[Signal, ...]
    inputs: tuple[Signal, ...]
    response: NDArray[np.complex128]
    harmonic_distortion: NDArray[np.float64]
    remaining_transient: NDArray[np.float64]
    step_error: NDArray[np.float64]
    status: NDArray[np.int8]
    wall_time: NDArray[np.float64]
    message: NDArray[np.object_]
    steps: NDArray[np.int64]
    harmonics: NDArray[np.float64]
    settings: dict[str, Any]
    attributes: dict[str, Any]
    theory: Theory | None = None
    marks: Mapping[str, float] = field(default_factory=dict)
    downward: Downward | None = None

    def entry(self, output: str, input: str) -> NDArray[np.complex128]:  # noqa: A002 (name of the axis in the file)
        """Return the response of one output to one input, shape (frequencies,); `ResultsError` if there is none."""
        return self.response[:, self._index(output, self.outputs), self._index(input, self.inputs)]

    def plot(self, *others: "Bode", outputs: Sequence[str] = (), inputs: Sequence[str] = ()) -> "Figure":
        """Return the Bode plot of the sweep, with others in the same axes; arguments and errors as `bode_figure`."""
        return drawn_by("bode", "bode_figure")([self, *others], outputs, inputs)

    @summarized
    def _repr_html_(self) -> str:
        """Return the largest response of each output to each input, and the largest error of the steps."""
        facts = {
            "file": self.path,
            "status": self.attributes.get("status", ""),
            "method": self.settings.get("method", ""),
            "frequencies": f"{len(self.frequency)}, {self.frequency.min():g} to {self.frequency.max():g} Hz"
            if len(self.frequency)
            else "none",
        }
        rows = (self._summary(o, i) for i in range(len(self.inputs)) for o in range(len(self.outputs)))
        headings = ["input", "output", ">points", ">largest", ">at", ">largest step error"]
        return summary(str(self.attributes.get("title", "sweep")), facts, headings, rows)

    def _summary(self, output: int, source: int) -> tuple[object, ...]:
        """Return the row of an output per input in the summary."""
        to, by = self.outputs[output], self.inputs[source]
        size, error = np.abs(self.response[:, output, source]), self.step_error[:, output, source]
        done, known = np.flatnonzero(np.isfinite(size)), error[np.isfinite(error)]
        points = f"{len(done)} of {len(size)}"
        if not len(done):
            return by.name, to.name, points, "", "", ""
        at = done[size[done].argmax()]
        unit = "" if to.unit == by.unit else f" {to.unit}/({by.unit})"
        worst = f"{100 * known.max():.2g} %" if len(known) else "not known"
        return by.name, to.name, points, f"{size[at]:.4g}{unit}", readable(float(self.frequency[at]), "Hz"), worst

    def to_xarray(self) -> "Dataset":
        """Return the sweep as an `xarray.Dataset` over frequency, output and input; requires the extra `analysis`."""
        import xarray

        entries, points = ("frequency", "output", "input"), ("frequency", "input")
        of_entries = ("response", "harmonic_distortion", "remaining_transient", "step_error")
        variables: dict[str, tuple[tuple[str, ...], Any]] = {
            name: (entries, getattr(self, name)) for name in of_entries
        }
        variables["harmonics"] = (("frequency", "harmonic", "output", "input"), self.harmonics)
        variables |= {name: (points, getattr(self, name)) for name in ("status", "wall_time", "message", "steps")}
        if self.downward is not None:
            variables |= {f"{name}{DOWN}": (entries, getattr(self.downward, name)) for name in of_entries[:3]}
            variables["branches"] = (points, self.downward.branches)
        coordinates = {
            "frequency": ("frequency", self.frequency, {"units": "Hz"}),
            "harmonic": np.arange(HARMONICS),
            "output": [signal.name for signal in self.outputs],
            "input": [signal.name for signal in self.inputs],
            "output_unit": ("output", [signal.unit for signal in self.outputs]),
            "input_unit": ("input", [signal.unit for signal in self.inputs]),
            "amplitude": ("input", [signal.amplitude for signal in self.inputs]),
        }
        return xarray.Dataset(variables, coords=coordinates, attrs=self.attributes)

    def _index(self, name: str, signals: Sequence[Signal]) -> int:
        """Return the index of a signal; `ResultsError` with the nearest names if there is none."""
        names = [signal.name for signal in signals]
        if name not in names:
            raise ResultsError(f"{self.path} has no signal {name!r}{nearest(name, names)}")
        return names.index(name)


def read_sweep(path: str | Path) -> Bode:
    """Read a sweep, finished or not; `ResultsError` where the file holds none."""
    path = Path(path)
    with reading(path) as file:
        if "bode" not in file:
            raise ResultsError(f"{path} holds no sweep; it has {', '.join(file) or 'nothing'}")
        group = file["bode"]
        frequency, amplitude = hdf5.axis(group, "frequency"), hdf5.array(group, "amplitude", None)
        outputs = list(zip(hdf5.texts(group["output"]), hdf5.texts(group["output_unit"]), strict=True))
        inputs = zip(hdf5.texts(group["input"]), hdf5.texts(group["input_unit"]), amplitude.tolist(), strict=True)
        shape = len(frequency), len(outputs), len(amplitude)
        return Bode(
            path=path,
            frequency=frequency,
            outputs=tuple(Signal(name, unit) for name, unit in outputs),
            inputs=tuple(Signal(name, unit, amplitude) for name, unit, amplitude in inputs),
            settings=hdf5.plain(file["sweep"].attrs),
            attributes=hdf5.plain(file.attrs) | {"status": hdf5.status_of(file)},
            step_error=_step_error(group, shape),
            theory=_read_theory(file, shape[1:]),
            marks=_marks(hdf5.text(file["system"].attrs["scene"])),
            downward=_downward(group, shape) if is_downward(group) else None,
            **_points(group, shape),
        )


def _downward(group: Node, shape: tuple[int, int, int]) -> Downward:
    """Read the downward sweep."""
    branches = hdf5.array(group, "branches", (shape[0], shape[2]), "i")
    return Downward(**_points(group, shape, DOWN), branches=branches)


def _points(group: Node, shape: tuple[int, int, int], side: str = "") -> dict[str, Any]:
    """Read the arrays of the points of one sweep, whose names have an ending; `shape` is that of its response."""
    points = shape[0], shape[2]
    kinds = {"response": (shape, "c"), "status": (points, "i"), "wall_time": (points, "f")}
    numbers = {
        name: hdf5.array(group, f"{name}{side}", *kinds.get(name, (shape, "f")))
        for name in COMPUTED
        if name != "message"
    }
    has_steps = f"steps{side}" in group
    steps = hdf5.array(group, f"steps{side}", points, "iu") if has_steps else np.zeros(points, np.int64)
    message = np.array([[hdf5.text(m) for m in row] for row in group[f"message{side}"][:]], dtype=object)
    of_harmonics, name = (shape[0], HARMONICS, *shape[1:]), f"harmonics{side}"
    harmonics = hdf5.array(group, name, of_harmonics, "f") if name in group else np.full(of_harmonics, np.nan)
    return {**numbers, "steps": steps, "message": message, "harmonics": harmonics}


def _marks(scene: str) -> dict[str, float]:
    """Return the published frequencies [Hz] of a scene's text by label; empty where the text is no scene of hfsa."""
    with contextlib.suppress(tomllib.TOMLDecodeError):
        return tomllib.loads(scene).get("marks", {})
    return {}


def _step_error(group: Node, shape: tuple[int, int, int]) -> NDArray[np.float64]:
    """Read the error due to communication steps; NaN in files of version 0.1, which lack it."""
    return hdf5.array(group, "step_error", shape) if "step_error" in group else np.full(shape, np.nan)


def _read_theory(file: Node, entries: tuple[int, ...]) -> Theory | None:
    """Read the theoretical response, if there is one; `entries` are the numbers of outputs and inputs."""
    group = file.get("theory")
    if group is None:
        return None
    frequency = hdf5.axis(group, "frequency")
    return Theory(frequency, hdf5.array(group, "response", (len(frequency), *entries), "c"))
