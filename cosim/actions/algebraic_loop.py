"""Algebraic loops across FMUs: outputs that depend on each other through direct feedthrough, solved by Newton's method.

Each pass sets the values w on the connections of a loop, fetches the outputs y(w), and corrects w towards w = y(w):

    w <- w + (1 - dy/dw)^-1 (y(w) - w)

until the change is at most `TOLERANCE` of the value, or of its nominal where that is larger. One more pass then reduces
the residual to rounding, so that it does not grow from point to point. dy/dw consists of the FMUs' directional
derivatives, or of finite differences where an FMU has none. Its inverse is reused until `PASSES` passes do not
converge; it is then computed again. A loop of linear parts takes two passes, whatever its gain.

The stepping loop in C computes the same bits as `run`; `solve` continues where `run` returns `STALE`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hfsa.cosim.actions.action import CompositeAction, Group, Transfer
from hfsa.cosim.fmi.co_simulation import Instance, StepError
from hfsa.cosim.fmi.library import fails

TOLERANCE = 1e-10
"""Largest last change but one of a value on a loop, relative to the value or its nominal."""

ROUNDING = 1e-15
"""Relative change below which a further pass changes nothing."""

PASSES = 8
"""Passes with one inverse before it is computed again."""

REFRESHES = 20
"""Inverses after which an unsolved loop is an error."""

STALE = 101
"""Status of a run that needs a new inverse, in addition to those of FMI."""

_DIFFERENCE = 1e-6
"""Relative step of the finite differences that replace directional derivatives."""


@dataclass(eq=False)
class AlgebraicLoop(CompositeAction):
    """One algebraic loop: the action that solves it.

    Attributes:
        number: index of the loop in its system.
        groups: outputs on the loop; `inner` are the transfers that close it, `transfers` those to other inputs.
        places: indices of the loop's connections on the `bus`, (n,); `ends` are (source instance, output, target
            instance, input) of each.
        scale: nominals of the values, (n,); `words` name the loop in messages.
        inverse: (1 - dy/dw)^-1, (n, n).
    """

    number: int
    groups: Sequence[Group]
    inner: Sequence[Transfer]
    transfers: Sequence[Transfer]
    places: np.ndarray
    ends: Sequence[tuple[str, str, str, str]]
    bus: np.ndarray
    scale: np.ndarray
    words: str
    instances: dict[str, Instance]
    inverse: np.ndarray = field(init=False)

    def __post_init__(self):
        n = len(self.places)
        self.inverse, self.guess, self.change = np.empty((n, n)), np.zeros(n), np.zeros(n)
        self.forget()

    def forget(self) -> None:
        """Discard the inverse: the next solution starts from the outputs at that time."""
        self.inverse[:] = np.nan

    def run(self) -> int:
        """Correct the values until they agree; return the first status that is not ok, or `STALE`."""
        warning, was_close = 0, False
        for _ in range(PASSES if self._is_begun() else 0):
            status = self._evaluate()
            if fails(status):
                return status
            warning = warning or status
            change = self._correct()
            if change <= ROUNDING or (was_close and change <= TOLERANCE):
                return warning
            was_close = change <= TOLERANCE
        return STALE

    def solve(self, time: float) -> int:
        """Solve with a new inverse at the present values, up to `REFRESHES` times; return 0 or the first warning.

        Raises `StepError` where the loop has no unique solution or Newton's method does not converge.
        """
        if not self._is_begun():
            self._checked(self._fetch(), time)
        for _ in range(REFRESHES):
            self._refresh(time)
            status = self.run()
            if status != STALE:
                return self._checked(status, time)
        i = int(np.argmax(np.abs(self.change) / self._size()))
        source, output, _, _ = self.ends[i]
        residual = float(self.bus[self.places][i] - self.change[i] - self.guess[i])
        raise StepError(
            source,
            output,
            "does not converge",
            time,
            f"the algebraic loop {self.words} is not solved after {REFRESHES * PASSES} passes of Newton's method; "
            f"residual {residual:.3g} at value {self.guess[i]:.6g}",
        )

    def _evaluate(self) -> int:
        """Set the loop's inputs and fetch its outputs; return the first status that is not ok."""
        set_ = self._run(transfer.call for transfer in self.inner)
        self.guess[:] = self.bus[self.places]
        if fails(set_):
            return set_
        got = self._fetch()
        return got if fails(got) else set_ or got

    def _fetch(self) -> int:
        """Fetch the loop's outputs; return the first status that is not ok."""
        return self._run(group.call for group in self.groups)

    def _is_begun(self) -> bool:
        """Whether an inverse has been computed."""
        return not np.isnan(self.inverse[0, 0])

    def _correct(self) -> float:
        """Take one Newton step; return the largest change relative to the size of its value."""
        residual = self.bus[self.places] - self.guess
        self.change[:] = product(self.inverse, residual)
        self.bus[self.places] = self.guess + self.change
        return float(np.max(np.abs(self.change) / self._size()))

    def _size(self) -> np.ndarray:
        """Return the sizes that changes are divided by, (n,)."""
        return np.maximum(np.abs(self.guess), self.scale)

    def _refresh(self, time: float) -> None:
        """Compute the inverse at the present values."""
        n = len(self.places)
        gradient = np.zeros((n, n))
        for name in dict.fromkeys(source for source, *_ in self.ends):
            rows = [i for i, (source, *_) in enumerate(self.ends) if source == name]
            columns = [i for i, (*_, target, _) in enumerate(self.ends) if target == name]
            outputs, inputs = [self.ends[i][1] for i in rows], [self.ends[i][3] for i in columns]
            gradient[np.ix_(rows, columns)] = direct_gain(self.instances[name], outputs, inputs)
        try:
            self.inverse[:] = np.linalg.inv(np.eye(n) - gradient)
        except np.linalg.LinAlgError:
            source, output, _, _ = self.ends[0]
            message = f"the algebraic loop {self.words} has loop gain 1, and so no solution or any number of them"
            raise StepError(source, output, "does not converge", time, message) from None


def product(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Return a matrix times a vector, summed column by column as in C; the order of a library's sums may differ."""
    total = np.zeros(len(matrix))
    for column, value in zip(matrix.T, vector, strict=True):
        total += column * value
    return total


def direct_gain(instance: Instance, outputs: Sequence[str], inputs: Sequence[str]) -> np.ndarray:
    """Return the direct feedthrough d output / d input, (outputs, inputs).

    Finite differences replace directional derivatives that the FMU does not provide.
    """
    if instance.fmu.description.has_derivatives:
        distinct = list(dict.fromkeys(outputs))
        return instance.jacobian(distinct, inputs)[[distinct.index(name) for name in outputs]]
    found, at = instance.handle(outputs), instance.handle(inputs)
    values = instance.get(at).copy()
    result = np.zeros((len(outputs), len(inputs)))
    for j, name in enumerate(inputs):
        step = _DIFFERENCE * max(abs(values[j]), abs(instance.fmu.variables[name].nominal))
        for sign in (1.0, -1.0):
            moved = values.copy()
            moved[j] += sign * step
            instance.set(at, moved)
            result[:, j] += sign * instance.get(found) / (2 * step)
    instance.set(at, values)
    return result
