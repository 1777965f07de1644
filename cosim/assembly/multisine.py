"""Instruments of a multisine sweep: a source of many lines at each excited input, and a sampler at the outputs.

system = with_multisine(scene, ["reference.command.position[3]"], scene.outputs, lines=40, parts=assembly)
source_names(scene, 2)                        # ("source[1]", "source[2]"), those of two inputs together
"""

from collections.abc import Sequence

from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.systems.connectors import derivative_inputs
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import MULTISINE_SOURCE, SAMPLER, SINE_SOURCE, Scene
from hfsa.cosim.systems.system import Component, Connection, System


def source_names(scene: Scene, inputs: int) -> tuple[str, ...]:
    """Return the names of the source components of inputs that are excited together."""
    name = scene.source.name
    return (name,) if inputs == 1 else tuple(f"{name}[{i}]" for i in range(1, inputs + 1))


def with_multisine(scene: Scene, excited: Sequence[str], outputs: Sequence[str], lines: int, parts: Assembly) -> System:
    """Return the scene's system with a multisine source at each input and a sampler at outputs (full names).

    `parts` is the assembly of the scene's system, which may be pruned. As with a sine, each sum rides on the value that
    its input would have without it, and its derivatives go to the input's companions where the FMU has them. `lines` is
    the number of lines of a source; amplitudes, orders and phases are start values of a run. Signal i + 1 of the
    sampler is `outputs[i]`, taken at every step. `StructureError` for a scene with a source of its own kind.
    """
    if scene.source.part != SINE_SOURCE:
        raise StructureError(
            f"method multisine puts its own source in the place of a {SINE_SOURCE}; the scene has {scene.source.part}"
        )
    fed = {connection.end for connection in parts.system.connections}
    sources, connections = [], []
    for name, full in zip(source_names(scene, len(excited)), excited, strict=True):
        component, variable = parts.system.split(full)
        found = parts.connector(full)
        bias = scene.source.start.get("offset", parts.system[component].start.get(variable, found.start))
        arguments = {"lines": lines, "unit": found.unit or "1"}
        sources.append(Component(name, MULTISINE_SOURCE, None, arguments, {"offset": bias} if bias else {}))
        connections.append(Connection(f"{name}.value", full))
        connections += [
            Connection(f"{name}.{port}", f"{component}.{companion}")
            for port, companion in derivative_inputs(parts.connectors[component], variable).items()
            if f"{component}.{companion}" not in fed
        ]
    units = [parts.connector(name).unit or "1" for name in outputs]
    sampler = Component(SAMPLER, SAMPLER, None, {"units": units}, {"sample_time": scene.step_size})
    connections += [Connection(name, f"{SAMPLER}.signal[{i}]") for i, name in enumerate(outputs, 1)]
    return System([*sources, *parts.system.components, sampler], [*parts.system.connections, *connections])
