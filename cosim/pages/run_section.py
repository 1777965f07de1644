"""Section of a report on a run: its signals by unit, errors, limits that acted, and how it ended."""

import math
from typing import Any

import numpy as np

from hfsa.cosim.figures.style import COLOURS
from hfsa.cosim.pages.blocks import Plot, Section, paragraph, table
from hfsa.cosim.pages.run_page import signal_data
from hfsa.cosim.results.recorded import Recorded
from hfsa.cosim.results.run import Run
from hfsa.cosim.signals.prefixes import readable

_POINTS = 20_000
"""Number of points at most of all curves of a run: a report may hold several."""


def run_section(run: Run, recorded: Recorded) -> Section:
    """Return the section on a run."""
    ended = f"Ended {run.status}" + (f": {run.message}" if run.message else "")
    blocks: list[str | Plot] = [paragraph(ended)]
    signals = signal_data(recorded, _POINTS)
    for unit in dict.fromkeys(signal["unit"] for signal in signals):
        blocks.append(_plot(unit, [signal for signal in signals if signal["unit"] == unit], recorded.axis))
    rows = [(name, *_numbers(run, name)) for name in run.values]
    blocks.append(table(["signal", ">lowest", ">highest", ">error", ">relative"], rows, "Signals"))
    if not run.errors:
        blocks.append(paragraph("The error of the communication steps is not known: --verify of hfsa run measures it."))
    return Section("Run", blocks)


def _numbers(run: Run, name: str) -> tuple[str, str, str, str]:
    """Return lowest and highest value of a signal, and its error, with unit."""
    values, unit = run.values[name], run.units[name]
    finite = values[np.isfinite(values)]
    low, high = (readable(float(x), unit) for x in (finite.min(), finite.max())) if finite.size else ("-", "-")
    error = run.errors.get(name)
    if error is None:
        return low, high, "-", "-"
    relative = f"{100 * error.relative:.3g} %" if math.isfinite(error.relative) else "-"
    return low, high, readable(error.absolute, unit), relative


def _plot(unit: str, signals: list[dict[str, Any]], axis: str) -> Plot:
    """Return the figure of the signals of one unit."""
    traces = [
        {
            "type": "scatter",
            "mode": "lines",
            "name": signal["name"],
            "x": signal["t"],
            "y": signal["y"],
            "line": {"color": COLOURS[k % len(COLOURS)], "width": 1.3},
            "hovertemplate": f"%{{x:.5g}}<br>%{{y:.5g}} {'' if unit == '1' else unit}",
        }
        for k, signal in enumerate(signals)
    ]
    title = "" if unit == "1" else f"({unit})"
    layout = {
        "xaxis": {"title": {"text": "Time (s)" if axis == "time" else "Row"}},
        "yaxis": {"title": {"text": title}},
        "hovermode": "closest",
    }
    return Plot(traces, layout, f"Signals {title}: {', '.join(signal['name'] for signal in signals)}", 320)
