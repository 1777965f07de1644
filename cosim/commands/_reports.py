"""Answers of the verbs as data for JSON and as text: listings of parts and scenes, reports of sweeps and runs."""

import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hfsa.components import ModelError
from hfsa.components._modelling.catalogue import hint, part_named
from hfsa.components._modelling.loading import files_of, is_path, kind_of
from hfsa.components._modelling.model import Kind, Quantity
from hfsa.components._modelling.parts import Argument, Part
from hfsa.cosim.assembly.load_scene import FILES, available_scenes, load_scene, scene_part
from hfsa.cosim.assembly.models import available_parts
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
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import compact

_KINDS = {
    "inputs": (Kind.INPUT,),
    "outputs": (Kind.OUTPUT, Kind.SAMPLED_OUTPUT),
    "parameters": (Kind.PARAMETER,),
}

FMU, ANALYSIS = "the FMU", "analyze"
"""Users of the arguments of a part."""
_TAKERS = (None, [FMU, ANALYSIS], [FMU], [ANALYSIS])
"""Users of arguments in the order of the listing."""


# Parts and scenes -----------------------------------------------------------------------------------------------------


def listing(name: str | None = None) -> dict[str, list[dict[str, Any]]]:
    """Return components, controllers, parts of others and scenes with what they offer; one alone by its name or path.

    The path of a folder lists what its files define. A part or scene that cannot be used has an `error` in the place of
    all else; by its own name, that is raised. `StructureError` for a name that is not there, with the nearest ones.
    """
    if name is not None and is_path(name):
        return _listing_of(Path(name))
    groups: dict[str, list[str]] = {"components": [], "controllers": [], "parts": []}
    for part_name in available_parts():
        home = "parts" if available_parts().is_own(part_name) else available_parts().package_of(part_name)
        groups[home].append(part_name)
    groups["scenes"] = [*available_scenes()]
    known = dict.fromkeys(known for group in groups.values() for known in group)
    if name is not None and name not in known:
        raise StructureError(f"nothing is called {name!r}{hint(name, known)}")
    return {
        group: [
            _entry(part_name, part_name, group == "scenes", is_alone=name is not None)
            for part_name in found
            if name in (None, part_name)
        ]
        for group, found in groups.items()
        if found or group != "parts"
    }


def _listing_of(path: Path) -> dict[str, list[dict[str, Any]]]:
    """Return the listing of a file of one's own, or of a folder's files."""
    if path.is_dir():
        documents = sorted(file for ending in FILES for file in path.glob(f"*{ending}"))
        files = {"parts": files_of(path, "part"), "scenes": [*files_of(path, "scene"), *documents]}
        files["scenes"] = [file for file in files["scenes"] if file.name != "pyproject.toml"]
        if not any(files.values()):
            raise StructureError(f"{path} has no parts and no scenes; expected .py files that define a function each")
    elif not path.is_file():
        raise StructureError(f"there is no file {path}")
    else:
        is_scene = path.suffix in FILES or kind_of(path) == "scene"
        files = {"parts": [] if is_scene else [path], "scenes": [path] if is_scene else []}
    return {
        group: [_entry(file.stem, str(file), group == "scenes", is_alone=not path.is_dir()) for file in found]
        for group, found in files.items()
    }


def _entry(label: str, name: str, is_scene: bool, is_alone: bool) -> dict[str, Any]:
    """Return what a part or scene offers; where it is not alone, its error instead if it has one."""
    try:
        return _scene_entry(label, name) if is_scene else _part_entry(part_named(name, available_parts()))
    except (ModelError, StructureError) as error:
        if is_alone:
            raise
        return {"name": label, "error": " ".join(str(error).split())}


def listing_text(data: Mapping[str, list[dict[str, Any]]]) -> str:
    """Return the listing as text; a single entry in full."""
    count = sum(map(len, data.values()))
    blocks = []
    for group, entries in data.items():
        if entries or count > 1:
            entry_lines = [line for entry in entries for line in _entry_lines(entry, in_full=count == 1)]
            blocks.append("\n".join([group, *(entry_lines or ["  none"])]))
    return "\n\n".join(blocks)


def _part_entry(part: Part) -> dict[str, Any]:
    """Return the entry of a part as plain data: levels, arguments, signals."""
    entry = {
        "name": part.name,
        "description": part.doc,
        "is_analysis": part.build is None,
        "has_analysis": part.analyze is not None,
        "levels": list(part.levels),
        "arguments": _part_arguments(part),
    }
    if part.build is not None:
        model = part.model()
        if part.is_own:
            model.check()
        for key, kinds in _KINDS.items():
            entry[key] = [_signal(quantity) for quantity in model.of(*kinds)]
        # an argument of the analysis may be a parameter of the FMU
        own = {parameter["name"]: parameter for parameter in entry["parameters"]}
        for name, parameter in own.items():
            parameter["taken_by"] = [FMU, ANALYSIS] if name in part.analysis_arguments else [FMU]
        entry["arguments"] = [argument for argument in entry["arguments"] if argument["name"] not in own]
    return entry


def _scene_entry(label: str, name: str) -> dict[str, Any]:
    """Return what a scene holds, as plain data."""
    scene = load_scene(name)
    part = None if name.endswith(FILES) else scene_part(name)
    return {
        "name": label,
        "description": part.doc if part else "",
        "arguments": _entries(part.arguments if part else {}),
        "components": [
            {"name": c.name, "part": c.part, "level": c.level, "arguments": dict(c.arguments), "start": dict(c.start)}
            for c in scene.system.components
        ],
        "inputs": list(scene.inputs),
        "outputs": list(scene.outputs),
        "band": list(scene.band),
        "step_size": scene.step_size,
        "algorithm": scene.algorithm,
    }


def _part_arguments(part: Part) -> list[dict[str, Any]]:
    """Return the arguments of the FMU and of the analysis of a part, except the level, with the users of each."""
    of_model = _entries(part.arguments if part.build is not None else {})
    of_analysis = _entries(part.analysis_arguments)
    both = [entry for entry in of_model if entry in of_analysis]
    return [
        *({**entry, "taken_by": [FMU, ANALYSIS]} for entry in both),
        *({**entry, "taken_by": [FMU]} for entry in of_model if entry not in both),
        *({**entry, "taken_by": [ANALYSIS]} for entry in of_analysis if entry not in both),
    ]


def _entries(arguments: Mapping[str, Argument]) -> list[dict[str, Any]]:
    """Return arguments, except the level, as plain data."""
    return [
        {"name": argument.name, "default": argument.default, "values": list(argument.values), "file": argument.file}
        for argument in arguments.values()
        if argument.name != "level"
    ]


def _signal(quantity: Quantity) -> dict[str, Any]:
    """Return a quantity as plain data; only parameters have a start value."""
    start = quantity.start if quantity.kind is Kind.PARAMETER else None
    return {"name": quantity.name, "unit": quantity.unit, "description": quantity.description, "start": start}


def _entry_lines(entry: Mapping[str, Any], in_full: bool) -> Iterable[str]:
    """Yield the lines of an entry; arguments and parameters only with `in_full`."""
    if "error" in entry:
        yield f"  {entry['name']}"
        yield f"      cannot be used: {entry['error']}"
        return
    levels = f" ({', '.join(entry['levels'])})" if entry.get("levels") else ""
    kind = " [analysis]" if entry.get("is_analysis") else ""
    yield f"  {entry['name']}{levels}{kind}"
    if entry["description"]:
        yield f"      {entry['description']}"
    for key in ("inputs", "outputs"):
        if entry.get(key):
            names = [s if isinstance(s, str) else s["name"] for s in entry[key]]
            label = "      in   " if key == "inputs" else "      out  "
            yield textwrap.fill(", ".join(compact(names)), 118, initial_indent=label, subsequent_indent=" " * 11)
    if not in_full:
        return
    heading = None
    items = [*entry["arguments"], *entry.get("parameters", [])]
    for item in sorted(items, key=lambda item: _TAKERS.index(item.get("taken_by"))):
        takers = item.get("taken_by", []) if entry.get("has_analysis") and not entry["is_analysis"] else []
        if takers and takers != heading:
            yield f"      {' and '.join(takers)} take" if len(takers) > 1 else f"      {takers[0]} alone takes"
            heading = takers
        unit = f" {item['unit']}" if item.get("unit", "1") != "1" else ""
        value = item["default"] if "default" in item else item["start"]
        choice = f", one of {', '.join(map(str, item['values']))}" if item.get("values") else ""
        choice += f", or the path of a {item['file']} file" if item.get("file") else ""
        about = f"  {item['description']}" if item.get("description") else ""
        yield f"      -p {item['name']}={_words(value)}{unit}{choice}{about}"


def _words(value: Any) -> str:
    """Return a value as typed on the command line."""
    if isinstance(value, list | tuple):
        return ",".join(map(_words, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


# Results --------------------------------------------------------------------------------------------------------------


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
