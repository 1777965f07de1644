"""Work-precision figure of a trade: error over cost of all configurations, with the front, the answer and the default.

save(trade_figure(found), Path("results/sdelta_shaker_trade.png"))
"""

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from hfsa.cosim.figures.labels import spread_frequencies
from hfsa.cosim.figures.style import ACCENT, COLOURS, GRID, INK, STYLE, save
from hfsa.cosim.results.trade import Trade, TradeRow
from hfsa.cosim.signals.prefixes import prefixed

__all__ = ["save", "trade_figure"]

_LEAST = 1e-12
"""Least error that is drawn: below is rounding."""

_WORST = 3.0
"""Largest error that is drawn."""


def trade_figure(found: Trade) -> Figure:
    """Return the figure of a trade; configurations without a known error are left out."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.2, 5.4), layout="constrained", dpi=160)
        axes = figure.subplots()
        factor, unit = prefixed(max((row.cost for row in found.front or found.rows), default=1.0), "s")
        predicted = [row for row in found.rows if _LEAST < row.predicted_error <= _WORST]
        measured = [row for row in found.rows if row.is_measured and 0 <= row.measured_error <= _WORST]
        _points(axes, factor, predicted, "predicted", ".", color=GRID, markersize=5)
        _points(axes, factor, measured, "measured", "o", color=COLOURS[0], markersize=5)
        front = [row for row in found.front if row.measured_error <= _WORST]
        if len(front) > 1:
            axes.plot(*_at(factor, front), "-", color=COLOURS[0], linewidth=1.2, label="front")
        for index, label, look in (
            (found.own, "default of the scene", {"marker": "s", "color": COLOURS[4], "markersize": 8}),
            (found.answer, "answer", {"marker": "*", "color": ACCENT, "markersize": 15}),
        ):
            if index is not None:
                row = found.rows[index]
                axes.plot(*_at(factor, [row]), linestyle="none", label=f"{label}: {_short(row)}", zorder=5, **look)
        axes.axhline(found.tolerance, color=INK, linewidth=0.8, linestyle="--", label=f"tolerance {found.tolerance:g}")
        if not predicted and not measured:
            axes.set_xlim(0.1, 10.0)
            axes.text(0.5, 0.5, "no error is known", transform=axes.transAxes, ha="center")
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlabel(f"CPU time per simulated second ({unit})")
        axes.set_ylabel("Largest relative error")
        axes.grid(which="major", color=GRID, linewidth=0.5)
        spread_frequencies(axes)
        figure.legend(loc="outside lower center", ncols=2, fontsize=8.5)
        axes.set_title(f"{found.title}: {found.purpose}", fontsize=11, loc="left", fontweight="bold")
    return figure


def _points(axes: Any, factor: float, rows: Sequence[TradeRow], label: str, marker: str, **look: Any) -> None:
    """Draw rows as points, by their predicted or measured errors and costs."""
    costs = [factor * getattr(row, f"{label}_cost") for row in rows]
    errors = [max(getattr(row, f"{label}_error"), _LEAST) for row in rows]
    axes.plot(costs, errors, marker, linestyle="none", label=label, **look)


def _at(factor: float, rows: Sequence[TradeRow]) -> tuple[list[float], list[float]]:
    """Return costs and errors of rows."""
    return [factor * row.cost for row in rows], [max(row.error, _LEAST) for row in rows]


def _short(row: TradeRow) -> str:
    """Return a row in a few words."""
    return f"{row.algorithm}, {row.step_size:.3g} s{', fused' if row.fuse else ''}"
