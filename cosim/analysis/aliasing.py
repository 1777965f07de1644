"""Aliasing: a sine with fewer than ten communication points in a period looks like a slow one, or like rest.

    check_resolved(system, connectors, step_size=1e-4)       # StructureError for a source of 9999 Hz

Held over such steps and seen at their ends alone, 9999 Hz at a step of 0.1 ms is a sine of 1 Hz. A source is a
component that no other feeds; what it drives the system with is its parameter `frequency` in Hz.
"""

from collections.abc import Mapping

from hfsa.cosim.signals.excitation import window_steps
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import System

_FREQUENCY = "frequency"


def check_resolved(system: System, connectors: Mapping[str, Mapping[str, Connector]], step_size: float) -> None:
    """Raise `StructureError` for a source whose period has too few steps [s], with the step that would do.

    `connectors` holds the variables of each component's FMU by name.
    """
    fed = {system.split(connection.end)[0] for connection in system.connections}
    for component in system.components:
        if component.name in fed:
            continue
        for name, variable in connectors[component.name].items():
            if variable.causality != "parameter" or variable.unit != "Hz" or name.rpartition(".")[2] != _FREQUENCY:
                continue
            frequency = component.start.get(name, variable.start)
            if frequency:
                _check(f"{component.name}.{name}", abs(frequency), step_size)


def _check(name: str, frequency: float, step_size: float) -> None:
    """Raise `StructureError` where a frequency [Hz] of that full name is not resolved."""
    try:
        window_steps(frequency, step_size)
    except ValueError as error:
        raise StructureError(f"{name}: {error}") from None
