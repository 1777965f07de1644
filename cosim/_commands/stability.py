"""A scene's limits of stability, as the answer to a command: the steps of every algorithm, and the sample times.

Like `measure.py` it stands on the roof: it asks `build.py` for files.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np

from hfsa.cosim import build
from hfsa.cosim._commands.measure import Loaded, with_levels
from hfsa.cosim._commands.shell import rendered, table
from hfsa.cosim._fuse import fused
from hfsa.cosim._stability_map import StabilityMap
from hfsa.cosim._stability_map_file import map_figure, write_map
from hfsa.cosim._style import save
from hfsa.cosim.instance import open_instances
from hfsa.cosim.linearize import linearize
from hfsa.cosim.sampling import SamplingLimit, sampling_limit
from hfsa.cosim.step_limits import StepLimit, step_limits
from hfsa.cosim.system import ALGORITHMS

CHOOSES = "chooses its steps"
"""What is said of an algorithm that no step is asked of."""

_WITHOUT_LIMIT = {
    "error_controlled": CHOOSES,
    "monolithic": CHOOSES,
    "linearized_feedback": "not known beforehand; no limit from the loops it closes within a step",
}


def scene_stability(loaded: Loaded) -> tuple[dict[str, Any], str]:
    """Return the limits of a scene, as data and as text; raises `StructureError` where it has no equilibrium."""
    scene, _ = with_levels(loaded.scene, None)
    system = fused(scene.system, scene.fuse)
    files = build.build(system)
    with open_instances(files) as instances:
        limits = list(step_limits(system, instances, scene.step_size))
        sampling = sampling_limit(system, instances, scene.outputs)
        growth = None
        if sampling is None:
            poles = linearize(system, instances, [], scene.outputs).poles
            growth = float(max((pole.real for pole in poles), default=-math.inf))
    data = {
        "step_size": scene.step_size,
        "algorithm": scene.algorithm,
        "growth": growth,
        "sample_time": None
        if sampling is None
        else {"own": sampling.sample_time, "longest": _number(sampling.longest)},
        "algorithms": [_entry(limit) for limit in limits]
        + [{"algorithm": name, "note": note} for name, note in _WITHOUT_LIMIT.items() if name in ALGORITHMS],
    }
    return data, _text(loaded.title, scene.step_size, limits, sampling, growth)


def map_stability(found: StabilityMap, title: str, path: Path) -> tuple[dict[str, Any], str]:
    """Write a map and its picture beside it; return what they hold, as data and as text."""
    write_map(path, found, title)
    picture = path.with_suffix(".png")
    save(map_figure(found, title), picture)
    agree, simulated = found.agreement
    known = found.growth[~np.isnan(found.growth)]
    data = {
        "file": path,
        "picture": picture,
        "algorithm": found.algorithm,
        "axes": {axis.name: axis.values.tolist() for axis in found.axes},
        "stable": int((known <= 0).sum()),
        "points": int(found.growth.size),
        "simulated": simulated,
        "agree": agree,
        "messages": list(found.messages),
    }
    lines = [
        f"{path}, {picture}: {found.algorithm} on {title}",
        f"  stable at {data['stable']} of {data['points']} points",
        f"  simulated {simulated}, of which {agree} agree ({100 * agree / max(simulated, 1):.4g} %)",
        *(f"  not built: {message}" for message in found.messages),
    ]
    return data, "\n".join(lines)


def _entry(limit: StepLimit) -> dict[str, Any]:
    if limit.message:
        return {"algorithm": limit.algorithm, "note": limit.message}
    return {
        "algorithm": limit.algorithm,
        "longest_step": _number(limit.longest),
        "is_unlimited": math.isinf(limit.longest),
        "is_stable": limit.is_stable,
        "flexible_growth": _number(limit.flexible),
        "rigid_growth": _number(limit.rigid),
    }


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _text(
    title: str, step_size: float, limits: list[StepLimit], sampling: SamplingLimit | None, growth: float | None
) -> str:
    rows = table("algorithm", "longest stable step", f"at {step_size:.4g} s", "flexible modes", "rigid motion")
    for limit in limits:
        if limit.message:
            rows.add_row(limit.algorithm, limit.message, "", "", "")
            continue
        longest = (
            "every one asked" if math.isinf(limit.longest) else f"{limit.longest:.5g} s" if limit.longest else "none"
        )
        verdict = {True: "stable", False: "UNSTABLE", None: "does not fit"}[limit.is_stable]
        rows.add_row(limit.algorithm, longest, verdict, _rate(limit.flexible), _rate(limit.rigid))
    for name, note in _WITHOUT_LIMIT.items():
        rows.add_row(name, note, "", "", "")
    lines = [f"{title}: communication steps about the equilibrium", rendered(rows)]
    if sampling is not None:
        longest = "at every one that was asked" if math.isinf(sampling.longest) else f"up to {sampling.longest:.5g} s"
        found = longest if sampling.longest else "at none that was asked"
        lines.append(f"sample time {sampling.sample_time:.5g} s; without communication steps stable {found}")
    elif growth is not None:
        lines.append(f"without communication steps the fastest growth is {growth:.4g} 1/s")
    return "\n".join(lines)


def _rate(growth: float) -> str:
    return "none" if math.isinf(growth) else f"{growth:+.4g} 1/s"
