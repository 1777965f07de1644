"""Results of a sweep and of a run in HDF5: laid out at once, written point by point, resumed, read by name.

    with SweepFile.create(path, plan, system) as file:      # or SweepFile.resume(path, plan, system)
        for i, k in file.unfinished():                      # input, frequency
            file.write([Point(i, k, response, ...)])
    bode = read_sweep(path)
    bode.entry("robot.platform.position[3]", "reference.command.position[3]")    # complex, shape (frequencies,)

    /            title created tool tool_version git_commit command python platform format_version status
    /system      the scene as text, components in the order in which they step; one group per FMU; operating_point
    /sweep       the settings, as attributes
    /bode        frequency [Hz], output, input: dimension scales; output_unit, input_unit, amplitude
                 response (complex, output per input), magnitude, phase [rad], harmonic_distortion,
                 remaining_transient, step_error: what the communication steps do to it, relative, NaN if not known
                 status, wall_time [s], message, over (frequency, input)
    /time        time [s] and one dataset per recorded variable; error_estimate, relative_error: their attributes

Units are SI, frequency is in Hz. xarray opens a group with its coordinates: `open_dataset(path, group="bode",
engine="h5netcdf")`. Only one process may write a file.
A file that is there already is not overwritten unless that is asked for (`results/target.py`).
"""

import contextlib
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.results import hdf5
from hfsa.cosim.results.hdf5 import Node
from hfsa.cosim.results.interrupts import deferred_interrupts
from hfsa.cosim.results.records import (
    AlgorithmChoice,
    ErrorEstimate,
    InstanceRecord,
    LevelChoice,
    OrderChoice,
    Plan,
    Point,
    ResultsError,
    Signal,
    Status,
    SystemRecord,
    Theory,
)
from hfsa.cosim.results.resume import check_same
from hfsa.cosim.results.target import Identity
from hfsa.cosim.signals.frequency_response import phase
from hfsa.cosim.systems.names import nearest

if TYPE_CHECKING:
    from xarray import Dataset

__all__ = [
    "AlgorithmChoice",
    "Bode",
    "ErrorEstimate",
    "Identity",
    "InstanceRecord",
    "LevelChoice",
    "OrderChoice",
    "Plan",
    "Point",
    "ResultsError",
    "RunFile",
    "Signal",
    "Status",
    "SweepFile",
    "SystemRecord",
    "Theory",
    "read_algorithm",
    "read_choices",
    "read_errors",
    "read_order",
    "read_run",
    "read_status",
    "read_sweep",
    "write_errors",
]

_LONGEST_MESSAGE = 240
_NAN = np.complex128(complex(np.nan, np.nan))
_ERRORS = ("error_estimate", "relative_error")
"""Attributes of a recorded variable."""


class SweepFile:
    """A sweep's results file, open for writing by this process alone; `identity` is what it is under any name."""

    def __init__(self, store: hdf5.Store):
        self.path, self.identity = store.path, store.identity
        self._store = store
        # what the file holds: rows are written whole, which is many times faster than entry by entry
        self._arrays = {name: store.file["bode"][name][:] for name in (*_COMPUTED, "magnitude", "phase")}

    @classmethod
    def create(cls, path: Path, plan: Plan, system: SystemRecord, force: bool = False) -> "SweepFile":
        """Create the file with all points pending; `force` replaces a results file of that name, as `Store.create`."""
        return cls(hdf5.Store.create(path, system, lambda file: _lay_out(file, plan), force))

    @classmethod
    def resume(cls, path: Path, plan: Plan, system: SystemRecord) -> "SweepFile":
        """Open the file to go on; `ResultsError` names what differs where it belongs to another sweep."""
        store = hdf5.Store.resume(path, lambda file: check_same(path, file, plan, system))
        hdf5.set_status(store.file, hdf5.RUNNING)
        return cls(store)

    def unfinished(self) -> list[tuple[int, int]]:
        """Return (input, frequency) of the points still to be measured: those pending and those that failed."""
        status = self._arrays["status"]
        open_points = np.argwhere((status == Status.PENDING) | (status == Status.FAILED))
        return [(int(i), int(k)) for k, i in open_points]

    def write(self, points: Iterable[Point]) -> None:
        """Write finished points and flush: the numbers, then the status, so that a point that says it is done is."""
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
            arrays["message"][point.frequency, point.input] = _clipped(point.message)
            arrays["status"][point.frequency, point.input] = point.status
        rows = {point.frequency for point in points}
        first, last = min(rows, default=0), max(rows, default=-1) + 1
        with deferred_interrupts():
            self._write_rows(slice(first, last), [name for name in arrays if name != "status"])
            self._write_rows(slice(first, last), ["status"])

    def _write_rows(self, rows: slice, names: Iterable[str]) -> None:
        """Write rows of some arrays, and see to it that they are on the disk."""
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


class RunFile:
    """The recorded variables of a time-domain run, by full name; rows not reached stay NaN.

    With `force` it replaces a results file of that name, as `Store.create`. `identity` is what the file is under any
    name.
    """

    def __init__(
        self,
        path: Path,
        time: NDArray[np.float64],
        units: Mapping[str, str],
        system: SystemRecord,
        force: bool = False,
    ):
        def fill(file: Node) -> None:
            """Lay out the time axis and a dataset for each variable."""
            group = file.create_group("time")
            hdf5.create_scale(group, "time", time, "s")
            for name, unit in units.items():
                dataset = hdf5.create_dataset(group, name, ["time"], np.nan, float, unit)
                for attribute in _ERRORS:
                    dataset.attrs[attribute] = np.nan  # until a verification writes it in place
            group.attrs.create("message", np.bytes_(b""), dtype=f"S{_LONGEST_MESSAGE}")

        self._store = hdf5.Store.create(path, system, fill, force)
        self.identity = self._store.identity

    def write(self, row: int, values: Mapping[str, NDArray[np.float64]]) -> None:
        """Write values of recorded variables from a row on, and flush."""
        with deferred_interrupts():
            for name, block in values.items():
                self._store.file["time"][name][row : row + len(block)] = block
            self._store.flush()

    def close(self, failure: str = "") -> None:
        """Close the file with status `complete`, or `failed` with the message as attribute of `/time`."""
        self._close(hdf5.FAILED if failure else hdf5.COMPLETE, failure)

    def interrupt(self) -> None:
        """Close the file of a run that was ended from outside, with status `interrupted`."""
        self._close(hdf5.INTERRUPTED, "interrupted before the end")

    def _close(self, status: bytes, message: str) -> None:
        """Close the file with a status and a message."""
        with deferred_interrupts():
            self._store.file["time"].attrs.modify("message", np.bytes_(_clipped(message)))
            hdf5.set_status(self._store.file, status)
            self._store.close()


@dataclass(frozen=True)
class Bode:
    """A sweep read from its file: arrays over (frequency, output, input) and the names of the axes.

    Attributes:
        frequency: shape (frequencies,) [Hz].
        outputs, inputs: full names with units, the inputs with their amplitudes.
        response: complex, output per input; NaN where a point is pending or failed.
        step_error: relative error by the communication steps, NaN where it is not known or the response is zero.
        status: `Status` as int8, shape (frequencies, inputs), like `wall_time` [s] and `message`.
        attributes: of the file; `settings`: of the sweep.
        theory: the linear response beside a measured one, where there is one.
        marks: frequencies [Hz] that others have found, by who or how, as the scene gives them.
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
    settings: dict[str, Any]
    attributes: dict[str, Any]
    theory: Theory | None = None
    marks: Mapping[str, float] = field(default_factory=dict)

    def entry(self, output: str, input: str) -> NDArray[np.complex128]:  # noqa: A002 (the file's own word)
        """Return the response of one output to one input, shape (frequencies,); `ResultsError` if there is none."""
        return self.response[:, self._index(output, self.outputs), self._index(input, self.inputs)]

    def to_xarray(self) -> "Dataset":
        """Return the sweep as an `xarray.Dataset` over frequency, output and input; it takes the extra `analysis`."""
        import xarray

        entries, points = ("frequency", "output", "input"), ("frequency", "input")
        of_entries = ("response", "harmonic_distortion", "remaining_transient", "step_error")
        variables = {name: (entries, getattr(self, name)) for name in of_entries}
        variables |= {name: (points, getattr(self, name)) for name in ("status", "wall_time", "message")}
        coordinates = {
            "frequency": ("frequency", self.frequency, {"units": "Hz"}),
            "output": [signal.name for signal in self.outputs],
            "input": [signal.name for signal in self.inputs],
            "output_unit": ("output", [signal.unit for signal in self.outputs]),
            "input_unit": ("input", [signal.unit for signal in self.inputs]),
            "amplitude": ("input", [signal.amplitude for signal in self.inputs]),
        }
        return xarray.Dataset(variables, coords=coordinates, attrs=self.attributes)

    def _index(self, name: str, signals: Sequence[Signal]) -> int:
        """Return the place of a signal; `ResultsError` with the nearest names if there is none."""
        names = [signal.name for signal in signals]
        if name not in names:
            raise ResultsError(f"{self.path} has no signal {name!r}{nearest(name, names)}")
        return names.index(name)


def read_sweep(path: str | Path) -> Bode:
    """Read a sweep, finished or not; `ResultsError` where the file holds none."""
    path = Path(path)
    file = hdf5.open_file(path)
    with file, hdf5.translated(path, "read"):
        if "bode" not in file:
            raise ResultsError(f"{path} holds no sweep; it has {', '.join(file) or 'nothing'}")
        group = file["bode"]
        outputs = zip(hdf5.texts(group["output"]), hdf5.texts(group["output_unit"]), strict=True)
        inputs = zip(
            hdf5.texts(group["input"]), hdf5.texts(group["input_unit"]), group["amplitude"][:].tolist(), strict=True
        )
        numbers = {name: group[name][:] for name in _COMPUTED if name != "message"}
        return Bode(
            path=path,
            frequency=group["frequency"][:],
            outputs=tuple(Signal(name, unit) for name, unit in outputs),
            inputs=tuple(Signal(name, unit, amplitude) for name, unit, amplitude in inputs),
            message=np.array([[hdf5.text(m) for m in row] for row in group["message"][:]], dtype=object),
            settings=hdf5.plain(file["sweep"].attrs),
            attributes=hdf5.plain(file.attrs) | {"status": hdf5.status_of(file)},
            step_error=_step_error(group),
            theory=_read_theory(file),
            marks=_marks(hdf5.text(file["system"].attrs["scene"])),
            **numbers,
        )


def read_run(path: str | Path) -> tuple[dict[str, NDArray[np.float64]], dict[str, str]]:
    """Read a time-domain run: arrays over time by name (`time` [s] first), and the units."""
    path = Path(path)
    file = hdf5.open_file(path)
    with file, hdf5.translated(path, "read"):
        if "time" not in file:
            raise ResultsError(f"{path} holds no run; it has {', '.join(file) or 'nothing'}")
        group = file["time"]
        names = ["time", *(name for name in group if name != "time")]
        return {name: group[name][:] for name in names}, {name: hdf5.text(group[name].attrs["units"]) for name in names}


def read_status(path: str | Path) -> tuple[str, str]:
    """Read the status of a time-domain run, and the message of one that failed."""
    path = Path(path)
    file = hdf5.open_file(path)
    with file, hdf5.translated(path, "read"):
        return hdf5.status_of(file), hdf5.text(file["time"].attrs["message"])


def write_errors(path: Path, errors: Mapping[str, ErrorEstimate]) -> None:
    """Write error estimates of recorded variables (full names) to the file of a run that is complete."""
    with hdf5.translated(path, "write"):
        store = hdf5.Store.resume(path, lambda _: None)
        try:
            for name, error in errors.items():
                for attribute, value in zip(_ERRORS, (error.absolute, error.relative), strict=True):
                    store.file["time"][name].attrs.modify(attribute, np.float64(value))
        finally:
            store.close()


def read_errors(path: str | Path) -> dict[str, ErrorEstimate]:
    """Read the error estimates of a time-domain run by variable; empty where it was not verified."""
    path = Path(path)
    file = hdf5.open_file(path)
    with file, hdf5.translated(path, "read"):
        group = file["time"]
        found = {
            name: ErrorEstimate(*(float(dataset.attrs.get(attribute, np.nan)) for attribute in _ERRORS))
            for name, dataset in group.items()
        }
    return {name: error for name, error in found.items() if np.isfinite(error.absolute)}


def read_choices(path: str | Path) -> dict[str, LevelChoice]:
    """Read how the levels of a file's instances were chosen, by instance; empty where the scene named them all."""
    path = Path(path)
    file = hdf5.open_file(path)
    with file, hdf5.translated(path, "read"):
        return hdf5.read_choices(file["system"])


def read_order(path: str | Path) -> OrderChoice | None:
    """Read how the order of steps of a file's system was computed; `None` where it is the scene's."""
    path = Path(path)
    file = hdf5.open_file(path)
    with file, hdf5.translated(path, "read"):
        return hdf5.read_order(file["system"])


def read_algorithm(path: str | Path) -> AlgorithmChoice | None:
    """Read which algorithm `auto` took for a file's system; `None` where it was named."""
    path = Path(path)
    file = hdf5.open_file(path)
    with file, hdf5.translated(path, "read"):
        return hdf5.read_algorithm(file["system"])


_COMPUTED = (
    "response",
    "harmonic_distortion",
    "remaining_transient",
    "status",
    "wall_time",
    "message",
)


def _marks(scene: str) -> dict[str, float]:
    """Frequencies [Hz] that a scene's text sets beside its responses, by label; none where it is not our text."""
    with contextlib.suppress(tomllib.TOMLDecodeError):
        return tomllib.loads(scene).get("marks", {})
    return {}


def _step_error(group: Node) -> NDArray[np.float64]:
    """Read the error by communication steps, NaN in files of version 0.1, which lack it."""
    return group["step_error"][:] if "step_error" in group else np.full(group["response"].shape, np.nan)


def _read_theory(file: Node) -> Theory | None:
    """Read the theoretical response, if there is one."""
    group = file.get("theory")
    return None if group is None else Theory(group["frequency"][:], group["response"][:])


def _lay_out(file: Node, plan: Plan) -> None:
    """Write `/sweep`, `/bode`, every dataset at its full size, and `/theory`."""
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
    hdf5.create_dataset(bode, "wall_time", points, np.nan, float, "s")
    members = {status.name.lower(): int(status) for status in Status}
    status = hdf5.create_dataset(bode, "status", points, np.int8(0), h5py.enum_dtype(members, basetype="i1"))
    status.attrs["flag_values"] = np.array(list(members.values()), dtype=np.int8)
    status.attrs["flag_meanings"] = " ".join(members)
    message = hdf5.create_dataset(bode, "message", points, b"", f"S{_LONGEST_MESSAGE}")
    message.attrs["_Encoding"] = "utf-8"  # xarray's word for how to decode it
    if plan.theory is not None:
        theory = file.create_group("theory")
        _lay_out_axes(theory, plan.theory.frequency, plan)
        hdf5.create_dataset(theory, "response", entries, _NAN, np.complex128, unit)
        theory["response"][:] = plan.theory.response


def _lay_out_axes(group: Node, frequency: NDArray[np.float64], plan: Plan) -> None:
    """Write the axes of a sweep."""
    hdf5.create_scale(group, "frequency", frequency, "Hz")
    hdf5.create_scale(group, "output", [signal.name for signal in plan.outputs])
    hdf5.create_scale(group, "input", [signal.name for signal in plan.inputs])


def _clipped(message: str) -> bytes:
    """Return a message as UTF-8 that fits its place, cut between characters."""
    return message.encode()[:_LONGEST_MESSAGE].decode(errors="ignore").encode()


def _common(signals: Sequence[Signal]) -> str | None:
    """Return the unit of all signals, `None` where there are several."""
    units = {signal.unit for signal in signals}
    return units.pop() if len(units) == 1 else None


def _response_unit(plan: Plan) -> str:
    """Return the one unit of all entries, or how each follows from the units of its output and input."""
    above, below = _common(plan.outputs), _common(plan.inputs)
    if above is None or below is None:
        return "output_unit/input_unit"
    return "1" if above == below else f"{above}/{below}" if below.isalnum() else f"{above}/({below})"
