"""Divergence: scales of recorded values, and the error that ends a run beyond a thousand times a scale.

    scales = recorded_scales(scene, system, connectors, ["tracking.axis[1].error"])
    recording.watch.limit(scales)          # from then on DivergenceError beyond a thousand times a scale

An unstable loop of linear models grows until its numbers overflow; they lose their meaning long before. The scale of an
output is, in this order,

    1. the scale that the scene declares (`Scene.scale`): a travel, a force or torque limit
    2. none where the FMU states both bounds: the run stops at these
    3. the largest of the nominal value that the FMU states, the scene's amplitude in that unit, and the start value

An output without a scale stops a run only where it is not finite. For an input, which is prescribed, only rule 1 holds.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.signals.prefixes import readable
from hfsa.cosim.systems.connectors import Connector, connector
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import System

FACTOR = 1000.0
"""Ratio of a value to its scale above which a run has diverged."""

_UNDECLARED = ", as the scene declares no scale for it"


@dataclass(frozen=True)
class Scale:
    """Usual size of a variable: `size` in its `unit`; `origin` and `remark` are its source in words."""

    size: float
    unit: str
    origin: str
    remark: str = ""

    @property
    def limit(self) -> float:
        """Largest value that counts as converged, in the unit."""
        return FACTOR * self.size

    def __str__(self) -> str:
        return f"{self.origin} of {readable(self.size, self.unit)}{self.remark}"


class DivergenceError(StepError):
    """Divergence of a recorded variable: its full name `signal`, and its `value` in the unit of `scale`."""

    def __init__(self, signal: str, value: float, scale: Scale, time: float):
        instance, _, variable = signal.partition(".")
        message = f"{readable(value, scale.unit)}, more than {FACTOR:g} times {scale}"
        super().__init__(instance, variable, "diverged", time, message)
        self.signal, self.value, self.scale = signal, value, scale

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.signal, self.value, self.scale, self.time)


def recorded_scales(
    scene: Scene, system: System, connectors: Mapping[str, Mapping[str, Connector]], names: Iterable[str]
) -> dict[str, Scale]:
    """Return the scales of those variables (full names) that have one.

    `system` is the part of the scene that runs; `connectors` holds the variables of each component's FMU by name.
    `StructureError` where the scene declares the scale of a variable that does not exist.
    """
    declared = {name: connector(system, connectors, name) for name in scene.scale}
    found = {}
    for name in names:
        variable = connector(system, connectors, name)
        unit = variable.unit or "1"
        if name in declared:
            found[name] = Scale(scene.scale[name], unit, "the scene's scale")
        elif variable.causality != "input" and variable.has_nominal and None in (variable.min, variable.max):
            sizes = {
                "its nominal value": abs(variable.nominal),
                "the scene's amplitude": scene.amplitude.get(unit, 0.0),
                "its start value": _start(system, name, variable),
            }
            origin = max(sizes, key=lambda words: sizes[words])
            found[name] = Scale(sizes[origin], unit, origin, _UNDECLARED)
    return found


def _start(system: System, name: str, variable: Connector) -> float:
    """Return the size of a variable at the start as the scene or else its FMU states it, 0 where neither does."""
    component, variable_name = system.split(name)
    given = system[component].start.get(variable_name, variable.start)
    return abs(float(given)) if isinstance(given, (int, float)) else 0.0
