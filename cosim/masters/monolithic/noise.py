"""Rounding noise of a joint equation; a solver that tries to resolve it gains nothing and stalls.

    noise = rounding_noise(ode, t, x, size, fastest, stop)     # of [der(x); w], (n + m,), at states of that size

There are three sources of noise, of which the largest counts:

    along the states    sums of large forces that are almost in balance
    along time          functions of time inside an FMU, for example a motion that is added to a constant
    last digits         a connected output w has steps of 2^-52 of its size, however it moves: 2e-16 rad at 1 rad

Sixth differences along a line eliminate a smooth function and amplify noise by a known factor (Moré and Wild,
Estimating computational noise, 2011). Along the states the smallest result of several lines counts, because a line may
cross a kink. Along time the lines have several lengths: a fast smooth function is resolved on the shortest, while a
function with steps shows none of its steps there. So the smallest result counts again, among the lines on which the
function changes between most neighbouring points.
"""

import math
from collections.abc import Iterable

import numpy as np

from hfsa.cosim.fmi.step_error import StepError
from hfsa.cosim.masters.monolithic.joint_ode import JointOde

REFUSALS = ("discard", "does not converge")
"""Statuses of an FMU or an algebraic loop at a state that a shorter step may avoid."""

_ORDER = 6
_AMPLIFIED = math.sqrt(math.comb(2 * _ORDER, _ORDER))
"""Standard deviation of differences of that order, for noise of standard deviation 1."""
_POINTS = 9
_LINES = 3
"""Number of lines along the states."""
_SPACING = 1e-3
"""Spacing of the points, relative to the size of a state or to the shortest time constant."""
_SHORTER = tuple(16**k for k in range(6))
"""Divisors of the spacing, one for each line along time."""
_CHANGES = 4
"""Smallest number of changes between the nine points of a line along time that counts."""
_UNIFORM = math.sqrt(12.0)
"""Width of a uniform distribution by its standard deviation."""


def rounding_noise(
    ode: JointOde, time: float, x: np.ndarray, size: np.ndarray, fastest: float, stop: float
) -> np.ndarray:
    """Return the standard deviation of the noise in [der(x); w], (n + m,), within `size`, (n,), around x, (n,).

    `fastest` [rad/s] is the inverse of the shortest time constant; no FMU is evaluated beyond `stop` [s]. Raises
    `StepError` where an FMU fails.
    """
    states, last_digits = _along_states(ode, time, x, size), np.zeros(len(x) + len(ode.places))
    ode.evaluate(time, x)
    last_digits[: len(x)] = np.linalg.norm(pushes(ode) * np.spacing(np.abs(ode.values)) / _UNIFORM, axis=1)
    spacing = min(_SPACING / fastest, (stop - time) / _POINTS)
    found = np.max([states, _along_time(ode, time, x, spacing), last_digits], axis=0)
    ode.evaluate(time, x)
    return found


def pushes(ode: JointOde) -> np.ndarray:
    """Return the derivative of der(x) by each value w, (n, m), with all connections closed, at the last evaluation."""
    joint, n, m = ode.partials(), len(ode.x), len(ode.places)
    return joint[:n, n:] @ np.linalg.inv(np.eye(m) - joint[n:, n:])


def _along_states(ode: JointOde, time: float, x: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return the noise along lines of states at one time, (n + m,)."""
    found = []
    for direction in np.random.default_rng(0).uniform(-1, 1, (_LINES, len(x))):
        line = _line(ode, [(time, x + (1 + _SPACING * k) * size * direction) for k in range(_POINTS)])
        if line is not None:
            found.append(_roughness(line))
    return np.min(found, axis=0) if found else np.zeros(len(x) + len(ode.places))


def _along_time(ode: JointOde, time: float, x: np.ndarray, spacing: float) -> np.ndarray:
    """Return the noise along time at one state, (n + m,); `spacing` [s] is that of the longest line."""
    found = []
    for shorter in _SHORTER:
        line = _line(ode, [(time + k * spacing / shorter, x) for k in range(_POINTS)])
        if line is not None:
            changes = np.count_nonzero(np.diff(line, axis=0), axis=0)
            found.append(np.where(changes >= _CHANGES, _roughness(line), np.inf))
    least = np.min(found, axis=0) if found else np.zeros(len(x) + len(ode.places))
    return np.where(np.isfinite(least), least, 0.0)


def _line(ode: JointOde, points: Iterable[tuple[float, np.ndarray]]) -> np.ndarray | None:
    """Return [der(x); w] at times and states, (points, n + m); `None` where an FMU refuses a point."""
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
