"""Entry of an FMU of any maker in the listing: interfaces, ports and parameters that a scene can use."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from hfsa.cosim.fmi.description import Description, Interface, describe
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.errors import StructureError

_INTERFACES: dict[Interface, str] = {"co_simulation": "Co-Simulation", "model_exchange": "Model Exchange"}


def fmu_entry(file: Path) -> dict[str, Any]:
    """Return what an FMU offers, as plain data; `StructureError` for a file that is none."""
    found = _interfaces(file)
    description = next(iter(found.values()))
    variables = description.variables.values()
    default = {"step_size": description.step_size, "stop_time": description.stop_time}
    return {
        "name": file.stem,
        "description": _about(description, found),
        "fmi_version": description.version,
        "interfaces": list(found),
        "states": len(description.states),
        "capabilities": _capabilities(description),
        "default_experiment": default,
        "arguments": [],
        "inputs": _signals(v for v in variables if v.causality == "input" and v.is_number),
        "outputs": _signals(v for v in variables if v.causality == "output" and v.is_number),
        "parameters": _signals(v for v in variables if v.causality == "parameter" and v.is_number),
    }


def _interfaces(file: Path) -> dict[Interface, Description]:
    """Return the descriptions of the interfaces of an FMU that can be run here."""
    found: dict[Interface, Description] = {}
    refusals = []
    for interface in _INTERFACES:
        try:
            found[interface] = describe(file, interface)
        except StructureError as error:
            refusals.append(error)
    if not found:
        raise refusals[0]
    return found


def _about(description: Description, interfaces: Iterable[Interface]) -> str:
    """Return the sentence on an FMU."""
    words = " and ".join(_INTERFACES[interface] for interface in interfaces)
    states = len(description.states)
    able = ", ".join(_capabilities(description)) or "none of the optional capabilities"
    return f"{description.name}: FMI {description.version}, {words}, {states} state{'' if states == 1 else 's'}; {able}"


def _capabilities(description: Description) -> list[str]:
    """Return the optional capabilities that a scene gains by, in words."""
    offered = {
        "directional derivatives": description.has_derivatives,
        "restores its state": description.can_restore,
        "input derivatives": description.can_interpolate,
    }
    return [words for words, is_offered in offered.items() if is_offered]


def _signals(variables: Iterable[Connector]) -> list[dict[str, Any]]:
    """Return variables as plain data."""
    return [{"name": v.name, "unit": v.unit or "1", "description": "", "start": v.start} for v in variables]
