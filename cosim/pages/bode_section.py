"""Section of a report on a sweep: a Bode plot for each input, peaks, errors, and points that are not done."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from hfsa.cosim.figures.curves import (
    Curve,
    Entry,
    align_phases,
    downward_sweep,
    find_peaks,
    finished_entries,
    name_curves,
    theory_sweep,
)
from hfsa.cosim.pages.blocks import Plot, Section, paragraph, table
from hfsa.cosim.pages.panel_data import rounded
from hfsa.cosim.results.files import Bode, Status

_HEIGHT = 620
_MOST_ROWS = 100
"""Number of points that a table lists at most."""


def bode_section(bode: Bode) -> Section:
    """Return the section on a sweep."""
    drawn = [*theory_sweep(bode), bode, *downward_sweep(bode)]
    entries = finished_entries(drawn, [], [])
    blocks: list[str | Plot] = [paragraph(_statuses(bode))]
    for source in dict.fromkeys(entry.input.name for entry in entries):
        blocks += _of_input(source, [entry for entry in entries if entry.input.name == source], drawn)
    blocks += _unfinished(bode)
    return Section("Frequency response", blocks)


def _of_input(source: str, entries: Sequence[Entry], drawn: Sequence[Bode]) -> list[str | Plot]:
    """Return the Bode plot of one input, and the table of its entries."""
    by_output: dict[str, list[Curve]] = {}
    for entry in entries:
        by_output.setdefault(entry.curve.output.name, []).append(entry.curve)
    name_curves(by_output, drawn)
    for curves in by_output.values():
        align_phases(curves)
    units = {entry.curve.output.name: entry.unit for entry in entries}
    traces = [trace for curves in by_output.values() for curve in curves for trace in _traces(curve, source)]
    rows = []
    for name, curves in by_output.items():
        peaks = "; ".join(peak.label for peak in find_peaks({name: curves})) or "none"
        rows.append((name, f"0 dB = 1 {units[name]}" if units[name] else "ratio", peaks, _step_error(curves, source)))
    words = f"Bode plot: {', '.join(by_output)} per {source}"
    return [
        Plot(traces, _layout(source), words, _HEIGHT),
        table(["output", "unit", "peaks", ">error of the steps"], rows, f"Responses to {source}"),
    ]


def _traces(curve: Curve, source: str) -> list[dict[str, Any]]:
    """Return magnitude and phase of a curve; what is known of each point appears under the pointer."""
    look = {"mode": "lines"} if curve.is_line else {"mode": "markers", "marker": {"size": 6, "color": curve.colour}}
    common: dict[str, Any] = {
        "type": "scatter",
        "x": rounded(curve.frequency),
        "legendgroup": curve.label,
        "line": {"color": curve.colour, "width": 1.5},
        **look,
    }
    notes = _notes(curve, source)
    level = {"y": rounded(curve.level), "name": curve.label, "text": notes, "yaxis": "y"}
    phase = {"y": rounded(curve.phase), "name": curve.label, "text": notes, "yaxis": "y2", "showlegend": False}
    return [
        {**common, **level, "hovertemplate": "%{x:.5g} Hz<br>%{y:.3f} dB%{text}"},
        {**common, **phase, "hovertemplate": "%{x:.5g} Hz<br>%{y:.3f} deg%{text}"},
    ]


def _notes(curve: Curve, source: str) -> list[str]:
    """Return what is known of each point: status and error of the communication steps."""
    if curve.is_line:
        return [""] * len(curve.frequency)
    errors = curve.bode.step_error[:, *_place(curve, source)]
    there = np.isin(curve.bode.frequency, curve.frequency)
    words = []
    for status, error in zip(curve.status, errors[there], strict=True):
        known = "" if np.isnan(error) else f"<br>steps within {100 * error:.3g} %"
        words.append(f"<br>{Status(int(status)).name.lower().replace('_', ' ')}{known}")
    return words


def _place(curve: Curve, source: str) -> tuple[int, int]:
    """Return the indices of output and input of a curve."""
    names = [signal.name for signal in curve.bode.inputs]
    return [signal.name for signal in curve.bode.outputs].index(curve.output.name), names.index(source)


def _step_error(curves: Sequence[Curve], source: str) -> str:
    """Return the largest error of the communication steps of measured curves."""
    if all(curve.is_line for curve in curves):
        return "none: no steps"
    found = [curve.bode.step_error[:, *_place(curve, source)] for curve in curves if not curve.is_line]
    largest = max((float(np.nanmax(errors)) for errors in found if not np.all(np.isnan(errors))), default=np.nan)
    return "not known" if np.isnan(largest) else f"{100 * largest:.3g} %"


def _statuses(bode: Bode) -> str:
    """Return how many points ended how."""
    counts = Counter(Status(int(status)).name.lower().replace("_", " ") for status in bode.status.flat)
    method = bode.settings.get("method", "")
    return f"Method {method}: " + ", ".join(f"{count} {name}" for name, count in counts.items())


def _unfinished(bode: Bode) -> list[str | Plot]:
    """Return the table of points that are not done, with their messages."""
    rows = [
        (
            bode.inputs[i].name,
            f"{bode.frequency[k]:.5g}",
            Status(int(bode.status[k, i])).name.lower().replace("_", " "),
            bode.message[k, i],
        )
        for k, i in np.argwhere((bode.status != Status.DONE) & (bode.status != Status.NOT_EXCITED))
    ]
    if not rows:
        return []
    more = f", the first {_MOST_ROWS} of {len(rows)}" if len(rows) > _MOST_ROWS else ""
    return [
        table(["input", ">frequency [Hz]", "status", "message"], rows[:_MOST_ROWS], f"Points that are not done{more}")
    ]


def _layout(source: str) -> dict[str, Any]:
    """Return the layout of a Bode plot."""
    return {
        "xaxis": {"type": "log", "title": {"text": f"Frequency (Hz), {source}"}, "anchor": "y2"},
        "yaxis": {"title": {"text": "Magnitude (dB)"}, "domain": [0.44, 1]},
        "yaxis2": {"title": {"text": "Phase (deg)"}, "domain": [0, 0.38], "dtick": 90},
        "hovermode": "closest",
    }
