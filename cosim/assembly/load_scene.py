"""Scenes by name or from a file, with arguments as typed on a command line.

Names and paths of parts count from the scene's file: `./spring.py` and `Cart.fmu` lie in its folder, and `spring` is
the part of that file if there is one. A bare name that is also that of another part is an error. So do the documents
that arguments name there; those typed as arguments count from the working folder. A loaded scene holds their content.
"""

import dataclasses
import math
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

import hfsa.cosim.scenes
from hfsa.components import Model, ModelError
from hfsa.components._modelling.catalogue import Catalogue, find, hint, part_named
from hfsa.components._modelling.documents import names_file
from hfsa.components._modelling.loading import is_path, kind_of, returned, shown
from hfsa.components._modelling.model import Kind
from hfsa.components._modelling.parts import SOLVER, Part, own_part, read_arguments
from hfsa.cosim.assembly.default_experiment import proposed
from hfsa.cosim.assembly.fmu_cache import fmu_file
from hfsa.cosim.assembly.models import AUTO, available_parts, named_part
from hfsa.cosim.assembly.packages import PACKAGE, package_of
from hfsa.cosim.fmi.description import describe
from hfsa.cosim.masters.algorithms import check_algorithm
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.kinds import refuse, table, text
from hfsa.cosim.systems.names import compact, expand, nearest
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.scene_file import read_scene
from hfsa.cosim.systems.system import Analysis, Component

T = TypeVar("T", Component, Analysis)

DOCUMENT = ".toml"
"""Ending of a scene that is a document."""

FILES = (DOCUMENT, PACKAGE)
"""Endings of files that are scenes whatever they hold; a `.py` file may also be a part."""

_OF_COMPONENT = re.compile(r"^([A-Za-z_]\w*(?:\[[\d.]+\])?)\.(.+)$")


@cache
def available_scenes() -> Catalogue:
    """Return the scenes by name, of `cosim/scenes` and of installed packages (`hfsa.scenes`)."""
    return find([hfsa.cosim.scenes], "hfsa.scenes", "scene")


def load_scene(name: str | Path, arguments: Mapping[str, Any] | None = None) -> Scene:
    """Return a scene by name, or from the path of a `.py`, `.toml` or `.ssp` file.

    `arguments` are the scene's own, or `component.argument`: a level, a structural argument, or a start value, of one
    component or of a range of them, `stack[1..3].maximum.force`. A level counts as the scene's argument of the
    component's name where there is one, so that others follow. Values may be text as typed on a command line.
    `StructureError` names what does not exist, and the nearest names.
    """
    name = text("a scene", str(name) if isinstance(name, Path) else name, "the name or path of a scene")
    arguments = dict(_checked(arguments))
    if name.endswith(PACKAGE):
        scene, own = package_of(name).scene, []
    elif name.endswith(DOCUMENT):
        if not Path(name).is_file():
            raise StructureError(f"there is no file {name}")
        scene, own = located(read_scene(Path(name), proposed), Path(name)), []
    else:
        part = scene_part(name)
        given = {key: arguments.pop(key) for key in list(arguments) if part.has_argument(key)}
        scene, own = written(part, given), list(part.arguments)
        of_levels = {name: arguments.pop(f"{name}.level") for name in _leveled(part, arguments, given)}
        if of_levels:
            scene = written(part, {**given, **of_levels})
    scene = _with_parameters(_analyzed(scene), arguments, own, f"scene {name}")
    check_algorithm(scene.algorithm)
    return scene


def _leveled(part: Part, arguments: Mapping[str, Any], given: Mapping[str, Any]) -> list[str]:
    """Return the components whose `level` among `arguments` is a value of the scene's argument of their name.

    The scene then takes it as that argument, and what follows from the level in other components follows.
    """
    return [
        name
        for name, argument in part.arguments.items()
        if name not in given and arguments.get(f"{name}.level") in argument.values
    ]


def with_arguments(scene: Scene, arguments: Mapping[str, Any] | None = None) -> Scene:
    """Return a scene with arguments `component.argument` of its components, as `load_scene`; errors likewise.

    Paths of its parts count from the working folder.
    """
    scene = located(scene, None)
    scene = _with_parameters(_analyzed(scene), _checked(arguments), [], "the scene")
    check_algorithm(scene.algorithm)
    return scene


def _checked(arguments: Mapping[str, Any] | None) -> Mapping[str, Any]:
    """Return arguments of a scene; `StructureError` for what is no mapping by name."""
    return table("the arguments of a scene", {} if arguments is None else arguments, "a table of values by name")


def _with_parameters(scene: Scene, arguments: Mapping[str, Any], own: Sequence[str], words: str) -> Scene:
    """Return the scene with arguments of its components; `own` are the scene's, `words` name it in errors."""
    for key, value in arguments.items():
        components, argument = _split(key)
        known = [*(c.name for c in scene.system.components), scene.source.name]
        if not any(component in known for component in components):
            raise StructureError(f"{words} has no argument {key!r}{_instead(scene, own, key)}")
        for component in components:
            if component not in known:
                raise StructureError(f"{words} has no argument {key!r}: no component is called {component!r}")
            scene = _with_argument(scene, component, argument, value)
    return scene


def written(part: Part, arguments: Mapping[str, Any]) -> Scene:
    """Return a scene as its function writes it, with analyses where start values are to come from them."""
    assert part.build is not None
    found = part.build(**read_arguments(part.name, part.build, arguments))
    scene = returned(part.build, Scene, found, StructureError)
    return located(scene, Path(part.module.__file__ or "")) if part.is_own else _read(scene, None)


def located(scene: Scene, file: Path | None) -> Scene:
    """Return a scene whose parts have absolute paths, or the names of parts that are not in the folder of its file.

    Arguments hold the content of documents instead of their paths. Without a file, paths count from the working folder.
    `StructureError` for a bare name that is that of a part in the folder and of another.
    """
    found = _each(scene, lambda item: dataclasses.replace(item, part=_located(item.part, file)))
    return _read(found, None if file is None else file.parent)


def _read(scene: Scene, folder: Path | None) -> Scene:
    """Return a scene with the content of documents among its arguments; their paths count from `folder`."""

    def of(item: T) -> T:
        """The component or analysis with its arguments."""
        if item.part.endswith(".fmu") or not names_file(item.arguments):
            return item
        part = part_named(item.part, available_parts())
        return dataclasses.replace(item, arguments=part.with_contents(item.arguments, folder))

    return _each(scene, of)


def _each(scene: Scene, of: Callable[[Any], Any]) -> Scene:
    """Return a scene with other components, and analyses among their start values, as `of` returns them."""

    def whole(component: Component) -> Component:
        """The component with its analyses."""
        start = {name: of(value) if isinstance(value, Analysis) else value for name, value in component.start.items()}
        return of(dataclasses.replace(component, start=start))

    system = dataclasses.replace(scene.system, components=[whole(component) for component in scene.system.components])
    return dataclasses.replace(scene, system=system, source=whole(scene.source))


def _located(part: str, scene: Path | None) -> str:
    """Return the name or the absolute path of a part that a scene's file names."""
    folder = Path() if scene is None else scene.parent
    if part.endswith(".fmu") and scene is not None:
        return str((folder / part).resolve())
    if part.endswith(".fmu") or scene is None or is_path(part):
        return str((folder / part).resolve()) if is_path(part) else part
    file = (folder / f"{part}.py").resolve()
    if not file.is_file() or file == scene.resolve() or kind_of(file) != "part":
        return part
    if part not in available_parts():
        return str(file)
    other = available_parts().file_of(part)
    if other is not None and other.resolve() == file:
        return part
    raise StructureError(
        f"{shown(scene)}: {part} is the name of {shown(file)} and of {other}; rename the file, or write ./{part}.py"
    )


def _split(key: str) -> tuple[list[str], str]:
    """Return the components and the argument that a typed name means; none where it names no component's."""
    match = _OF_COMPONENT.match(key)
    return (expand(match[1]), match[2]) if match else ([], "")


def _instead(scene: Scene, own: Sequence[str], key: str) -> str:
    """Return what works in the place of an argument that a scene does not have, or the names most like it."""
    everyone = [*scene.system.components, scene.source]

    def of_parts(argument: str) -> list[str]:
        """Full names of an argument that components have."""
        return compact(f"{component.name}.{argument}" for component in everyone if _has_argument(component, argument))

    if own_of_parts := of_parts(key):
        return f", but components have it: -p {', -p '.join(f'{known}=VALUE' for known in own_of_parts)}"
    return nearest(key, [*own, *(of_parts(_split(key)[1]) if _split(key)[1] else ())])


def _has_argument(component: Component, argument: str) -> bool:
    """Whether a part of ours has a level, an argument or a variable with a start value of this name."""
    if component.is_foreign:
        return False
    part = named_part(component)
    if part.has_argument(argument) or argument == SOLVER:
        return True
    try:
        model = _model_with(part, component, argument)
    except ModelError:
        return False
    settable = {quantity.name for quantity in model if quantity.kind not in (Kind.OUTPUT, Kind.SAMPLED_OUTPUT)}
    return set(expand(argument)) <= settable


def scene_part(name: str) -> Part:
    """Return the scene of a name, or that of a Python file or of a folder's, whose function is named as the file."""
    if not is_path(name):
        if name not in available_scenes():
            raise StructureError(f"no scene is called {name!r}{hint(name, available_scenes())}")
        return available_scenes()[name]
    try:
        return own_part(name, "scene")
    except ModelError as error:
        raise StructureError(str(error)) from error.__cause__ or error


def _with_argument(scene: Scene, name: str, argument: str, value: Any) -> Scene:
    """Return the scene with one level, structural argument or start value of a component changed."""
    component = scene.source if name == scene.source.name else scene.system[name]
    part = None if component.is_foreign else named_part(component)
    if argument == "level":
        changed = dataclasses.replace(component, level=value)
    elif argument in component.start:
        changed = _with_start(component, part, argument, value)
    elif part is not None and (part.has_argument(argument) or argument == SOLVER):
        changed = _without_replaced(component, part, {**component.arguments, **part.with_contents({argument: value})})
    else:
        changed = _with_start(component, part, argument, value)
    if component is scene.source:
        return dataclasses.replace(scene, source=changed)
    components = [changed if c is component else c for c in scene.system.components]
    return dataclasses.replace(scene, system=dataclasses.replace(scene.system, components=components))


def _with_start(component: Component, part: Part | None, argument: str, value: Any) -> Component:
    """Return a component with another start value."""
    start = {**component.start, argument: _start_value(component, part, argument, value)}
    computed = {member: of for member, of in component.computed.items() if member not in expand(argument)}
    return dataclasses.replace(component, start=start, computed=computed)


def _without_replaced(component: Component, part: Part, arguments: Mapping[str, Any]) -> Component:
    """Return a component with other structural arguments.

    They replace start values that the scene has computed, where the model's own follow from them.
    """
    changed = dataclasses.replace(component, arguments=arguments)
    if not component.computed:
        return changed
    before, after = (_own_starts(part, component, values) for values in (component.arguments, arguments))
    replaced = {name for name in component.computed if before.get(name) != after.get(name)}
    return dataclasses.replace(
        changed,
        start={name: value for name, value in component.start.items() if name not in replaced},
        computed={name: of for name, of in component.computed.items() if name not in replaced},
    )


def _own_starts(part: Part, component: Component, arguments: Mapping[str, Any]) -> dict[str, float]:
    """Return the start values of a component's model itself; none where it cannot be built, as the build will tell."""
    try:
        level = None if component.level == AUTO else component.level
        return {quantity.name: quantity.start for quantity in part.model(level, **arguments).of(Kind.PARAMETER)}
    except ModelError:
        return {}


def _start_value(component: Component, part: Part | None, argument: str, value: Any) -> Any:
    """Return a start value that fits the variables `argument` stands for; errors name what is known, and the bounds."""
    model = None if part is None else _model_with(part, component, argument)
    variables = describe(fmu_file(component)).variables if model is None else {}
    known = variables if model is None else [quantity.name for quantity in model]
    for member in expand(argument):
        if member not in known:
            names = [*known, *(part.arguments if part else ())]
            raise StructureError(f"{component.name} has no argument {member!r}{nearest(member, names)}")
    if (
        model is None
        and (typed := _of_type({variables[member].type for member in expand(argument)}, value)) is not None
    ):
        return typed
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if math.isnan(number):
        refuse(f"{component.name}.{argument}", value, "a number")
    if model is not None:
        for member in expand(argument):
            model.set_start(member, number)
    return number


def _of_type(types: set[str], value: Any) -> Any:
    """Return a start value of a string or Boolean variable of a foreign FMU; `None` for any other variable."""
    if types == {"String"}:
        return str(value)
    if types == {"Boolean"} and value in ("true", "false", True, False):
        return value in ("true", True)
    return None


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
        analyses = {name: value for name, value in component.start.items() if isinstance(value, Analysis)}
        start = {**component.start, **{name: analysis_value(value) for name, value in analyses.items()}}
        computed = {member: value for name, value in analyses.items() for member in expand(name)}
        return dataclasses.replace(component, start=start, computed=computed)

    components = [numbers(component) for component in scene.system.components]
    return dataclasses.replace(scene, system=dataclasses.replace(scene.system, components=components))


def analysis_value(wanted: Analysis) -> float | list[float]:
    """Return the number, or the list of numbers, that an analysis gives for a key."""
    result = part_named(wanted.part, available_parts()).analysis(**wanted.arguments)
    name, _, members = wanted.key.partition("[")
    if name not in result:
        raise StructureError(f"the analysis of {wanted.part} has no result {name!r}{nearest(name, result)}")
    try:
        values = np.asarray(result[name], dtype=float)
    except (TypeError, ValueError):
        refuse(f"the result {name} of the analysis of {wanted.part}", result[name], "numbers")
    if members:
        if values.ndim == 0:
            refuse(f"the result {name} of the analysis of {wanted.part}", result[name], f"a list for {wanted.key}")
        low, _, high = members.removesuffix("]").partition("..")
        values = values[int(low) - 1 : int(high or low)]
    return values.tolist()
