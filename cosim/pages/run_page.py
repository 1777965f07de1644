"""Page of a run: the machines that moved, and all recorded signals, under one cursor in time.

    write_page(Path("run.html"), run_page(recorded, [Body("robot", panel, displacements)]))

Displacements are small: they are drawn times a factor, which the page states and a slider changes.
"""

import html
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.pages.bodies import FRAMES, Body, left_out
from hfsa.cosim.pages.page import Page
from hfsa.cosim.pages.panel_data import LOOKS, coordinates, panel_data, rounded, scale_of
from hfsa.cosim.pages.thinning import envelope, kept_rows
from hfsa.cosim.results.recorded import Recorded
from hfsa.cosim.signals.prefixes import prefixed

_CURVE, _CURVES = 4000, 60_000
"""Number of points at most of a curve, and of all curves of a page."""

_BODY = """<p class="hint" id="remarks">{remarks}</p>
<div id="panels" role="tablist" aria-label="Bodies"></div>
<div id="plot" role="img" aria-live="polite"></div>
<div id="controls">
<button id="play" type="button" aria-pressed="false">Play</button>
<label for="time">Time <input id="time" type="range" min="0" max="0" step="1" value="0">
<output id="now" for="time"></output></label>
<label for="size">Displacement, times <input id="size" type="range" min="-2" max="2" step="0.05" value="0">
<output id="times" for="size"></output></label>
</div>
<h2>Signals</h2>
<div id="signals" role="img" aria-label="Recorded signals over time"></div>
<p class="hint">A click on a curve moves the time; so do the keys left and right. The space bar plays.</p>
"""


def run_page(recorded: Recorded, bodies: Sequence[Body]) -> tuple[Page, list[str]]:
    """Return the page of a run, and sentences on what it leaves out."""
    kept = kept_rows(len(recorded.at), FRAMES)
    sentences = left_out(recorded, bodies, kept)
    data = {
        "time": rounded(recorded.at[kept]),
        "bodies": [_body(body, kept) for body in bodies],
        "signals": signal_data(recorded),
        **LOOKS,
    }
    remarks = html.escape(" ".join(f"{sentence[:1].upper()}{sentence[1:]}." for sentence in sentences))
    return Page(recorded.title, _BODY.format(remarks=remarks), ("panel.js", "run.js"), data), sentences


def _body(body: Body, kept: NDArray[np.int64]) -> dict[str, Any]:
    """Return a body as plain data: its panel, and the places of its layers in every frame."""
    factor, _ = scale_of(body.panel)
    layers = [
        (layer, None if shift is None else shift[kept])
        for layer, shift in zip(body.panel.layers, body.displacements, strict=True)
        if layer.cells.size
    ]
    return {
        "name": html.escape(body.name),
        "panel": panel_data(body.panel, body.name),
        "times": body.magnification,
        "shifts": [None if shift is None else [coordinates(points, factor) for points in shift] for _, shift in layers],
    }


def signal_data(recorded: Recorded, points: int = _CURVES) -> list[dict[str, Any]]:
    """Return the signals as plain data, thinned to a number of points in all.

    Those of one unit have the same prefix; a value that is no number is a gap.
    """
    largest: dict[str, float] = {}
    for name, values in recorded.values.items():
        size = float(np.abs(values[np.isfinite(values)]).max(initial=0.0))
        largest[recorded.units[name]] = max(size, largest.get(recorded.units[name], 0.0))
    most = max(min(_CURVE, points // max(1, len(recorded.values))), 200)
    found = []
    for name, values in recorded.values.items():
        factor, unit = prefixed(largest[recorded.units[name]], recorded.units[name])
        rows = envelope(values, most)
        shown = [number if math.isfinite(number) else None for number in rounded(factor * values[rows])]
        names = {"name": html.escape(name), "unit": html.escape(unit)}
        found.append({**names, "t": rounded(recorded.at[rows]), "y": shown})
    return found
