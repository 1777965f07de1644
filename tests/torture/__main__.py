"""Run the trials and write the table, `docs/torture.md`; exit code 1 if one did not hold.

make torture                                  # all, from a seed of today
make torture ARGS="runtime --seed 7"          # those of one file: told, not written
make torture ARGS="--count 10000"             # more of each
"""

import argparse
import importlib
import pkgutil
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import torture
from torture.row import Row

PAGE = Path(__file__).parents[2] / "docs" / "torture.md"
_INTRODUCTION = """\
# Torture

What was done to hfsa on purpose, how often, and how often it held: nothing lost, nothing touched, no traceback, no
process or folder left behind, no end beyond a time limit. `make torture` draws new trials from a seed and writes this
page; a trial that does not hold makes its exit code 1. The trials are in `tests/torture`.
"""


def modules() -> dict[str, object]:
    """Return the files with trials by name."""
    names = [module.name for module in pkgutil.iter_modules(torture.__path__) if not module.name.startswith("_")]
    found = {name: importlib.import_module(f"torture.{name}") for name in names}
    return {name: module for name, module in found.items() if hasattr(module, "trials")}


def line(row: Row) -> str:
    """Return a row of the table."""
    cells = [row.trial, f"{row.count:,}", f"{row.held:,}", str(len(row.failures)), row.note]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def page(rows: Sequence[Row], seed: int) -> str:
    """Return the text of the page."""
    failures = [f"* {row.trial}: {sentence}" for row in rows for sentence in row.failures[:5]]
    did_not = ["", "## What did not hold", "", *failures] if failures else []
    head = ["", f"Seed {seed}.", "", "| trial | count | held | did not | figures |", "|---|--:|--:|--:|---|"]
    return "\n".join([_INTRODUCTION.rstrip(), *head, *map(line, rows), *did_not, ""])


def main(arguments: Sequence[str]) -> int:
    """Run, tell and write; return the exit code."""
    known = modules()
    parser = argparse.ArgumentParser(prog="make torture", description="Run trials of what must not break.")
    parser.add_argument("names", nargs="*", choices=[*known, []], help="files of trials; all without a name")
    parser.add_argument("--seed", type=int, default=int(time.time()) // 86400)
    parser.add_argument("--count", type=int, default=100, help="trials of each kind, about")
    options = parser.parse_args(arguments)
    rows = []
    for name in options.names or known:
        for row in known[name].trials(options.seed, options.count):  # type: ignore[attr-defined]
            rows.append(row)
            print(line(row), *row.failures[:5], sep="\n  ", flush=True)
    if not options.names:
        PAGE.write_text(page(rows, options.seed), encoding="utf-8")
    return int(any(row.failures for row in rows))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
