"""Writes `docs/published.md`: every published number beside what the parts compute, from `published_sources`.

    make published        # or: python tests/published.py

`published_sources` says what is printed and how it is computed, in a file for each source; `published_probes` computes
what no part's `analyze` does; no computed number is stored. `test_published.py` judges every entry and keeps
`docs/published.md` up to date. A file has

    [sources]       titles of the sources by key, that of the file first
    [[evaluation]]  what is evaluated once: `part` with `level` and `arguments` as on the command line, or with
                    `probe`, a function of `published_probes`. Attributes of `Entry` here hold for all its values.
    values          what is compared, each with attributes of `Entry`. Without `source` it is that of the file.
"""

import re
import tomllib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import published_probes

import hfsa.components
import hfsa.controllers
from hfsa.components._modelling.catalogue import find, part_named
from hfsa.components._modelling.units import unit as parse_unit

Text = str | list[str] | list[list[str]]
"""Numbers as they are printed: one, a row or a matrix."""
Verdict = Literal["agrees", "misprint", "not reproducible"]

DATA = Path(__file__).with_name("published_sources")
FILES = ("sdelta", "stage", "accelerometer", "modules")
REPORT = Path(__file__).parents[1] / "docs/published.md"
KINDS = ("printed", "derived")
VERDICTS: tuple[Verdict, ...] = ("agrees", "misprint", "not reproducible")

SCALED = {
    "mm": 1e-3,
    "um": 1e-6,
    "nm": 1e-9,
    "mrad": 1e-3,
    "urad": 1e-6,
    "deg": np.pi / 180,
    "um/V": 1e-6,
    "N/um": 1e6,
    "MPa": 1e6,
    "kHz": 1e3,
    "mm/N": 1e-3,
    "1/(N.mm)": 1e3,
    "%": 1e-2,
}
"""Units of entries that are not SI, in SI units; the others are spelt as in a part."""

_SMALLEST_DIFFERENCE = 1e-9
_NOTHING = 1e-9
"""What is 0, by the largest number beside it."""


@dataclass(frozen=True)
class Evaluation:
    """What is evaluated once: the analysis of a part, or a probe about it.

    Attributes:
        part: name of the part.
        level: of the part; none for its first.
        arguments: of the analysis as typed on the command line, or of the probe.
        probe: function of `published_probes`, instead of the part's analysis.
    """

    part: str
    level: str | None
    arguments: tuple[tuple[str, Any], ...]
    probe: str | None

    @property
    def words(self) -> str:
        """The command that shows the numbers, or the call of the probe."""
        if self.probe:
            values = [f"{name}={list(v) if isinstance(v, tuple) else repr(v)}" for name, v in self.arguments]
            return f"{self.probe}({', '.join(values)})"
        level = f" --level {self.level}" if self.level else ""
        return f"hfsa analyze {self.part}{level}" + "".join(f" -p {name}={value}" for name, value in self.arguments)


@dataclass(frozen=True)
class Entry:
    """One published quantity, a number or an array of them.

    Attributes:
        evaluation: what computes it.
        source: key of the source.
        kind: `printed` in the source, or `derived` from its data, without this project, and printed nowhere.
        quantity: what it is.
        equation: where the source prints it, or what it is derived from.
        key: path into the evaluation, `resonance_hz.lumped`, `stiffness_S[1,5]`, `force[1:2]`, 1-based; all without.
        unit: of `printed`, as in a part or one of `SCALED`.
        printed: with its digits, a power of ten behind them as an exponent.
        tolerance: of each number, in `unit`; half a unit of its last digit without.
        relative_tolerance: of each number, by its size; instead of `tolerance`.
        verdict: what the comparison comes to; what is derived can only agree, or its digits are ours to correct.
        corrected: of a misprint, with its digits.
        reason: why, or what else there is to say.

    Raises:
        ValueError: a derived quantity with another verdict than `agrees`.
    """

    evaluation: Evaluation
    source: str
    kind: Literal["printed", "derived"]
    quantity: str
    equation: str
    unit: str
    printed: Text
    key: str = ""
    tolerance: float | list[float] | None = None
    relative_tolerance: float | None = None
    verdict: Verdict = "agrees"
    corrected: Text | None = None
    reason: str = ""

    def __post_init__(self):
        if self.kind == "derived" and self.verdict != "agrees":
            raise ValueError(
                f"{self.title}: {self.verdict}, but derived digits are no source's: correct them until they agree"
            )

    @property
    def title(self) -> str:
        """Unique title of the entry."""
        return f"{self.evaluation.part}: {self.quantity} ({self.kind}, {self.source}, {self.equation})"

    @property
    def scale(self) -> float:
        """The unit in SI units; `ValueError` for a unit that there is not."""
        return SCALED.get(self.unit) or float(parse_unit(self.unit).name == self.unit)

    @property
    def computed(self) -> np.ndarray:
        """What the part makes of it, in `unit`, in the shape of `printed`."""
        return at_key(evaluated(self.evaluation), self.key) / self.scale

    @property
    def difference(self) -> float:
        """Largest difference of computed and printed, relative to each printed number, or to the largest at a 0."""
        printed = numbers(self.printed)
        size = np.where(printed == 0, np.abs(printed).max() or 1.0, np.abs(printed))
        return float(np.max(np.abs(self.computed - printed) / size))

    def agrees_with(self, text: Text) -> bool:
        """Whether every computed number rounds to the one of `text`."""
        expected, computed = numbers(text), self.computed
        if computed.shape != expected.shape:
            raise ValueError(f"{self.title}: computed has shape {computed.shape}, printed {expected.shape}")
        # Rounding of the decimal numbers themselves
        allowed = self._allowed(text) + 1e-14 * np.abs(expected)
        return bool(np.all(np.abs(computed - expected) <= allowed))

    def _allowed(self, text: Text) -> np.ndarray:
        """Return how far each computed number may be from the one of `text`."""
        if self.relative_tolerance is not None:
            return self.relative_tolerance * np.abs(numbers(text))
        return half_units(text) if self.tolerance is None else np.array(self.tolerance)


class Number(NamedTuple):
    """How a number is printed: with so many decimals, times ten to the exponent."""

    value: float
    decimals: int
    exponent: int | None

    @classmethod
    def of(cls, text: str) -> "Number":
        """Return how `text` is printed."""
        mantissa, _, exponent = text.partition("e")
        return cls(float(text), len(mantissa.partition(".")[2]), int(exponent) if exponent else None)

    def alike(self, value: float) -> str:
        """Return another value printed in the same way, with one digit more."""
        power = self.exponent or 0
        text = f"{value / 10.0**power:.{self.decimals + 1}f}"
        text = text.removeprefix("-") if float(text) == 0 else text
        return text if self.exponent is None else f"{text}e{self.exponent}"


def numbers(text: Text) -> np.ndarray:
    """Return printed numbers as numbers."""
    return np.array(text, dtype=float)


def half_units(text: Text) -> np.ndarray:
    """Return half a unit of the last digit of printed numbers; of a bare 0, which means nothing at all, next to 0."""
    words = np.ravel(text).tolist()
    nothing = _NOTHING * (np.abs(numbers(text)).max() or 1.0)
    found = [Number.of(one) for one in words]
    units = [0.5 * 10.0 ** ((n.exponent or 0) - n.decimals) for n in found]
    return np.reshape(
        [nothing if word == "0" else unit for word, unit in zip(words, units, strict=True)], np.shape(text)
    )


def at_key(found: Any, key: str) -> np.ndarray:
    """Return what a path leads to."""
    for name, index in re.findall(r"(\w+)|\[([\d,:]+)\]", key):
        found = found[name] if name else np.asarray(found)[tuple(map(_position, index.split(",")))]
    values = np.asarray(found)
    if np.iscomplex(values).any():
        raise ValueError(f"{key or 'the result'} is {values}, expected real numbers")
    return values.real.astype(float)


def _position(index: str) -> int | slice:
    """Return `3`, or `2:5` with its end, as numpy counts."""
    first, colon, last = index.partition(":")
    return slice(int(first) - 1, int(last)) if colon else int(index) - 1


@cache
def parts() -> dict:
    """Return the parts by name."""
    return find([hfsa.components, hfsa.controllers])


@cache
def evaluated(evaluation: Evaluation) -> Any:
    """Return what a part's analysis or a probe returns, computed once."""
    arguments = {name: list(v) if isinstance(v, tuple) else v for name, v in evaluation.arguments}
    if evaluation.probe:
        return published_probes.PROBES[evaluation.probe](**arguments)
    return part_named(evaluation.part, parts()).analysis(evaluation.level, **arguments)


@cache
def sources() -> dict[str, str]:
    """Return the titles of the sources by key."""
    return {key: title for data in _data().values() for key, title in data["sources"].items()}


@cache
def entries() -> tuple[Entry, ...]:
    """Return all entries in the order of the files."""
    return tuple(entry for name, data in _data().items() for entry in _entries(name, data["evaluation"]))


def entry(part: str, quantity: str, equation: str) -> Entry:
    """Return the entry of a part with that quantity of that equation; `KeyError` if there is none."""
    wanted = (part, quantity, equation)
    for one in entries():
        if (one.evaluation.part, one.quantity, one.equation) == wanted:
            return one
    raise KeyError(wanted)


def _entries(source: str, groups: list[dict[str, Any]]) -> Iterator[Entry]:
    known = {field.name for field in fields(Entry)}
    for group in groups:
        about = {"source": source, **group}
        arguments = {n: tuple(v) if isinstance(v, list) else v for n, v in about.pop("arguments", {}).items()}
        part, level, probe = about.pop("part"), about.pop("level", None), about.pop("probe", None)
        evaluation = Evaluation(part, level, tuple(arguments.items()), probe)
        values = about.pop("values")
        if unknown := about.keys() - known:
            raise ValueError(f"evaluation of {part}: unknown {', '.join(sorted(unknown))}")
        for value in values:
            yield Entry(**{"evaluation": evaluation, **about, **value})


@cache
def _data() -> dict[str, Any]:
    return {name: tomllib.loads((DATA / f"{name}.toml").read_text()) for name in FILES}


# The report -----------------------------------------------------------------------------------------------------------


def report() -> str:
    """Return the text of `docs/published.md`."""
    text = [
        "# Published numbers and ours",
        "Written by `make published` from `tests/published_sources`, which the tests read, too.",
        "A **printed** quantity stands in a source with just these digits, at the equation or table named; a power of "
        "ten is shown as an exponent. It **agrees** where the computed numbers round to the printed ones, to half a "
        "unit of the last digit unless its file says otherwise. It is a **misprint** where they do not and where it is "
        "known what is right, be it a slip of a digit or of the computation behind it: the computed numbers round to "
        "the corrected ones. Otherwise it is **not reproducible**, and the reason says why. A slip early in a "
        "computation makes misprints of all that follows; where these are listed a second time with the slip put in, "
        "they agree. What a source says in words only is marked so.",
        "A **derived** quantity is printed nowhere: it was computed from a source's data without this project. It says "
        "nothing about the source. It must agree; where it does not, the digits or the parts are corrected.",
        "Computed numbers are shown with a digit more. The difference is relative to the printed number; of an array "
        "it is the largest. Numbers come from the command shown, or from a function of `tests/published_probes`.",
        _summary(),
    ]
    for part in dict.fromkeys(entry.evaluation.part for entry in entries()):
        text.append(f"## {part}")
        for kind in KINDS:
            if found := [e for e in entries() if (e.evaluation.part, e.kind) == (part, kind)]:
                text += [f"### {part}, {kind}", _table(found)]
    return "\n\n".join(text) + "\n"


def _summary() -> str:
    """Return what was printed in each source and what became of it, and how much was derived from it and agrees."""
    columns = [("printed", verdict) for verdict in VERDICTS] + [("derived", "agrees")]
    counts = Counter((e.source, e.kind, e.verdict) for e in entries())
    rows = [[f"{key}: {title}", *[counts[key, *column] for column in columns]] for key, title in sources().items()]
    rows.append(["all", *[sum(column) for column in list(zip(*rows, strict=True))[1:]]])
    head = ["source", *[f"{kind}: {verdict}" for kind, verdict in columns]]
    return _markdown(head, rows)


def _table(found: list[Entry]) -> str:
    value = found[0].kind
    columns = ["quantity", "source", value, "computed", "difference", "verdict", "computed by"]
    return _markdown(columns, [_row(entry) for entry in found])


def _row(entry: Entry) -> list[str]:
    unit = "" if entry.unit == "1" else f" {entry.unit}"
    verdict = entry.verdict if entry.verdict == "agrees" else f"**{entry.verdict}**"
    if entry.corrected:
        verdict += f", corrected {_shown(entry.corrected)}{unit}"
    reason = f": {entry.reason}" if entry.reason else ""
    small = entry.difference < _SMALLEST_DIFFERENCE
    return [
        entry.quantity,
        f"{entry.source}, {entry.equation}",
        _shown(entry.printed) + unit,
        _shown(_alike(entry.corrected or entry.printed, entry.computed)) + unit,
        f"< {_SMALLEST_DIFFERENCE:.0e}" if small else f"{entry.difference:.1e}",
        verdict + reason,
        f"`{entry.evaluation.words}`",
    ]


def _alike(text: Text, values: np.ndarray) -> Text:
    """Return values printed like `text`, in its shape."""
    if isinstance(text, str):
        return Number.of(text).alike(float(values))
    return [_alike(one, value) for one, value in zip(text, values, strict=True)]  # type: ignore[return-value]


def _shown(text: Text) -> str:
    """Return numbers on one line, rows of a matrix apart."""
    if isinstance(text, str):
        return text
    if isinstance(text[0], list):
        return "; ".join(", ".join(row) for row in text)
    if len(text) > 2 and len(set(text)) == 1:
        return f"{len(text)} times {text[0]}"
    return ", ".join(text)  # type: ignore[arg-type]


def _markdown(columns: list[str], rows: list[list]) -> str:
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


if __name__ == "__main__":
    REPORT.write_text(report())
    print(REPORT)
