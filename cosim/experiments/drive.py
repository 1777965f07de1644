"""Inputs driven by signals of the user's own, from a request by names to a scene that is ready for them.

request = requested({"base.position": "chirp,to=200"}, scene, descriptions)     # full names and signals
scene = released(scene, request)                                                # nothing else feeds these inputs
"""

import dataclasses
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hfsa.cosim.analysis.driven_inputs import deviation_sentence, sentences, way_of
from hfsa.cosim.experiments.drive_text import signal_of
from hfsa.cosim.experiments.selection import find_signals
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.masters.algorithms import algorithm_named
from hfsa.cosim.signals.drive import Function, Signal
from hfsa.cosim.signals.table import Table, table
from hfsa.cosim.systems.connectors import Connector, derivative_inputs
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import System
from hfsa.cosim.systems.units import BaseUnit, conversion, known_base

_SAMPLES = 20_001
"""Times at which the range of a signal is found."""


def requested(drive: Mapping[str, Any], scene: Scene, known: Assembly) -> dict[str, Signal]:
    """Return the signals by the full names of the inputs that they drive.

    Args:
        drive: by full or short name of an input, a signal, a function of the time [s], a table (rows, 2) of times and
            values, or a text (`drive_text.py`).
        known: descriptions of the scene's components.

    Raises:
        StructureError: a name that is no input or given twice; something that is no signal; a table that is wrong or in
            a unit that does not fit.
    """
    found: dict[str, Signal] = {}
    for name, wanted in drive.items():
        for full in find_signals([name], scene.inputs, known.connectors, "input"):
            if full in found:
                raise StructureError(f"{full} is driven twice; expected one signal")
            found[full] = _in_unit(_signal(wanted, name, full), full, known.connector(full))
    return found


def released(scene: Scene, driven: Collection[str], used: Collection[str]) -> Scene:
    """Return the scene without what fed driven inputs (full names), and the inputs for derivatives of them.

    A component that fed nothing else is left out, unless a variable of it is `used`.
    """
    system = scene.system
    before = {system.split(name)[0] for c in system.connections for name in (c.start, c.end)}
    kept = [c for c in system.connections if c.end not in driven]
    after = {system.split(name)[0] for c in kept for name in (c.start, c.end)}
    after |= {system.split(name)[0] for name in (*driven, *used)} | {name for group in scene.fuse for name in group}
    components = [c for c in system.components if c.name in after or c.name not in before]
    if len(kept) == len(system.connections):
        return scene
    names = {component.name for component in components}
    inputs = [name for name in scene.inputs if system.split(name)[0] in names]
    return dataclasses.replace(scene, system=System(components, kept), inputs=inputs)


def with_companions(driven: Mapping[str, Signal], known: Assembly) -> list[str]:
    """Return the driven inputs and those that take their derivatives, by full name."""
    names = []
    for full in driven:
        component, variable = known.system.split(full)
        others = derivative_inputs(known.connectors[component], variable).values()
        names += [full, *(f"{component}.{other}" for other in others)]
    return list(dict.fromkeys(names))


def half_range(signal: Signal, end: float) -> float:
    """Return half the range of a signal from 0 to `end` [s], 0 where it is constant."""
    times = np.unique(np.concatenate([np.linspace(0, end, _SAMPLES), signal.knots(0, end)[: 10**6]]))
    values = signal.derivatives(times)[0]
    return float(values.max() - values.min()) / 2


def with_amplitudes(scene: Scene, driven: Mapping[str, Signal], known: Assembly) -> Scene:
    """Return the scene with the size of the driving signals as amplitudes, for the choice of levels and algorithms.

    A constant signal has the amplitude of the scene in its unit, or else its nominal size. `StructureError` for a
    signal that has no value at some time of the run.
    """
    sizes: dict[str, float] = {}
    for name, signal in driven.items():
        variable = known.connector(name)
        unit = variable.unit or "1"
        try:
            size = half_range(signal, scene.stop_time)
        except ValueError as error:
            raise StructureError(f"drive of {name}: {error}") from error
        size = size or scene.amplitude.get(unit, abs(variable.nominal))
        sizes[unit] = max(size, sizes.get(unit, 0.0))
    return dataclasses.replace(scene, amplitude={**scene.amplitude, **sizes})


def driven_sentences(
    driven: Mapping[str, Signal], assembly: Assembly, scene: Scene, known: Collection[str] = ()
) -> list[str]:
    """Return the sentences on what the steps of a scene, and the inputs of its FMUs, leave of the driving signals.

    Of the `known` ones (full names) the error of the response is known, and says more than the deviation of the input.
    """
    found: list[str] = []
    row, system = algorithm_named(scene.algorithm), assembly.system
    for name, signal in driven.items():
        component, variable = system.split(name)
        way = way_of(row, assembly.descriptions[component], variable)
        found += sentences(name, signal, way, scene.step_size, scene.stop_time)
        if name not in known and not assembly.descriptions[component].is_sampled:
            found += deviation_sentence(name, signal, way, scene.step_size, scene.stop_time, scene.tolerance)
        others = list(derivative_inputs(assembly.connectors[component], variable).values())
        if missing := others[signal.known :]:
            words = f"{name}: {signal.text} has no derivative for {', '.join(missing)}, which keep their start values"
            found.append(words)
        elif others and not signal.is_smooth and len(signal.breaks(0.0, scene.stop_time)):
            found.append(f"{name}: where its signal jumps or bends, {', '.join(others)} miss an impulse")
    return found


def _signal(wanted: Any, name: str, full: str) -> Signal:
    """Return the signal of a request for an input."""
    if isinstance(wanted, Signal):
        return wanted
    if isinstance(wanted, str | Path):
        return signal_of(str(wanted), list(dict.fromkeys([full, name, full.partition(".")[2]])))
    try:
        return Function(wanted) if callable(wanted) else table(wanted, source="an array")
    except (TypeError, ValueError) as error:
        raise StructureError(
            f"drive of {full}: {error}; expected a signal, a function of the time, rows of a time and a value, or a "
            "text"
        ) from None


def _in_unit(signal: Signal, name: str, variable: Connector) -> Signal:
    """Return the signal in the unit of its input; `StructureError` where a table is in another that does not fit."""
    if not isinstance(signal, Table) or signal.unit is None or signal.unit == (variable.unit or "1"):
        return signal
    factors = conversion(known_base(signal.unit), _base(variable), variable.is_relative)
    if factors is None:
        raise StructureError(f"{signal.source} is in {signal.unit}, but {name} in {variable.unit or 'no unit'}")
    factor, offset = factors
    return dataclasses.replace(signal, values=factor * signal.values + offset, unit=variable.unit)


def _base(variable: Connector) -> BaseUnit | None:
    """Return the base unit of a variable."""
    return variable.base_unit or known_base(variable.unit or "1")
