"""The page of tools, from the results of `run.py`."""

import math
import re
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

COLUMNS = ((2, "CS"), (2, "ME"), (3, "CS"), (3, "ME"))
PACKAGES = ((2, "SSP"), (3, "SSP"))
RIGHT = 1e-4
"""Largest error of a run that counts as right: those of integrators with a tolerance stay below it."""

HEAD = """# Tools that were tried

FMUs and a package of this project in tools of others, as `make elsewhere` installs and runs them on Linux. A number
is the largest error of an output, relative to its range, against a loop of our own over 500 steps of 0.1 ms. Every
input is a sine of its own, held over steps or, where the tool lets inputs move within a step, linear in it. In
parentheses is how many of the FMUs run and are right to {right:g}. At ticks nothing is compared: there a tool may
show the value before or after. [FMUs in your tool](your-tool.md) says what to expect of Model Exchange with moving
inputs.

The {count} FMUs are {titles}.
"""


def cell(runs: list[dict[str, Any]]) -> str:
    """Return the words of one cell: largest error of the runs that are right, and their number."""
    right = [run["found"] for run in runs if is_right(run)]
    if not runs:
        return "-"
    most = f"{max(right):.0e}".replace("0e+00", "0") if right else "**fails**"
    return f"{most} ({len(right)} of {len(runs)})" if len(runs) > 1 else most


def is_right(run: Mapping[str, Any]) -> bool:
    """Whether a run has ended with the right trajectory."""
    return not isinstance(run["found"], str) and run["found"] <= RIGHT


def failures(runs: list[dict[str, Any]]) -> list[str]:
    """Return a sentence for what a tool runs wrongly or not at all; interfaces that fail alike share one."""
    places: dict[str, dict[str, list[str]]] = {}
    for run in runs:
        if not is_right(run):
            place = places.setdefault(f"FMI {run['fmi']} {run['interface']}", {})
            place.setdefault(words(run["found"]), []).append(run["title"])
    alike: dict[str, list[str]] = {}
    for place, found in places.items():
        sentence = "; ".join(f"{', '.join(titles)} {text}" for text, titles in found.items())
        alike.setdefault(sentence, []).append(place)
    return [f"{', '.join(names)}: {sentence}" for sentence, names in alike.items()]


def words(found: float | str) -> str:
    """Return an error, or an error message, in words."""
    if isinstance(found, str):
        return f"({short(found)})"
    return "not finite" if math.isinf(found) else f"off by {found:.0e}"


def short(text: str) -> str:
    """Return an error message without its paths, on one line of a table."""
    text = re.sub(r"\S*/\S+", "...", text).replace("|", "/").replace("`", "'")
    return text if len(text) <= 110 else f"{text[:107]}..."


def remarks(module: ModuleType, columns: tuple[tuple[int, str], ...]) -> str:
    """Return what an adapter says of some columns, each sentence once."""
    found: dict[str, list[str]] = {}
    for fmi, interface in columns:
        if (fmi, interface) in module.REMARKS:
            found.setdefault(module.REMARKS[fmi, interface], []).append(f"FMI {fmi} {interface}")
    return "; ".join(f"{', '.join(places)}: {sentence}" for sentence, places in found.items())


def table(
    modules: Mapping[str, ModuleType], results: Mapping[str, Any], columns: tuple[tuple[int, str], ...]
) -> list[str]:
    """Return the rows of a table of the tools that could be installed and offer one of the columns."""
    names = [f"FMI {fmi}" if interface == "SSP" else f"FMI {fmi} {interface}" for fmi, interface in columns]
    lines = [f"| tool | {' | '.join(names)} | remark |", "|---" * (len(columns) + 2) + "|"]
    for name, found in results.items():
        if not found["version"] or not set(columns) & set(modules[name].OFFERS):
            continue
        cells = [cell([run for run in found["runs"] if (run["fmi"], run["interface"]) == column]) for column in columns]
        lines.append(f"| {name} {found['version']} | {' | '.join(cells)} | {remarks(modules[name], columns)} |")
    return lines


def write_page(file: Path, modules: Mapping[str, ModuleType], results: Mapping[str, Any]) -> None:
    """Write the page of the tools."""
    results = {name: results[name] for name in modules if name in results}
    titles = list(dict.fromkeys(r["title"] for f in results.values() for r in f["runs"] if r["interface"] != "SSP"))
    lines = [HEAD.format(count=len(titles), titles=", ".join(titles), right=RIGHT)]
    lines += ["## FMUs", "", *table(modules, results, COLUMNS), ""]
    lines += ["## The robot under control, 9 FMUs as one package", ""]
    lines += ["Against `jacobi_plain`, or our loop in the tool's order of exchange, over 200 steps of 50 us.", ""]
    lines += [*table(modules, results, PACKAGES), ""]
    wrong = {name: failures(found["runs"]) for name, found in results.items()}
    if any(wrong.values()):
        lines += ["## What fails, in the words of the tool", ""]
        lines += [f"* {name}: {sentence}" for name, sentences in wrong.items() for sentence in sentences] + [""]
    absent = [name for name, found in results.items() if not found["version"]]
    if absent:
        lines += ["## What could not be had here", ""]
        lines += [f"* {name}: {getattr(modules[name], 'MISSING', 'the installation failed')}." for name in absent] + [
            ""
        ]
    file.write_text("\n".join(lines), encoding="utf-8")
