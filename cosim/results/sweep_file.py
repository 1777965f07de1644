"""Results file of a frequency sweep, written point by point and resumable."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.results import hdf5
from hfsa.cosim.results.hdf5 import LONGEST_MESSAGE, Node, clipped
from hfsa.cosim.results.interrupts import deferred_interrupts
from hfsa.cosim.results.records import Plan, Point, Signal, Status, SystemRecord
from hfsa.cosim.results.resume import check_same, earlier_version
from hfsa.cosim.results.store import Store
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


class SweepFile:
    """Results file of a sweep, open for writing by this process alone; `identity` is independent of its name."""

    def __init__(self, store: Store):
        self.path, self.identity = store.path, store.identity
        self._store = store
        # copy of the datasets: writing whole rows is many times faster than writing single entries
        self._arrays = {name: store.file["bode"][name][:] for name in (*COMPUTED, "magnitude", "phase")}

    @classmethod
    def create(cls, path: Path, plan: Plan, system: SystemRecord, force: bool = False) -> "SweepFile":
        """Create the file with all points pending; `force` replaces a results file of hfsa, as `Store.create`."""
        return cls(Store.create(path, system, lambda file: _lay_out(file, plan), force))

    @classmethod
    def resume(cls, path: Path, plan: Plan, system: SystemRecord) -> "SweepFile":
        """Open the file to continue; `ResultsError` lists the differences where it belongs to another sweep."""
        store = Store.resume(path, lambda file: check_same(path, file, plan, system))
        hdf5.set_status(store.file, hdf5.RUNNING)
        return cls(store)

    @property
    def earlier_version(self) -> str:
        """Version of hfsa that made the file, empty where it is the present one."""
        return earlier_version(self._store.file)

    def unfinished(self) -> list[tuple[int, int]]:
        """Return the indices (input, frequency) of the points to measure: pending and failed ones."""
        status = self._arrays["status"]
        open_points = np.argwhere((status == Status.PENDING) | (status == Status.FAILED))
        return [(int(i), int(k)) for k, i in open_points]

    def write(self, points: Iterable[Point]) -> None:
        """Write finished points and flush: the numbers before the status, so that a point marked done is complete."""
        points = list(points)
        arrays = self._arrays
        for point in points:
            where = (point.frequency, slice(None), point.input)
            if point.response is not None:
                arrays["response"][where] = point.response
                arrays["magnitude"][where] = np.abs(point.response)
                arrays["phase"][where] = phase(point.response)
            for name in ("harmonic_distortion", "remaining_transient"):
                if getattr(point, name) is not None:
                    arrays[name][where] = getattr(point, name)
            arrays["wall_time"][point.frequency, point.input] = point.wall_time
            arrays["message"][point.frequency, point.input] = clipped(point.message)
            arrays["status"][point.frequency, point.input] = point.status
        rows = {point.frequency for point in points}
        first, last = min(rows, default=0), max(rows, default=-1) + 1
        with deferred_interrupts():
            self._write_rows(slice(first, last), [name for name in arrays if name != "status"])
            self._write_rows(slice(first, last), ["status"])

    def _write_rows(self, rows: slice, names: Iterable[str]) -> None:
        """Write rows of some arrays and flush."""
        for name in names:
            self._store.file["bode"][name][rows] = self._arrays[name][rows]
        self._store.flush()

    def close(self) -> None:
        """Close the file with its status: `complete` when every point was measured, otherwise `interrupted`."""
        pending = np.any(self._arrays["status"] == Status.PENDING)
        with deferred_interrupts():
            hdf5.set_status(self._store.file, hdf5.INTERRUPTED if pending else hdf5.COMPLETE)
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
    hdf5.create_dataset(bode, "response", entries, _NAN, np.complex128, unit)
    hdf5.create_dataset(bode, "magnitude", entries, np.nan, float, unit)
    hdf5.create_dataset(bode, "phase", entries, np.nan, float, "rad")
    hdf5.create_dataset(bode, "harmonic_distortion", entries, np.nan, float, "1")
    hdf5.create_dataset(bode, "remaining_transient", entries, np.nan, float, "1")
    hdf5.create_dataset(bode, "step_error", entries, np.nan, float, "1")
    if plan.step_error is not None:
        bode["step_error"][:] = plan.step_error
    if plan.lines is not None:
        for name, values, unit in (
            ("line_amplitude", plan.lines.amplitude, _common(plan.inputs) or "input_unit"),
            ("line_phase", plan.lines.phase, "rad"),
        ):
            hdf5.create_dataset(bode, name, points, np.nan, float, unit)[:] = values
        hdf5.create_dataset(bode, "crest_factor", ["input"], np.nan, float, "1")[:] = plan.lines.crest_factor
    hdf5.create_dataset(bode, "wall_time", points, np.nan, float, "s")
    members = {status.name.lower(): int(status) for status in Status}
    status = hdf5.create_dataset(bode, "status", points, np.int8(0), h5py.enum_dtype(members, basetype="i1"))
    status.attrs["flag_values"] = np.array(list(members.values()), dtype=np.int8)
    status.attrs["flag_meanings"] = " ".join(members)
    message = hdf5.create_dataset(bode, "message", points, b"", f"S{LONGEST_MESSAGE}")
    message.attrs["_Encoding"] = "utf-8"  # attribute by which xarray decodes bytes
    if plan.theory is not None:
        theory = file.create_group("theory")
        _lay_out_axes(theory, plan.theory.frequency, plan)
        hdf5.create_dataset(theory, "response", entries, _NAN, np.complex128, unit)
        theory["response"][:] = plan.theory.response


def _lay_out_axes(group: Node, frequency: NDArray[np.float64], plan: Plan) -> None:
    """Create the dimension scales of a sweep."""
    hdf5.create_scale(group, "frequency", frequency, "Hz")
    hdf5.create_scale(group, "output", [signal.name for signal in plan.outputs])
    hdf5.create_scale(group, "input", [signal.name for signal in plan.inputs])


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
