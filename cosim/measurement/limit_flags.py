"""Limit flags: outputs that are 1 while a saturation or limit is active, known by the last part of their name.

    limit_signals(connectors)                  # ["controller.axis[1].saturation", "stack[1].contact_lost"]
    for found in active_limits(time, values):  # values of a run by full name
        print(found.message)                   # the limit, when it was active, its meaning, and advice

A part declares a limit by the name of an output alone; runs, sweeps and reports evaluate the flags. The output of an
FMU of another maker is no flag, whatever its name.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hfsa.cosim.results.files import read_limit_flags
from hfsa.cosim.systems.connectors import Connector


@dataclass(frozen=True)
class Limit:
    """A kind of limit.

    Attributes:
        word: state of the component while the limit is active, `saturated`.
        meaning: consequence for the results; `advice`: possible remedy.
        spoils_response: whether a response measured meanwhile differs from the small-signal response.
    """

    word: str
    meaning: str
    advice: str
    spoils_response: bool = True


_SATURATED = Limit("saturated", "a command is held at its limit", "take a smaller motion or a higher limit")

LIMITS: Mapping[str, Limit] = {
    "saturation": _SATURATED,
    "saturated": _SATURATED,
    "current_limited": Limit(
        "at its current limit",
        "the amplifier gives no more current, and the voltage falls behind its command",
        "take a slower motion or a higher limit",
    ),
    "contact_lost": Limit(
        "out of contact",
        "a contact that can only push would have to pull, and is computed as if it were glued",
        "take a preload, or a motion in which it pushes throughout",
    ),
    "overload": Limit(
        "overloaded",
        "a load exceeds its permissible value, although the model does not fail",
        "take a smaller motion",
        spoils_response=False,
    ),
    "workspace_left": Limit(
        "outside its workspace",
        "a limb is as short as its rod, a tube is beyond its end, or the pose is singular, and the machine would block",
        "take a smaller motion or another posture",
    ),
    "displacement_warning": Limit(
        "displaced too far",
        "its equations hold for small displacements only, and this one is large",
        "take a smaller motion",
        spoils_response=False,
    ),
}
"""Kinds of limits by the last part of their signals' names."""


@dataclass(frozen=True)
class ActiveLimit:
    """A limit that was active in a run.

    Attributes:
        signal: full name of the flag.
        first_time: time of the first active point [s]; `share`: fraction of active points.
        lasting_since: time [s] from which it was active to the end, `None` where it was inactive at the end.
    """

    signal: str
    first_time: float
    share: float
    lasting_since: float | None = None

    @property
    def limit(self) -> Limit:
        """The kind of limit."""
        return LIMITS[_flag_of(self.signal)]

    @property
    def message(self) -> str:
        """Message about the limit after a run."""
        limit = self.limit
        lasting = "" if self.lasting_since is None else f", to the end from {self.lasting_since:.9g} s on"
        return (
            f"{_spelled(self.signal)}: {limit.word}, first at t = {self.first_time:.9g} s, {100 * self.share:.3g} % of "
            f"the time{lasting}: {limit.meaning}; {limit.advice}"
        )

    @property
    def response_message(self) -> str:
        """Message about the limit during the measurement of a frequency response."""
        limit = self.limit
        spoilt = ", and the response is not the small-signal response" if limit.spoils_response else ""
        return (
            f"{_spelled(self.signal)}: {limit.word} at t = {self.first_time:.9g} s: {limit.meaning}{spoilt}; "
            f"{limit.advice}"
        )


def is_limit(name: str) -> bool:
    """Whether a variable with that name, full or not, is a limit flag."""
    return _flag_of(name) in LIMITS


def limit_signals(connectors: Mapping[str, Mapping[str, Connector]]) -> list[str]:
    """Return the limit flags (full names) among outputs; `connectors` are each component's variables by name."""
    return [
        f"{component}.{name}"
        for component, variables in connectors.items()
        for name, variable in variables.items()
        if variable.causality == "output" and variable.is_conventional and is_limit(name)
    ]


def recorded_flags(path: Path, values: Mapping[str, NDArray[np.float64]]) -> dict[str, NDArray[np.float64]]:
    """Return the limit flags among the values of a run by full name, as its file names them."""
    stated = read_limit_flags(path)
    return {name: v for name, v in values.items() if (is_limit(name) if stated is None else name in stated)}


class LimitLog:
    """Limits that are active in a run, from flags that come block by block."""

    def __init__(self):
        self._logs: dict[str, _Log] = {}

    def add(self, time: NDArray[np.float64], flags: Mapping[str, NDArray[np.float64]]) -> None:
        """Add a block: times [s], and flags by full name, (points,); those of a thinned file are fractions."""
        for name, values in flags.items():
            self._logs.setdefault(name, _Log()).add(time, values)

    @property
    def active(self) -> list[ActiveLimit]:
        """The limits that were active, the earliest first."""
        found = [
            ActiveLimit(name, log.first, log.active / log.points, log.since)
            for name, log in self._logs.items()
            if log.first is not None
        ]
        return sorted(found, key=lambda limit: limit.first_time)


@dataclass
class _Log:
    """One flag so far: number of points, how many were active, the first active time, and since when to the end [s]."""

    points: int = 0
    active: float = 0.0
    first: float | None = None
    since: float | None = None

    def add(self, time: NDArray[np.float64], flags: NDArray[np.float64]) -> None:
        """Add a block of finite flags."""
        acts = np.flatnonzero(flags)
        self.points += len(flags)
        self.active += float(np.sum(flags))
        if len(acts) and self.first is None:
            self.first = float(time[acts[0]])
        rests = np.flatnonzero(flags == 0)
        if len(rests):
            later = rests[-1] + 1
            self.since = float(time[later]) if later < len(flags) else None
        elif len(acts) and self.since is None:
            self.since = float(time[0])


def active_limits(time: ArrayLike, values: Mapping[str, ArrayLike]) -> list[ActiveLimit]:
    """Return the limits that were active in a run, the earliest first.

    `time` [s] has shape (points,), like the `values` of each variable by full name; points not reached are NaN. The
    flags of a thinned file are fractions.
    """
    log, at = LimitLog(), np.asarray(time, dtype=float)
    for name in filter(is_limit, values):
        flags = np.asarray(values[name], dtype=float)
        reached = np.isfinite(flags)
        log.add(at[reached], {name: flags[reached]})
    return log.active


def _flag_of(name: str) -> str:
    """Return the last part of a name, a key of `LIMITS` for a limit flag."""
    return name.rpartition(".")[2]


def _spelled(name: str) -> str:
    """Return a full name as in messages: `controller: axis[1].saturation`."""
    component, _, variable = name.partition(".")
    return f"{component}: {variable}"
