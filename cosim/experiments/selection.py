"""Selection of signals by typed names: full or short, single or ranges.

find_signals(["platform.position[1..3]"], scene.outputs, assembly.connectors, "output")
"""

import dataclasses
from collections.abc import Mapping, Sequence

from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.systems.connectors import Connector, derivative_inputs
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import expand, matching_names, nearest
from hfsa.cosim.systems.scene import Scene

_CAUSALITIES = {"input": ("input",), "output": ("output",), "signal": ("output", "input", "local")}
"""Causalities of each kind of signal, in their priority among variables with the same short name."""


def find_signals(
    wanted: Sequence[str], offered: Sequence[str], variables: Mapping[str, Mapping[str, Connector]], kind: str
) -> list[str]:
    """Return the full names of wanted inputs, outputs or signals; without wanted names, those offered by the scene.

    `kind` is `input`, `output`, or `signal`: any variable that can change in a run. A name may have a range, and may
    omit the component where it is unique. `StructureError`, with the nearest names, for a name that matches no variable
    or several.
    """
    if not wanted:
        return list(offered)
    known = signals(variables, kind)
    found = []
    for name in (member for item in wanted for member in expand(item)):
        groups = (offered, *(_of(variables, causality) for causality in _CAUSALITIES[kind]))
        fitting = [name] if name in known else next(filter(None, (matching_names(name, group) for group in groups)), [])
        if not fitting:
            short = [full.partition(".")[2] for full in known]
            raise StructureError(
                f"no {kind} is called {name!r}{nearest(name, dict.fromkeys([*offered, *known, *short]))}"
            )
        if len(fitting) > 1:
            raise StructureError(f"{name} fits several {kind}s: {', '.join(fitting)}; expected one of them")
        found += fitting
    return list(dict.fromkeys(found))


def signals(variables: Mapping[str, Mapping[str, Connector]], kind: str = "signal") -> list[str]:
    """Return the full names of all variables of a kind."""
    return [name for causality in _CAUSALITIES[kind] for name in _of(variables, causality)]


def _of(variables: Mapping[str, Mapping[str, Connector]], causality: str) -> list[str]:
    """Return the full names of all numbers of one causality."""
    every = ((component, v) for component, known in variables.items() for v in known.values())
    return [f"{component}.{v.name}" for component, v in every if v.causality == causality and v.is_number]


def with_amplitude(scene: Scene, amplitude: float | None, inputs: Sequence[str], assembly: Assembly) -> Scene:
    """Return the scene with one amplitude for all given inputs, in the unit of each."""
    if amplitude is None:
        return scene
    units = {assembly.connector(name).unit or "1" for name in inputs}
    return dataclasses.replace(scene, amplitude={**scene.amplitude, **dict.fromkeys(units, amplitude)})


def with_nominal_amplitudes(scene: Scene, inputs: Sequence[str], assembly: Assembly) -> Scene:
    """Return the scene with the nominal size of each given input as amplitude, where the scene has none in its unit."""
    nominal: dict[str, float] = {}
    for variable in map(assembly.connector, inputs):
        nominal.setdefault(variable.unit or "1", abs(variable.nominal))
    return dataclasses.replace(scene, amplitude={**nominal, **scene.amplitude})


def free_inputs(assembly: Assembly) -> list[str]:
    """Return the unconnected inputs (full names), without those for derivatives of other inputs."""
    fed = {connection.end for connection in assembly.system.connections}
    free = []
    for component, known in assembly.connectors.items():
        names = [v.name for v in known.values() if v.causality == "input" and f"{component}.{v.name}" not in fed]
        follow = {companion for name in names for companion in derivative_inputs(known, name).values()}
        free += [f"{component}.{name}" for name in names if name not in follow]
    return free
