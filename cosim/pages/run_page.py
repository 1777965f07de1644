"""Page of a run: the machines that moved, and all recorded signals, under one cursor in time.

    write_page(Path("run.html"), run_page(recorded, [Body("robot", panel, displacements)]))

Displacements are small: they are drawn times a factor, which the page states and a slider changes.
"""

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.figures.drawing import Panel
from hfsa.cosim.pages.page import Page
from hfsa.cosim.pages.panel_data import LOOKS, coordinates, panel_data, rounded, scale_of
from hfsa.cosim.pages.thinning import envelope, kept_rows, lost_motion
from hfsa.cosim.results.recorded import Recorded
from hfsa.cosim.signals.prefixes import prefixed

FRAMES = 1500
"""Number of rows at most whose motion a page holds."""
_CURVE, _CURVES = 4000, 60_000
"""Number of points at most of a curve, and of all curves."""
_SHOWN = 0.12
"""Largest displacement as drawn, relative to the size of its body."""
_COARSE = 0.1
"""Lost motion, relative to the range of a signal, from which on a page says so."""

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


@dataclass(frozen=True)
class Body:
    """A machine that moves: where it is in the scene, its panel, and the displacements of its layers.

    Attributes:
        name: name of its instance.
        panel: the body where all signals are zero.
        displacements: by layer (rows, points, axes) in the unit of the panel; `None` for one that stands still.
        signals: the signals that move it, (rows,) each.
    """

    name: str
    panel: Panel
    displacements: Sequence[NDArray[np.float64] | None]
    signals: Sequence[NDArray[np.float64]]


def run_page(recorded: Recorded, bodies: Sequence[Body]) -> tuple[Page, list[str]]:
    """Return the page of a run, and sentences on what it leaves out."""
    kept = kept_rows(len(recorded.at), FRAMES)
    sentences = _left_out(recorded, bodies, kept)
    data = {
        "time": rounded(recorded.at[kept]),
        "bodies": [_body(body, kept) for body in bodies],
        "signals": signal_data(recorded),
        **LOOKS,
    }
    remarks = html.escape(" ".join(f"{sentence[:1].upper()}{sentence[1:]}." for sentence in sentences))
    return Page(recorded.title, _BODY.format(remarks=remarks), ("panel.js", "run.js"), data), sentences


def _left_out(recorded: Recorded, bodies: Sequence[Body], kept: NDArray[np.int64]) -> list[str]:
    """Return sentences on what the frames of a page do not show."""
    if len(kept) == len(recorded.at) or not bodies:
        return []
    lost = max(lost_motion(recorded.at, body.signals, kept) for body in bodies)
    words = f"the motion is drawn at {len(kept)} of {len(recorded.at)} points in time"
    if lost > _COARSE:
        words += f", between which it changes by {100 * lost:.0f} % of its range; --from and --to choose a stretch"
    return [words]


def _body(body: Body, kept: NDArray[np.int64]) -> dict[str, Any]:
    """Return a body as plain data: its panel, and the places of its layers in every frame."""
    factor, _ = scale_of(body.panel)
    layers = [
        (layer, None if shift is None else shift[kept])
        for layer, shift in zip(body.panel.layers, body.displacements, strict=True)
        if layer.cells.size
    ]
    largest = max((float(np.abs(shift).max()) for _, shift in layers if shift is not None), default=0.0)
    size = float(np.ptp(np.vstack([layer.points for layer, _ in layers]), axis=0).max())
    return {
        "name": html.escape(body.name),
        "panel": panel_data(body.panel, body.name),
        "times": _one_two_five(_SHOWN * size / largest) if largest else 1.0,
        "shifts": [None if shift is None else [coordinates(points, factor) for points in shift] for _, shift in layers],
    }


def _one_two_five(value: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is no larger than a value above 0."""
    power = 10.0 ** math.floor(math.log10(value))
    return power * max(step for step in (1.0, 2.0, 5.0) if step * power <= value * (1 + 1e-9))


def signal_data(recorded: Recorded) -> list[dict[str, Any]]:
    """Return the signals as plain data; those of one unit have the same prefix, a value that is no number is a gap."""
    largest: dict[str, float] = {}
    for name, values in recorded.values.items():
        size = float(np.abs(values[np.isfinite(values)]).max(initial=0.0))
        largest[recorded.units[name]] = max(size, largest.get(recorded.units[name], 0.0))
    most = max(min(_CURVE, _CURVES // max(1, len(recorded.values))), 200)
    found = []
    for name, values in recorded.values.items():
        factor, unit = prefixed(largest[recorded.units[name]], recorded.units[name])
        rows = envelope(values, most)
        shown = [number if math.isfinite(number) else None for number in rounded(factor * values[rows])]
        names = {"name": html.escape(name), "unit": html.escape(unit)}
        found.append({**names, "t": rounded(recorded.at[rows]), "y": shown})
    return found
