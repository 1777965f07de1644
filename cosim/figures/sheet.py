"""Layout of a Bode plot: panels of curves with a common unit, arranged in rows and columns.

Few responses share panels by unit. More have a small panel each: inputs over outputs where both are several, else row
after row. Of yet more, those that are largest in their panel have colours, and the others are faint.
"""

import itertools
import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from hfsa.cosim.figures.curves import Curve, Entry, align_phases, fade, find_peaks, name_curves
from hfsa.cosim.figures.labels import Peak
from hfsa.cosim.figures.style import COLOURS, LETTER_WIDTH
from hfsa.cosim.results.files import Bode
from hfsa.cosim.results.records import Signal

_MOST_SHARED = 12
"""Number of entries above which each has a small panel of its own."""
_MOST_PANELS = 64
"""Number of entries above which they share panels all the same."""
_PANEL, _SMALL_PANEL = (4.2, 4.8), (2.1, 1.85)
"""Width and height [inch]."""


@dataclass
class Panel:
    """Pair of axes: curves of one input with a common unit.

    Attributes:
        unit: unit of 0 dB.
        title: title above the axes.
        peaks: peaks to label, the highest first.
    """

    input: Signal
    unit: str
    curves: list[Curve] = field(default_factory=list)
    title: str = ""
    peaks: list[Peak] = field(default_factory=list)

    @property
    def outputs(self) -> dict[str, list[Curve]]:
        """Curves by output."""
        names = dict.fromkeys(curve.output.name for curve in self.curves)
        return {name: [curve for curve in self.curves if curve.output.name == name] for name in names}


@dataclass(frozen=True)
class Sheet:
    """Panels in rows, with the sizes and labels of the figure.

    Attributes:
        rows: panels, `None` for an empty place.
        size: width and height [inch].
        font: font size [points].
        magnitude, phase, frequency: labels of the axes.
        intervals: largest number of intervals between phase ticks.
        above, beside: headings of the columns and rows; empty without headings.
        heading: what all panels have in common; empty for nothing.
        is_shared: whether panels share the axes of their row and column.
    """

    rows: Sequence[Sequence[Panel | None]]
    size: tuple[float, float]
    font: float = 10.0
    magnitude: str = "Magnitude ({})"
    phase: str = "Phase (deg)"
    frequency: str = "Frequency (Hz)"
    intervals: int = 6
    above: Sequence[str] = ()
    beside: Sequence[str] = ()
    heading: str = ""
    is_shared: bool = False


def sheet_of(sweeps: Sequence[Bode], entries: Sequence[Entry]) -> Sheet:
    """Return the sheet of entries: panels by unit, or small panels by entry where there are many."""
    names = {(source.name, unit, curve.output.name) for source, unit, curve in entries}
    together = Counter((source, unit) for source, unit, _ in names)
    is_few = len(names) <= _MOST_SHARED and max(together.values()) <= len(COLOURS)
    return (sheet_by_unit if is_few or len(names) > _MOST_PANELS else sheet_by_entry)(sweeps, entries)


def sheet_by_unit(sweeps: Sequence[Bode], entries: Sequence[Entry]) -> Sheet:
    """Return a sheet with a column for each input and a panel for each unit in it, the unit of the input first."""
    panels = _panels(sweeps, entries, key=lambda entry: (entry.input.name, entry.unit))
    for panel in panels:
        fade(panel.outputs)
    order = list(dict.fromkeys(source.name for bode in sweeps for source in bode.inputs))
    panels.sort(key=lambda panel: (order.index(panel.input.name), panel.unit != ""))
    columns = [list(column) for _, column in itertools.groupby(panels, lambda panel: panel.input.name)]
    rows = [list(row) for row in itertools.zip_longest(*columns)]
    for panel in panels:
        outputs = list(panel.outputs)
        target = f"\N{RIGHTWARDS ARROW}  {outputs[0]}" if len(outputs) == 1 else ""
        fits = LETTER_WIDTH * (len(panel.input.name) + len(target)) < _PANEL[0]
        panel.title = f"{panel.input.name}{'  ' if fits else chr(10)}{target}".rstrip()
    size = (8.6, 6.2) if len(panels) == 1 else (max(8.0, _PANEL[0] * len(columns)), 0.8 + _PANEL[1] * len(rows))
    return Sheet(rows, size)


def sheet_by_entry(sweeps: Sequence[Bode], entries: Sequence[Entry]) -> Sheet:
    """Return a sheet of small panels with a column for each input and a row for each output, named at its edges.

    Of one input, or of one output, panels with titles follow each other row by row.
    """
    panels = _panels(sweeps, entries, key=lambda entry: (entry.input.name, entry.curve.output.name))
    there = {(panel.input.name, name): panel for panel in panels for name in panel.outputs}
    for panel in panels:
        panel.peaks = panel.peaks[:1]
    above = [name for name in _names(sweeps, "inputs") if any(source == name for source, _ in there)]
    beside = [name for name in _names(sweeps, "outputs") if any(output == name for _, output in there)]
    if len(above) > 1 and len(beside) > 1:
        rows = [[there.get((source, output)) for source in above] for output in beside]
        return _small(rows, above=above, beside=beside)
    for (source, output), panel in there.items():
        panel.title = output if len(above) == 1 else source
    ordered = [there[pair] for pair in itertools.product(above, beside)]
    columns = math.ceil(math.sqrt(len(ordered)))
    padded = [*ordered, *[None] * (-len(ordered) % columns)]
    arrow = "\N{RIGHTWARDS ARROW}"
    heading = f"{above[0]}  {arrow}" if len(above) == 1 else f"{arrow}  {beside[0]}"
    return _small([padded[i : i + columns] for i in range(0, len(padded), columns)], heading=heading)


def _small(
    rows: Sequence[Sequence[Panel | None]], above: Sequence[str] = (), beside: Sequence[str] = (), heading: str = ""
) -> Sheet:
    """Return the sheet of small panels that share axes."""
    size = (1.0 + _SMALL_PANEL[0] * max(len(rows[0]), 2), 1.3 + _SMALL_PANEL[1] * len(rows))
    return Sheet(rows, size, 7.0, "{}", "deg", "Hz", 3, above, beside, heading, is_shared=True)


def _names(sweeps: Sequence[Bode], side: str) -> list[str]:
    """Return the names of the inputs or outputs of sweeps, each once."""
    return list(dict.fromkeys(signal.name for bode in sweeps for signal in getattr(bode, side)))


def _panels(sweeps: Sequence[Bode], entries: Sequence[Entry], key: Callable[[Entry], tuple[str, str]]) -> list[Panel]:
    """Return a panel for the entries of each key, with named curves and aligned phases."""
    panels: dict[tuple[str, str], Panel] = {}
    for entry in entries:
        panels.setdefault(key(entry), Panel(entry.input, entry.unit)).curves.append(entry.curve)
    for panel in panels.values():
        name_curves(panel.outputs, sweeps)
        for curves in panel.outputs.values():
            align_phases(curves)
        panel.peaks = find_peaks(panel.outputs)
    return list(panels.values())
