"""From a system to its assembly: the FMU file of each component, found or exported; and the instruments of a scene.

    scene = load_scene("sdelta_shaker", {"damping": "0.02", "robot.stiffness": "ch3_rods"})
    system = instrument(scene, "reference.command.position[3]", scene.outputs)
    build(system).files                           # {"reference": .../SDeltaReference.fmi2.fmu, ...}

Here begins the roof: this room and those above it see both wings, nothing below does.
"""

import dataclasses
from collections.abc import Sequence
from typing import Literal

from hfsa.cosim.assembly.fmu_cache import FMI, fmu_file
from hfsa.cosim.assembly.isolation import isolation_library
from hfsa.cosim.assembly.level_rules import check_levels
from hfsa.cosim.assembly.transformations import with_transformations
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.description import describe
from hfsa.cosim.masters.algorithms import algorithm_named
from hfsa.cosim.systems.connectors import derivative_inputs
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import LOCK_IN, Scene
from hfsa.cosim.systems.system import Component, Connection, System


def build(system: System, fmi: Literal[2, 3] = FMI, known: Assembly | None = None) -> Assembly:
    """Return the assembly of a system, FMUs exported where the cache does not hold them.

    Connections that convert or scale a value are components of its system (`transformations.py`). Components with files
    in a `known` assembly are taken from there. Raises `StructureError` for levels that do not fit
    together, `ModelError` and `ExportError` as `fmus.export`.
    """
    check_levels(system)
    found = _found(system, fmi, known)
    transformed = with_transformations(found)
    return found if transformed is system else _found(transformed, fmi, found)


def _found(system: System, fmi: Literal[2, 3], known: Assembly | None) -> Assembly:
    """Return the assembly of a system as it is; arguments and errors as of `build`."""
    shared = [c for c in system.components if known is not None and c in known.system.components]
    shared = [c for c in shared if known is not None and c.name in known.files]
    files = {c.name: known.files[c.name] for c in shared if known is not None}
    descriptions = {c.name: known.descriptions[c.name] for c in shared if known is not None}
    for component in system.components:
        if component.name not in files:
            files[component.name] = fmu_file(component, fmi)
            descriptions[component.name] = describe(files[component.name])
    is_foreign = any(component.is_foreign for component in system.components)
    return Assembly(system, files, descriptions, isolation_library() if is_foreign else None)


def with_ports(assembly: Assembly, algorithm: str, fmi: Literal[2, 3] = FMI) -> Assembly:
    """Return the assembly whose parts have the ports that an algorithm takes; a finished `.fmu` stays without."""
    row = algorithm_named(algorithm)
    if row.ports is None:
        return assembly
    system, files = assembly.system, dict(assembly.files)
    for name, pairs in row.ports(system, assembly.connectors).items():
        if not system[name].is_foreign:
            files[name] = fmu_file(system[name], fmi, tuple(pairs))
    return Assembly.read(system, files, assembly.isolation)


def instrument(
    scene: Scene,
    excited: str,
    outputs: Sequence[str] | None = None,
    fmi: Literal[2, 3] = FMI,
    parts: Assembly | None = None,
) -> System:
    """Return the scene's system with a sine source at one input and a lock-in amplifier at outputs (full names).

    Source and amplifier take the units of what they are joined to; the amplifier samples at every step. Signal i + 1 of
    the amplifier is `outputs[i]`; all outputs of the scene by default. The sine rides on the value that the input would
    have without it: its start value, the scene's or else the FMU's own. The source's derivatives go to the inputs that
    take them (`connectors.derivative_inputs`). `parts` is the assembly of the scene's system, where there is one; it
    may be pruned, and its system is then the one that gets the instruments.
    """
    outputs = scene.outputs if outputs is None else outputs
    plain = build(scene.system, fmi) if parts is None else parts
    system = plain.system
    component, variable = system.split(excited)
    found = plain.connector(excited)
    unit = found.unit or "1"
    bias = system[component].start.get(variable, found.start)
    units = [plain.connector(name).unit or "1" for name in outputs]
    if unit not in scene.amplitude:
        known = ", ".join(scene.amplitude) or "none"
        raise StructureError(f"the scene has no amplitude for {excited} in {unit}; it has {known}")
    source = dataclasses.replace(
        scene.source,
        arguments={**scene.source.arguments, "unit": unit},
        start={"amplitude": scene.amplitude[unit], **({"offset": bias} if bias else {}), **scene.source.start},
    )
    lock_in = Component(LOCK_IN, LOCK_IN, None, {"units": units}, {"sample_time": scene.step_size})
    fed = {connection.end for connection in system.connections}
    joined = [("value", excited)]
    joined += [
        (port, f"{component}.{companion}")
        for port, companion in derivative_inputs(plain.connectors[component], variable).items()
        if f"{component}.{companion}" not in fed
    ]
    connections = [
        *(Connection(f"{source.name}.{port}", end) for port, end in joined),
        *(Connection(f"{source.name}.{port}", f"{LOCK_IN}.{port}") for port in ("sine", "cosine")),
        *(Connection(name, f"{LOCK_IN}.signal[{i}]") for i, name in enumerate(outputs, 1)),
    ]
    return System([source, *system.components, lock_in], [*system.connections, *connections])
