"""Panels of drawings as plain data: coordinates in the unit with a prefix that fits the panel, colours and widths."""

import html
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.figures.drawing import ROLE_COLOURS, Layer, Panel
from hfsa.cosim.signals.prefixes import prefixed

_ON_DARK = {"body": "#6fb1ec", "rest": "#6b7280", "moved": "#f08a96", "axis": "#e8a06b", "mark": "#e6e9ee"}
_WIDTH = {"body": 7, "rest": 4, "moved": 6, "axis": 3, "mark": 2}
_DIGITS = 7
"""Digits of coordinates, which keep a page small."""

LOOKS = {"colours": {"light": ROLE_COLOURS, "dark": _ON_DARK}, "widths": _WIDTH}
"""Colours and widths of layers by their roles."""


def panel_data(panel: Panel, title: str) -> dict[str, Any]:
    """Return a panel as plain data, with a title for one without; a plane has a third coordinate, zero."""
    factor, unit = scale_of(panel)
    coloured = [layer.values for layer in panel.layers if layer.values is not None and layer.values.size]
    scale, shown = prefixed(float(max((np.abs(v).max() for v in coloured), default=0.0)), panel.quantity_unit)
    return {
        "title": panel.title or title,
        "unit": "" if unit == "1" else unit,
        "axes": list(panel.axes),
        "is_flat": len(panel.axes) == 2,
        "quantity": panel.quantity if shown == "1" else f"{panel.quantity} ({shown})",
        "layers": [_layer(layer, factor, scale) for layer in panel.layers if layer.cells.size],
    }


def scale_of(panel: Panel) -> tuple[float, str]:
    """Return the factor of a panel's coordinates and their unit with a prefix."""
    everything = np.vstack([points for layer in panel.layers for points in _places(layer)])
    return prefixed(float(np.abs(everything).max()), panel.unit)


def _places(layer: Layer) -> Sequence[NDArray[np.float64]]:
    """Return the points of a layer, and those at rest if it moves."""
    return [layer.points] if layer.rest is None else [layer.points, layer.rest]


def _layer(layer: Layer, factor: float, scale: float) -> dict[str, Any]:
    """Return a layer as plain data."""
    return {
        "role": layer.role,
        "name": html.escape(layer.name),
        "cells": layer.cells.tolist(),
        "points": coordinates(layer.points, factor),
        "rest": None if layer.rest is None else coordinates(layer.rest, factor),
        "values": None if layer.values is None else rounded(scale * layer.values),
        "texts": [html.escape(text) for text in layer.texts],
        "notes": [html.escape(note) for note in layer.notes],
    }


def coordinates(points: np.ndarray, factor: float) -> list[list[float]]:
    """Return coordinates by axis, shape (3, points)."""
    solid = np.zeros((len(points), 3))
    solid[:, : points.shape[1]] = factor * points
    return [rounded(column) for column in solid.T]


def rounded(values: NDArray[np.float64]) -> list[float]:
    """Return numbers with as many digits as a drawing shows."""
    return [float(f"{value:.{_DIGITS}g}") for value in values]
