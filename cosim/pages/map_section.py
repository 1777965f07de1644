"""Section of a report on a stability map: growth over one or two arguments, and how simulations agree."""

from typing import Any

import numpy as np

from hfsa.cosim.pages.blocks import Plot, Section, paragraph, table
from hfsa.cosim.pages.panel_data import rounded
from hfsa.cosim.results.stability_map import GEOMETRIC, Axis, StabilityMap


def map_section(found: StabilityMap) -> Section:
    """Return the section on a stability map."""
    agreed, simulated = found.agreement
    stable, built = int(found.stable.sum()), int(found.built.sum())
    words = (
        f"{found.algorithm} at steps of {found.step_size:.4g} s: {stable} of {built} points are stable; simulations "
        f"agree at {agreed} of {simulated}"
    )
    blocks: list[str | Plot] = [paragraph(words), _plot(found)]
    if found.messages:
        blocks.append(table(["points that cannot be built"], [(message,) for message in found.messages]))
    return Section("Stability", blocks)


def _plot(found: StabilityMap) -> Plot:
    """Return the figure of the growth."""
    x, *more = found.axes
    words = f"Growth of the fastest mode [1/s] over {', '.join(axis.name for axis in found.axes)}; above 0 is unstable"
    if not more:
        trace = {"type": "scatter", "mode": "lines+markers", "x": rounded(x.values), "y": _numbers(found.growth)}
        layout = {"xaxis": _axis(x), "yaxis": {"title": {"text": "Growth (1/s)"}}}
        return Plot([trace], layout, words)
    (y,) = more
    finite = found.growth[np.isfinite(found.growth)]
    bound = float(np.quantile(np.abs(finite), 0.95)) if finite.size else 1.0
    trace = {
        "type": "heatmap",
        "x": rounded(x.values),
        "y": rounded(y.values),
        "z": [_numbers(row) for row in found.growth.T],
        "zmid": 0,
        "zmin": -bound,
        "zmax": bound,
        "colorscale": [[0, "#0b5fa5"], [0.5, "#f3e9d2"], [1, "#b3541e"]],
        "colorbar": {"title": {"text": "Growth (1/s)"}},
        "hovertemplate": f"{x.name} %{{x:.4g}}<br>{y.name} %{{y:.4g}}<br>%{{z:.4g}} 1/s<extra></extra>",
    }
    return Plot([trace], {"xaxis": _axis(x), "yaxis": _axis(y)}, words)


def _axis(axis: Axis) -> dict[str, Any]:
    """Return an axis, logarithmic where its values are spaced geometrically."""
    low, high = axis.values.min(), axis.values.max()
    return {"title": {"text": axis.name}, "type": "log" if low > 0 and high / low >= GEOMETRIC else "linear"}


def _numbers(values: np.ndarray) -> list[float | None]:
    """Return numbers, with gaps for those that are not finite."""
    return [value if np.isfinite(value) else None for value in rounded(values)]
