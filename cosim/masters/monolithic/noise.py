"""Noise that rounding makes in a joint equation; a solver that resolves it gains nothing and comes to rest.

    noise = rounding_noise(ode, t, x, size, fastest, stop)     # of [der(x); w], (n + m,), at states of that size

It comes in three ways, of which the largest counts:

    along the states    sums of large forces that are almost in balance
    along time          what an FMU makes of time itself: a motion that is added to a constant inside it, say
    of last digits      a connected output w has steps of 2^-52 of its size, however it moves: 2e-16 rad at 1 rad

Sixth differences along a line leave nothing of a smooth function, and amplify noise by a known factor (Moré and Wild,
Estimating computational noise, 2011). Along the states the least of several lines counts, because one may cross a kink.
Along time lines have several lengths: what is smooth, though fast, is so on the shortest, and what comes in steps has
none of them there. So the least counts again, but of lines on which there is a change from most points to the next.
"""

import math
from collections.abc import Iterable

import numpy as np

from hfsa.cosim.fmi.base_instance import StepError
from hfsa.cosim.masters.monolithic.joint_ode import JointOde

REFUSALS = ("discard", "does not converge")
"""What an FMU, or an algebraic loop, may say of a state that a shorter step does not come to."""

_ORDER = 6
_AMPLIFIED = math.sqrt(math.comb(2 * _ORDER, _ORDER))
"""Standard deviation of differences of that order of noise of standard deviation 1."""
_POINTS = 9
_LINES = 3
"""Lines along which the states are moved."""
_SPACING = 1e-3
"""From one point to the next, relative to the size of a state, or to the shortest time in which anything happens."""
_SHORTER = tuple(16**k for k in range(6))
"""Lines along time, by how many times shorter their spacing is."""
_CHANGES = 4
"""Points of a line along time, of eight, that differ from the one before where that line counts."""
_UNIFORM = math.sqrt(12.0)
"""Width of a uniform distribution by its standard deviation."""


def rounding_noise(
    ode: JointOde, time: float, x: np.ndarray, size: np.ndarray, fastest: float, stop: float
) -> np.ndarray:
    """Return the standard deviation of the noise in [der(x); w], (n + m,), at x, (n,), and about it by `size`, (n,).

    `fastest` [rad/s] is the inverse of the shortest time in which anything happens; no FMU is asked for anything beyond
    `stop` [s]. `StepError` where an FMU fails.
    """
    states, last_digits = _along_states(ode, time, x, size), np.zeros(len(x) + len(ode.places))
    ode.evaluate(time, x)
    last_digits[: len(x)] = np.linalg.norm(pushes(ode) * np.spacing(np.abs(ode.values)) / _UNIFORM, axis=1)
    spacing = min(_SPACING / fastest, (stop - time) / _POINTS)
    found = np.max([states, _along_time(ode, time, x, spacing), last_digits], axis=0)
    ode.evaluate(time, x)
    return found


def pushes(ode: JointOde) -> np.ndarray:
    """Return by how much der(x) moves with each value w, all connections closed, (n, m), at the last evaluation."""
    joint, n, m = ode.partials(), len(ode.x), len(ode.places)
    return joint[:n, n:] @ np.linalg.inv(np.eye(m) - joint[n:, n:])


def _along_states(ode: JointOde, time: float, x: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return the noise on lines of states at one time."""
    found = []
    for direction in np.random.default_rng(0).uniform(-1, 1, (_LINES, len(x))):
        line = _line(ode, [(time, x + (1 + _SPACING * k) * size * direction) for k in range(_POINTS)])
        if line is not None:
            found.append(_roughness(line))
    return np.min(found, axis=0) if found else np.zeros(len(x) + len(ode.places))


def _along_time(ode: JointOde, time: float, x: np.ndarray, spacing: float) -> np.ndarray:
    """Return the noise on lines of time at one state, the longest with that spacing [s]; none where nothing changes."""
    found = []
    for shorter in _SHORTER:
        line = _line(ode, [(time + k * spacing / shorter, x) for k in range(_POINTS)])
        if line is not None:
            changes = np.count_nonzero(np.diff(line, axis=0), axis=0)
            found.append(np.where(changes >= _CHANGES, _roughness(line), np.inf))
    least = np.min(found, axis=0) if found else np.zeros(len(x) + len(ode.places))
    return np.where(np.isfinite(least), least, 0.0)


def _line(ode: JointOde, points: Iterable[tuple[float, np.ndarray]]) -> np.ndarray | None:
    """Return [der(x); w] at times and states, (points, n + m); `None` where an FMU refuses one."""
    try:
        return np.array([np.concatenate([ode.evaluate(*point), ode.values]) for point in points])
    except StepError as error:
        if error.status not in REFUSALS:
            raise
        return None


def _roughness(line: np.ndarray) -> np.ndarray:
    """Return the standard deviation of the noise on a line, (points, n), as (n,)."""
    differences = np.diff(line, _ORDER, axis=0)
    return np.sqrt(np.mean(differences**2, axis=0)) / _AMPLIFIED
