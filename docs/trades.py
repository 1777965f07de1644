"""The page of trades: the answer of `hfsa trade` for some scenes, with its front and its figure.

    make trades                                   # docs/trades.md and its pictures
    python docs/trades.py beam robot-ctc          # some of them; the others stay as they are

Each section is the output of one command, which stands above it. The page is committed, as its numbers are measured.
"""

import re
import shlex
import sys
import tempfile
from pathlib import Path

from pictures import PICTURES, shrink

from hfsa.cosim.cli import main as hfsa
from hfsa.cosim.results.trade import Trade, TradeRow

PAGE = Path(__file__).with_name("trades.md")
HEAD = """# Trades

The cheapest way to run a scene within 0.1 %, by `hfsa trade`: predicted from the linearised FMUs, then run. A cost is
CPU time per simulated second on one core; `make trades` measures all of it again. [Speed and accuracy](trade.md) has
the method.
"""

TRADES = {
    "robot": ("The robot under PD control", "sdelta_hfsa --input command.position[3]"),
    "robot-ctc": ("The robot under computed torque", "sdelta_hfsa -p law=ctc --input command.position[3]"),
    "stage": ("The piezo stage, static stacks", "stage_tracking -p motion=three_axis --stop 0.1"),
    "stage-linear": (
        "The piezo stage, stacks with dynamics",
        "stage_tracking -p motion=three_axis -p stack=linear --stop 0.1",
    ),
    "stage-bode": ("The piezo stage at a bias", "stage_bode"),
    "accelerometer": ("The accelerometer on the robot", "sdelta_accelerometer"),
    "beam": ("A payload on massless beams", "beam_payload -p suspension=massless"),
}


def main(names: list[str]) -> None:
    """Make the sections of some names, by default of all, and write the page."""
    sections = dict(re.findall(r"^\((\S+)\)=\n(.*?)(?=^\(|\Z)", PAGE.read_text(), re.M | re.S)) if PAGE.exists() else {}
    for name in names or TRADES:
        sections[name] = section(name)
        text = "".join(f"({known})=\n{sections[known].rstrip()}\n\n" for known in TRADES if known in sections)
        PAGE.write_text(f"{HEAD}\n{text.rstrip()}\n", encoding="utf-8")


def section(name: str) -> str:
    """Return the section of one trade."""
    title, words = TRADES[name]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "trade.h5")
        code = hfsa(["trade", *shlex.split(words), "-o", str(file)])
        if code > 1:
            raise SystemExit(code)
        found = Trade.read(file)
        shrink(file.with_suffix(".png"), PICTURES / f"trade-{name}.png")
    sentences = "\n".join(f"* {sentence.replace('->', 'to')}" for sentence in found.sentences)
    table = "\n".join(["| | configuration | cost | predicted | error | predicted | limit / step |", "|" + "---|" * 7])
    table += "".join(f"\n{_cells(row, found)}" for row in found.shown)
    return (
        f"## {title}\n\n```console\n.venv/bin/hfsa trade {words}\n```\n\n{sentences}\n\n{table}\n\n"
        f"![Error over cost](pictures/trade-{name}.png)\n"
    )


def _cells(row: TradeRow, found: Trade) -> str:
    """Return a row of the table."""
    marks = {found.answer: "**answer**", found.own: "default"}
    mark = " ".join(word for i, word in marks.items() if i is not None and found.rows[i] is row)
    cells = [
        mark,
        str(row),
        f"{1e3 * row.measured_cost:.3g} ms",
        f"{1e3 * row.predicted_cost:.3g} ms",
        f"{100 * row.measured_error:.2g} %",
        f"{100 * row.predicted_error:.2g} %",
        f"{row.stability_margin:.3g}",
    ]
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    main(sys.argv[1:])
