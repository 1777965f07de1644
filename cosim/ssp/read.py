"""A system structure package as a scene: its FMUs are the components, flattened, with what starts where.

    found = read("quarter_truck.ssp", keep)
    found.scene, found.remarks

Of a package that hfsa has written, the annotation gives back the scene: names of components, inputs with their
amplitudes, order, algorithm and all other settings; the source in it is the scene's own. Of any other package the
outputs are those of its system, else all outputs of its FMUs; step and end are what it states, else what its FMUs
state; it has no inputs, as nothing in it says how large an excitation may be.
"""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hfsa.cosim.archives.archive import read_file
from hfsa.cosim.fmi.description import describe
from hfsa.cosim.ssp.annotation import read_annotation
from hfsa.cosim.ssp.element_names import legal_names
from hfsa.cosim.ssp.experiment import Experiment
from hfsa.cosim.ssp.flatten import Flat, Join, Place, flatten
from hfsa.cosim.ssp.read_structure import Keep, read_structure
from hfsa.cosim.ssp.units import IDENTITY, Affine
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System
from hfsa.cosim.systems.transformations import transformation

STOP_TIME = 1.0
"""End of a run [s] that neither a package nor its FMUs state."""
STEPS = 1000
"""Communication steps of a run whose step nobody states."""


@dataclass(frozen=True)
class Package:
    """Scene of a package, and a sentence for each thing that the user should know about it."""

    scene: Scene
    remarks: tuple[str, ...]


def read(file: Path, keep: Keep) -> Package:
    """Return the scene of a package; `keep` keeps its FMUs.

    `StructureError`, with document and line, for what is no SSP that can be simulated.
    """
    structure = read_structure(read_file(file), str(file), keep)
    experiment = structure.experiment
    if experiment.start_time != 0:
        raise StructureError(f"{file} starts at {experiment.start_time:g} s, expected 0 s, where scenes start")
    flat = flatten(structure.system)
    settings: dict[str, Any] = {}
    known: dict[str, str] = {}
    if experiment.ours is not None:
        settings, known = read_annotation(experiment.ours, f"{file}: annotation")
    names = _names(flat, known)
    try:
        system = _system(flat, names, list(known.values()))
        if settings:
            scene = _with_own_source(system, settings)
            remarks = []
        else:
            scene, remarks = _scene(system, flat, names, experiment)
    except StructureError as error:
        raise StructureError(f"{file}: {error}") from None
    remarks += [
        f"element {'.'.join(path)} is the component {name}"
        for path, name in names.items()
        if _is_new(path, name, known)
    ]
    if experiment.foreign:
        remarks.append(f"annotations of {', '.join(experiment.foreign)} are ignored")
    if flat.unused:
        remarks.append(f"parameters that name nothing are ignored: {', '.join(flat.unused)}")
    return Package(scene, tuple(f"{file}: {remark}" for remark in remarks))


def _names(flat: Flat, known: dict[str, str]) -> dict[tuple[str, ...], str]:
    """Return the name of each component: that of the annotation, else one that is legal and free."""
    full = {path: ".".join(path) for path in flat.parts}
    legal = legal_names([*known.values(), *(name for name in full.values() if name not in known)])
    return {path: known.get(name, legal.get(name, name)) for path, name in full.items()}


def _is_new(path: tuple[str, ...], name: str, known: dict[str, str]) -> bool:
    """Whether a component has a name that neither its element nor the annotation gives."""
    return ".".join(path) != name and ".".join(path) not in known


def _system(flat: Flat, names: dict[tuple[str, ...], str], order: list[str]) -> System:
    """Return the system, components in an order of names, and those that it does not have behind."""
    components = {
        names[path]: Component(names[path], str(part.file), start=flat.starts[path])
        for path, part in flat.parts.items()
    }
    first = [name for name in order if name in components]
    rest = [name for name in components if name not in first]
    connections = [_connection(join, flat, names) for join in flat.joins]
    return System([components[name] for name in (*first, *rest)], connections)


def _connection(join: Join, flat: Flat, names: dict[tuple[str, ...], str]) -> Connection:
    """Return a connection between two components, with factor and offset where its units alone do not give them."""
    start, end = (f"{names[place[0]]}.{place[1]}" for place in (join.start, join.end))
    plain = Connection(start, end)
    ends = (describe(flat.parts[path].file).variables[name] for path, name in (join.start, join.end))
    try:
        usual = transformation(plain, *ends)
    except StructureError:  # without a factor, the units would not fit
        usual = None
    does = IDENTITY if usual is None else Affine(usual.factor, usual.offset)
    if join.map.is_like(does):
        return plain
    if join.map == IDENTITY:
        raise StructureError(
            f"{join.place}: {plain} is not converted by suppressUnitConversion, although the units differ; expected a "
            "LinearTransformation beside it"
        )
    return Connection(start, end, join.map.factor, join.map.offset)


def _with_own_source(system: System, settings: dict[str, Any]) -> Scene:
    """Return the scene of an annotation; the source among its components is taken out, with its values."""
    source: Component | None = settings.get("source")
    if source is None or all(component.name != source.name for component in system.components):
        return Scene(system, **settings)
    packed = system[source.name]
    start = {**source.start, **packed.start}
    amplitude, value = start.pop("amplitude", None), describe(Path(packed.part)).variables.get("value")
    if amplitude is not None and value is not None:
        settings = {**settings, "amplitude": {**settings.get("amplitude", {}), value.unit or "1": amplitude}}
    rest = System(
        [component for component in system.components if component is not packed],
        [c for c in system.connections if system.split(c.start)[0] != source.name],
    )
    return Scene(rest, **{**settings, "source": dataclasses.replace(source, start=start)})


def _scene(
    system: System, flat: Flat, names: dict[tuple[str, ...], str], experiment: Experiment
) -> tuple[Scene, list[str]]:
    """Return the scene of a package of another tool, and what is assumed of it."""
    remarks = []
    descriptions = [describe(Path(component.part)) for component in system.components]
    stop = experiment.stop_time or max((d.stop_time for d in descriptions if d.stop_time), default=None)
    if stop is None:
        stop = STOP_TIME
        remarks.append(f"nothing says how long to run; the end is at {stop:g} s, which --stop changes")
    step = experiment.step_size or min((d.step_size for d in descriptions if d.step_size), default=None)
    if step is None:
        step = stop / STEPS
        remarks.append(f"nothing says how to step; the communication step is {step:g} s, which --step changes")
    full = [_full(place, names) for place in flat.outputs]
    outputs = full or [
        f"{component.name}.{v.name}"
        for component, description in zip(system.components, descriptions, strict=True)
        for v in description.variables.values()
        if v.causality == "output" and v.is_real
    ]
    return Scene(system, inputs=(), outputs=list(dict.fromkeys(outputs)), step_size=step, stop_time=stop), remarks


def _full(place: Place, names: dict[tuple[str, ...], str]) -> str:
    """Return the full name of a variable."""
    path, variable = place
    return f"{names[path]}.{variable}"
