"""Geometry of the SDelta robot: dimensions, postures, and the inverse kinematics of its three limbs.

World frame: origin at the centroid of the base triangle B1 B2 B3, X along B1 -> B2, Z up. Limb j is on the side
B_j -> B_j+1. Its tube slides by u_j along that side, the C axis e_c, from the middle m_j, and turns by phi_j about it;
phi_j is zero if the limb points horizontally inwards. The limb ends at S_j, a corner of the platform, at distance l_j:

    S_j = a + Q s_j,    u_j = e_c . (S_j - m_j),    l_j (cos(phi_j) i_j + sin(phi_j) Z) = S_j - m_j - u_j e_c

with i_j = Z x e_c, Q the attitude of the platform and a the position of S, the centroid of its joints. The triangle of
the platform is rotated by half a turn against the base: each of its corners faces the middle of a side.

From a posture Q_0, a_0, where r = S_j - m_j has the components r_i along i_j and r_z along Z, a rotation R and a
displacement d of S move a joint by s, and slide and turn its tube by

    s = d + (R - 1) Q_0 s_j,    du_j = e_c . s,    dphi_j = atan2(r_i s_z - r_z s_i, r_i^2 + r_z^2 + r_i s_i + r_z s_z)

without a small difference of two large numbers.
"""

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._modelling.model import ModelError

HEIGHT = 0.150
"""Height of S above the base in the symmetric posture [m] (eq 3.47)."""

_CORNERS = np.array([[np.cos(a), np.sin(a), 0.0] for a in np.deg2rad([210.0, 330.0, 90.0])])
_SIDES = np.roll(_CORNERS, -1, axis=0) - _CORNERS

UP = np.array([0.0, 0.0, 1.0])
C_AXES = _SIDES / np.linalg.norm(_SIDES, axis=1, keepdims=True)
"""Rows e_c: directions of the three C axes, shape (3, 3)."""
INWARDS = np.cross(UP, C_AXES)
"""Rows i_j: horizontal, from a side to the inside, shape (3, 3)."""

_ROTATION_TOLERANCE = 1e-9


def require_positive(dimensions: Any, owner: str, *units: str) -> None:
    """Raise `ModelError` for a field of a dataclass that is not positive and finite; `units` of the fields in turn.

    `owner` is the argument that the dataclass is, empty for fields that are arguments themselves. Fields that are not
    set, `None`, are not checked; the last unit is that of all further fields.
    """
    for k, field in enumerate(fields(dimensions)):
        value, unit = getattr(dimensions, field.name), units[min(k, len(units) - 1)]
        if value is not None and not (np.isfinite(value) and value > 0):
            name, shown = f"{owner}.{field.name}".lstrip("."), f"{value:g} {unit}".rstrip()
            raise ModelError(f"{name} is {shown}, expected a finite number above 0")


@dataclass(frozen=True)
class Geometry:
    """Triangles of the base and of the platform's joints; by default those of the thesis (eq 3.47).

    Attributes:
        base_radius: circumradius R of the base triangle [m].
        platform_radius: circumradius r of the platform's joint triangle [m].

    Raises:
        ModelError: a radius that is not positive and finite.
    """

    base_radius: float = 0.450
    platform_radius: float = 0.150

    def __post_init__(self):
        require_positive(self, "geometry", "m")

    @cached_property
    def middles(self) -> np.ndarray:
        """Rows m_j: middles of the sides of the base, shape (3, 3) [m]."""
        return self.base_radius * (_CORNERS + np.roll(_CORNERS, -1, axis=0)) / 2

    @cached_property
    def joints(self) -> np.ndarray:
        """Rows s_j: platform joints from S, in the platform's axes, shape (3, 3) [m]."""
        return self.platform_radius * self.middles / np.linalg.norm(self.middles, axis=1, keepdims=True)

    @property
    def reach(self) -> float:
        """Half the length of a side of the base, the farthest that a tube slides either way [m]."""
        return float(np.sqrt(3) / 2 * self.base_radius)


THESIS_GEOMETRY = Geometry()
"""The triangles of the thesis."""


@dataclass(frozen=True)
class Posture:
    """Attitude and position of the platform.

    Attributes:
        rotation: angles of intrinsic rotations about z, x, y in degrees, Q = Rz Rx Ry. A rotation matrix (3, 3) is
            accepted and converted to its angles.
        position: position of S, the centroid of the platform's joints, in the world frame [m].

    Raises:
        ModelError: a matrix that is no rotation, with its residual; values that are not three finite numbers.
    """

    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    position: tuple[float, float, float] = (0.0, 0.0, HEIGHT)

    def __post_init__(self):
        rotation = np.asarray(self.rotation, dtype=float)
        if rotation.shape == (3, 3):
            rotation = angles(rotation)
        for name, value in (("rotation", rotation), ("position", np.asarray(self.position, dtype=float))):
            if value.shape != (3,) or not np.all(np.isfinite(value)):
                raise ModelError(f"posture.{name} is {value.tolist()}, expected three finite numbers")
            object.__setattr__(self, name, tuple(value.tolist()))

    @property
    def matrix(self) -> np.ndarray:
        """Attitude Q, platform to world, shape (3, 3)."""
        (sz, sx, sy), (cz, cx, cy) = (function(np.deg2rad(self.rotation)) for function in (np.sin, np.cos))
        Q = [
            [cz * cy - sz * sx * sy, -sz * cx, cz * sy + sz * sx * cy],
            [sz * cy + cz * sx * sy, cz * cx, sz * sy - cz * sx * cy],
            [-cx * sy, sx, cx * cy],
        ]
        return np.array(Q) + 0.0  # no -0


SYMMETRIC = Posture()
"""The reference posture: platform level and centred, at `HEIGHT`."""


class Limbs(NamedTuple):
    """Coordinates of the three limbs at a pose, arrays of three.

    Attributes:
        slide: u_j [m].
        length: l_j, from the C axis to the platform joint [m].
        angle: phi_j [rad].
    """

    slide: np.ndarray
    length: np.ndarray
    angle: np.ndarray


def angles(Q: np.ndarray) -> np.ndarray:
    """Return the angles of intrinsic rotations about z, x, y [deg] of a rotation matrix; `ModelError` for any other."""
    residual = np.abs(Q.T @ Q - np.eye(3)).max()
    if not residual <= _ROTATION_TOLERANCE:
        raise ModelError(
            f"no rotation: Q^T Q differs from 1 by {residual:.3g}, expected {_ROTATION_TOLERANCE:g} or less"
        )
    determinant = np.linalg.det(Q)
    if determinant < 0:
        raise ModelError(f"no rotation but a reflection: det Q is {determinant:.3g}, expected 1")
    from scipy.spatial.transform import Rotation  # imported here, as it takes as long as a small sweep

    return Rotation.from_matrix(Q).as_euler("ZXY", degrees=True)


def limbs_at(geometry: Geometry, Q: np.ndarray, a: np.ndarray) -> Limbs:
    """Return the limbs at attitude `Q` (3, 3) and position `a` of S (3,): inverse kinematics."""
    reach = a + geometry.joints @ Q.T - geometry.middles
    along, inward, up = (np.sum(axes * reach, axis=1) for axes in (C_AXES, INWARDS, UP))
    return Limbs(along, np.hypot(inward, up), np.arctan2(up, inward))


def tube_motion(geometry: Geometry, Q: np.ndarray, a: np.ndarray, turn: ca.SX, move: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return slides [m] and angles [rad] of the tubes, columns of three, for a motion of the platform from a pose.

    The pose is the attitude `Q` (3, 3) and the position `a` of S (3,). From there the platform rotates by R, with
    `turn` = R - 1 (3, 3), and S moves by `move` (3, 1). The result is accurate to all digits for small motions; a tube
    turns by less than half a turn.
    """
    slide, angle = [], []
    for j, arm in enumerate(geometry.joints @ Q.T):
        reach, moved = a + arm - geometry.middles[j], move + turn @ ca.DM(arm)
        inward, up = INWARDS[j] @ reach, reach[2]
        moved_inward, moved_up = ca.dot(ca.DM(INWARDS[j]), moved), moved[2]
        slide.append(ca.dot(ca.DM(C_AXES[j]), moved))
        across = inward * moved_up - up * moved_inward
        angle.append(ca.atan2(across, inward**2 + up**2 + inward * moved_inward + up * moved_up))
    return ca.vertcat(*slide), ca.vertcat(*angle)
