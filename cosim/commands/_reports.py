"""Reports of sweeps and runs, as data for JSON and as text."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.commands._branches import branches_data, branches_lines
from hfsa.cosim.measurement.limit_flags import ActiveLimit, active_limits, recorded_flags
from hfsa.cosim.results.files import (
    AlgorithmChoice,
    Bode,
    ErrorEstimate,
    OrderChoice,
    Status,
    read_algorithm,
    read_choices,
    read_driven,
    read_errors,
    read_order,
    read_run,
    read_status,
    read_step_size,
    read_sweep,
)


def sweep_report(path: Path) -> tuple[dict[str, Any], str, bool]:
    """Return the report of a sweep as data and as text, and whether every point is done."""
    bode = read_sweep(path)
    sides = [("", bode)] if bode.downward is None else [("upwards", bode), ("downwards", bode.downward)]
    counts = {s.name.lower(): sum(int(np.sum(side.status == s)) for _, side in sides) for s in Status}
    is_done = [np.isin(side.status, (Status.DONE, Status.NOT_EXCITED)) for _, side in sides]
    troubles = [
        {
            "input": bode.inputs[i].name,
            "frequency": float(bode.frequency[k]),
            "status": Status(side.status[k, i]).name.lower(),
            "message": f"{way}: {side.message[k, i]}" if way else side.message[k, i],
        }
        for (way, side), done in zip(sides, is_done, strict=True)
        for k, i in np.argwhere(~done | (side.message != ""))
    ]
    data = {
        "file": path,
        "status": bode.attributes["status"],
        "points": counts,
        "frequency": [bode.frequency[0], bode.frequency[-1]],
        "inputs": [signal.name for signal in bode.inputs],
        "outputs": [signal.name for signal in bode.outputs],
        "peaks": [_peak(bode, o, i) for o in range(len(bode.outputs)) for i in range(len(bode.inputs))],
        "troubles": troubles,
        "levels": _levels(path),
        "order": order_data(read_order(path)),
        "algorithm": bode.settings.get("algorithm"),
        "choice": algorithm_data(choice := read_algorithm(path)),
        "step_error": _largest_step_error(bode),
        "steps": sum(int(side.steps.sum()) for _, side in sides),
        "branches": branches_data(bode),
    }
    lines = [f"{path}: {', '.join(f'{count} {name}' for name, count in counts.items() if count)}"]
    lines += branches_lines(data["branches"])
    lines += [
        f"  {t['input']} at {t['frequency']:.6g} Hz {t['status']}: {t['message']}" for t in troubles if t["message"]
    ]
    lines += [f"  {choice.sentence}"] if choice else []
    return data, "\n".join(lines), all(bool(np.all(done)) for done in is_done)


def _largest_step_error(bode: Bode) -> dict[str, Any] | None:
    """Return the largest error due to communication steps and its place; `None` where it is not known."""
    if np.isnan(bode.step_error).all():
        return None
    k, output, source = np.unravel_index(int(np.nanargmax(bode.step_error)), bode.step_error.shape)
    return {
        "output": bode.outputs[output].name,
        "input": bode.inputs[source].name,
        "frequency": float(bode.frequency[k]),
        "relative": float(bode.step_error[k, output, source]),
    }


def _peak(bode: Any, output: int, source: int) -> dict[str, Any]:
    """Return frequency and magnitude of the peak of an entry."""
    size = np.nan_to_num(np.abs(bode.response[:, output, source]))
    k = int(np.argmax(size))
    return {
        "output": bode.outputs[output].name,
        "input": bode.inputs[source].name,
        "frequency": float(bode.frequency[k]),
        "magnitude": float(size[k]),
    }


def run_report(path: Path) -> tuple[dict[str, Any], str]:
    """Return the report of a run as data and as text: bounds of each variable, and times of active limits.

    For a failed run they refer to the values recorded until then.
    """
    recorded, units = read_run(path)
    status, message = read_status(path)
    errors = read_errors(path)
    reached = np.all([np.isfinite(v) for v in recorded.values()], axis=0)
    values = {name: v[reached] for name, v in recorded.items()}
    flags = recorded_flags(path, values)
    limits = active_limits(values["time"], flags)
    stop_time, step_size, rows = float(values["time"].max(initial=0.0)), read_step_size(path), len(values["time"])
    steps = max(rows - 1, 0) if step_size is None else round(stop_time / step_size)
    data = {
        "file": path,
        "size": path.stat().st_size,
        "status": status,
        "message": message,
        "stop_time": stop_time,
        "steps": steps,
        "rows": rows,
        "variables": [
            {"name": name, "unit": units[name], **_bounds(v), **error_data(errors.get(name))}
            for name, v in values.items()
            if name != "time"
        ],
        "limits": limits_data(limits),
        "levels": _levels(path),
        "order": order_data(read_order(path)),
        "choice": algorithm_data(choice := read_algorithm(path)),
        "driven": list(map(asdict, driven := read_driven(path))),
    }
    kept = f" of which {rows} points are kept," if rows < steps else ""
    found = f"{stop_time:g} s in {steps} steps,{kept} {_bytes(data['size'])}"
    lines = [f"{path}: {found}{f', {status}: {message}' if message else ''}"]
    lines += [
        f"  {v['name']}: {v['minimum']:.4g} to {v['maximum']:.4g} {v['unit']}{_error_words(v)}"
        for v in data["variables"]
        if v["name"] not in flags
    ]
    for found in limits:
        often = f"{100 * found.share:.3g} % of the time"
        lasting = "" if found.lasting_since is None else f", to the end from {found.lasting_since:.6g} s on"
        lines.append(f"  {found.signal}: {found.limit.word}, first at {found.first_time:.6g} s, {often}{lasting}")
    lines += [f"  {one.name} is driven by {one.signal}" for one in driven]
    lines += [f"  {choice.sentence}"] if choice else []
    return data, "\n".join(lines)


def _bytes(size: int) -> str:
    """Return the size of a file [byte] as text."""
    return f"{size / 1e6:.3g} MB" if size >= 1e6 else f"{size / 1e3:.3g} kB"


def _bounds(values: NDArray[np.float64]) -> dict[str, float]:
    """Return bounds and last value of a recorded variable; NaN without values."""
    if not len(values):
        return dict.fromkeys(("minimum", "maximum", "last"), float("nan"))
    return {"minimum": values.min(), "maximum": values.max(), "last": values[-1]}


def error_data(error: ErrorEstimate | None) -> dict[str, float | None]:
    """Return the error estimate of a variable for JSON; `None` where the run was not verified."""
    if error is None:
        return {"error_estimate": None, "relative_error": None}
    return {"error_estimate": error.absolute, "relative_error": error.relative}


def _error_words(variable: Mapping[str, Any]) -> str:
    """Return the error estimate of a variable as the end of a line."""
    if variable["error_estimate"] is None:
        return ""
    return f", error {variable['error_estimate']:.3g} {variable['unit']} ({100 * variable['relative_error']:.3g} %)"


def _levels(path: Path) -> dict[str, dict[str, Any]]:
    """Return the choices of levels by instance; empty where the scene names all levels."""
    return {name: {**asdict(choice), "error": choice.error} for name, choice in read_choices(path).items()}


def order_data(choice: OrderChoice | None) -> dict[str, Any] | None:
    """Return the computed order of steps for JSON; `None` where the order is the scene's."""
    return None if choice is None else asdict(choice)


def algorithm_data(choice: AlgorithmChoice | None) -> dict[str, Any] | None:
    """Return the choice of `auto` for JSON; `None` where the scene names the algorithm."""
    return None if choice is None else {**asdict(choice), "error": choice.error}


def limits_data(limits: Iterable[ActiveLimit]) -> list[dict[str, Any]]:
    """Return the active limits for JSON, times in s."""
    return [
        {
            "signal": found.signal,
            "kind": found.limit.word,
            "first_time": found.first_time,
            "share": found.share,
            "lasting_since": found.lasting_since,
        }
        for found in limits
    ]
