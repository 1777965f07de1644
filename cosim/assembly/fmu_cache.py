"""FMU files of components: exported where the cache does not hold them.

An FMU's folder in the cache is named by a hash of all it is made from, and appears complete or not at all, so that
several processes may build at once and any may be killed. Of a part that comes with hfsa that is the source of all
parts; of any other it is the text of the FMU itself, so that modules and data that the part reads count too.
"""

import contextlib
import dataclasses
import hashlib
import json
import os
import shutil
import sysconfig
import tempfile
import time
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from hfsa.components import Model, ModelError
from hfsa.components._modelling.cache import cache_folder, cache_subfolder
from hfsa.components._modelling.documents import names_file
from hfsa.components._modelling.feedback_ports import with_linear_feedback
from hfsa.components._modelling.parts import SOLVER, Part, read_arguments, read_value
from hfsa.components._modelling.sealed import finish, is_sound
from hfsa.cosim.archives.archive import Archive
from hfsa.cosim.assembly.conventions import following
from hfsa.cosim.assembly.models import AUTO, is_part, model_of, named_part, part_of
from hfsa.cosim.assembly.sources import sources
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.fmi.description import describe
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component
from hfsa.fmus._trial import death
from hfsa.fmus.c_code import generate
from hfsa.fmus.export import export, members

FMI: Literal[2, 3] = 2
"""Version of the FMUs a scene is built from; ours take derivatives of inputs in either (`fmus/README.md`)."""

_MOST_TRIED = 100_000
"""Most variables of an FMU that is tried before it is run: reading more takes the trial minutes and gigabytes."""

_HERE = ("here",)

_ABANDONED = 86400.0
"""Age [s] at which an unfinished folder in the cache is taken for one that nobody finishes."""


def fmu_file(component: Component, fmi: Literal[2, 3] = FMI, feedback: Sequence[tuple[str, str]] = ()) -> Path:
    """Return one component's FMU file: its own `.fmu`, or its part's, exported where the cache does not hold it.

    `feedback` are inputs that can be made to follow outputs, (input, output) each. A `.fmu` of another maker is first
    tried in a process of its own: `StepError` where that does not survive it.
    """
    if component.is_foreign:
        return _finished(component)
    folder = cache_folder() / "fmus" / key_of(component, fmi, feedback)
    if not is_sound(folder):
        _export(with_linear_feedback(model_of(component), feedback), fmi, folder)
    (file,) = folder.glob("*.fmu")
    return file


def fmu_with_starts(component: Component, fmi: Literal[2, 3] = FMI, platforms: Sequence[str] = _HERE) -> Path:
    """Return the FMU of a component with the component's start values in it, for tools that set none, on platforms.

    The settings of a solver are no start values of a model, and a foreign `.fmu` is as it is. Errors as of `fmu_file`.
    """
    start = {name: value for name, value in component.start.items() if not name.startswith("solver.")}
    if component.is_foreign or (not start and tuple(platforms) == _HERE):
        return fmu_file(component, fmi)
    words = json.dumps([key_of(component, fmi), sorted(start.items()), list(platforms)])
    folder = cache_folder() / "fmus" / hashlib.sha256(words.encode()).hexdigest()[:32]
    if not is_sound(folder):
        model = model_of(component)
        for name, value in start.items():
            model.set_start(name, value)
        _export(model, fmi, folder, platforms)
    (file,) = folder.glob("*.fmu")
    return file


def own_parts(scene: Scene) -> str:
    """Return a hash of the FMUs of a scene's parts that do not come with hfsa, at level `auto` those of all levels."""
    digest = hashlib.sha256()
    for component in scene.system.components:
        for member in component.members or (component,):
            part = named_part(member) if is_part(member.part) else None
            if part is not None and part.is_own:
                for level in part.levels if member.level == AUTO else (member.level,):
                    digest.update(_text(part, level, member.arguments, FMI).encode())
    return digest.hexdigest()


def _text(part: Part, level: str | None, arguments: Mapping[str, Any], fmi: Literal[2, 3]) -> str:
    """Return a hash of all that is text in the FMU of a part; at a level that cannot be built, the reason."""
    try:
        model = part.model(level, **arguments)
    except ModelError as error:
        return str(error)
    digest = hashlib.sha256()
    for name, text in sorted(members(model, generate(model), {}, fmi).items()):
        digest.update(name.encode() + b"\0" + text + b"\0")
    return digest.hexdigest()


def key_of(component: Component, fmi: Literal[2, 3] = FMI, feedback: Sequence[tuple[str, str]] = ()) -> str:
    """Return a hash of all that the FMU file of a part, or of several, depends on, what is left out of it included."""
    if component.kept is None:
        return _known_key(component, fmi, feedback)
    whole = _known_key(dataclasses.replace(component, kept=None), fmi, feedback)
    return hashlib.sha256(json.dumps([whole, component.kept]).encode()).hexdigest()[:32]


def _known_key(component: Component, fmi: Literal[2, 3], feedback: Sequence[tuple[str, str]]) -> str:
    """Return `_key`, computed once per process for what a component is made of, unless its part may have changed."""
    if _is_own(component):
        return _key(component, fmi, feedback)
    words = repr((_made_of(component), fmi, tuple(feedback), sources(), os.environ.get("CC", "")))
    if words not in _keys:
        _keys[words] = _key(component, fmi, feedback)
    return _keys[words]


_keys: dict[str, str] = {}


def _made_of(component: Component) -> tuple:
    """Return what a component's FMU is made of, as it stands in the scene."""
    inside = [(member.name, member.start.get("sample_time"), _made_of(member)) for member in component.members]
    arguments = sorted(component.arguments.items())
    if names_file(component.arguments):
        arguments = sorted(part_of(component).with_contents(component.arguments).items())
    return component.part, component.level, arguments, inside, component.connections, component.kept


def _is_own(component: Component) -> bool:
    """Whether a part of a component does not come with hfsa."""
    return any(part_of(member).is_own for member in component.members or (component,))


def _key(component: Component, fmi: Literal[2, 3], feedback: Sequence[tuple[str, str]]) -> str:
    """Return a hash of all that the FMU file depends on."""
    words = [_ingredients(component, fmi), list(feedback), fmi, sources(), version("casadi"), sysconfig.get_platform()]
    return hashlib.sha256(json.dumps([*words, os.environ.get("CC", "")]).encode()).hexdigest()[:32]


def _ingredients(component: Component, fmi: Literal[2, 3]) -> list:
    """Return in words what a component's model is made from."""
    if component.members:
        times = [member.start.get("sample_time") for member in component.members]
        inside = [[member.name, member.kept, *_ingredients(member, fmi)] for member in component.members]
        return [inside, times, list(map(str, component.connections))]
    part = part_of(component)
    assert part.build is not None
    if part.is_own:
        return [part.name, _text(part, component.level, component.arguments, fmi)]
    structural = {name: value for name, value in component.arguments.items() if part.has_argument(name)}
    if component.level is not None:
        structural["level"] = component.level
    read = read_arguments(part.name, part.build, structural)
    rest = {
        name: value if name == SOLVER else read_value(f"{part.name}: {name}", float, value)
        for name, value in component.arguments.items()
        if not part.has_argument(name)
    }
    return [part.name, repr(sorted(read.items())), repr(sorted(rest.items()))]


def _export(model: Model, fmi: Literal[2, 3], folder: Path, platforms: Sequence[str] = _HERE) -> None:
    """Export into a folder of its own and rename that: another process's result, if it came first, is as good."""
    cache_subfolder(folder.parent.name)
    for left in folder.parent.glob(".unfinished-*"):
        with contextlib.suppress(FileNotFoundError):  # its owner has just finished
            if time.time() - left.stat().st_mtime > _ABANDONED:
                shutil.rmtree(left, ignore_errors=True)
    unfinished = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=folder.parent))
    try:
        export(model, unfinished, (fmi,), platforms)
        finish(unfinished, folder)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def _finished(component: Component) -> Path:
    """Return a component's own file, which somebody else has made; errors as of `fmu_file`."""
    file = Path(component.part).resolve()
    if file.is_dir():
        raise StructureError(f"{component.name}: {file} is a folder, expected the file of an FMU")
    if not file.is_file():
        raise StructureError(f"{component.name}: there is no file {file}")
    if component.arguments or component.level:
        raise StructureError(f"{component.name}: {file.name} is a finished FMU; it takes start values, no arguments")
    count = len(describe(file).variables)  # what cannot be read is told so
    if count <= _MOST_TRIED and (ending := _death(file, file.stat().st_mtime_ns)):
        message = f"{ending}; repair or replace it, `hfsa check {file.name}` looks closer"
        raise StepError(component.name, file.name, "cannot be run", None, message)
    return file if component.conventions is None else following(file)


@cache
def _death(file: Path, modified: int) -> str | None:  # noqa: ARG001 (another file under that name is tried again)
    """Return how the process of its own that tries an FMU ended, `None` where that survived."""
    with tempfile.TemporaryDirectory(prefix="hfsa-") as folder, Archive(file, str(file), "FMU") as archive:
        archive.unpack(Path(folder), lambda name: not name.startswith(("sources/", "documentation/")))
        return death(Path(folder))
