"""Listing of parts, scenes and FMUs with their arguments, parameters and signals, as data for JSON and as text."""

import textwrap
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from hfsa.components import ModelError
from hfsa.components._modelling.argument_texts import Text, text_of
from hfsa.components._modelling.arguments import arguments_of
from hfsa.components._modelling.catalogue import hint, part_named
from hfsa.components._modelling.loading import files_of, is_path, kind_of
from hfsa.components._modelling.model import Kind, Quantity
from hfsa.components._modelling.parts import Argument, Part
from hfsa.cosim.assembly.load_scene import FILES, available_scenes, load_scene, scene_part
from hfsa.cosim.assembly.models import available_parts
from hfsa.cosim.commands._fmu_listing import fmu_entry
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import compact
from hfsa.cosim.systems.scene import Scene

_KINDS = {
    "inputs": (Kind.INPUT,),
    "outputs": (Kind.OUTPUT, Kind.SAMPLED_OUTPUT),
    "parameters": (Kind.PARAMETER,),
}

FMU, ANALYSIS = "the FMU", "analyze"
"""Users of the arguments of a part."""
_TAKERS = (None, [FMU, ANALYSIS], [FMU], [ANALYSIS])
"""Users of arguments in the order of the listing."""


def listing(name: str | None = None) -> dict[str, list[dict[str, Any]]]:
    """Return components, controllers, parts of others and scenes with what they offer; one alone by its name or path.

    The path of a folder lists what its files define. A part or scene that cannot be used has an `error` in the place of
    all else; by its own name, that is raised. `StructureError` for a name that is not there, with the nearest ones.
    """
    if name is not None and (is_path(name) or name.endswith(".fmu")):
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
    elif path.suffix == ".fmu":
        return {"FMUs": [fmu_entry(path)]}
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
        "arguments": _entries(part.arguments if part else {}, _owners(scene)),
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
    of_model = _entries(part.arguments if part.build is not None else {}, _same(part.analyze))
    of_analysis = _entries(part.analysis_arguments, _same(part.build))
    both = [entry for entry in of_model if entry in of_analysis]
    return [
        *({**entry, "taken_by": [FMU, ANALYSIS]} for entry in both),
        *({**entry, "taken_by": [FMU]} for entry in of_model if entry not in both),
        *({**entry, "taken_by": [ANALYSIS]} for entry in of_analysis if entry not in both),
    ]


def _same(function: Callable[..., Any] | None) -> Mapping[str, Any]:
    """Return the owner of arguments of another function of a part, by name of the argument."""
    return dict.fromkeys(arguments_of(function), function)


def _owners(scene: Scene) -> Mapping[str, Any]:
    """Return the owners of the arguments of a scene's parts, by name of the argument."""
    parts = [part_named(c.part, available_parts()) for c in scene.system.components if not c.is_foreign]
    return {argument.name: argument.owner for part in parts for argument in part.arguments.values()}


def _entries(arguments: Mapping[str, Argument], others: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return arguments, except the level, as plain data; `others` describe those whose owner does not, by name."""
    listed = [argument for argument in arguments.values() if argument.name != "level"]
    return [_argument(argument, text_of(argument, others.get(argument.name))) for argument in listed]


def _argument(argument: Argument, text: Text) -> dict[str, Any]:
    """Return an argument as plain data."""
    return {
        "name": argument.name,
        "default": argument.default,
        "unit": text.unit,
        "description": text.sentence,
        "values": list(argument.values),
        "file": argument.file,
    }


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
        unit = f" {item['unit']}" if item["unit"] not in ("", "1") else ""
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
