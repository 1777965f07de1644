"""Scene as a TOML document: stored with results, hashed, and read back.

The keys are those of `Scene`, with `components`, in the order in which they step, and `connections` as arrays of
tables; ranges may be written:

    inputs = ["reference.command.position[1..3]"]
    ...
    [[components]]
    name = "robot"
    part = "sdelta"
    arguments = { stiffness = "ch4" }

    [[connections]]
    start = "reference.drive[1..3].slide"
    end = "robot.drive[1..3].slide"
"""

import dataclasses
import json
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from numbers import Integral, Real
from pathlib import Path
from typing import Any

from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.kinds import refuse
from hfsa.cosim.systems.names import nearest
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System

_REQUIRED = ("inputs", "outputs")
_OF_EXPERIMENT = ("step_size", "stop_time")
"""Keys that may be missing where the FMUs of the scene propose a value."""

Propose = Callable[[Sequence[Component]], Mapping[str, tuple[float, str]]]
"""Function of the components of a scene that proposes values, with their origin, for keys that the scene lacks."""

_ALWAYS = ("inputs", "outputs", "band", "step_size", "stop_time", "tolerance", "algorithm")
_OPTIONAL = ("marks", "fuse", "scale", "recorded", "quiet_inputs")


def scene_text(scene: Scene) -> str:
    """Return the scene as TOML; `read_scene_text` returns an equal scene, and equal scenes have equal text."""
    lines = []
    for component in scene.system.components:
        lines += ["", "[[components]]", *(f"{key} = {_value(value)}" for key, value in _table(component).items())]
    for connection in scene.system.connections:
        lines += ["", "[[connections]]", *(f"{key} = {_value(value)}" for key, value in _joined(connection).items())]
    return settings_text(scene) + "\n".join(lines) + "\n"


def settings_text(scene: Scene) -> str:
    """Return all of a scene but its system as TOML; `read_settings` returns it."""
    text = "".join(toml_line(key, getattr(scene, key)) for key in _ALWAYS)
    text += toml_line("amplitude", scene.amplitude) + toml_line("source", _table(scene.source))
    return text + "".join(toml_line(key, getattr(scene, key)) for key in _OPTIONAL if getattr(scene, key))


def toml_line(key: str, value: Any) -> str:
    """Return a line of TOML."""
    return f"{key} = {_value(value)}\n"


def read_scene(file: Path, propose: Propose = lambda _: {}) -> Scene:
    """Return the scene of a `.toml` file; `StructureError` names the file and the wrong key.

    The path of a foreign `.fmu` is relative to the folder of the scene. `propose` gives a step or stop that is missing.
    """
    file = Path(file)
    try:
        text = file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        byte = error.object[error.start]
        raise StructureError(
            f"{file}: not a TOML document: byte {error.start} is {byte:#04x}, expected text in UTF-8"
        ) from None
    return read_scene_text(text, str(file), file.parent.resolve(), propose)


def read_scene_text(
    text: str, where: str = "scene", folder: Path | None = None, propose: Propose = lambda _: {}
) -> Scene:
    """Return the scene of a TOML document; `where` names the document in messages.

    Paths of foreign FMUs count from `folder`, without one they stay; `propose` gives a step or stop that is missing.
    """
    table = _settings(text, where, ("components", "connections"), ("components",))
    parts = _tables(where, table.pop("components"), "components")
    joined = _tables(where, table.pop("connections", []), "connections")
    for item in joined:
        _check_keys(f"{where}: connection", item, ("start", "end", "factor", "offset"), ("start", "end"))
    try:
        components = [_in_folder(_component("component", item), folder) for item in parts]
        missing = [key for key in _OF_EXPERIMENT if key not in table]
        table |= {key: value for key, (value, _) in (propose(components) if missing else {}).items() if key in missing}
        _check_keys(where, table, table, _OF_EXPERIMENT)
        return Scene(System(components, [Connection(**item) for item in joined]), **table)
    except StructureError as error:
        raise StructureError(f"{where}: {error}") from None


def read_settings(text: str, where: str, beside: Iterable[str] = (), required: Iterable[str] = ()) -> dict[str, Any]:
    """Return the fields of a scene in a TOML document, and the tables `beside` them, of which some are `required`.

    `StructureError` for an unknown or missing key; `where` names the document.
    """
    return _settings(text, where, beside, [*required, *_OF_EXPERIMENT])


def _settings(text: str, where: str, beside: Iterable[str], required: Iterable[str]) -> dict[str, Any]:
    """Return the fields of a scene as `read_settings`, perhaps without step and stop."""
    try:
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also a number of too many digits, and arrays within arrays
        raise StructureError(f"{where}: not a TOML document: {error}") from None
    fields = [f.name for f in dataclasses.fields(Scene) if f.name != "system"]
    _check_keys(where, table, [*fields, *beside], [*required, *_REQUIRED])
    try:
        if "source" in table:
            table["source"] = _component("source", table["source"])
    except StructureError as error:
        raise StructureError(f"{where}: {error}") from None
    return table


def _in_folder(component: Component, folder: Path | None) -> Component:
    """Return a component whose foreign FMU lies in a folder."""
    if folder is None or not component.is_foreign:
        return component
    return dataclasses.replace(component, part=str(folder / component.part))


def _component(label: str, table: Any) -> Component:
    """Return the component of a table; `label` is what it is called in messages."""
    fields = [f.name for f in dataclasses.fields(Component) if f.name not in ("members", "connections", "computed")]
    _check_keys(label, table, fields, ("name", "part"))
    return Component(**table)


def _tables(where: str, value: Any, key: str) -> list[dict[str, Any]]:
    """Return the value if it is a list of tables, else raise `StructureError`."""
    if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
        refuse(f"{where}: {key}", value, f"tables, written [[{key}]]")
    return value


def _check_keys(where: str, table: Any, known: Iterable[str], required: Iterable[str]) -> None:
    """Raise `StructureError` for an unknown or missing key."""
    if not isinstance(table, dict):
        refuse(where, table, "a table")
    for key in table:
        if key not in known:
            raise StructureError(f"{where} has no key {key!r}{nearest(key, known)}")
    for key in required:
        if key not in table:
            raise StructureError(f"{where} lacks the key {key!r}")


def _table(component: Component) -> dict[str, Any]:
    """Return the fields of a component that are neither `None` nor empty."""
    fields = {f.name: getattr(component, f.name) for f in dataclasses.fields(component) if f.name != "computed"}
    return {key: value for key, value in fields.items() if value not in (None, {}, ())}


def _joined(connection: Connection) -> dict[str, Any]:
    """Return the fields of a connection, factor and offset where it is transformed."""
    fields = dataclasses.asdict(connection)
    return fields if connection.is_transformed else {key: fields[key] for key in ("start", "end")}


def _value(value: Any) -> str:
    """Return a TOML value on one line; numbers keep every bit."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, Integral):
        return str(int(value))
    if isinstance(value, Real):
        return repr(float(value))
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(key)} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, Sequence):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    raise StructureError(f"{value!r} cannot be written as TOML; expected numbers, strings, lists and tables")
