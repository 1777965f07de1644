"""The page of extremes: what was tried, what must come of it, and what came.

    make extremes                        # all rows, and the page
    python docs/extremes.py --long       # with a run of 1e9 steps in place of 1e7
    python docs/extremes.py damping step # some, printed; the page stays as it is

The rows are in `extreme_rows`, one file for each extreme. The exit code is 1 if a row is not as expected.
"""

import importlib
import inspect
import os
import pkgutil
import sys
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path

import extreme_rows
from extreme_rows.row import Outcome, Row

PAGE = Path(__file__).with_name("extremes.md")

ORDER = (
    "gains",
    "damping",
    "amplitudes",
    "stiffness",
    "steps",
    "long_run",
    "postures",
    "time_scales",
    "values",
)
"""Files of rows, in the order of the page."""

HEAD = """# Extremes

What was tried at the extremes, what must come of it, and what came. `make extremes` runs every row and writes this
page; a row that is not as expected makes its exit code 1. Each row is held against an independent expectation: a closed
form, the equations of a part differentiated by CasADi, the linear response, or the one-step matrix; where nothing can
be computed, a message that names the cause. The rows are in `docs/extreme_rows`.

An error is relative to the expected value, or to the largest value of a motion. {duration}

{verdict}
"""


def rows(is_long: bool = False) -> Iterator[Row]:
    """Yield all rows, in the order of the page; nothing is run."""
    found = {info.name for info in pkgutil.iter_modules(extreme_rows.__path__)} - {"row", "bench"}
    if found != set(ORDER):
        raise LookupError(f"the page has the rows of {', '.join(ORDER)}; there are those of {', '.join(sorted(found))}")
    for name in ORDER:
        make = importlib.import_module(f"extreme_rows.{name}").rows
        yield from make(is_long) if inspect.signature(make).parameters else make()


def page(judged: Sequence[tuple[Row, Outcome]], is_long: bool) -> str:
    """Return the page of rows with their outcomes."""
    failed = sum(not outcome.is_expected for _, outcome in judged)
    verdict = f"All {len(judged)} rows are as expected." if not failed else f"{failed} of {len(judged)} rows are NOT."
    duration = (
        "The long run takes 1e9 steps (`--long`); `make extremes` takes 1e7."
        if is_long
        else "The long run takes 1e7 steps; with `--long` it takes 1e9."
    )
    lines = [["extreme", "tried", "expected", "came", ""], ["---"] * 5]
    lines += [[row.extreme, row.tried, str(row.expected), outcome.came, word(outcome)] for row, outcome in judged]
    table = "\n".join("| " + " | ".join(_cell(text) for text in line) + " |" for line in lines)
    return f"{HEAD.format(duration=duration, verdict=verdict)}\n{table}\n"


def listed(text: str) -> list[str]:
    """Return what a page lists as tried, in order."""
    return [line.split(" | ")[1].replace(r"\|", "|") for line in text.splitlines() if line.startswith("| ")][2:]


def word(outcome: Outcome) -> str:
    """Return the verdict in a word."""
    return "ok" if outcome.is_expected else "**NOT**"


def _cell(text: str) -> str:
    """Return a text that a table of Markdown shows as it is, but for code in backticks."""
    pieces = text.split("`")
    plain = [piece.replace("*", r"\*").replace("_", r"\_").replace("<", r"\<") for piece in pieces[::2]]
    if text in ("---", "**NOT**"):
        return text
    pieces[::2] = [piece.replace("[", r"\[") for piece in plain]
    return "`".join(pieces).replace("|", r"\|")


def main(arguments: Sequence[str]) -> int:
    """Run the rows of these extremes, or all, print them, write the page where all were run; return the exit code."""
    is_long = "--long" in arguments
    every = list(rows(is_long))
    wanted = [argument for argument in arguments if argument != "--long"]
    known = list(dict.fromkeys(row.extreme for row in every))
    if unknown := [name for name in wanted if name not in known]:
        print(f"no extreme is called {', '.join(unknown)}; there are {', '.join(known)}", file=sys.stderr)
        return 2
    judged = []
    for row in every:
        if wanted and row.extreme not in wanted:
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of numpy, about values that are no numbers
            outcome = row.run()
        judged.append((row, outcome))
        print(f"{'ok ' if outcome.is_expected else 'NOT'}  {row.extreme}: {row.tried}\n     {outcome.came}", flush=True)
    if not wanted:
        PAGE.write_text(page(judged, is_long), encoding="utf-8")
    failed = sum(not outcome.is_expected for _, outcome in judged)
    print(f"{len(judged) - failed} rows as expected, {failed} NOT")
    return 1 if failed else 0


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    sys.exit(main(sys.argv[1:]))
