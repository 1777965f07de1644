"""Curves of a Bode plot: one entry of one results file each, with label, colour, phase branch and peaks."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.figures.labels import Peak
from hfsa.cosim.figures.style import COLOURS, GRID
from hfsa.cosim.results.files import Bode
from hfsa.cosim.results.records import ResultsError, Signal, Status
from hfsa.cosim.signals.branches import JUMP_DOWN, JUMP_UP
from hfsa.cosim.signals.frequency_response import negligible, resonances
from hfsa.cosim.systems.names import legible

_DOWNWARDS = "stepped downwards"

METHODS = {
    "linear": "linear theory",
    "stepped": "stepped sine, co-simulated FMUs",
    _DOWNWARDS: "stepped sine, downwards",
    "multisine": "multisine, co-simulated FMUs",
}
"""Labels of the methods of a sweep in a legend."""

_CLOSE = 0.02
"""Relative distance of frequencies below which only the highest of several peaks is marked."""
_MOST_PEAKS = 4
"""Largest number of marked peaks in a panel."""


@dataclass
class Curve:
    """Entry of a results file: magnitude [dB] and phase [deg] over frequency [Hz], without missing points.

    `jumps` are pairs of indices: the points before and after a jump from one branch to another. A faint curve has no
    colour of its own.
    """

    bode: Bode
    output: Signal
    frequency: NDArray[np.float64]
    level: NDArray[np.float64]
    phase: NDArray[np.float64]
    status: NDArray[np.int8]
    failed: NDArray[np.float64]
    jumps: Sequence[tuple[int, int]] = ()
    colour: str = COLOURS[0]
    label: str = ""
    is_faint: bool = False

    @property
    def is_line(self) -> bool:
        """Whether the response is theoretical and drawn as a line."""
        return self.bode.settings.get("method") == "linear"

    @property
    def is_downward(self) -> bool:
        """Whether the response was measured downwards in frequency."""
        return self.bode.settings.get("method") == _DOWNWARDS


class Entry(NamedTuple):
    """Curve with its input, and the unit of its 0 dB."""

    input: Signal
    unit: str
    curve: Curve


def theory_sweep(bode: Bode) -> list[Bode]:
    """Return the theory within a measured sweep as a sweep of its own; empty where the file has none."""
    if bode.theory is None:
        return []
    points = len(bode.theory.frequency), len(bode.inputs)
    settings = {**bode.settings, "method": "linear"}
    status = np.full(points, Status.DONE, dtype=np.int8)
    return [replace(bode, **vars(bode.theory), status=status, settings=settings, theory=None)]


def downward_sweep(bode: Bode) -> list[Bode]:
    """Return the downward sweep of a file that follows branches as a sweep of its own; empty where it has none."""
    if (down := bode.downward) is None:
        return []
    settings = {**bode.settings, "method": _DOWNWARDS}
    return [replace(bode, response=down.response, status=down.status, settings=settings, theory=None)]


def select_entries(sweeps: Sequence[Bode], outputs: list[str], inputs: list[str]) -> list[Entry]:
    """Return the entries to draw; `ResultsError` where there is none.

    Entries that are zero by symmetry are drawn where their output is named, and are left out otherwise.
    """
    entries = []
    for bode in sweeps:
        units, amplitudes = [s.unit for s in bode.outputs], [s.amplitude for s in bode.inputs]
        left_out = negligible(bode.response, units, amplitudes)
        for (o, output), (i, source) in itertools.product(enumerate(bode.outputs), enumerate(bode.inputs)):
            wanted = output.name in outputs if outputs else not left_out[o, i]
            if wanted and (not inputs or source.name in inputs):
                unit, factor = _display_unit(output.unit, source.unit)
                entries.append(Entry(source, unit, _curve(bode, output, source, factor)))
    entries = [entry for entry in entries if len(entry.curve.frequency)]
    if not entries:
        raise ResultsError(f"{', '.join(str(bode.path) for bode in sweeps)}: no finished points to draw")
    return entries


def _curve(bode: Bode, output: Signal, source: Signal, factor: float) -> Curve:
    """Return the curve of an output per input, scaled by a factor."""
    response = factor * bode.entry(output.name, source.name)
    place = [s.name for s in bode.inputs].index(source.name)
    status = bode.status[:, place]
    there = np.isfinite(response) & (np.abs(response) > 0)
    phase = np.degrees(np.unwrap(np.angle(response[there])))
    level = 20 * np.log10(np.abs(response[there]))
    failed = bode.frequency[status == Status.FAILED]
    curve = Curve(bode, output, bode.frequency[there], level, phase, status[there], failed)
    if bode.downward is not None and not curve.is_line:
        flag, before = (JUMP_DOWN, 1) if curve.is_downward else (JUMP_UP, -1)
        arrivals = np.flatnonzero(bode.downward.branches[there, place] & flag)
        curve.jumps = [(int(k) + before, int(k)) for k in arrivals if 0 <= k + before < len(level)]
    return curve


def name_curves(by_output: Mapping[str, Sequence[Curve]], sweeps: Sequence[Bode]) -> None:
    """Set a distinct colour and label of each curve of a panel: by output, by method, by file."""
    outputs = list(by_output)
    methods = [bode.settings.get("method") for bode in sweeps]
    for curve in itertools.chain.from_iterable(by_output.values()):
        method = str(curve.bode.settings.get("method", ""))
        label = METHODS.get(method, method)
        if methods.count(method) > 1:
            label += f", {legible(curve.bode.path.stem)}"
        if len(outputs) > 1:
            label = f"{curve.output.name}: {label}"
        curve.label = label
        # a line and its measured points share a colour; further outputs and files have colours of their own
        siblings = [bode for bode in sweeps if bode.settings.get("method") == method]
        sibling = next(i for i, bode in enumerate(siblings) if bode is curve.bode)
        curve.colour = COLOURS[(outputs.index(curve.output.name) + sibling) % len(COLOURS)]


def fade(by_output: Mapping[str, Sequence[Curve]]) -> None:
    """Make all but the largest outputs of a panel faint where there are more than colours, under one label."""
    if len(by_output) <= len(COLOURS):
        return
    ordered = sorted(by_output, key=lambda name: -max(curve.level.max() for curve in by_output[name]))
    for place, name in enumerate(ordered):
        for curve in by_output[name]:
            if place < len(COLOURS) - 1:
                curve.colour = COLOURS[place]
            else:
                curve.colour, curve.is_faint = GRID, True
                curve.label = f"{len(ordered) - len(COLOURS) + 1} smaller responses"


def align_phases(curves: Sequence[Curve]) -> None:
    """Shift the phases of curves of one output to the branch of the densest curve, which begins in (-180, 180]."""
    dense = _densest(curves)
    for curve in curves:
        if curve is not dense:
            near = np.interp(np.log(curve.frequency), np.log(dense.frequency), dense.phase)
            curve.phase = curve.phase + 360 * np.round((near - curve.phase) / 360)


def find_peaks(by_output: Mapping[str, Sequence[Curve]]) -> list[Peak]:
    """Return the peaks to label, highest first: 3 dB above their surroundings, the highest of close ones."""
    dense = [_densest(curves) for curves in by_output.values() if not curves[0].is_faint]
    positions = [_peak_position(curve, i) for curve in dense for i in resonances(curve.level)]
    peaks: list[Peak] = []
    for f, level in sorted(positions, key=lambda position: -position[1]):
        if all(abs(math.log(f / other.x)) > _CLOSE for other in peaks):
            peaks.append(Peak(f, level, f"{f:.4g} Hz, {level:.1f} dB"))
    return peaks[:_MOST_PEAKS]


def _densest(curves: Sequence[Curve]) -> Curve:
    """Return the curve with the most points."""
    return max(curves, key=lambda curve: len(curve.frequency))


def _peak_position(curve: Curve, peak: int) -> tuple[float, float]:
    """Return frequency [Hz] and level [dB] of a peak; for a line, interpolated between its grid points.

    Near a resonance 1 / |response|^2 is a parabola over the squared frequency, which three points determine.
    """
    if not curve.is_line:
        return curve.frequency[peak], curve.level[peak]
    near = slice(peak - 1, peak + 2)
    square = curve.frequency[peak] ** 2
    offset, inverse = curve.frequency[near] ** 2 - square, 10 ** (-curve.level[near] / 10)
    a, b, c = np.polyfit(offset, inverse, 2)
    least = c - b**2 / (4 * a) if a > 0 else 0.0
    if least <= 0:  # the parabola has no positive minimum: the grid is too coarse
        return curve.frequency[peak], curve.level[peak]
    return math.sqrt(square - b / (2 * a)), -10 * math.log10(least)


def _display_unit(output: str, source: str) -> tuple[str, float]:
    """Return the unit of 0 dB, empty for equal units, and the factor from SI."""
    if output == source:
        return "", 1.0
    lengths = {"m": ("mm", 1e3), "rad": ("deg", 180 / math.pi)}
    micro = source not in lengths and output == "m"
    above, up = ("um", 1e6) if micro else lengths.get(output, (output, 1.0))
    below, down = lengths.get(source, (source, 1.0))
    return f"{above}/{below}" if below.isalnum() else f"{above}/({below})", up / down
