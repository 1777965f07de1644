"""The frame of a results file: who made it, of which system, and how a file is created so that no crash can spoil it.

Everything a file will hold is laid out and written once, with fill values, before the file gets its name; afterwards
numbers are only overwritten in place. So the file is readable after a kill at any moment, and a disk that fills up is
noticed before the work begins, not after. From its first moment to its last the file is locked for others.
"""

import contextlib
import io
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from hfsa.cosim.results import target
from hfsa.cosim.results.interrupts import deferred_interrupts
from hfsa.cosim.results.records import AlgorithmChoice, LevelChoice, OrderChoice, ResultsError, SystemRecord

FORMAT_VERSION = "1"

RUNNING, COMPLETE, INTERRUPTED, FAILED = b"running", b"complete", b"interrupted", b"failed"
_LONGEST_STATUS = 16


Node = Any
"""A file, group or dataset of h5py, whose own types say of a group's member only that it is one of three kinds."""


class Store:
    """An HDF5 file open for writing by this process alone: `file` is h5py's, `flush` and `close` report a full disk.

    `identity` tells it from whatever else may get its name.
    """

    def __init__(self, path: Path, disk: "_Disk"):
        self.path = path
        self._disk = disk
        # a change of the working folder, by whatever code, changes nothing
        self._real = Path(os.path.realpath(path))
        self.identity = target.Identity.of(disk.fileno())
        with translated(path, "open"):
            self.file: Node = h5py.File(disk, "r+")

    @classmethod
    def create(cls, path: Path, system: SystemRecord, fill: Callable[[Node], None], force: bool = False) -> "Store":
        """Create a results file and open it, once it is complete on disk.

        `ResultsError` where something stands there: a results file of ours is replaced with `force`, all else never.
        """
        target.check_new(path, force)
        with target.unfinished(path) as part:
            disk = _Disk(path, part, "x+")
            try:
                with deferred_interrupts(), translated(path, "write"):
                    with h5py.File(disk, "w") as file:
                        _write_attributes(file, system.title)
                        _write_system(file.create_group("system"), system)
                        fill(file)
                    disk.report()
                disk = disk.placed(part, lambda: target.check_new(path, force))
                return cls(path, disk)
            except BaseException:
                disk.close()
                raise

    @classmethod
    def resume(cls, path: Path, check: Callable[[Node], None]) -> "Store":
        """Open a results file to go on with it, which `check` may refuse before anything is changed."""
        if not path.is_file():
            raise ResultsError(f"there is no file {path}")
        disk = _Disk(path, path, "r+")
        try:
            if not target.Identity.of(disk.fileno()).is_at(path):
                raise ResultsError(f"cannot write {path}: another process has just replaced it")
            with translated(path, "open"), h5py.File(disk, "r") as file:
                _check_version(path, file)
                check(file)
            return cls(path, disk)
        except BaseException:
            disk.close()
            raise

    def flush(self) -> None:
        """Write everything to the file; `ResultsError` where that fails."""
        with deferred_interrupts():
            self.file.flush()
        self._disk.report()

    def close(self) -> None:
        """Write everything and close; `ResultsError` where something was not written. What was stays readable.

        `ResultsError`, too, where the file has lost its name.
        """
        with deferred_interrupts():
            self.file.close()
            self._disk.close()
        self._disk.report()
        self.identity.check(self._real)


class _Disk(io.FileIO):
    """The file HDF5 writes to, locked: `opened` is its present name, `path` the one to tell.

    A write that fails is remembered, not reported: after one, HDF5 crashes when it ends.
    """

    def __init__(self, path: Path, opened: Path, mode: str):
        with translated(path, "write"):
            super().__init__(opened, mode)
        self.path = path
        self.error: OSError | None = None
        try:
            target.lock(self.fileno(), path)
        except ResultsError:
            self.close()
            raise

    def placed(self, part: Path, check: Callable[[], target.Found]) -> "_Disk":
        """Give the file, complete and called `part`, the name `path`, still locked."""
        if target.fcntl is None:  # Windows renames no file that is open
            self.close()
            target.put_in_place(part, self.path, check)
            return _Disk(self.path, self.path, "r+")
        target.put_in_place(part, self.path, check)
        return self

    def report(self) -> None:
        """Raise `ResultsError` for what the disk refused."""
        if self.error is not None:
            raise ResultsError(f"cannot write {self.path}: {_reason(self.error)}") from self.error

    def write(self, data, /) -> int:
        """Write everything; an error of the system is kept for later, as HDF5 cannot bear one here."""
        rest = memoryview(data)
        size = len(rest)
        try:
            while len(rest):
                rest = rest[super().write(rest) :]
        except OSError as error:
            self.error = self.error or error
        return size

    def truncate(self, size: int | None = None, /) -> int:
        """Change the size; an error is kept, as in `write`."""
        try:
            return super().truncate(size)
        except OSError as error:
            self.error = self.error or error
            return size or 0


def open_file(path: Path) -> Node:
    """Open a results file for reading; `ResultsError` where it is missing, being written or no results file."""
    if not path.is_file():
        raise ResultsError(f"there is no file {path}")
    with translated(path, "open"):
        file: Node = h5py.File(path, "r", locking=None if target.has_locks(path) else False)
    try:
        _check_version(path, file)
    except ResultsError:
        file.close()
        raise
    return file


def _check_version(path: Path, file: Node) -> None:
    """Raise `ResultsError` for a file of another format."""
    found = file.attrs.get("format_version")
    if found != FORMAT_VERSION:
        raise ResultsError(f"{path} has format version {found}, expected {FORMAT_VERSION}")


@contextlib.contextmanager
def translated(path: Path, verb: str) -> Iterator[None]:
    """Turn what h5py and the system raise for a full disk, a locked or a broken file into a `ResultsError`."""
    try:
        yield
    except (OSError, RuntimeError, KeyError) as error:
        if isinstance(error, ResultsError):
            raise
        raise ResultsError(f"cannot {verb} {path}: {_reason(error)}") from error


def set_status(file: Node, status: bytes) -> None:
    """Write the status attribute in place."""
    file.attrs.modify("status", np.bytes_(status.ljust(_LONGEST_STATUS, b"\0")))


def status_of(file: Node) -> str:
    """Return the status attribute: `running`, `complete`, `interrupted` or `failed`."""
    return bytes(file.attrs["status"]).rstrip(b"\0").decode()


def create_scale(group: Node, name: str, values: Any, unit: str | None = None) -> Node:
    """Write a dimension scale: numbers with their unit, or texts."""
    if len(values) and isinstance(values[0], str):
        dataset = group.create_dataset(name, data=list(values), dtype=h5py.string_dtype())
    else:
        dataset = group.create_dataset(name, data=np.asarray(values, dtype=float))
    dataset.make_scale(name)
    if unit is not None:
        set_unit(dataset, unit)
    return dataset


def create_dataset(group: Node, name: str, dimensions: Sequence[str], fill: Any, dtype: Any, unit: str | None = None):
    """Lay out a dataset over dimension scales of its group, filled on disk; a complex fill must be `np.complex128`."""
    shape = tuple(len(group[d]) for d in dimensions)
    dataset = group.create_dataset(name, shape, dtype, data=np.full(shape, fill), fillvalue=fill)
    for axis, dimension in enumerate(dimensions):
        dataset.dims[axis].attach_scale(group[dimension])
    if unit is not None:
        set_unit(dataset, unit)
    return dataset


def set_unit(dataset: Node, unit: str) -> None:
    """Write the unit where xarray (`units`) and readers of the Scientific Data Format (`UNIT`) look for it."""
    dataset.attrs["units"] = unit
    dataset.attrs["UNIT"] = unit


def text(value: Any) -> str:
    """Return a text attribute or element as `str`."""
    return value.decode() if isinstance(value, bytes) else str(value)


def texts(dataset: Node) -> list[str]:
    """Return the elements of a dataset of texts."""
    return [text(value) for value in dataset[:]]


def plain(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Return attributes as plain Python values."""
    values = {}
    for name, value in attributes.items():
        item = value.tolist() if isinstance(value, np.generic | np.ndarray) else value
        values[name] = text(item) if isinstance(item, bytes) else item
    return values


def _write_attributes(file: Node, title: str) -> None:
    """Write what made the file, and when."""
    file.attrs["title"] = title
    file.attrs["created"] = datetime.now(UTC).isoformat(timespec="seconds")
    file.attrs["tool"] = target.TOOL
    file.attrs["tool_version"] = version("hfsa")
    file.attrs["git_commit"] = _git_commit()
    file.attrs["command"] = " ".join([Path(sys.argv[0]).name, *sys.argv[1:]])
    file.attrs["python"] = platform.python_version()
    file.attrs["platform"] = platform.platform()
    file.attrs["format_version"] = FORMAT_VERSION
    # fixed length, so that it can be overwritten in place
    file.attrs.create("status", np.bytes_(RUNNING), dtype=f"S{_LONGEST_STATUS}")


def _write_system(group: Node, system: SystemRecord) -> None:
    """Write the scene, and of each instance what it was made of."""
    group.attrs["scene"] = system.scene
    for record in system.instances:
        instance = group.create_group(record.instance)
        for key in ("name", "file", "sha256", "fmi_version", "level", "solver"):
            instance.attrs[key] = getattr(record, key)
        _write_named(instance, "start", record.start)
        if record.choice is not None:
            _write_choice(instance, record.choice)
    _write_named(group, "operating_point", system.operating_point)
    if system.order is not None:
        _write_order(group, system.order)
    if system.algorithm is not None:
        _write_algorithm(group, system.algorithm)


def _write_named(group: Node, name: str, values: Mapping[str, float]) -> None:
    """Write numbers by name, if there are any."""
    if values:
        part = group.create_group(name)
        create_scale(part, "variable", list(values))
        create_dataset(part, "value", ["variable"], np.nan, float)[:] = list(values.values())


def _write_choice(instance: Node, choice: LevelChoice) -> None:
    """Write how an instance's level was chosen: attributes `level_...`, and `levels` with the error of each."""
    for key, value in (("error", choice.error), ("error_together", choice.together), ("tolerance", choice.tolerance)):
        instance.attrs[f"level_{key}"] = value
    levels = instance.create_group("levels")
    create_scale(levels, "level", list(choice.errors))
    create_dataset(levels, "error", ["level"], np.nan, float, "1")[:] = list(choice.errors.values())
    refusals = [choice.refusals.get(level, "") for level in choice.errors]
    levels.create_dataset("refusal", data=refusals, dtype=h5py.string_dtype()).dims[0].attach_scale(levels["level"])


def read_choices(group: Node) -> dict[str, LevelChoice]:
    """Return how levels were chosen, by instance, from the group `/system`; empty where the scene named them all."""
    choices = {}
    for name, instance in group.items():
        if "level_error" in instance.attrs:
            levels = instance["levels"]
            known = texts(levels["level"])
            refusals = zip(known, texts(levels["refusal"]), strict=True)
            choices[name] = LevelChoice(
                text(instance.attrs["level"]),
                float(instance.attrs["level_tolerance"]),
                dict(zip(known, levels["error"][:].tolist(), strict=True)),
                {level: refusal for level, refusal in refusals if refusal},
                float(instance.attrs["level_error_together"]),
            )
    return choices


def _write_order(group: Node, choice: OrderChoice) -> None:
    """Write how the order of steps was computed: attributes `order_...` beside the scene that has that order."""
    names = {"order": list(choice.order), "order_own": list(choice.own)}
    for key, value in names.items():
        group.attrs.create(key, value, dtype=h5py.string_dtype())
    for key in ("about", "error", "own_error", "compared", "is_complete"):
        group.attrs[f"order_{key}"] = getattr(choice, key)


def read_order(group: Node) -> OrderChoice | None:
    """Return how the order of steps was computed, from the group `/system`; `None` where it is the scene's."""
    if "order" not in group.attrs:
        return None
    attributes = group.attrs
    return OrderChoice(
        tuple(map(text, attributes["order"])),
        tuple(map(text, attributes["order_own"])),
        text(attributes["order_about"]),
        float(attributes["order_error"]),
        float(attributes["order_own_error"]),
        int(attributes["order_compared"]),
        bool(attributes["order_is_complete"]),
    )


def _write_algorithm(group: Node, choice: AlgorithmChoice) -> None:
    """Write what `auto` took: attributes `algorithm` and `algorithm_...`, arrays over those that were tried."""
    tried = list(dict.fromkeys([*choice.errors, *choice.refusals]))
    group.attrs["algorithm"] = choice.algorithm
    for key in ("step_size", "tolerance", "about", "unknown"):
        group.attrs[f"algorithm_{key}"] = getattr(choice, key)
    group.attrs.create("algorithm_tried", tried, dtype=h5py.string_dtype())
    group.attrs["algorithm_errors"] = [choice.errors.get(name, np.nan) for name in tried]
    refusals = [choice.refusals.get(name, "") for name in tried]
    group.attrs.create("algorithm_refusals", refusals, dtype=h5py.string_dtype())


def read_algorithm(group: Node) -> AlgorithmChoice | None:
    """Return what `auto` took, from the group `/system`; `None` where the algorithm was named."""
    if "algorithm" not in group.attrs:
        return None
    attributes = group.attrs
    tried = list(map(text, attributes["algorithm_tried"]))
    errors = dict(zip(tried, np.atleast_1d(attributes["algorithm_errors"]).tolist(), strict=True))
    refusals = dict(zip(tried, map(text, attributes["algorithm_refusals"]), strict=True))
    return AlgorithmChoice(
        text(attributes["algorithm"]),
        float(attributes["algorithm_step_size"]),
        float(attributes["algorithm_tolerance"]),
        text(attributes["algorithm_about"]),
        {name: error for name, error in errors.items() if not refusals[name]},
        {name: why for name, why in refusals.items() if why},
        text(attributes["algorithm_unknown"]),
    )


def _git_commit() -> str:
    """Return the commit of the checkout this code runs from, with `-dirty` where it was changed; empty elsewhere."""
    folder = Path(__file__).parent
    try:
        call = ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
        done = subprocess.run(call, cwd=folder, capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


def _reason(error: Exception) -> str:
    """Return the system's own words out of an HDF5 message."""
    message = str(error)
    if "unable to lock file" in message:
        return "another process has it open"
    if "error message = '" in message:
        return message.split("error message = '")[1].split("'")[0]
    return getattr(error, "strerror", None) or message
