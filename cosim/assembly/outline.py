"""Outline of a part: the description of its whole FMU and the dependencies of its equations, without compiling it.

    outlined(system).connectors            # every name of the system, before anything is left out
    outline_of(component).dependencies     # what each of its states and outputs depends on; None of a foreign FMU

Names are looked up in the whole system, while only what a scene needs of it is built (`prune.py`). An outline is kept
in the cache by the same hash as the FMU.
"""

import json
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

from hfsa.components._modelling.model import Kind
from hfsa.components._modelling.prune import Dependencies, dependencies
from hfsa.components._modelling.sealed import finish, is_sound
from hfsa.cosim.assembly.fmu_cache import FMI, cache_folder, cache_subfolder, fmu_file, key_of
from hfsa.cosim.assembly.level_rules import check_levels
from hfsa.cosim.assembly.models import model_of
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.description import Description, describe
from hfsa.cosim.systems.system import Component, System

_DESCRIPTION, _DEPENDENCIES = "modelDescription.xml", "dependencies.json"


@dataclass(frozen=True)
class Outline:
    """Description of a component's whole FMU, and the dependencies of its model; `None` for a foreign FMU."""

    description: Description
    dependencies: Dependencies | None


def outlined(system: System) -> Assembly:
    """Return the assembly of a system without FMU files: its descriptions give all names; errors as `build.build`.

    The file of a foreign FMU is part of it.
    """
    check_levels(system)
    descriptions = {component.name: outline_of(component).description for component in system.components}
    files = {c.name: descriptions[c.name].file for c in system.components if c.is_foreign}
    return Assembly(system, files, descriptions)


def outline_of(component: Component) -> Outline:
    """Return the outline of a component, from the cache where that holds it.

    Raises `StructureError`, `ModelError` and `ExportError` as `fmu_file`.
    """
    if component.is_foreign:
        return Outline(describe(fmu_file(component)), None)
    folder = cache_folder() / "outlines" / key_of(component)
    if not is_sound(folder):
        _write(component, folder)
    return Outline(describe(folder / _DESCRIPTION), _read(folder / _DEPENDENCIES))


def _write(component: Component, folder: Path) -> None:
    """Write the outline of a part into a folder, which appears complete or not at all."""
    from hfsa.fmus.c_code import generate
    from hfsa.fmus.model_description import model_description

    model = model_of(component)
    text = model_description(model, generate(model), FMI)
    found = dependencies(model)
    data = {"kinds": found.kinds, "needs": found.needs, "is_sampled": found.is_sampled}
    unfinished = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=cache_subfolder(folder.parent.name)))
    try:
        (unfinished / _DESCRIPTION).write_bytes(text)
        (unfinished / _DEPENDENCIES).write_text(json.dumps(data), encoding="utf-8")
        finish(unfinished, folder)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def _read(file: Path) -> Dependencies:
    """Return dependencies from a file."""
    data = json.loads(file.read_text(encoding="utf-8"))
    kinds = {name: Kind(kind) for name, kind in data["kinds"].items()}
    return Dependencies(kinds, data["needs"], data["is_sampled"])
