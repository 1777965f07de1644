"""From names to FMU files: scenes and parts found by name, exported, kept in a cache, and wired to the instruments.

    scene = load_scene("sdelta_shaker", {"damping": "0.02", "robot.stiffness": "ch3_rods"})
    system = instrument(scene, "reference.command.position[3]", scene.outputs)
    files = build(system)                         # {"reference": .../SDeltaReference.fmi2.fmu, ...}

This is the roof: beside `cli.py` the only place that sees both wings. The cache is `$HFSA_CACHE`, else `hfsa` in
`$XDG_CACHE_HOME` or `~/.cache`. An FMU's folder there is named by a hash of all it is made from, and appears complete
or not at all, so that several processes may build at once and any may be killed.
"""

import contextlib
import dataclasses
import hashlib
import importlib.util
import json
import os
import shutil
import sysconfig
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

import numpy as np

import hfsa.components
import hfsa.controllers
import hfsa.cosim.scenes
import hfsa.fmus
from hfsa.components._compose import compose
from hfsa.components._feedback_ports import with_linear_feedback
from hfsa.components._model import Model
from hfsa.components._parts import SOLVER, Part, find, part_named, read_arguments
from hfsa.cosim._feedback_loops import ALGORITHM as LINEARIZED_FEEDBACK
from hfsa.cosim._feedback_loops import feedback_loops
from hfsa.cosim._fmi.description import describe
from hfsa.cosim._scene_text import read_scene
from hfsa.cosim.instance import StepError
from hfsa.cosim.system import (
    DERIVATIVES,
    Analysis,
    Component,
    Connection,
    Scene,
    StructureError,
    System,
    companions,
    connector,
    expand,
    nearest,
)
from hfsa.fmus._trial import death
from hfsa.fmus.export import export

FMI: Literal[2, 3] = 2
"""Version of the FMUs a scene is built from; ours take derivatives of inputs in either (`fmus/README.md`)."""

LOCK_IN = "lock_in"
"""Name of the lock-in amplifier among an instrumented system's components."""

AUTO = "auto"
"""The level of a component that is to be chosen by the scene's tolerance (`levels.py`)."""

_ABANDONED = 86400.0
"""Age [s] at which an unfinished folder in the cache is taken for one that nobody finishes."""


@dataclass(frozen=True)
class Rule:
    """A part at a level whose inputs that begin with `inputs` only the parts (at levels) of `allowed` may feed."""

    part: str
    level: str
    inputs: str
    allowed: Mapping[str, tuple[str, ...] | None]
    reason: str


RULES = (
    Rule(
        "sdelta",
        "rigid",
        "drive[",
        {"sdelta_reference": None, "c_drive": ("ideal",)},
        "it puts out its static reaction only, because a held inertial reaction diverges at every step",
    ),
)
"""Levels that do not fit together although their connectors do."""


@cache
def parts() -> dict[str, Part]:
    """Return all components and controllers by name."""
    return find([hfsa.components, hfsa.controllers])


@cache
def scenes() -> dict[str, Part]:
    """Return the scenes of `cosim/scenes` by name; their `build` returns a `Scene`."""
    return find([hfsa.cosim.scenes])


def load_scene(name: str, arguments: Mapping[str, Any] | None = None) -> Scene:
    """Return a scene by name, or from the path of a `.py` or `.toml` file.

    `arguments` are the scene's own, or `component.argument`: a level, a structural argument, or a start value. Values
    may be text as typed on a command line. `StructureError` names what does not exist, and the nearest names.
    """
    arguments = dict(arguments or {})
    if name.endswith(".toml"):
        if not Path(name).is_file():
            raise StructureError(f"there is no file {name}")
        scene, own = read_scene(Path(name)), []
    else:
        part = _scene_part(name)
        given = {key: arguments.pop(key) for key in list(arguments) if key in part.arguments}
        assert part.build is not None
        scene, own = part.build(**read_arguments(part.name, part.build, given)), list(part.arguments)
    assert isinstance(scene, Scene)
    scene = _analyzed(scene)
    for key, value in arguments.items():
        component, dot, argument = key.partition(".")
        known = [c.name for c in scene.system.components]
        if not dot or component not in [*known, scene.source.name]:
            names = [*own, *(f"{c}.{key.rpartition('.')[2]}" for c in known)]
            raise StructureError(f"scene {name} has no argument {key!r}{nearest(key, names)}")
        scene = _with_argument(scene, component, argument, value)
    return scene


def build(system: System, fmi: Literal[2, 3] = FMI) -> dict[str, Path]:
    """Return the FMU file of each component by name, exported where the cache does not hold it.

    Raises `StructureError` for levels that do not fit together, `ModelError` and `ExportError` as `fmus.export`.
    """
    check_levels(system)
    return {component.name: fmu_file(component, fmi) for component in system.components}


def instrument(scene: Scene, excited: str, outputs: Sequence[str] | None = None, fmi: Literal[2, 3] = FMI) -> System:
    """Return the scene's system with a sine source at one input and a lock-in amplifier at outputs (full names).

    Source and amplifier take the units of what they are joined to; the amplifier samples at every step. Signal i + 1 of
    the amplifier is `outputs[i]`; all outputs of the scene by default. The sine rides on the value that the input would
    have without it: its start value, the scene's or else the FMU's own. The source's derivatives go to the
    input's companions where the FMU has them.
    """
    outputs = scene.outputs if outputs is None else outputs
    variables = {name: describe(file).variables for name, file in build(scene.system, fmi).items()}
    component, variable = scene.system.split(excited)
    found = connector(scene.system, variables, excited)
    unit = found.unit or "1"
    bias = scene.system[component].start.get(variable, found.start)
    units = [connector(scene.system, variables, name).unit or "1" for name in outputs]
    if unit not in scene.amplitude:
        raise StructureError(f"the scene has no amplitude for {excited} in {unit}; it has {_list(scene.amplitude)}")
    source = dataclasses.replace(
        scene.source,
        arguments={**scene.source.arguments, "unit": unit},
        start={"amplitude": scene.amplitude[unit], **({"offset": bias} if bias else {}), **scene.source.start},
    )
    lock_in = Component(LOCK_IN, "lock_in", None, {"units": units}, {"sample_time": scene.step_size})
    fed = {connection.end for connection in scene.system.connections}
    joined = [("value", excited)]
    joined += [
        (port, f"{component}.{companion}")
        for port, companion in zip(DERIVATIVES, companions(variable), strict=True)
        if companion in variables[component] and f"{component}.{companion}" not in fed
    ]
    connections = [
        *(Connection(f"{source.name}.{port}", end) for port, end in joined),
        *(Connection(f"{source.name}.{port}", f"{LOCK_IN}.{port}") for port in ("sine", "cosine")),
        *(Connection(name, f"{LOCK_IN}.signal[{i}]") for i, name in enumerate(outputs, 1)),
    ]
    return System([source, *scene.system.components, lock_in], [*scene.system.connections, *connections])


def files_for(system: System, algorithm: str, fmi: Literal[2, 3] = FMI) -> dict[str, Path]:
    """Return the FMU files of `build` as an algorithm takes them.

    For `linearized_feedback` parts on its loops have ports for it; a finished `.fmu` stays without.
    """
    files = build(system, fmi)
    if algorithm != LINEARIZED_FEEDBACK:
        return files
    loops = feedback_loops(system, {name: describe(file).variables for name, file in files.items()})
    for name in {loop.plant for loop in loops}:
        if not system[name].part.endswith(".fmu"):
            pairs = dict.fromkeys((loop.input, loop.output) for loop in loops if loop.plant == name)
            files[name] = fmu_file(system[name], fmi, tuple(pairs))
    return files


def fmu_file(component: Component, fmi: Literal[2, 3] = FMI, feedback: Sequence[tuple[str, str]] = ()) -> Path:
    """Return one component's FMU file: its own `.fmu`, or its part's, exported where the cache does not hold it.

    `feedback` are inputs that can be made to follow outputs, (input, output) each. A `.fmu` of another maker is first
    tried in a process of its own: `StepError` where that does not survive it.
    """
    if component.part.endswith(".fmu"):
        file = Path(component.part).resolve()
        if not file.is_file():
            raise StructureError(f"{component.name}: there is no file {file}")
        if component.arguments or component.level:
            raise StructureError(
                f"{component.name}: {file.name} is a finished FMU; it takes start values, no arguments"
            )
        describe(file)  # what cannot be read is told so
        if ending := _death(file, file.stat().st_mtime_ns):
            message = f"{ending}; repair or replace it, `hfsa check {file.name}` looks closer"
            raise StepError(component.name, file.name, "cannot be run", None, message)
        return file
    folder = cache_folder() / "fmus" / _key(component, fmi, feedback)
    if not folder.is_dir():
        _export(with_linear_feedback(model_of(component), feedback), fmi, folder)
    (file,) = folder.glob("*.fmu")
    return file


def model_of(component: Component) -> Model:
    """Return the model of a component: its part's, or those of its members as one, named after them."""
    if component.members:
        members = {member.name: model_of(member) for member in component.members}
        for member in component.members:
            if "sample_time" in member.start and "sample_time" in members[member.name]:
                members[member.name].set_start("sample_time", member.start["sample_time"])
        name = "".join(dict.fromkeys(model.name for model in members.values()))
        return compose(name, members, [(c.start, c.end) for c in component.connections])
    return _part_of(component).model(component.level, **component.arguments)


def check_levels(system: System) -> None:
    """Raise `StructureError` where `RULES` forbid that two components are joined, also within one FMU."""
    inside = [connection for whole in system.components for connection in whole.connections]
    between = [Connection(*map(system.own_name, (c.start, c.end))) for c in system.connections]
    system = System([part for whole in system.components for part in whole.members or (whole,)], [*inside, *between])
    for connection in system.connections:
        (target, variable), (source, _) = system.split(connection.end), system.split(connection.start)
        for rule in RULES:
            if system[target].part != rule.part or _level(system[target]) != rule.level:
                continue
            part, level = system[source].part, _level(system[source])
            levels = rule.allowed.get(part, ())
            if variable.startswith(rule.inputs) and not (levels is None or level in levels):
                allowed = (f"{p} ({' or '.join(ls)})" if ls else p for p, ls in rule.allowed.items())
                raise StructureError(
                    f"{connection}: {target} is {rule.part} at level {rule.level}, which may be joined to "
                    f"{' or '.join(allowed)} only: {rule.reason}. {source} is {part} at level {level or 'none'}"
                )


def cache_folder() -> Path:
    """Return the folder of the cache; it may not exist yet."""
    own = os.environ.get("HFSA_CACHE")
    return Path(own) if own else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "hfsa"


def _scene_part(name: str) -> Part:
    if not name.endswith(".py"):
        if name not in scenes():
            raise StructureError(f"no scene is called {name!r}{nearest(name, scenes())}")
        return scenes()[name]
    file = Path(name)
    specification = importlib.util.spec_from_file_location(file.stem, file)
    if specification is None or specification.loader is None or not file.is_file():
        raise StructureError(f"there is no file {name}")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    function = getattr(module, file.stem, None)
    if function is None:
        raise StructureError(f"{name} defines no function {file.stem}; a scene is a function named as its file")
    return Part(file.stem, module, function, None)


def _with_argument(scene: Scene, name: str, argument: str, value: Any) -> Scene:
    """Return the scene with one level, structural argument or start value of a component changed."""
    component = scene.source if name == scene.source.name else scene.system[name]
    part = None if component.part.endswith(".fmu") else part_named(component.part, parts())
    if argument == "level":
        changed = dataclasses.replace(component, level=value)
    elif part is not None and argument in (*part.arguments, SOLVER):
        changed = dataclasses.replace(component, arguments={**component.arguments, argument: value})
    else:
        start = {**component.start, argument: _start_value(component, part, argument, value)}
        changed = dataclasses.replace(component, start=start)
    if component is scene.source:
        return dataclasses.replace(scene, source=changed)
    components = [changed if c is component else c for c in scene.system.components]
    return dataclasses.replace(scene, system=dataclasses.replace(scene.system, components=components))


def _start_value(component: Component, part: Part | None, argument: str, value: Any) -> float:
    """Return a start value that fits the variables `argument` stands for; errors name what is known, and the bounds."""
    model = None if part is None else _model_with(part, component, argument)
    known = describe(fmu_file(component)).variables if model is None else [quantity.name for quantity in model]
    for member in expand(argument):
        if member not in known:
            names = [*known, *(part.arguments if part else ())]
            raise StructureError(f"{component.name} has no argument {member!r}{nearest(member, names)}")
    try:
        number = float(value)
    except ValueError:
        raise StructureError(f"{component.name}.{argument} is {value!r}, expected a number") from None
    if model is not None:
        for member in expand(argument):
            model.set_start(member, number)
    return number


def _model_with(part: Part, component: Component, argument: str) -> Model:
    """Return the component's model; at level auto the highest that knows a variable, else the highest of all."""
    if component.level != AUTO:
        return part.model(component.level, **component.arguments)
    models = [part.model(level, **component.arguments) for level in reversed(part.levels)]
    names = set(expand(argument))
    return next((model for model in models if names <= {quantity.name for quantity in model}), models[0])


def _analyzed(scene: Scene) -> Scene:
    """Return the scene with numbers for the start values that are to come from analyses."""

    def numbers(component: Component) -> Component:
        """The component with each `Analysis` among its start values worked out."""
        start: dict[str, Any] = {}
        for name, value in component.start.items():
            start[name] = _analysis(value) if isinstance(value, Analysis) else value
        return dataclasses.replace(component, start=start)

    components = [numbers(component) for component in scene.system.components]
    return dataclasses.replace(scene, system=dataclasses.replace(scene.system, components=components))


def _analysis(wanted: Analysis) -> float | list[float]:
    """Return the number, or the list of numbers, that an analysis gives for a key."""
    result = part_named(wanted.part, parts()).analysis(**wanted.arguments)
    name, _, members = wanted.key.partition("[")
    if name not in result:
        raise StructureError(f"the analysis of {wanted.part} has no result {name!r}{nearest(name, result)}")
    values = np.asarray(result[name], dtype=float)
    if members:
        low, _, high = members.removesuffix("]").partition("..")
        values = values[int(low) - 1 : int(high or low)]
    return values.tolist()


def _level(component: Component) -> str | None:
    """Return the component's level, its part's default where it names none, `None` where the part has no levels."""
    if component.part.endswith(".fmu"):
        return None
    default = part_named(component.part, parts()).arguments.get("level")
    return component.level or component.arguments.get("level") or (default.default if default else None)


def _key(component: Component, fmi: int, feedback: Sequence[tuple[str, str]]) -> str:
    """Return a hash of all that the FMU file depends on."""
    words = [_ingredients(component), list(feedback), fmi, sources(), version("casadi"), sysconfig.get_platform()]
    return hashlib.sha256(json.dumps([*words, os.environ.get("CC", "")]).encode()).hexdigest()[:32]


def _ingredients(component: Component) -> list:
    """Return in words what a component's model is made from."""
    if component.members:
        times = [member.start.get("sample_time") for member in component.members]
        members = [[member.name, *_ingredients(member)] for member in component.members]
        return [members, times, list(map(str, component.connections))]
    part = _part_of(component)
    assert part.build is not None
    structural = {name: value for name, value in component.arguments.items() if name in part.arguments}
    if component.level is not None:
        structural["level"] = component.level
    read = read_arguments(part.name, part.build, structural)
    rest = {name: value for name, value in component.arguments.items() if name not in part.arguments}
    rest = {name: value if name == SOLVER else float(value) for name, value in rest.items()}
    return [part.name, repr(sorted(read.items())), repr(sorted(rest.items()))]


def _part_of(component: Component) -> Part:
    """Return a component's part; `StructureError` where its level is still to be chosen."""
    part = part_named(component.part, parts())
    if component.level == AUTO:
        raise StructureError(
            f"{component.name}: level auto is a scene's question, and there is no FMU of it; name one of "
            f"{_list(part.levels)}"
        )
    return part


@cache
def _death(file: Path, modified: int) -> str | None:  # noqa: ARG001 (another file under that name is tried again)
    return death(file)


@cache
def sources() -> str:
    """Return a hash of the sources of the left wing."""
    digest = hashlib.sha256()
    for package in (hfsa.components, hfsa.controllers, hfsa.fmus):
        for file in sorted(_files(package)):
            digest.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()


def _files(package: ModuleType) -> list[Path]:
    folders = [Path(folder) for folder in package.__path__]
    return [f for folder in folders for f in folder.rglob("*") if f.suffix in (".py", ".c", ".h")]


def _export(model: Model, fmi: Literal[2, 3], folder: Path) -> None:
    """Export into a folder of its own and rename that: another process's result, if it came first, is as good."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    for left in folder.parent.glob(".unfinished-*"):
        with contextlib.suppress(FileNotFoundError):  # its owner has just finished
            if time.time() - left.stat().st_mtime > _ABANDONED:
                shutil.rmtree(left, ignore_errors=True)
    unfinished = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=folder.parent))
    try:
        export(model, unfinished, (fmi,))
        unfinished.rename(folder)
    except OSError:
        if not folder.is_dir():
            raise
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def _list(names) -> str:
    return ", ".join(names) or "none"
