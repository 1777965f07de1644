"""What communication steps leave of a driving signal: its deviation between the points, its aliasing, its jumps.

    sentences("plant.force", signal, "held", step_size=1e-3, end=2.0)
    deviation_sentence("plant.force", signal, "held", step_size=1e-3, end=2.0, tolerance=1e-3)

Between two points an input is what the master feeds (`actions/drive.py`): held at its value at the first point or in
the middle, on a line, or on a parabola. The deviation from the signal is the largest one at a quarter, a half and three
quarters of steps, or at the rows of a table, relative to half the range of the signal. A frequency above half the rate
of the points is seen at another one, and no deviation tells that of a table that is read at points alone.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.fmi.description import Description
from hfsa.cosim.masters.algorithm import Algorithm
from hfsa.cosim.signals.drive import Signal
from hfsa.cosim.signals.prefixes import readable

Way = Literal["held", "middle", "line", "parabola", "exact"]
"""Ways in which a driven input moves within a step."""

_FEWEST = 10
"""Communication points in a period of the highest frequency, below which a sentence says how many there are."""

_MOST = 20_000
"""Largest number of steps that are examined."""

_SAME = 1e-6
"""Fraction of a step within which a jump and a communication point are the same instant."""

_WORDS = {
    "held": "held from the beginning of each step",
    "middle": "held over each step",
    "line": "on a line over each step",
    "parabola": "on a parabola over each step",
}


@dataclass(frozen=True)
class Sampled:
    """Values of a signal within steps: `time` [s], the signal and what is fed, (n,) each."""

    time: NDArray[np.float64]
    signal: NDArray[np.float64]
    fed: NDArray[np.float64]


def way_of(algorithm: Algorithm, description: Description, variable: str) -> Way:
    """Return the way in which an algorithm moves a driven input of an FMU."""
    if not algorithm.is_limited:
        return "exact"
    if algorithm.inputs == "held":
        return "held"
    if not description.variables[variable].is_real or description.is_sampled:
        return "held"
    if description.input_derivative(variable, 1) is None:
        return "middle"
    return "line" if description.input_derivative(variable, 2) is None else "parabola"


def sentences(name: str, signal: Signal, way: Way, step_size: float, end: float) -> list[str]:
    """Return the sentences on ends, content and jumps of a signal from 0 to `end` [s]; none where all fit."""
    found = signal.remarks(0.0, end)
    if way != "exact":
        found += filter(None, (_points_sentence(signal, step_size), _jumps_sentence(signal, step_size, end)))
    return [f"{name}: {words}" for words in found]


def deviation_sentence(
    name: str, signal: Signal, way: Way, step_size: float, end: float, tolerance: float
) -> list[str]:
    """Return the sentence on a deviation beyond the tolerance, relative to half the range; none for a smaller one."""
    deviation, range_ = deviation_of(signal, way, step_size, end)
    if way == "exact" or deviation <= tolerance * range_:
        return []
    return [
        f"{name}: the input is {_WORDS[way]} of {readable(step_size, 's')}, and deviates from its signal by up to "
        f"{100 * deviation / range_:.3g} % of half its range (tolerance {100 * tolerance:.3g} %); {_advice(way)}"
    ]


def deviation_of(signal: Signal, way: Way, step_size: float, end: float) -> tuple[float, float]:
    """Return the largest deviation of the fed input from its signal between the points, and half the range of that.

    Steps in which the signal jumps do not count.
    """
    if way == "exact":
        return 0.0, 0.0
    steps = max(round(end / step_size), 1)
    examined = np.unique(np.linspace(0, steps - 1, min(steps, _MOST)).astype(np.int64))
    fractions = np.tile([0.25, 0.5, 0.75], len(examined))
    numbers = np.repeat(examined, 3)
    rows = signal.knots(0.0, steps * step_size)
    inside = np.floor(rows / step_size).astype(np.int64)
    numbers = np.concatenate([numbers, inside])
    fractions = np.clip(np.concatenate([fractions, rows / step_size - inside]), 0.0, 1.0 - _SAME)
    jumps = _jumps(signal, steps * step_size)
    is_smooth = ~np.isin(numbers, np.floor(jumps / step_size + _SAME).astype(np.int64)[_is_within(jumps, step_size)])
    found = _sampled(signal, way, step_size, numbers[is_smooth], fractions[is_smooth])
    if not len(found.time):
        return 0.0, 0.0
    values = np.concatenate([found.signal, found.fed])
    return float(np.abs(found.signal - found.fed).max()), float(values.max() - values.min()) / 2


def _sampled(
    signal: Signal, way: Way, step_size: float, numbers: NDArray[np.int64], fractions: NDArray[np.float64]
) -> Sampled:
    """Return the signal and what is fed at fractions of steps, by their numbers."""
    begin, time, margin = numbers * step_size, (numbers + fractions) * step_size, _SAME * step_size
    values = signal.derivatives(time, margin)[0]
    first, last = signal.derivatives(begin, margin)[0], signal.derivatives(begin + step_size, -margin)[0]
    middle = signal.derivatives(begin + step_size / 2)[0]
    x = fractions
    fed = {
        "held": first,
        "middle": middle,
        "line": first + x * (last - first),
        "parabola": first + x * (-3 * first + 4 * middle - last) + 2 * x**2 * (first - 2 * middle + last),
    }[way]
    return Sampled(time, values, fed)


def _points_sentence(signal: Signal, step_size: float) -> str:
    """Return a sentence on few points in a period of the highest frequency; empty where there are enough."""
    if not signal.highest or (points := 1 / (signal.highest * step_size)) >= _FEWEST * (1 - 1e-9):
        return ""
    words = f"its content up to {signal.highest:.4g} Hz has {points:.3g} communication points per period"
    if points <= 2:
        return f"{words}; above {0.5 / step_size:.4g} Hz it is seen at other frequencies (aliasing)"
    return f"{words}; a step of {readable(1 / (_FEWEST * signal.highest), 's')} has {_FEWEST}"


def _jumps(signal: Signal, end: float) -> NDArray[np.float64]:
    """Return the times [s] at which the value jumps."""
    times = signal.breaks(0.0, end)
    if not len(times):
        return times
    gaps = np.diff(times)
    margin = 1e-3 * float(gaps.min()) if len(gaps) else 1e-9 * end
    before, after = signal.derivatives(times, -margin)[0], signal.derivatives(times, margin)[0]
    size = max(float(np.abs(before).max()), float(np.abs(after).max()))
    return times[np.abs(after - before) > 1e-12 * size]


def _is_within(times: NDArray[np.float64], step_size: float) -> NDArray[np.bool_]:
    """Whether times are between two communication points."""
    return np.abs(times / step_size - np.round(times / step_size)) > _SAME


def _jumps_sentence(signal: Signal, step_size: float, end: float) -> str:
    """Return a sentence on jumps between communication points; empty where there are none."""
    jumps = _jumps(signal, end)
    late = jumps[_is_within(jumps, step_size)]
    if not len(late):
        return ""
    seen = np.ceil(late[0] / step_size) * step_size
    if len(late) == 1:
        return f"it jumps at {late[0]:.9g} s, between two communication points, and the input at {seen:.9g} s"
    between = np.diff(np.floor(jumps / step_size))
    lost = int(np.count_nonzero(between == 0))
    passed = f", and {lost} values between two points are passed over" if lost else ""
    return (
        f"it jumps {len(late)} times between communication points, first at {late[0]:.9g} s; the input jumps at the "
        f"next point{passed}"
    )


def _advice(way: Way) -> str:
    """Return what follows a signal closer."""
    if way == "held":
        return "a shorter step, or an algorithm that moves inputs (jacobi_linear), follows it closer"
    return "a shorter step follows it closer"
