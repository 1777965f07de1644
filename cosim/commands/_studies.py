"""Design studies on the command line: their options, and their answers as data for JSON and as text."""

import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hfsa.components._modelling import study as studies
from hfsa.components._modelling.study import Optimum, Range, Response, Study, bounds, optimum, response_map, slopes
from hfsa.cosim.commands._shell import PICTURE, described_part, rendered, results_file, table
from hfsa.cosim.figures.response_map import response_map_figure
from hfsa.cosim.figures.sensitivity import sensitivity_figure
from hfsa.cosim.figures.style import save
from hfsa.cosim.results.response_map import MapQuantity, ResponseMap, write_response_map
from hfsa.cosim.results.target import check_picture
from hfsa.cosim.signals.prefixes import readable
from hfsa.cosim.systems.errors import StructureError

_SHARE = 20.0
_WIDTH = 118


@dataclass(frozen=True)
class StudyRequest:
    """Options of a design study: one of sensitivity, map and optimum.

    Attributes:
        sensitivity: whether to compute the sensitivities.
        map: two dimensions, `tm,l` or with ranges `tm=1e-5:4e-5,l`.
        optimize: whether to compute the optimum.
        bounds: bounds of the optimum, `20` or `20,tm=1e-5:4e-5,l=2e-4`.
        output: file of the map or of the path.
        force: whether to replace an existing results file.
        path: file of postures to follow.
        picture: file of a picture.
        is_over: whether values of arguments are varied.
    """

    sensitivity: bool
    map: str | None
    optimize: bool
    bounds: str | None
    output: Path | None
    force: bool = False
    path: Path | None = None
    picture: Path | None = None
    is_over: bool = False

    def is_study(self) -> bool:
        """Return whether a study, path or picture is requested; `StructureError` for conflicting options."""
        given = {
            "--sensitivity": self.sensitivity,
            "--map": self.map is not None,
            "--optimize": self.optimize,
            "--path": self.path is not None,
            "--picture": self.picture is not None,
            "--over": self.is_over,
        }
        requested = [option for option, is_given in given.items() if is_given]
        if len(requested) > 1:
            raise StructureError(f"{' and '.join(requested)} are different studies; take one at a time")
        has_file = self.map is not None or self.path is not None or self.is_over
        if self.output is not None and not has_file and not self.sensitivity:
            raise StructureError(
                "-o is the file of a map, a path or a table, or a picture of sensitivities, which takes --map, --path, "
                "--over or --sensitivity; --picture names its own"
            )
        if self.force and not has_file:
            raise StructureError(
                "--force replaces the file of a map, a path or a table, which takes --map, --path or --over"
            )
        if self.bounds is not None and not self.optimize:
            raise StructureError("--bounds are bounds of an optimum, which takes --optimize")
        return bool(requested)


def study_answer(study: Study, request: StudyRequest, name: str, words: Mapping[str, Any]) -> tuple[Any, str, bool]:
    """Return the answer as data and as text, and whether it is valid: an optimum must have converged.

    Args:
        study: study of the part.
        request: options of the study, with `is_study`.
        name: name of the part.
        words: arguments of the study, as typed, with the tables of files.
    """
    if request.sensitivity:
        if request.output is not None:
            check_picture(request.output)
        data, text = _sensitivity(study)
        if request.output is None:
            return data, text, True
        save(sensitivity_figure(study.title, data["sensitivity"]), request.output)
        return {**data, "picture": request.output}, f"{text}\n{request.output}", True
    if request.map is not None:
        path, described = results_file(request.output, name, "map", request.force), described_part(name, words)
        return *_map(study, _items(request.map, "--map"), path, described, request.force), True
    share, given = _bounds(request.bounds or f"{_SHARE:g}")
    found = optimum(study, bounds(study, share, given))
    return _optimum_data(found), _optimum_text(found), found.is_converged


# Options --------------------------------------------------------------------------------------------------------------


def _items(words: str, option: str) -> dict[str, Range | None]:
    """Return the ranges of `tm=1e-5:4e-5,l` by name, `None` for a name without range."""
    ranges: dict[str, Range | None] = {}
    for word in words.split(","):
        name, equals, value = (part.strip() for part in word.partition("="))
        if not name or (equals and not value):
            raise StructureError(f"{option} {words!r} is not of the form NAME or NAME=LOW:HIGH, joined by commas")
        if name in ranges:
            raise StructureError(f"{option} names {name} twice")
        ranges[name] = _range(value, f"{option} {name}") if equals else None
    return ranges


def _bounds(words: str) -> tuple[float, dict[str, Range]]:
    """Return the share and the ranges by name of `20,tm=1e-5:4e-5,l=2e-4`; a single value is both ends."""
    named = [word for word in words.split(",") if "=" in word]
    shares = [word for word in words.split(",") if "=" not in word]
    if len(shares) > 1:
        raise StructureError(f"--bounds {words!r} has more than one PERCENT; bounds of one dimension are NAME=LOW:HIGH")
    share = _number(shares[0], "--bounds", "PERCENT or NAME=LOW:HIGH") if shares else _SHARE
    ranges = _items(",".join(named), "--bounds") if named else {}
    return share / 100, {name: span for name, span in ranges.items() if span is not None}


def named_ranges(words: str | None, option: str) -> dict[str, Range]:
    """Return the ranges of `tm=1e-5:4e-5,l=1e-4:2e-4` by name; none without words."""
    ranges = _items(words, option) if words else {}
    for name, span in ranges.items():
        if span is None:
            raise StructureError(f"{option} {name} has no range, expected {name}=LOW:HIGH")
    return {name: span for name, span in ranges.items() if span is not None}


def named_numbers(words: str | None, option: str) -> dict[str, float]:
    """Return the numbers of `x=1e-6,yaw=1e-4` by name; none without words."""
    numbers = {}
    for name, (low, high) in named_ranges(words, option).items():
        if low != high:
            raise StructureError(f"{option} {name} is a range, expected one number")
        numbers[name] = low
    return numbers


def _range(words: str, what: str) -> Range:
    """Return the ends of a typed range, LOW:HIGH or one value for both."""
    low, colon, high = words.partition(":")
    first = _number(low, what)
    return first, _number(high, what) if colon else first


def _number(word: str, what: str, expected: str = "a number") -> float:
    """Return a typed number; `StructureError` for any other word."""
    try:
        return float(word)
    except ValueError:
        raise StructureError(f"{what} has {word.strip()!r}, expected {expected}") from None


# Answers --------------------------------------------------------------------------------------------------------------


def _sensitivity(study: Study) -> tuple[dict[str, Any], str]:
    """Return the sensitivities of all responses as data and text, sorted by the magnitude of those of the objective."""
    found = {name: slopes(study, name) for name in study.responses}
    zero = [name for name, variable in study.variables.items() if variable.value == 0]
    order = sorted(
        (name for name in study.variables if name not in zero), key=lambda name: -abs(found[study.objective][name])
    )
    present = {name: float(value[0]) for name, value in study.at(study.values).items()}
    data = {
        "study": study.title,
        "responses": present,
        "dimensions": {name: study.variables[name].value for name in order},
        "sensitivity": {response: {name: of[name] for name in order} for response, of in found.items()},
        "remarks": list(study.slope_remarks),
    }
    rows = table("dimension", "", ">now", *(f">{response}" for response in found))
    for name in order:
        v = study.variables[name]
        rows.add_row(name, v.description, readable(v.value, v.unit), *(f"{of[name]:+.4f}" for of in found.values()))
    lines = [
        f"{study.title}: {_values(study.responses, present)}",
        rendered(rows),
        "relative sensitivity d ln(response) / d ln(dimension): growth in per cent for one per cent of a dimension",
        *([f"dimensions that are 0 have no relative sensitivity: {', '.join(zero)}"] if zero else []),
        *(_paragraph(remark) for remark in study.slope_remarks),
    ]
    return data, "\n".join(lines)


def as_record(found: studies.ResponseMap) -> ResponseMap:
    """Return a map as a record for file and figure: numbers with units, without the equations of the study."""
    study, present = found.study, found.study.at(found.study.values)
    axes = {
        name: MapQuantity(values, variable.unit, variable.description, variable.value)
        for name, values in found.axes.items()
        for variable in (study.variables[name],)
    }
    responses = {
        name: MapQuantity(values, response.unit, response.description, float(present[name][0]))
        for name, values in found.responses.items()
        for response in (study.responses[name],)
    }
    design = {name: (variable.value, variable.unit) for name, variable in study.variables.items()}
    return ResponseMap(study.title, axes, responses, design)


def _map(
    study: Study, ranges: Mapping[str, Range | None], path: Path, words: str, force: bool
) -> tuple[dict[str, Any], str]:
    """Write a map and its picture; return a summary as data and as text."""
    found = response_map(study, ranges)
    written = as_record(found)
    write_response_map(path, written, words, force)
    picture = path.with_suffix(PICTURE)
    save(response_map_figure(written), picture)
    blank = float(np.mean(np.isnan(found.responses[study.objective])))
    extremes = {name: _extremes(found.axes, values) for name, values in found.responses.items()}
    data = {
        "file": path,
        "picture": picture,
        "study": study.title,
        "axes": {name: [axis[0], axis[-1]] for name, axis in found.axes.items()},
        "design": {name: study.variables[name].value for name in found.axes},
        "impossible": blank,
        "failing": found.failing,
        "responses": extremes,
    }
    spans = [
        f"{name} {readable(axis[0], unit := study.variables[name].unit)} to {readable(axis[-1], unit)}"
        for name, axis in found.axes.items()
    ]
    rest = f", of which {100 * blank:.3g} % cannot be built" if blank else ""
    lines = [f"{study.title}: {', '.join(spans)}{rest}"]
    points = found.responses[study.objective].size
    lines += [f"  empty at {count} of {points} points, which lack {text}" for text, count in found.failing.items()]
    for name, ends in extremes.items():
        unit = study.responses[name].unit
        places = [
            f"{word} {readable(end['value'], unit)} at "
            + ", ".join(f"{n} {readable(end['at'][n], study.variables[n].unit)}" for n in found.axes)
            for word, end in ends.items()
        ]
        lines.append(f"  {name}: {'; '.join(places)}")
    return data, "\n".join([*lines, str(path), str(picture)])


def _extremes(axes: Mapping[str, np.ndarray], values: np.ndarray) -> dict[str, Any]:
    """Return the smallest and the largest value and their places."""
    ends = {}
    for word, index in (("lowest", np.nanargmin(values)), ("highest", np.nanargmax(values))):
        place = np.unravel_index(index, values.shape)
        at = {name: float(axis[i]) for (name, axis), i in zip(axes.items(), place, strict=True)}
        ends[word] = {"value": float(values[place]), "at": at}
    return ends


def _optimum_data(found: Optimum) -> dict[str, Any]:
    """Return an optimum as plain data."""
    study = found.study
    return {
        "study": study.title,
        "maximised": study.objective,
        "is_converged": found.is_converged,
        "status": found.status,
        "starts": found.starts,
        "agreeing": found.agreeing,
        "responses": found.responses,
        "present": {name: float(value[0]) for name, value in study.at(study.values).items()},
        "dimensions": {
            name: {
                "value": found.values[name],
                "present": variable.value,
                "bounds": found.bounds[name],
                "at_bound": found.at_bound[name] or None,
                "sensitivity": slope,
            }
            for (name, variable), slope in zip(study.variables.items(), _slopes_there(found).values(), strict=True)
        },
        "active_requirements": found.active,
        "requirements": [*study.conditions, *study.requirements],
        "references": study.references,
        "remarks": study.remarks,
    }


def _optimum_text(found: Optimum) -> str:
    """Return an optimum as text: dimensions, active requirements, responses, remarks."""
    study = found.study
    rows = table("dimension", ">now", ">lower", ">upper", ">optimum", "at bound", ">sensitivity")
    for (name, v), slope in zip(study.variables.items(), _slopes_there(found).values(), strict=True):
        low, high = found.bounds[name]
        cells = [readable(value, v.unit) for value in (v.value, low, high, found.values[name])]
        rows.add_row(name, *cells, found.at_bound[name], f"{slope:+.4f}")
    present = {name: float(value[0]) for name, value in study.at(study.values).items()}
    designs = {"optimum": found.responses, "now": present, **study.references}
    results = table("", *(f">{name}" for name in study.responses))
    for text, values in designs.items():
        results.add_row(text, *(readable(values[name], r.unit) for name, r in study.responses.items()))
    ended = f"IPOPT: {found.status}, the same optimum from {found.agreeing} of {found.starts} initial points"
    if not found.is_converged:
        ended = f"NOT an optimum; IPOPT did not converge: {found.status}; try narrower --bounds"
    lines = [f"{study.title}: largest {study.objective} within the bounds", ended, "", rendered(rows), ""]
    lines += [f"active: {text}" for text in found.active]
    lines += ["", rendered(results), ""]
    return "\n".join([*lines, *(_paragraph(remark) for remark in study.remarks)])


def _slopes_there(found: Optimum) -> dict[str, float]:
    """Return the sensitivities of the objective at the optimum."""
    return slopes(found.study, found.study.objective, list(found.values.values()))


def _values(responses: Mapping[str, Response], values: Mapping[str, float]) -> str:
    """Return responses in one line of text."""
    return ", ".join(f"{name} {readable(values[name], response.unit)}" for name, response in responses.items())


def _paragraph(text: str) -> str:
    """Return a remark as a wrapped list item."""
    return textwrap.fill(text, _WIDTH, initial_indent="* ", subsequent_indent="  ")
