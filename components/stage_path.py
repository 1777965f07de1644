"""Reference motion of the 3-RRR stage along a path of its platform: elongations of its three stacks over time.

    table    elongations, or poses turned into elongations, joined by splines (`_modelling/motion_table.py`)
    circle   x = s(t) (x_0 + radius cos(omega t)),  y = s(t) (y_0 + radius sin(omega t)),  yaw = s(t) yaw_0
             s = 10 a^3 - 15 a^4 + 6 a^5,  a = min(frequency t, 1),  omega = 2 pi frequency

l(x, y, yaw) is the inverse kinematics in closed form, of every instant and not of the rows alone: the platform of an
`exact` stage that follows l moves on the splines of the pose. With a Jacobian in place of the links it is
J^-1 (x, y, yaw). Rates and accelerations are the exact derivatives.

The table is a CSV file whose first row names the columns: `time` [s], and `x`, `y` [m] and `yaw` [rad] from rest, or
`elongation_1`, `elongation_2` and `elongation_3` [m]. Before its first row and after its last one the stage stands
still. A circle begins at rest and is complete from the second turn on, with two continuous derivatives.

The outputs are those of `stage_reference`, `stack[i].elongation` [m] with `_rate` and `_acceleration`, and of a path of
poses the commanded `platform.position` [m] and `.rotation` [rad] with their derivatives. There is no input and so no
Bode plot.

Source: thesis of 2000 on the 3-RRR stage, ch. 2, for the kinematics; the motions are not in it.
"""

from collections.abc import Iterator
from typing import Literal

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from hfsa.components import Model, ModelError
from hfsa.components._mechanics.pzt import TOKIN
from hfsa.components._mechanics.rrr_design import Design, Matrix
from hfsa.components._mechanics.rrr_facts import GEOMETRY, STACK_STROKE
from hfsa.components._mechanics.rrr_kinematics import AS_NAMED, Kinematics, LinkChanges, elongations
from hfsa.components._modelling.facts import Known
from hfsa.components._modelling.motion_table import Motion, MotionTable, splined

FACTS = {**GEOMETRY, STACK_STROKE: Known("stroke")}

_POSE = ("x", "y", "yaw")
_ELONGATIONS = ("elongation_1", "elongation_2", "elongation_3")
_ROUNDING = 1e-9
"""Tolerance at the ends of the stroke [m], for poses given with a few digits."""
_ANGLES = 360
"""Points of a circle that are checked."""
_ORDERS = (
    ("", "", "", 1e-6, 1e-4),
    ("_rate", "/s", "rate of the ", 1e-3, 1e-1),
    ("_acceleration", "/s2", "acceleration of the ", 1.0, 1e2),
)


def stage_path(
    *,
    motion: Literal["circle"] | MotionTable = "circle",
    centre: tuple[float, float, float] = (0.0, 0.0, -9e-4),
    radius: float = 2e-6,
    kinematics: Kinematics = "nominal",
    links: LinkChanges = AS_NAMED,
    jacobian: Matrix | None = None,
    stroke: float = TOKIN.stroke,
) -> Model:
    """Return the reference along one path.

    Args:
        motion: `circle`, or the path of a CSV file.
        centre: x_0, y_0 [m] and yaw_0 [rad] of the circle from rest.
        radius: radius of the circle [m].
        kinematics: parameter set of the stage's links; `measured` is a Jacobian.
        links: lengths [m] and angles [rad] of the links in place of those of the set.
        jacobian: Jacobian from elongations to pose in place of the links, nine numbers row by row [m/m; m/m; rad/m].
        stroke: free stroke of the stacks [m].

    Raises:
        ModelError: a file that is no such table, by its line; a pose out of reach of the legs, or elongations outside
            the free stroke, by the row or the angle; a motion of another name.
    """
    m = Model("StagePath", "Reference motion of the 3-RRR stage along a path")
    is_direct = False
    if isinstance(motion, MotionTable):
        is_direct, names = _columns(motion)
        moved = splined(motion, names, m.time)
        points = motion.values(names)
        places = (f"row {row}, {at:g} s" for row, at in enumerate(motion.time, 1))
    elif motion == "circle":
        moved, points = _circle(m, centre, radius), _points(centre, radius)
        places = (f"the circle at {angle} degrees" for angle in range(_ANGLES))
    else:
        raise ModelError(f"stage_path: motion is {motion!r}, expected circle or the path of a .csv file")
    pose = ca.SX.sym("pose", 3)
    reached = pose if is_direct else _inverse(Design(kinematics, links, jacobian=jacobian), pose)
    _check(points, np.array(_function(pose, reached)(points.T)).T, places, stroke, is_direct)
    if not is_direct:
        for (order, per, words, move, turn), column in zip(_ORDERS, moved, strict=True):
            m.output(
                f"platform.position{order}[1..2]", column[:2], f"m{per}", f"Commanded {words}position", nominal=move
            )
            m.output(f"platform.rotation{order}", column[2], f"rad{per}", f"Commanded {words}yaw", nominal=turn)
    for (order, per, words, move, _), column in zip(_ORDERS, _along(pose, reached, moved), strict=True):
        m.output(f"stack[1..3].elongation{order}", column, f"m{per}", f"Reference {words}elongation", nominal=move)
    return m


def _columns(table: MotionTable) -> tuple[bool, tuple[str, ...]]:
    """Return whether a table has elongations, and the names of its columns in order; `ModelError` for other columns."""
    for is_direct, names in ((False, _POSE), (True, _ELONGATIONS)):
        if set(table.names) == set(names):
            return is_direct, names
    raise ModelError(
        f"stage_path: the table has the columns {', '.join(table.names)}, expected {', '.join(_POSE)}, or "
        f"{', '.join(_ELONGATIONS)}"
    )


def _circle(m: Model, centre: tuple[float, float, float], radius: float) -> Motion:
    """Return the pose on a circle, reached from rest in one turn."""
    frequency = m.parameter("frequency", 5.0, "Hz", "Turns per second", min=0)
    a = ca.fmin(frequency * m.time, 1)
    turn = 2 * ca.pi * frequency * m.time
    blend = a**3 * (10 - 15 * a + 6 * a**2)
    pose = blend * (ca.DM(centre) + radius * ca.vertcat(ca.cos(turn), ca.sin(turn), 0))
    rate = ca.jacobian(pose, m.time)
    return Motion(pose, rate, ca.jacobian(rate, m.time))


def _points(centre: tuple[float, float, float], radius: float) -> NDArray[np.float64]:
    """Return poses on a circle, (points, 3)."""
    angle = np.radians(np.arange(_ANGLES))
    return np.asarray(centre) + radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_ANGLES)])


def _inverse(design: Design, pose: ca.SX) -> ca.SX:
    """Return the elongations at a pose, both (3, 1): inverse kinematics of the links, or of a Jacobian."""
    if design.jacobian is None and design.kinematics != "measured":
        return elongations(design.links_at_rest, pose)
    return ca.DM(np.linalg.inv(design.jacobian_at_rest)) @ pose


def _function(pose: ca.SX, reached: ca.SX) -> ca.Function:
    """Return the function of poses to elongations, (3, points) each."""
    return ca.Function("elongation", [pose], [reached])


def _along(pose: ca.SX, reached: ca.SX, moved: Motion) -> Motion:
    """Return elongations, rates and accelerations of a motion, by the chain rule."""
    rate, acceleration = ca.SX.sym("rate", 3), ca.SX.sym("acceleration", 3)
    slope = ca.jtimes(reached, pose, rate)
    curve = ca.jtimes(reached, pose, acceleration) + ca.jtimes(slope, pose, rate)
    found = ca.Function("along", [pose, rate, acceleration], [reached, slope, curve])(*moved)
    return Motion(*found)


def _check(
    points: NDArray[np.float64],
    found: NDArray[np.float64],
    places: Iterator[str],
    stroke: float,
    is_direct: bool,
) -> None:
    """Raise `ModelError` for the first point out of reach, or with elongations outside the free stroke."""
    inside = np.all((found >= -_ROUNDING) & (found <= stroke + _ROUNDING), axis=1)
    for point, elongation, place, is_reached in zip(points, found, places, inside, strict=True):
        if is_reached:
            continue
        label = f"stage_path: {place}: " + ("" if is_direct else "pose {:g} m, {:g} m, {:g} rad ".format(*point))
        if not np.all(np.isfinite(elongation)):
            raise ModelError(f"{label}is out of the legs' reach; the stage moves by some 1e-5 m and 1e-3 rad")
        shown = ", ".join(f"{value * 1e6:.3f}" for value in elongation)
        needs = "elongations of" if is_direct else "needs elongations of"
        raise ModelError(f"{label}{needs} {shown} um, expected 0 to {stroke * 1e6:g} um, the free stroke")
