"""Driving signals as texts: a shape with numbers, or a column of a file.

signal_of("chirp,amplitude=1e-6,from=1,to=200,duration=2", ["mass.base.position"])
signal_of("wind.csv:force,interpolation=smooth", ["plant.force"])
"""

import re
import typing
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

from hfsa.cosim.experiments.drive_table import file_and_column, read_table
from hfsa.cosim.signals.drive import Signal
from hfsa.cosim.signals.shapes import Chirp, Ramp, Sine, Step
from hfsa.cosim.signals.sums import Multisine, Noise
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import nearest

SHAPES: Mapping[str, type[Signal]] = {kind.name: kind for kind in (Step, Ramp, Sine, Chirp, Multisine, Noise)}
"""Shapes by name."""

_OPTION = re.compile(r"^\s*(\w+)\s*=(.*)$")


def signal_of(text: str, inputs: Sequence[str]) -> Signal:
    """Return the signal of a text; `inputs` are the names of the input that it drives.

    `StructureError` for a name that is no shape and no file, an option that it has not, and what `read_table` and the
    shapes refuse.
    """
    words = text.split(",")
    first = len(words)
    while first > 1 and _OPTION.match(words[first - 1]):
        first -= 1
    subject, options = ",".join(words[:first]).strip(), _options(words[first:], text)
    if (found := file_and_column(subject)) is not None:
        _check_options(subject, options, ["interpolation"])
        return read_table(*found, options.get("interpolation", "linear"), inputs)  # type: ignore[arg-type]
    if subject not in SHAPES:
        words = [*SHAPES, "FILE.csv", "FILE.csv:COLUMN", "FILE.h5:VARIABLE"]
        raise StructureError(f"no signal is called {subject!r}{nearest(subject, SHAPES)}; expected {', '.join(words)}")
    return _shape(subject, options)


def _options(words: Sequence[str], text: str) -> dict[str, str]:
    """Return options by name; `StructureError` for one that is given twice."""
    found: dict[str, str] = {}
    for word in words:
        match = _OPTION.match(word)
        assert match is not None
        if match[1] in found:
            raise StructureError(f"{text}: {match[1]} is given twice")
        found[match[1]] = match[2].strip()
    return found


def _check_options(subject: str, options: Mapping[str, str], known: Sequence[str]) -> None:
    """Raise `StructureError` for an option that a signal has not."""
    for name in options:
        if name not in known:
            raise StructureError(f"{subject} has no option {name!r}; it has {', '.join(known)}")


def _shape(name: str, options: Mapping[str, str]) -> Signal:
    """Return a shape with options."""
    kind = SHAPES[name]
    hints = typing.get_type_hints(kind)
    known = {field.name.rstrip("_"): field.name for field in fields(kind)}  # type: ignore[arg-type]
    _check_options(name, options, list(known))
    values = {known[key]: _value(name, key, text, hints[known[key]]) for key, text in options.items()}
    try:
        return kind(**values)
    except ValueError as error:
        raise StructureError(str(error)) from None


def _value(shape: str, option: str, text: str, hint: Any) -> Any:
    """Return the value of an option by its annotation."""
    if hint not in (int, float):
        choices = typing.get_args(hint)
        if text not in choices:
            raise StructureError(f"{shape}: {option} is {text!r}, expected {' or '.join(choices)}")
        return text
    try:
        return hint(text)
    except ValueError:
        expected = "a whole number" if hint is int else "a number"
        raise StructureError(f"{shape}: {option} is {text!r}, expected {expected}") from None
