"""Section of a report on a trade: the answer in words, error over cost, and the front as a table."""

import math
from collections.abc import Sequence
from typing import Any

from hfsa.cosim.figures.style import ACCENT, COLOURS, GRID
from hfsa.cosim.pages.blocks import Plot, Section, paragraph, table
from hfsa.cosim.results.trade import Trade, TradeRow

_LEAST, _WORST = 1e-12, 3.0
"""Errors that are drawn."""


def trade_section(found: Trade) -> Section:
    """Return the section on a trade."""
    rows = [
        (str(row), row.levels or "-", _percent(row.predicted_error), _percent(row.measured_error), f"{row.cost:.3g}")
        for row in found.shown
    ]
    headings = ["configuration", "levels", ">predicted error", ">measured error", ">CPU time per simulated second [s]"]
    return Section(
        f"Trade of the {found.purpose}",
        [*map(paragraph, found.sentences), _plot(found), table(headings, rows, "Front, answer and default")],
    )


def _plot(found: Trade) -> Plot:
    """Return the figure of errors over costs."""
    predicted = [row for row in found.rows if not row.is_measured and _LEAST < row.predicted_error <= _WORST]
    measured = [row for row in found.rows if row.is_measured and _LEAST < row.measured_error <= _WORST]
    front = [row for row in found.front if row in measured]
    marked = [row for row in (found.best,) if row is not None and _LEAST < row.error <= _WORST]
    traces = [
        _points("predicted", predicted, {"mode": "markers", "marker": {"color": GRID, "size": 6}}),
        _points("measured", measured, {"mode": "markers", "marker": {"color": COLOURS[0], "size": 8}}),
        _points("front", front, {"mode": "lines", "line": {"color": COLOURS[0]}}),
        _points("answer", marked, {"mode": "markers", "marker": {"color": ACCENT, "size": 16, "symbol": "star"}}),
    ]
    layout = {
        "xaxis": {"type": "log", "title": {"text": "CPU time per simulated second (s)"}},
        "yaxis": {"type": "log", "title": {"text": "Largest relative error"}, "exponentformat": "power"},
        "shapes": [{"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": found.tolerance, "y1": found.tolerance}],
        "hovermode": "closest",
    }
    return Plot(traces, layout, f"Error over cost of {len(found.rows)} configurations; tolerance {found.tolerance:g}")


def _points(name: str, rows: Sequence[TradeRow], look: dict[str, Any]) -> dict[str, Any]:
    """Return rows as points."""
    return {
        "type": "scatter",
        "name": name,
        "x": [row.cost for row in rows],
        "y": [row.error for row in rows],
        "text": [str(row) for row in rows],
        "hovertemplate": "%{text}<br>%{x:.3g} s, error %{y:.3g}",
        **look,
    }


def _percent(error: float) -> str:
    """Return a relative error in percent."""
    return "not known" if math.isnan(error) else f"{100 * error:.3g} %"
