"""Loop of a scene opened at a connection: its loop gain, sensitivity and margins.

found = open_loop("sdelta_hfsa", "controller.axis[1].command")
found.margins.phase, found.margins.delay
"""

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.margins import Margins, OpenedLoop, find_connection
from hfsa.cosim.analysis.margins import open_loop as opened_at
from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.assembly.native_loop import BACKENDS, chosen_loop
from hfsa.cosim.experiments.arguments import checked
from hfsa.cosim.experiments.setup import Warn, default_path, refuse_order, set_up, with_levels
from hfsa.cosim.experiments.sweep_plan import usage_errors
from hfsa.cosim.experiments.sweep_request import EVEN
from hfsa.cosim.fidelity import levels
from hfsa.cosim.measurement.sweep import points_of, system_record
from hfsa.cosim.results.files import Plan, Signal, SweepFile, read_sweep
from hfsa.cosim.results.target import check_new
from hfsa.cosim.signals import excitation
from hfsa.cosim.signals.prefixes import readable
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.notebook import drawn_by, summarized, summary
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.scene_file import scene_text
from hfsa.cosim.systems.system import Connection

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OUTPUTS = (Signal("loop_gain", "1"), Signal("sensitivity", "1"))
"""Outputs in the results file: L and S = 1 / (1 + L); the input is the connection."""

_DENSE, _LINE = 2000, 1000


@dataclass(frozen=True)
class OpenLoop:
    """Loop opened at a connection.

    Attributes:
        path: results file with loop gain and sensitivity.
        connection: connection at which the loop is opened.
        margins: margins of the closed loop.
    """

    path: Path
    connection: Connection
    margins: Margins

    def plot(self) -> "Figure":
        """Return the Bode plot of loop gain and sensitivity; `ResultsError` where the file is gone."""
        return drawn_by("bode", "bode_figure")([read_sweep(self.path)])

    @summarized
    def _repr_html_(self) -> str:
        """Return the margins."""
        margins = self.margins
        rows = [("gain", f"{20 * math.log10(one.value):.4g} dB", readable(one.frequency, "Hz")) for one in margins.gain]
        rows += [
            ("phase", f"{math.degrees(one.value):.4g} deg", readable(one.frequency, "Hz")) for one in margins.phase
        ]
        peak = margins.sensitivity_peak, readable(margins.sensitivity_frequency, "Hz")
        rows.append(("peak of the sensitivity", f"{20 * math.log10(peak[0]):.4g} dB", peak[1]))
        facts = {
            "file": self.path,
            "closed loop": "stable" if margins.is_stable else "unstable",
            "delay margin": "none" if math.isinf(margins.delay) else readable(margins.delay, "s"),
        }
        return summary(
            f"loop opened at {self.connection.start} -> {self.connection.end}", facts, ["margin", ">value", ">at"], rows
        )


@checked()
def open_loop(
    scene: str | Path | Scene,
    connection: str,
    parameters: Mapping[str, Any] | None = None,
    *,
    low: float | None = None,
    high: float | None = None,
    points: int | None = None,
    grid: Literal["response", "log", "linear"] = "response",
    step_size: float | None = None,
    algorithm: str | None = None,
    tolerance: float | None = None,
    fuse: Sequence[str] = (),
    order: str | None = None,
    algebraic_loops: Literal["solve", "refuse"] = "solve",
    keep: Literal["needed", "all"] = "needed",
    path: str | Path | None = None,
    force: bool = False,
    warn: Warn = warnings.warn,
) -> OpenLoop:
    """Write loop gain and sensitivity at a connection to a results file, and return the margins of the loop.

    Args:
        connection: connection at which the loop is opened, given by either end or as `start -> end`.
        low, high: ends of the band [Hz] (default: the scene's, widened to the frequencies of the margins).
        keep: `needed` leaves out what the loop does not pass through, unless a limit flag needs it; `all` keeps it.
        path: results file (default: `results/SCENE_open_loop.h5`).

    The other arguments are those of `sweep`. Raises `StructureError` for a connection that does not exist or closes no
    loop, and the errors of `sweep`.
    """
    file = Path(path) if path is not None else default_path(scene, "_open_loop")
    check_new(file, force)
    setup = set_up(
        scene,
        parameters,
        fuse,
        algebraic_loops,
        order,
        file=None if path is None else file,
        step_size=step_size,
        algorithm=algorithm,
        tolerance=tolerance,
    )
    refuse_order(setup)
    for sentence in setup.disagreements:
        warn(sentence)
    library = chosen_loop(BACKENDS[0], warn) if levels.automatic(setup.scene) else None
    of_scene, choices = with_levels(setup.scene, library)
    for component, choice in choices.items():
        warn(choice.sentence(component))
    opened = find_connection(of_scene.system, connection)
    variants = Variants(of_scene, keep=keep, observed=[opened.start], excited=[opened.end])
    assembly, left_out = variants.parts.check(), variants.left_out.sentence
    if variants.left_out.warning:
        warn(left_out)
    with assembly.open() as instances:
        loop = opened_at(assembly.system, instances, opened)
    margins = loop.margins()
    frequency = _frequencies(of_scene, loop, margins, low, high, points or _LINE, grid)
    gain = loop.gain(frequency)
    settings = {"method": "linear", "open_loop": str(opened)}
    plan = Plan(frequency, OUTPUTS, (Signal(str(opened), "1"),), settings)
    point = {"operating_point": loop.operating_point, "left_out": left_out}
    record = system_record(setup.title, scene_text(of_scene), assembly, **point)
    with SweepFile.create(file, plan, levels.with_choices(record, choices), force) as written:
        written.write(points_of(np.stack([gain, 1 / (1 + gain)], axis=1)[:, :, None]))
    return OpenLoop(file, opened, margins)


def _frequencies(
    scene: Scene, loop: OpenedLoop, margins: Margins, low: float | None, high: float | None, points: int, grid: str
) -> NDArray[np.float64]:
    """Return the frequencies [Hz] of the file; `StructureError` above half the sampling frequency of the loop."""
    found = [m.frequency for m in (*margins.gain, *margins.phase)]
    first = low or min(scene.band[0], *(f / 2 for f in found), math.inf)
    last = high or min(max(scene.band[1], *(f * 2 for f in found), 0.0), loop.highest)
    if last > loop.highest:
        raise StructureError(
            f"{last:g} Hz is above half the sampling frequency, {loop.highest:g} Hz, the end of its loop gain"
        )
    with usage_errors():
        if grid in EVEN:
            return EVEN[grid](first, last, points)
        dense = excitation.logarithmic(first, last, _DENSE)
        return excitation.along_response(dense, loop.gain(dense), points)
