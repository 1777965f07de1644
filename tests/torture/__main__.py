"""Run all kinds of trials and write `docs/torture.md`; exit code 1 where a trial did not hold.

    PYTHONPATH=tests python -m torture --seed 7 --count 20 kills

With names of kinds, only these run and the page stays as it is. `--count` is the number of trials of a kind.
"""

import argparse
import importlib
import sys
import time
from pathlib import Path

from torture.row import Row

FOLDER = Path(__file__).parent
PAGE = FOLDER.parents[1] / "docs/torture.md"
NOT_TRIALS = ("__init__", "__main__", "row")

HEAD = """\
# Torture

What was done to hfsa on purpose, how often, and how often it held. `make torture` runs every row and writes this page
(`ARGS="--seed 7 kills"` for one kind, which leaves the page alone); a trial that does not hold makes its exit
code 1. The trials are in `tests/torture`, one file per kind. A small share of each runs with the tests.

To hold means: a sentence instead of a traceback, a documented exit code, an end within the time limit, no file lost or
written elsewhere, no process and no temporary folder left behind.
"""


def kinds() -> list[str]:
    """Return the names of the files with trials."""
    return sorted(file.stem for file in FOLDER.glob("*.py") if file.stem not in NOT_TRIALS and file.stem[0] != "_")


def page(rows: list[Row], seed: int) -> str:
    """Return the page with a line per row, and what did not hold."""
    lines = [f"| {row.what} | {row.count} | {row.held} | {len(row.faults)} | {row.note} |" for row in rows]
    count, held = sum(row.count for row in rows), sum(row.held for row in rows)
    table = "\n".join(["| trial | count | held | did not | what came |", "| --- | --: | --: | --: | --- |", *lines])
    left = [f"* {row.what}: {fault}" for row in rows for fault in dict.fromkeys(row.faults)]
    failed = "\n## What did not hold\n\n" + "\n".join(left) + "\n" if left else ""
    return f"{HEAD}\nSeed {seed}: {held} of {count} trials held.\n\n{table}\n{failed}"


def main() -> int:
    """Run the trials of the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", help=f"kinds of trials: {', '.join(kinds())}; all by default")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=20, help="number of trials of a kind")
    options = parser.parse_args()
    rows = []
    for kind in options.kinds or kinds():
        begin = time.monotonic()
        for row in importlib.import_module(f"torture.{kind}").trials(options.seed, options.count):
            rows.append(row)
            print(f"{kind}: {row.what}: {row.held} of {row.count} held, {time.monotonic() - begin:.0f} s", flush=True)
            for fault in row.faults:
                print(f"    {fault}", flush=True)
    if not options.kinds:
        PAGE.write_text(page(rows, options.seed), encoding="utf-8")
    return int(any(row.faults for row in rows))


if __name__ == "__main__":
    sys.exit(main())
