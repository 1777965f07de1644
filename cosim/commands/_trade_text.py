"""Answer of the verb `trade` as text and as data for JSON."""

from pathlib import Path
from typing import Any

from hfsa.cosim.commands._shell import rendered, table
from hfsa.cosim.results.trade import Trade, TradeRow
from hfsa.cosim.signals.prefixes import readable


def trade_text(found: Trade, figure: Path) -> str:
    """Return the sentences, the front as a table, and the files."""
    return "\n".join([*found.sentences, _table(found), f"{found.path}, {figure}"])


def trade_data(found: Trade, figure: Path) -> dict[str, Any]:
    """Return a trade for JSON, in SI units; errors and costs that are not known are null."""
    answer, cheaper, own = (None if i is None else found.rows[i] for i in (found.answer, found.next_cheaper, found.own))
    return {
        "file": found.path,
        "figure": figure,
        "purpose": found.purpose,
        "tolerance": found.tolerance,
        "answer": None if answer is None else _data(answer),
        "next_cheaper": None if cheaper is None else _data(cheaper),
        "default": None if own is None else _data(own),
        "front": [_data(row) for row in found.front],
        "measured": [_data(row) for row in found.rows if row.is_measured],
        "evaluated": len(found.rows),
        "reference": found.reference,
        "uncertainty": found.uncertainty,
        "sentences": list(found.sentences),
    }


def _table(found: Trade) -> str:
    """Return the shown rows as a table, cost and error predicted beside measured."""
    whole = table(
        "", "algorithm", ">step", ">cost", ">predicted", ">error", ">predicted", ">limit / step", "fused", "levels"
    )
    for row in found.shown:
        marks = [
            word
            for word, i in (("answer", found.answer), ("default", found.own))
            if i is not None and found.rows[i] is row
        ]
        whole.add_row(
            " ".join(marks),
            row.algorithm,
            readable(row.step_size, "s", ".3g"),
            _cost(row.measured_cost),
            _cost(row.predicted_cost),
            _error(row.measured_error),
            _error(row.predicted_error),
            _margin(row.stability_margin),
            row.fuse,
            row.levels,
        )
    return rendered(whole)


def _cost(seconds: float) -> str:
    """Return a cost as text."""
    return "not known" if seconds != seconds else f"{readable(seconds, 's', '.3g')}/s"


def _error(error: float) -> str:
    """Return an error as text."""
    return "not known" if error != error else f"{100 * error:.2g} %"


def _margin(margin: float) -> str:
    """Return the ratio of the longest stable step to a step as text."""
    return "not known" if margin != margin else "no limit" if margin == float("inf") else f"{margin:.3g}"


def _data(row: TradeRow) -> dict[str, Any]:
    """Return a row for JSON."""
    return {
        "algorithm": row.algorithm,
        "step_size": row.step_size,
        "levels": row.arguments,
        "fuse": row.groups,
        "error": {
            "predicted": row.predicted_error,
            "measured": row.measured_error,
            "predicted_at": row.predicted_place,
            "measured_at": row.measured_place,
        },
        "cost": {"predicted": row.predicted_cost, "measured": row.measured_cost},
        "counts": {"steps": row.steps, "calls": row.calls, "evaluations": row.evaluations},
        "stability_margin": row.stability_margin,
        "is_unlimited": row.stability_margin == float("inf"),
        "failure": row.failure,
    }
