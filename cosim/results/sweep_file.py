"""Results file of a frequency sweep, written point by point and resumable."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.results import hdf5
from hfsa.cosim.results.hdf5 import LONGEST_MESSAGE, Node, clipped
from hfsa.cosim.results.records import Plan, Point, Signal, Status, SystemRecord
from hfsa.cosim.results.resume import check_same, earlier_version
from hfsa.cosim.results.store import Store, translate_errors
from hfsa.cosim.signals.branches import DIFFERENT, JUMP_DOWN, JUMP_UP, branch_flags
from hfsa.cosim.signals.frequency_response import phase

_NAN = np.complex128(complex(np.nan, np.nan))

COMPUTED = (
    "response",
    "harmonic_distortion",
    "remaining_transient",
    "status",
    "wall_time",
    "message",
)

LATER = ("steps", "harmonics")
"""Datasets that files of earlier versions lack."""

HARMONICS = 4
"""Number of harmonics of a response: mean, fundamental, second and third."""

DOWN = "_down"
"""Ending of the datasets of the downward sweep, which a file has that follows branches (`--start previous`)."""


class SweepFile:
    """Results file of a sweep, open for writing by this process alone; `identity` is independent of its name."""

    def __init__(self, store: Store):
        self.path, self.identity = store.path, store.identity
        self._store = store
        # copy of the datasets: writing whole rows is many times faster than writing single entries
        bode = store.file["bode"]
        names = [*COMPUTED, "magnitude", "phase", *(name for name in LATER if name in bode)]
        self._has_branches = is_downward(bode)
        if self._has_branches:
            downward = [f"{name}{DOWN}" for name in (*COMPUTED, *LATER)]
            names += [*(name for name in downward if name in bode), "branches"]
        self._arrays = {name: bode[name][:] for name in names}
        self._units = hdf5.texts(bode["output_unit"])
        self._tolerance = float(store.file["sweep"].attrs.get("settling_tolerance", 0.0))

    @classmethod
    def create(cls, path: Path, plan: Plan, system: SystemRecord, force: bool = False) -> "SweepFile":
        """Create the file with all points pending; `force` replaces a results file of hfsa, as `Store.create`."""
        return cls(Store.create(path, system, lambda file: _lay_out(file, plan), force))

    @classmethod
    def resume(cls, path: Path, plan: Plan, system: SystemRecord) -> "SweepFile":
        """Open the file to continue; `ResultsError` lists the differences where it belongs to another sweep."""
        store = Store.resume(path, lambda file: check_same(path, file, plan, system))
        try:
            with translate_errors(path, "read"):
                file = cls(store)
            hdf5.set_status(store.file, hdf5.RUNNING)
        except BaseException:
            store.close()
            raise
        return file

    @property
    def earlier_version(self) -> str:
        """Version of hfsa that made the file, empty where it is the present one."""
        return earlier_version(self._store.file)

    def unfinished(self) -> list[tuple[int, int]]:
        """Return the indices (input, frequency) of the points to measure: pending and failed ones."""
        sides = [self._arrays[name] for name in ("status", f"status{DOWN}") if name in self._arrays]
        open_points = np.argwhere(np.any([(s == Status.PENDING) | (s == Status.FAILED) for s in sides], axis=0))
        return [(int(i), int(k)) for k, i in open_points]

    def write(self, points: Iterable[Point]) -> None:
        """Write finished points and flush: the numbers before the status, so that a point marked done is complete."""
        points = list(points)
        arrays = self._arrays
        for point in points:
            where, side = (point.frequency, slice(None), point.input), DOWN if point.is_downward else ""
            if point.response is not None:
                arrays[f"response{side}"][where] = point.response
                if not point.is_downward:
                    arrays["magnitude"][where] = np.abs(point.response)
                    arrays["phase"][where] = phase(point.response)
            for name in ("harmonic_distortion", "remaining_transient"):
                if getattr(point, name) is not None:
                    arrays[f"{name}{side}"][where] = getattr(point, name)
            if point.harmonics is not None and f"harmonics{side}" in arrays:
                arrays[f"harmonics{side}"][point.frequency, :, :, point.input] = point.harmonics
            arrays[f"wall_time{side}"][point.frequency, point.input] = point.wall_time
            arrays[f"message{side}"][point.frequency, point.input] = clipped(point.message)
            if f"steps{side}" in arrays:
                arrays[f"steps{side}"][point.frequency, point.input] = point.steps
            arrays[f"status{side}"][point.frequency, point.input] = point.status
        rows = {point.frequency for point in points}
        first, last = min(rows, default=0), max(rows, default=-1) + 1
        if self._has_branches:
            for i in {point.input for point in points if point.is_downward}:
                up, down = (arrays[f"response{side}"][:, :, i] for side in ("", DOWN))
                arrays["branches"][:, i] = branch_flags(up, down, self._units, self._tolerance)
                last = len(arrays["branches"])
        with self._store.writing():
            statuses = [name for name in arrays if name.startswith("status")]
            self._write_rows(slice(first, last), [name for name in arrays if name not in statuses])
            self._write_rows(slice(first, last), statuses)

    def _write_rows(self, rows: slice, names: Iterable[str]) -> None:
        """Write rows of some arrays and flush."""
        for name in names:
            self._store.file["bode"][name][rows] = self._arrays[name][rows]
        self._store.flush()

    def tell(self, sentences: Iterable[str]) -> None:
        """Add warnings of FMUs to those of the file, one sentence for each instance."""
        with self._store.writing():
            known = hdf5.warnings_of(self._store.file)
            hdf5.set_warnings(self._store.file, [*known, *(s for s in sentences if s not in known)])

    def close(self) -> None:
        """Close the file with its status: `complete` when every point was measured, otherwise `interrupted`."""
        pending = any(np.any(a == Status.PENDING) for name, a in self._arrays.items() if name.startswith("status"))
        with self._store.writing():
            try:
                hdf5.set_status(self._store.file, hdf5.INTERRUPTED if pending else hdf5.COMPLETE)
            finally:
                self._store.close()

    def __enter__(self) -> "SweepFile":
        return self

    def __exit__(self, *_) -> None:
        self.close()


def _lay_out(file: Node, plan: Plan) -> None:
    """Create `/sweep`, `/bode` with every dataset at its full size, and `/theory`."""
    settings = file.create_group("sweep")
    for name, value in plan.settings.items():
        settings.attrs[name] = value
    bode = file.create_group("bode")
    entries, points, unit = ["frequency", "output", "input"], ["frequency", "input"], _response_unit(plan)
    _lay_out_axes(bode, plan.frequency, plan)
    for side, signals in (("output", plan.outputs), ("input", plan.inputs)):
        units = bode.create_dataset(f"{side}_unit", data=[s.unit for s in signals], dtype=h5py.string_dtype())
        units.dims[0].attach_scale(bode[side])
    hdf5.create_dataset(bode, "amplitude", ["input"], np.nan, float, _common(plan.inputs) or "input_unit")
    bode["amplitude"][:] = [signal.amplitude for signal in plan.inputs]
    hdf5.create_dataset(bode, "magnitude", entries, np.nan, float, unit)
    hdf5.create_dataset(bode, "phase", entries, np.nan, float, "rad")
    hdf5.create_dataset(bode, "step_error", entries, np.nan, float, "1")
    if plan.step_error is not None:
        bode["step_error"][:] = plan.step_error
    _lay_out_points(bode, unit)
    if plan.has_branches:
        _lay_out_points(bode, unit, DOWN)
        flags = hdf5.create_dataset(bode, "branches", points, np.int8(0), np.int8)
        flags.attrs["flag_masks"] = np.array([JUMP_UP, JUMP_DOWN, DIFFERENT], dtype=np.int8)
        flags.attrs["flag_meanings"] = "jump_up jump_down different"
    if plan.lines is not None:
        for name, values, own_unit in (
            ("line_amplitude", plan.lines.amplitude, _common(plan.inputs) or "input_unit"),
            ("line_phase", plan.lines.phase, "rad"),
        ):
            hdf5.create_dataset(bode, name, points, np.nan, float, own_unit)[:] = values
        hdf5.create_dataset(bode, "crest_factor", ["input"], np.nan, float, "1")[:] = plan.lines.crest_factor
    if plan.theory is not None:
        theory = file.create_group("theory")
        _lay_out_axes(theory, plan.theory.frequency, plan)
        hdf5.create_dataset(theory, "response", entries, _NAN, np.complex128, unit)
        theory["response"][:] = plan.theory.response


def is_downward(bode: Node) -> bool:
    """Whether `/bode` holds a downward sweep too."""
    return f"response{DOWN}" in bode


def _lay_out_points(bode: Node, unit: str, side: str = "") -> None:
    """Create the datasets of the points of one sweep, their names with an ending."""
    entries, points = ["frequency", "output", "input"], ["frequency", "input"]
    hdf5.create_dataset(bode, f"response{side}", entries, _NAN, np.complex128, unit)
    hdf5.create_dataset(bode, f"harmonic_distortion{side}", entries, np.nan, float, "1")
    hdf5.create_dataset(bode, f"remaining_transient{side}", entries, np.nan, float, "1")
    hdf5.create_dataset(bode, f"wall_time{side}", points, np.nan, float, "s")
    hdf5.create_dataset(bode, f"steps{side}", points, np.int64(0), np.int64, "1")
    _lay_out_harmonics(bode, unit, side)
    members = {status.name.lower(): int(status) for status in Status}
    status = hdf5.create_dataset(bode, f"status{side}", points, np.int8(0), h5py.enum_dtype(members, basetype="i1"))
    status.attrs["flag_values"] = np.array(list(members.values()), dtype=np.int8)
    status.attrs["flag_meanings"] = " ".join(members)
    # netCDF-C takes the encoding from the type, and xarray fails where an attribute gives it as well
    hdf5.create_dataset(bode, f"message{side}", points, b"", h5py.string_dtype("utf-8", LONGEST_MESSAGE))


def _lay_out_axes(group: Node, frequency: NDArray[np.float64], plan: Plan) -> None:
    """Create the dimension scales of a sweep."""
    hdf5.create_scale(group, "frequency", frequency, "Hz")
    hdf5.create_scale(group, "output", [signal.name for signal in plan.outputs])
    hdf5.create_scale(group, "input", [signal.name for signal in plan.inputs])


def _lay_out_harmonics(bode: Node, unit: str, side: str) -> None:
    """Create the dataset of the harmonics, and their dimension scale."""
    if "harmonic" not in bode:
        hdf5.create_scale(bode, "harmonic", np.arange(HARMONICS), "1")
    hdf5.create_dataset(bode, f"harmonics{side}", ["frequency", "harmonic", "output", "input"], np.nan, float, unit)


def _common(signals: Sequence[Signal]) -> str | None:
    """Return the unit of all signals, `None` where there are several."""
    units = {signal.unit for signal in signals}
    return units.pop() if len(units) == 1 else None


def _response_unit(plan: Plan) -> str:
    """Return the unit common to all entries, or the names of the datasets whose quotient is the unit of each."""
    above, below = _common(plan.outputs), _common(plan.inputs)
    if above is None or below is None:
        return "output_unit/input_unit"
    return "1" if above == below else f"{above}/{below}" if below.isalnum() else f"{above}/({below})"
