"""Rows of a results file among the points of a recording, taken block by block while a run goes on.

    rows = KeptRows(master.record(names, rows=capacity), kept, flags)
    file.write(rows.written, rows.take())        # whenever there are new points

A limit flag of a row is the fraction of the points since the row before at which it was active. The recording forgets
what was taken, so that the memory of a run does not grow with its length.
"""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.actions.recording import Recording
from hfsa.cosim.measurement.limit_flags import LimitLog


class KeptRows:
    """Rows of a file: `kept` holds the numbers of their points, ascending from 0, `flags` names the limit flags.

    Attributes:
        written: number of rows taken.
        limits: the limits that were active at any point.
    """

    def __init__(self, recording: Recording, kept: NDArray[np.int64], flags: Collection[str] = ()):
        self._recording, self._kept, self._flags = recording, kept, frozenset(flags)
        self.written, self.limits = 0, LimitLog()
        self._forgotten = self._seen = 0

    @property
    def is_behind(self) -> bool:
        """Whether points were recorded after the last row taken."""
        return self._recording.rows > 0

    def take(self) -> dict[str, NDArray[np.float64]]:
        """Return the rows recorded since the last call, by variable."""
        recording = self._recording
        flags = {name: recording[name][self._seen :] for name in recording.names if name in self._flags}
        self.limits.add(recording.time[self._seen :], flags)
        reached = int(np.searchsorted(self._kept, self._forgotten + recording.rows))
        points = self._kept[self.written : reached] - self._forgotten
        values = self._at(points)
        self.written = reached
        taken = int(points[-1]) + 1 if len(points) else 0
        recording.forget(taken)
        self._forgotten += taken
        self._seen = recording.rows
        return values

    def last(self) -> dict[str, NDArray[np.float64]]:
        """Return the last point recorded, by variable, as a row that is not planned."""
        return self._at(np.array([self._recording.rows - 1]))

    def _at(self, points: NDArray[np.int64]) -> dict[str, NDArray[np.float64]]:
        """Return the values at points of the recording; of a limit flag, the mean since the point before."""
        values = {name: self._recording[name] for name in self._recording.names}
        if not len(points):
            return {name: of_all[:0].copy() for name, of_all in values.items()}
        begins, end = np.append(0, points[:-1] + 1), points[-1] + 1
        counts, flags = points + 1 - begins, self._flags
        return {
            name: np.add.reduceat(of_all[:end], begins) / counts if name in flags else of_all[points]
            for name, of_all in values.items()
        }
