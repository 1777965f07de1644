"""Error of a run that cannot continue, and the words for statuses of FMI calls."""

from typing import Any

from hfsa.cosim.fmi.isolation.waiting import LOST, NOT_LOADED, OVERDUE, is_overdue
from hfsa.cosim.fmi.library import TERMINATED

_STATUS = {
    0: "ok",
    1: "warning",
    2: "discard",
    3: "error",
    4: "fatal",
    5: "pending",
    TERMINATED: "terminated",
    LOST: "lost",
    OVERDUE: "overdue",
    NOT_LOADED: "not loaded",
}
FATAL = 4
"""Status of FMI after which the instance can be called no more."""

_UNSTABLE = "where the loop is unstable at this step, a smaller one helps"
_ADVICE = {
    "discard": "the FMU refuses a step of this size from here; try a smaller one",
    "error": "the run cannot continue; check its inputs and parameters",
    "fatal": "the FMU cannot be used in this process any more; check its inputs and parameters",
    "terminated": "the FMU requests the end of the run",
    "lost": "`hfsa check` tries the FMU on its own",
    "overdue": "allow more time or take another step",
    "not finite": _UNSTABLE,
    "out of bounds": _UNSTABLE,
    "diverged": _UNSTABLE,
}


class StepError(RuntimeError):
    """Error of a run that cannot continue: a failed FMI call, or a response outside its bounds.

    Attributes:
        instance: name of the instance.
        function: the failed FMI function, or the variable with an inadmissible value.
        status: `discard`, `error`, `fatal`, `terminated`, `lost` (its process ended), `overdue`, or `not finite`,
            `out of bounds`, `diverged`.
        time: communication point [s] of the failure; `None` before initialization.
        message: log messages of the FMU, or details of the value.
    """

    exit_code = 4

    def __init__(self, instance: str, function: str, status: str, time: float | None, message: str = ""):
        at = "" if time is None else f" at t = {time:.9g} s"
        advice = f"; {_ADVICE[status]}" if status in _ADVICE else ""
        super().__init__(f"{instance}: {function}: {status}{at}{': ' + message if message else ''}{advice}")
        self.instance, self.function, self.status, self.time = instance, function, status, time
        self.message = message

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.instance, self.function, self.status, self.time, self.message)


def check_time(what: str, time: float) -> None:
    """Raise `StepError` of what has come to a time [s], where the time limit of `waiting.limited` is over."""
    if is_overdue():
        raise StepError(what, "stepping", "overdue", time, "it did not end within the time limit")


def label_of(status: int) -> str:
    """Return the word for a status of a call."""
    return _STATUS.get(status, f"status {status}")
