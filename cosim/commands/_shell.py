"""Output of a verb: the answer on stdout, as text or JSON; progress, warnings and errors on stderr; the exit code.

0 done    1 a check found problems or points failed    2 wrong usage    3 build failed    4 simulation failed
130 interrupted    143 ended by SIGTERM    129 ended by SIGHUP
"""

import contextlib
import errno
import io
import json
import math
import os
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from hfsa.cosim.results.interrupts import Interrupted, handled_signals

DONE, PROBLEMS, USAGE, BUILD_FAILED, SIMULATION_FAILED, INTERRUPTED = 0, 1, 2, 3, 4, 130

PICTURE = ".png"
"""Ending of the picture beside an HDF5 file."""

TRACEBACK = "--traceback"
"""Option of every verb: an error prints its traceback."""

# a full or failing disk is a failed simulation, not wrong usage
_DISK = {errno.ENOSPC, errno.EFBIG, errno.EIO, errno.EDQUOT}

_WIDEST = 10_000


def run(verb: Callable[[], int | None], traced: bool = False) -> int:
    """Run a verb and return its exit code.

    Errors with an `exit_code`, refusals of the system and lack of memory are printed as one line on stderr, with
    `traced` below their traceback; all others are bugs and raised.
    """
    try:
        return _ended(verb, traced)
    except KeyboardInterrupt as again:  # while the first one is being handled
        return getattr(again, "code", INTERRUPTED)
    except Exception as error:
        if (cause := _interruption(error)) is None:
            raise
        warn(getattr(cause, "description", "interrupted"))
        return getattr(cause, "code", INTERRUPTED)


def _interruption(error: BaseException) -> KeyboardInterrupt | None:
    """Return the interruption in whose handling an error was raised, as by a lock that it left half released."""
    context = error.__context__
    while context is not None and not isinstance(context, KeyboardInterrupt):
        context = context.__context__
    return context


def _ended(verb: Callable[[], int | None], traced: bool) -> int:
    """Run a verb and return its exit code, as `run`."""
    try:
        with handled_signals(), plain_warnings():
            return verb() or DONE
    except Interrupted as interruption:
        warn(interruption.description)
        return interruption.code
    except KeyboardInterrupt:
        warn("interrupted")
        return INTERRUPTED
    except BrokenPipeError:
        # the reader of stdout has closed it: nothing may be flushed to it at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except UnicodeEncodeError as error:
        if not any("\udc80" <= c <= "\udcff" for c in error.object):  # what stands for bytes of a path or an argument
            raise
        return _failed(f"{error.object[:200]!a} has bytes that are no UTF-8, expected another name", USAGE, traced)
    except (ValueError, RuntimeError) as error:
        code: int | None = getattr(error, "exit_code", None)
        if type(error).__name__ == "LinAlgError":  # numpy's, which may not be imported yet
            return _failed(f"arguments so large or small give no numbers: {error}", USAGE, traced)
        if code is None:
            raise
        if isinstance(error.__cause__, OSError) and error.__cause__.errno in _DISK:
            code = SIMULATION_FAILED
        return _failed(str(error), code, traced)
    except OSError as error:
        code = SIMULATION_FAILED if error.errno in _DISK else USAGE
        return _failed(_disk_words(error), code, traced)
    except MemoryError as error:
        return _failed(f"not enough memory: {error or 'none is left'}", SIMULATION_FAILED, traced)


def _failed(message: str, code: int, traced: bool) -> int:
    """Print an error, with `traced` below its traceback, and return its exit code."""
    if traced:
        traceback.print_exc()
    print(f"error: {message}", file=sys.stderr)
    return code


def _disk_words(error: OSError) -> str:
    """Return a sentence on an error of the system: the file, the reason, and what to set where the place is ours."""
    reason = error.strerror or str(error)
    what = f"{error.filename}: {reason}" if error.filename else reason
    try:
        place = tempfile.gettempdir()
    except OSError:
        return f"{what}; set TMPDIR to a folder that can be written"
    if error.filename and not Path(os.fsdecode(error.filename)).is_relative_to(place):
        return what
    return f"{what}; temporary files go to {place}, and TMPDIR names another folder"


def open_streams() -> None:
    """Open what the caller has closed of the standard streams, so that no file of ours takes their numbers.

    A character that the encoding of a stream lacks is written as its escape.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "r" if number == 0 else "w", encoding="utf-8", closefd=False))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


@contextlib.contextmanager
def plain_warnings() -> Iterator[None]:
    """Print warnings that libraries address to users as `warn`, each once; others as Python does."""
    printed: set[str] = set()
    as_python_does = warnings.showwarning

    def shown(message: Warning | str, category: type[Warning], *place: Any) -> None:
        if category is not UserWarning:
            as_python_does(message, category, *place)
        elif str(message) not in printed:
            printed.add(str(message))
            warn(str(message))

    with warnings.catch_warnings():
        warnings.showwarning = shown
        yield


def warn(message: str) -> None:
    """Print a line on stderr."""
    print(f"hfsa: {message}", file=sys.stderr)


def answer(data: Any, text: str, as_json: bool) -> None:
    """Print the answer of a verb: `data` as JSON, or `text`."""
    try:
        print(json.dumps(plain(data), indent=2, ensure_ascii=False, allow_nan=False) if as_json else text)
        sys.stdout.flush()  # raises here instead of at exit
    except BrokenPipeError:
        raise
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # nothing may be flushed to it at exit
        raise OSError(error.errno, error.strerror, "standard output") from error


def rendered(*tables: Any) -> str:
    """Return the first of several rich tables that fits the terminal, else the last, as text.

    Without a terminal it is the first one in its full width.
    """
    from rich.console import Console
    from rich.measure import Measurement

    width = Console().width if sys.stdout.isatty() else _WIDEST
    text = io.StringIO()
    console = Console(file=text, width=width, markup=False, highlight=False, no_color=True)
    wide = console.options.update(width=_WIDEST)
    fitting = (t for t in tables if Measurement.get(console, wide, t).maximum <= width)
    console.print(next(fitting, tables[-1]))
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines() if line.strip())


def table(*headings: str) -> Any:
    """Return an empty rich table with a line below its headings; a column of `>heading` is right-aligned."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    empty = Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False)
    for heading in headings:
        empty.add_column(heading.removeprefix(">"), justify="right" if heading.startswith(">") else "left")
    return empty


def named_values(words: list[str] | None, option: str = "-p") -> dict[str, str]:
    """Return the NAME=VALUE words of an option by name; `StructureError` for one without `=` or a name given twice."""
    from hfsa.cosim.systems.errors import StructureError

    values: dict[str, str] = {}
    for word in words or ():
        name, equals, value = word.partition("=")
        if not (name and equals):
            raise StructureError(f"{option} {word!r} is not of the form NAME=VALUE")
        if name in values:
            raise StructureError(f"{option} {name} is given twice: {values[name]} and {value}")
        values[name] = value
    return values


def part_arguments(level: str | None, words: list[str] | None) -> dict[str, str]:
    """Return the arguments of a part from NAME=VALUE words and `level`; `StructureError` for a level given twice."""
    return named_values([*([] if level is None else [f"level={level}"]), *(words or ())])


def results_file(output: Path | None, name: str, kind: str, force: bool) -> Path:
    """Return the HDF5 file of a map or path, by default `results/NAME_kind.h5`.

    `StructureError` for the ending of its picture, `ResultsError` for a file that is there, unless it may be replaced.
    """
    from hfsa.cosim.results.target import check_new, check_picture
    from hfsa.cosim.systems.errors import StructureError

    path = output or Path("results", f"{name}_{kind}.h5")
    if path.suffix == PICTURE:
        raise StructureError(f"-o {path} is the {kind}'s HDF5 file; its picture is written beside it, with {PICTURE}")
    check_new(path, force)
    check_picture(path.with_suffix(PICTURE))
    return path


def described_part(name: str, words: Mapping[str, Any]) -> str:
    """Return the name of a part with its arguments, as typed, or the tables of files."""
    return " ".join([name, *(f"{key}={value}" for key, value in words.items())])


def plain(value: Any, name: str = "the answer") -> Any:
    """Return a value for JSON: arrays as nested lists, complex numbers by part, NaN and infinity as null.

    `StructureError` for a value that JSON does not know, with its place in what is called `name`.
    """
    if isinstance(value, Mapping):
        return {str(key): plain(item, f"{name}[{key!r}]") for key, item in value.items()}
    if callable(getattr(value, "tolist", None)):
        return plain(value.tolist(), name)
    if isinstance(value, list | tuple):
        return [plain(item, f"{name}[{index}]") for index, item in enumerate(value)]
    if isinstance(value, complex):
        return {"real": plain(value.real), "imaginary": plain(value.imag)}
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Path):
        return str(value)
    if value is None or isinstance(value, str | int):
        return value
    from hfsa.cosim.systems.errors import StructureError

    raise StructureError(f"{name} is of the type {type(value).__name__}, expected a number, a text or a list of them")


@contextlib.contextmanager
def progress(label: str) -> Iterator[Callable[[float, str], None]]:
    """Show a progress bar on stderr, if it is a terminal; yield a function of the finished part (0 to 1) and a word."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[word]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(label, total=1.0, word="")
        yield lambda part, word: bar.update(task, completed=part, word=word)
