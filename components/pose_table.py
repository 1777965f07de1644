"""Motion of a platform from a table: a displacement and a rotation vector over time, with exact derivatives.

The table is a CSV file whose first row names the columns: `time` [s], and some of `x`, `y`, `z` [m] and `rotation_x`,
`rotation_y`, `rotation_z` [rad], the components of the displacement and of the rotation vector from the posture; those
that it has not are 0. Splines with two continuous derivatives join the rows, and the platform stands still before the
first and after the last one (`_modelling/motion_table.py`).

The outputs are `position[i]` [m] and `rotation[i]` [rad], with `_rate` and `_acceleration`: a command of
`sdelta_reference`. There is no input and so no Bode plot.
"""

import math

import numpy as np

from hfsa.components import Model, ModelError
from hfsa.components._modelling.motion_table import MotionTable, splined

_POSITION, _ROTATION = ("x", "y", "z"), ("rotation_x", "rotation_y", "rotation_z")


def pose_table(*, table: MotionTable | None = None, reach: float = 1.0) -> Model:
    """Return the motion of one table; without one the platform stands still.

    Args:
        table: the path of a CSV file.
        reach: farthest displacement along an axis that may be meant [m]; a rotation is less than half a turn.

    Raises:
        ModelError: a file that is no such table, by its line; columns of another motion; a row beyond reach.
    """
    table = MotionTable({"time": (0.0, 1.0), "x": (0.0, 0.0)}) if table is None else table
    known = (*_POSITION, *_ROTATION)
    if strange := [name for name in table.names if name not in known]:
        raise ModelError(
            f"pose_table: the table has the columns {', '.join(strange)}, expected some of {', '.join(known)}"
        )
    for names, limit, unit in ((_POSITION, reach, "m"), (_ROTATION, math.pi, "rad")):
        size = np.abs(table.values(names))
        if size.max() > limit:
            row, column = (int(place) for place in np.argwhere(size > limit)[0])
            raise ModelError(
                f"pose_table: row {row + 1}: {names[column]} is {table.values(names)[row, column]:g} {unit}, expected "
                f"{limit:.4g} {unit} at most"
            )
    m = Model("PoseTable", "Motion of a platform from a table")
    words = (("", "", 1e-4, 1e-3), ("_rate", "/s", 1e-2, 1e-1), ("_acceleration", "/s2", 1.0, 10.0))
    for (order, per, move, turn), column in zip(words, splined(table, known, m.time), strict=True):
        text = ("Commanded {}" + order.replace("_", ", ")).format
        m.output(f"position{order}[1..3]", column[:3], f"m{per}", text("displacement"), nominal=move)
        m.output(f"rotation{order}[1..3]", column[3:], f"rad{per}", text("rotation vector"), nominal=turn)
    return m
