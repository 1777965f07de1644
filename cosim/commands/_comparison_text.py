"""Answer of the verb `compare`: a table as text, and all results as data for JSON."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from rich.table import Table

from hfsa.cosim.analysis.sampling import SamplingLimit
from hfsa.cosim.commands._reports import algorithm_data, error_data, limits_data, order_data
from hfsa.cosim.commands._shell import rendered
from hfsa.cosim.commands._shell import table as empty_table
from hfsa.cosim.experiments.compare import Comparison, Run
from hfsa.cosim.measurement.trial import Outcome, OutputGroup
from hfsa.cosim.results.files import ErrorEstimate
from hfsa.cosim.signals.prefixes import readable

_NOTHING = "-"
_FLICKER = 0.01
"""Part of a run, after the first activation of a limit, in which further activations are not shown separately."""


def comparison_data(compared: Comparison, figure: Path) -> dict[str, Any]:
    """Return a comparison for JSON, in SI units."""
    return {
        "scene": compared.scene,
        "over": compared.over,
        "figure": figure,
        "runs": [_run_data(run) for run in compared.runs],
    }


def comparison_text(compared: Comparison, figure: Path) -> str:
    """Return a comparison as text: table, full names of its columns, failed runs, choices of `auto`, and files."""
    names = _short_names([group for run in compared.runs for group in run.outcome.groups])
    labels: dict[str, str] = {}
    for run in compared.runs:
        labels |= {names[group.key]: group.label for group in run.outcome.groups}
    columns = _columns(compared, names)
    lines = [rendered(_by_rows(columns), _by_columns(columns))]
    lines += [f"  {short}: {label}" for short, label in labels.items() if short != label]
    lines += [f"  {run.label} failed: {run.outcome.failure}" for run in compared.runs if run.outcome.failure]
    lines += [f"  {run.label}: {run.algorithm.sentence}" for run in compared.runs if run.algorithm]
    lines += [f"{run.outcome.path}" for run in compared.runs]
    return "\n".join([*lines, str(figure)])


# Text -----------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Column:
    """Heading of one or two words, and one cell per run."""

    heading: str
    cells: list[str]
    justify: Literal["left", "right"] = "right"


def _columns(compared: Comparison, names: dict[tuple[str, str], str]) -> list[_Column]:
    """Return the columns: all three numbers of the first group, the peaks of the others, and facts about each run."""
    outcomes = [run.outcome for run in compared.runs]
    groups = [{group.key: group for group in outcome.groups} for outcome in outcomes]
    columns = [_Column(name, [run.values[name] for run in compared.runs], "left") for name in compared.over]
    for place, (group, short) in enumerate(names.items()):
        for key in ("peak", "rms", "final") if place == 0 else ("peak",):
            cells = [_number(of.get(group), key, outcome) for of, outcome in zip(groups, outcomes, strict=True)]
            columns.append(_Column(f"{short} {key}", cells))
    if any(outcome.errors for outcome in outcomes):
        columns.append(_Column("step error", [_step_error(outcome) for outcome in outcomes]))
    columns.append(_Column("limits", [_limits(outcome) for outcome in outcomes], "left"))
    if any(outcome.sampling for outcome in outcomes):
        columns.append(_Column("sampling limit", [_sampling(outcome.sampling) for outcome in outcomes]))
    columns.append(_Column("steps", [str(outcome.steps) for outcome in outcomes]))
    columns.append(_Column("wall time", [_wall_time(outcome) for outcome in outcomes]))
    return columns


def _by_rows(columns: list[_Column]) -> Table:
    """Return the table with one row per run."""
    table = empty_table()
    for column in columns:
        table.add_column(column.heading.replace(" ", "\n"), justify=column.justify, overflow="fold")
    for row in zip(*(column.cells for column in columns), strict=True):
        table.add_row(*row)
    return table


def _by_columns(columns: list[_Column]) -> Table:
    """Return the table with one column per run."""
    table = empty_table()
    table.add_column(columns[0].heading, overflow="fold")
    for cell in columns[0].cells:
        table.add_column(cell, justify="right", overflow="fold")
    for column in columns[1:]:
        table.add_row(column.heading, *column.cells)
    return table


def _number(group: OutputGroup | None, key: str, outcome: Outcome) -> str:
    """Return a number with its unit; none for a failed run, whose numbers depend on when it failed."""
    return _NOTHING if group is None or outcome.failure else readable(getattr(group, key), group.unit)


def _limits(outcome: Outcome) -> str:
    """Return the time of a failure, and the first active time of each kind of limit."""
    words = []
    if outcome.failure:
        at = outcome.failure_time
        words.append("FAILED" if at is None else f"FAILED at {readable(at, 's', '#.4g')}")
    for word in dict.fromkeys(found.limit.word for found in outcome.limits):
        acting = [found for found in outcome.limits if found.limit.word == word]
        first = min(found.first_time for found in acting)
        lasting = min((f.lasting_since for f in acting if f.lasting_since is not None), default=first)
        words.append(f"{word} at {readable(first, 's', '#.4g')}")
        if lasting - first > _FLICKER * outcome.stop_time:
            words.append(f"  and from {readable(lasting, 's', '#.4g')} on")
    return "\n".join(words) or "none"


def _step_error(outcome: Outcome) -> str:
    """Return the largest relative error due to the communication step over all groups."""
    errors = [_error_of(group, outcome) for group in outcome.groups]
    relative = [error.relative for error in errors if error is not None]
    return f"{100 * max(relative):.3g} %" if relative else _NOTHING


def _error_of(group: OutputGroup, outcome: Outcome) -> ErrorEstimate | None:
    """Return the largest errors over the members of a group, `None` where the run was not verified."""
    errors = [outcome.errors[name] for name in group.members if name in outcome.errors]
    if not errors:
        return None
    return ErrorEstimate(max(error.absolute for error in errors), max(error.relative for error in errors))


def _wall_time(outcome: Outcome) -> str:
    """Return the wall time of a run, if it ran."""
    return readable(outcome.wall_time, "s", ".3g") if math.isfinite(outcome.wall_time) else _NOTHING


def _sampling(limit: SamplingLimit | None) -> str:
    """Return the longest stable sample time as text; `none` where all are stable, `unstable` where none is."""
    if limit is None:
        return _NOTHING
    if limit.longest in (0.0, math.inf):
        return "none" if limit.is_stable else "unstable"
    text = readable(limit.longest, "s")
    return text if limit.is_stable else f"unstable\nabove {text}"


def _short_names(groups: Iterable[OutputGroup]) -> dict[tuple[str, str], str]:
    """Return a short name for each group by key: the shortest unique ending of its name."""
    keys = list(dict.fromkeys(group.key for group in groups))

    def ending(name: str) -> str:
        """Return the shortest ending, in whole words, that no other name has."""
        parts = name.split(".")
        for count in range(1, len(parts)):
            short = ".".join(parts[-count:])
            if sum(f".{other}".endswith(f".{short}") for other, _ in keys) == 1:
                return short
        return name

    return {key: ending(key[0]) for key in keys}


# Data -----------------------------------------------------------------------------------------------------------------


def _run_data(run: Run) -> dict[str, Any]:
    """Return a run for JSON, times in s."""
    outcome = run.outcome
    return {
        "values": run.values,
        "file": outcome.path,
        "status": "failed" if outcome.failure else "complete",
        "message": outcome.failure,
        "failure_time": outcome.failure_time,
        "stop_time": outcome.stop_time,
        "steps": outcome.steps,
        "wall_time": outcome.wall_time,
        "groups": [_group_data(group, outcome) for group in outcome.groups],
        "limits": limits_data(outcome.limits),
        "sampling": _sampling_data(outcome.sampling),
        "warnings": outcome.warnings,
        "order": order_data(run.order),
        "choice": algorithm_data(run.algorithm),
    }


def _group_data(group: OutputGroup, outcome: Outcome) -> dict[str, Any]:
    """Return the numbers of a group for JSON, in its unit."""
    numbers = {key: getattr(group, key) for key in ("peak", "rms", "final")} | error_data(_error_of(group, outcome))
    return {"name": group.name, "members": group.members, "unit": group.unit, **numbers}


def _sampling_data(limit: SamplingLimit | None) -> dict[str, Any] | None:
    """Return a sampling limit for JSON; `longest` is null where all sample times are stable, 0 where none is."""
    if limit is None:
        return None
    return {"sample_time": limit.sample_time, "longest": limit.longest, "is_stable": limit.is_stable}
