"""Aliasing: a sine with fewer than ten communication points in a period looks like a slow sine, or like a constant.

    check_resolved(system, connectors, step_size=1e-4)       # StructureError for a source of 9999 Hz

At a step of 0.1 ms the samples of a sine of 9999 Hz are those of a sine of 1 Hz. A source is a component without
connected inputs; its frequency is its parameter `frequency` in Hz.
"""

from collections.abc import Mapping

from hfsa.cosim.signals.excitation import window_steps
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import System

_FREQUENCY = "frequency"


def check_resolved(system: System, connectors: Mapping[str, Mapping[str, Connector]], step_size: float) -> None:
    """Raise `StructureError` for a source whose period has too few steps [s]; the message names a sufficient step.

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
    """Raise `StructureError` for a frequency [Hz], by full name, that the step does not resolve."""
    try:
        window_steps(frequency, step_size)
    except ValueError as error:
        raise StructureError(f"{name}: {error}") from None
