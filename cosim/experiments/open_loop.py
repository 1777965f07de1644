"""A scene's loop opened at a connection: loop gain and sensitivity into a results file, its margins as the answer.

    data, text = sweep_loop(load("sdelta_hfsa", {}), "controller.axis[1].command", Path("results/loop.h5"))

Like `measure.py` it stands on the roof: it asks `assembly/build.py` for files.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.margins import Loop, Margins, find_connection, open_loop
from hfsa.cosim.assembly import build
from hfsa.cosim.assembly.native_loop import LOOPS, chosen_loop
from hfsa.cosim.experiments.sweep import Loaded, refuse_order, usage_errors, with_levels
from hfsa.cosim.fidelity import levels
from hfsa.cosim.fmi.co_simulation import open_instances
from hfsa.cosim.fmi.description import describe
from hfsa.cosim.measurement.sweep import finished, system_record
from hfsa.cosim.results.files import Plan, Signal, SweepFile
from hfsa.cosim.signals import excitation
from hfsa.cosim.systems.connectors import check
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.scene_file import scene_text

OUTPUTS = (Signal("loop_gain", "1"), Signal("sensitivity", "1"))
"""What the file holds of a loop: L and S = 1 / (1 + L), over the connection as input."""

_DENSE, _LINE = 2000, 1000


def sweep_loop(
    loaded: Loaded,
    name: str,
    path: Path,
    *,
    low: float | None = None,
    high: float | None = None,
    points: int | None = None,
    grid: str = "response",
    force: bool = False,
    warn: Callable[[str], None] = print,
) -> tuple[dict[str, Any], str]:
    """Write loop gain and sensitivity at a connection into the file `path`; return the margins, as data and as text.

    Frequencies [Hz] are from `low` to `high`, by default the scene's band, widened to what the margins are found at.
    Raises `StructureError` for a connection that does not exist or closes no loop. `force` replaces a results file.
    """
    refuse_order(loaded)
    for sentence in loaded.disagreements:
        warn(sentence)
    library = chosen_loop(LOOPS[0], warn) if levels.automatic(loaded.scene) else None
    scene, choices = with_levels(loaded.scene, library)
    for component, choice in choices.items():
        warn(choice.sentence(component))
    files = build.build(scene.system)
    check(scene.system, {component: describe(file).variables for component, file in files.items()})
    connection = find_connection(scene.system, name)
    with open_instances(files) as instances:
        loop = open_loop(scene.system, instances, connection)
    margins = loop.margins()
    frequency = _frequencies(scene, loop, margins, low, high, points or _LINE, grid)
    gain = loop.gain(frequency)
    settings = {"method": "linear", "open_loop": str(connection)}
    plan = Plan(frequency, OUTPUTS, (Signal(str(connection), "1"),), settings)
    record = system_record(loaded.title, scene_text(scene), (scene.system, files), operating_point=loop.operating_point)
    with SweepFile.create(path, plan, levels.with_choices(record, choices), force) as file:
        file.write(finished(np.stack([gain, 1 / (1 + gain)], axis=1)[:, :, None]))
    return _data(loop, margins, path), _text(loop, margins, path)


def _frequencies(
    scene: Scene, loop: Loop, margins: Margins, low: float | None, high: float | None, points: int, grid: str
) -> NDArray[np.float64]:
    """Return the frequencies [Hz] of the file; `StructureError` beyond the highest that the loop has a gain at."""
    found = [m.frequency for m in (*margins.gain, *margins.phase)]
    first = low or min(scene.band[0], *(f / 2 for f in found), math.inf)
    last = high or min(max(scene.band[1], *(f * 2 for f in found), 0.0), loop.highest)
    if last > loop.highest:
        raise StructureError(
            f"{last:g} Hz is above half the sampling frequency, {loop.highest:g} Hz, where a sampled loop ends"
        )
    with usage_errors():
        if grid == "log":
            return excitation.logarithmic(first, last, points)
        dense = excitation.logarithmic(first, last, _DENSE)
        return excitation.along_response(dense, loop.gain(dense), points)


def _data(loop: Loop, margins: Margins, path: Path) -> dict[str, Any]:
    """Return the margins as plain data."""
    return {
        "file": path,
        "connection": str(loop.connection),
        "is_stable": margins.is_stable,
        "gain_margins": [{"frequency": m.frequency, "factor": m.value} for m in margins.gain],
        "phase_margins": [{"frequency": m.frequency, "phase": m.value} for m in margins.phase],
        "delay_margin": margins.delay,
        "sensitivity": {"peak": margins.sensitivity_peak, "frequency": margins.sensitivity_frequency},
    }


def _text(loop: Loop, margins: Margins, path: Path) -> str:
    """Return the margins as text."""
    gains = [f"{m.value:.6g} ({20 * math.log10(m.value):.4g} dB) at {m.frequency:.6g} Hz" for m in margins.gain]
    phases = [f"{math.degrees(m.value):.4g} degrees at {m.frequency:.6g} Hz" for m in margins.phase]
    delay = f"{margins.delay:.4g} s" if math.isfinite(margins.delay) else "none"
    return "\n".join(
        [
            f"{path}: loop gain and sensitivity at {loop.connection}",
            f"  the closed loop is {'stable' if margins.is_stable else 'UNSTABLE: its margins mean little'}",
            f"  gain margin    {'; '.join(gains) or 'none: no gain reaches -1'}",
            f"  phase margin   {'; '.join(phases) or 'none: the gain never crosses 1'}",
            f"  delay margin   {delay}",
            f"  sensitivity    {margins.sensitivity_peak:.4g} at most, at {margins.sensitivity_frequency:.6g} Hz",
        ]
    )
