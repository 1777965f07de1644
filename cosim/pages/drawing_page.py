"""Page of a part's drawings: one panel at a time, which turns with the pointer, and moves where a layer has a rest.

    write_page(Path("robot.html"), drawing_page(part.drawing()))

Coordinates are in the unit with a prefix that fits the panel. Drawings are known by their attributes alone
(`components/_modelling/drawing.py`).
"""

import html
from typing import Any

import numpy as np

from hfsa.cosim.figures.drawing import Drawing, Layer, Panel
from hfsa.cosim.figures.style import ACCENT, COLOURS, INK
from hfsa.cosim.pages.page import Page
from hfsa.cosim.signals.prefixes import prefixed

_COLOUR = {"body": COLOURS[0], "rest": "#a7aeb8", "moved": COLOURS[1], "axis": ACCENT, "mark": INK}
_ON_DARK = {"body": "#6fb1ec", "rest": "#6b7280", "moved": "#f08a96", "axis": "#e8a06b", "mark": "#e6e9ee"}
_WIDTH = {"body": 7, "rest": 4, "moved": 6, "axis": 3, "mark": 2}
_DIGITS = 7
"""Digits of coordinates, which keep a page small."""

_BODY = """<div id="panels" role="tablist" aria-label="Panels"></div>
<div id="plot" role="img" aria-live="polite"></div>
<div id="controls">
<button id="play" type="button" aria-pressed="false">Play</button>
<label for="size">Displacement, times what is drawn <input id="size" type="range" min="0" max="3" step="0.05" value="1">
<output id="times" for="size">1</output></label>
</div>
<p class="hint">Drag turns the view, the wheel changes its size, a point under the pointer shows its coordinates. Keys:
left and right change the panel, the space bar plays.</p>
"""


def drawing_page(drawing: Drawing) -> Page:
    """Return the page of a drawing."""
    data = {
        "colours": {"light": _COLOUR, "dark": _ON_DARK},
        "widths": _WIDTH,
        "panels": [_panel(panel, place) for place, panel in enumerate(drawing.panels, 1)],
    }
    return Page(drawing.title, _BODY, ("drawing.js",), data)


def _panel(panel: Panel, place: int) -> dict[str, Any]:
    """Return a panel as plain data; coordinates of a plane have a third one, zero."""
    everything = np.vstack([points for layer in panel.layers for points in _places(layer)])
    factor, unit = prefixed(float(np.abs(everything).max()), panel.unit)
    coloured = [layer.values for layer in panel.layers if layer.values is not None and layer.values.size]
    scale, shown = prefixed(float(max((np.abs(v).max() for v in coloured), default=0.0)), panel.quantity_unit)
    return {
        "title": panel.title or f"panel {place}",
        "unit": "" if unit == "1" else unit,
        "axes": list(panel.axes),
        "is_flat": len(panel.axes) == 2,
        "quantity": panel.quantity if shown == "1" else f"{panel.quantity} ({shown})",
        "layers": [_layer(layer, factor, scale) for layer in panel.layers if layer.cells.size],
    }


def _places(layer: Layer) -> list[np.ndarray]:
    """Return the points of a layer, and those at rest if it moves."""
    return [layer.points] if layer.rest is None else [layer.points, layer.rest]


def _layer(layer: Layer, factor: float, scale: float) -> dict[str, Any]:
    """Return a layer as plain data."""
    return {
        "role": layer.role,
        "name": html.escape(layer.name),
        "cells": layer.cells.tolist(),
        "points": _coordinates(layer.points, factor),
        "rest": None if layer.rest is None else _coordinates(layer.rest, factor),
        "values": None if layer.values is None else _rounded(scale * layer.values),
        "texts": [html.escape(text) for text in layer.texts],
        "notes": [html.escape(note) for note in layer.notes],
    }


def _coordinates(points: np.ndarray, factor: float) -> list[list[float]]:
    """Return coordinates by axis, shape (3, points)."""
    solid = np.zeros((len(points), 3))
    solid[:, : points.shape[1]] = factor * points
    return [_rounded(column) for column in solid.T]


def _rounded(values: np.ndarray) -> list[float]:
    """Return numbers with as many digits as a drawing shows."""
    return [float(f"{value:.{_DIGITS}g}") for value in values]
