"""Direct kinematics of the SDelta robot: its pose at given motor angles, by following them from a known pose.

Motor angles belong to several poses, the assemblies of the robot. Which one it is in depends on how it got there, so
the pose is followed along the straight line of motor angles from a start,

    theta(s) = theta_start + s (theta - theta_start),    N dx = L J_L dtheta

in steps of s that Newton's method corrects. A step is taken if Newton's corrections are small against the platform and
shrink fast from the first one on; otherwise it is halved. The path ends at a singularity, where det N is 0 and another
assembly would begin: its sign is that of the start all along.
"""

from typing import NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._mechanics.screws import exponential
from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC, Posture
from hfsa.components._mechanics.sdelta_kinematics import THESIS, Kinematics, Mechanism
from hfsa.components._modelling.model import ModelError

_LARGEST = 0.2
"""Largest first correction of a step, by the radius of the platform."""
_SHRINKING = 0.2
"""Largest ratio of a correction to the one before it."""
_CONVERGED = 1e-10
"""Correction after which, by quadratic convergence, only rounding is left [m]."""
_ROUNDING = 1e-8
"""Correction below which rounding may spoil its ratio to the one before it [m]."""
_CORRECTIONS = 12
_SHORTEST = 1e-10

_VECTOR = ca.SX.sym("rotation", 3)
_ROTATION = ca.Function("rotation", [_VECTOR], [exponential(_VECTOR)])


class Followed(NamedTuple):
    """The pose at the end of a path of motor angles.

    Attributes:
        kinematics: kinematics there.
        shares: shares of the path at the ends of its steps, from 0 to 1, shape (n,).
        condition_numbers: condition numbers there, shape (n,).
        determinants: det N about S there, all of one sign, shape (n,) [m3].
    """

    kinematics: Kinematics
    shares: np.ndarray
    condition_numbers: np.ndarray
    determinants: np.ndarray


def follow_motors(motors: np.ndarray, start: Posture = SYMMETRIC, mechanism: Mechanism = THESIS) -> Followed:
    """Return the pose that the robot reaches when its motors turn from the posture `start` to angles (6,) [rad].

    Raises:
        ModelError: motor angles that are not six finite numbers; a start that is singular or out of reach; a path that
            meets a singularity or the end of a tube's travel, with the share of it that is possible.
    """
    wanted = np.asarray(motors, dtype=float)
    if wanted.shape != (6,) or not np.all(np.isfinite(wanted)):
        raise ModelError(f"direct kinematics: motor angles are {wanted.tolist()}, expected six finite numbers")
    now = Kinematics.at(start, mechanism)
    first, passed = now.motor_angles, [(0.0, now.condition_number, now.determinant)]
    share, step = 0.0, 1.0
    while share < 1:
        end = min(1.0, share + step)
        found = _moved(now, first + end * (wanted - first))
        if isinstance(found, Kinematics) and found.determinant * now.determinant > 0:
            now, share, step = found, end, 2 * step
            passed.append((share, now.condition_number, now.determinant))
            continue
        step = (end - share) / 2
        if step < _SHORTEST:
            reason = found if isinstance(found, str) else ""
            raise ModelError(
                f"direct kinematics: the motors cannot turn from {_degrees(start)} to {_text(wanted)} rad: "
                f"{100 * share:.3g} % of the way {reason or 'the robot is singular'}, with the condition number "
                f"{now.condition_number:.3g} just before; expected a path within one assembly, such as one in parts"
            )
    return Followed(now, *np.array(passed).T)


def direct_kinematics(
    motors: np.ndarray, start: Posture = SYMMETRIC, mechanism: Mechanism = THESIS
) -> tuple[np.ndarray, np.ndarray]:
    """Return attitude (3, 3) and position of S (3,) at motor angles; arguments and errors as `follow_motors`."""
    found = follow_motors(motors, start, mechanism).kinematics
    return found.Q, found.position


def _moved(now: Kinematics, motors: np.ndarray) -> Kinematics | str:
    """Return the kinematics at motor angles close to those of `now`, by Newton's method, or why the step is too long.

    The reason is empty if the corrections do not shrink, as they do close to `now`.
    """
    to_tubes, wanted = now.mechanism.drives_matrix, now.mechanism.drives_matrix @ motors
    limit, radius = np.inf, now.mechanism.geometry.platform_radius
    for k in range(_CORRECTIONS):
        missing = wanted - to_tubes @ now.motor_angles
        # a tube that has turned by a whole turn is where it was
        missing[1::2] = (missing[1::2] + np.pi) % (2 * np.pi) - np.pi
        correction = now.tubes_to_pose() @ missing
        size = float(np.abs(correction * now.mechanism.lengths).max())
        if (k == 0 and size > _LARGEST * radius) or size > limit:
            return ""
        Q = _ROTATION(correction[:3]).full() @ now.Q
        try:
            now = Kinematics.of(Q, now.position + correction[3:], now.mechanism)
        except ModelError as error:
            return "a tube is at the end of its side of the base" if "out of reach" in str(error) else ""
        if size < _CONVERGED:
            return now
        limit = max(_SHRINKING * size, _ROUNDING)
    return ""


def _degrees(posture: Posture) -> str:
    """Return a posture in words."""
    return f"rotation {_text(posture.rotation)} deg, position {_text(posture.position)} m"


def _text(values: np.ndarray | tuple[float, ...]) -> str:
    """Return numbers as text for a message."""
    return f"({', '.join(f'{value + 0.0:.6g}' for value in values)})"
