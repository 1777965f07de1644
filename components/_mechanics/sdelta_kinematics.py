"""Differential kinematics of the SDelta robot.

    N dx = L dq,    dq = [du_1, dphi_1, ... du_3, dphi_3],    L = diag(1, l_1, 1, l_2, 1, l_3)
    dq = J_L dtheta,    dx = T dtheta,    T = N^-1 L J_L

The entries of N dx are the displacements of the joint S_j along the C axis e_c and along e_n = e_c x e_l, across the
limb. The rows of N are [p x e; e] with p = S_j minus the reference point (eq 3.17, where the sign of p x e is
misprinted). Motors are ordered L1, R1, L2, R2, L3, R3; the difference of a pair slides its tube, their sum turns it.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from hfsa.components._mechanics.sdelta_geometry import (
    C_AXES,
    INWARDS,
    SYMMETRIC,
    THESIS_GEOMETRY,
    UP,
    Geometry,
    Limbs,
    Posture,
    angles,
    limbs_at,
    require_positive,
)
from hfsa.components._modelling.arguments import ArgumentGroup
from hfsa.components._modelling.model import Model, ModelError

SCREW_PITCH = 0.060
"""Travel of a nut per turn of its motor [m] (from eqs 3.26c and 3.55)."""
GEAR_REDUCTION = 6.0
"""Gear reduction: motor turns per turn of a tube (eq 3.54)."""

CONDITION_LIMIT = 1e4
"""Largest `Kinematics.condition_number` of a regular posture."""

_ORIGIN = np.zeros(3)


@dataclass(frozen=True)
class Transmission(ArgumentGroup):
    """Transmission of a C-drive; by default that of the thesis.

    Attributes:
        pitch: travel of a nut per turn of its motor [m].
        gear: motor turns per turn of the tube.

    Raises:
        ModelError: a value that is not positive and finite.
    """

    pitch: float = SCREW_PITCH
    gear: float = GEAR_REDUCTION

    def __post_init__(self):
        require_positive(self, "", "m", "")

    @property
    def matrix(self) -> np.ndarray:
        """J_C of one C-drive, [du; dphi] = J_C [dtheta_L; dtheta_R], shape (2, 2) [m/rad, 1] (eq 3.13)."""
        slide, turn = self.pitch / (4 * np.pi), 1 / (2 * self.gear)
        return np.array([[slide, -slide], [turn, turn]])


THESIS_TRANSMISSION = Transmission()
"""Transmission of the thesis."""


@dataclass(frozen=True)
class Mechanism(ArgumentGroup):
    """Dimensions that decide the kinematics; by default those of the thesis.

    Attributes:
        geometry: circumradii of the triangles of base and platform [m].
        transmission: transmission of the drives.
    """

    geometry: Geometry = THESIS_GEOMETRY
    transmission: Transmission = THESIS_TRANSMISSION

    @property
    def drives_matrix(self) -> np.ndarray:
        """J_L of all three C-drives, shape (6, 6)."""
        return np.kron(np.eye(3), self.transmission.matrix)

    @property
    def home(self) -> Limbs:
        """Limbs at the symmetric posture, where all motor angles are zero."""
        return limbs_at(self.geometry, SYMMETRIC.matrix, np.array(SYMMETRIC.position))

    @property
    def lengths(self) -> np.ndarray:
        """Lengths that convert rotations to displacements, so that matrices of mixed units have a condition number."""
        return np.repeat([self.geometry.platform_radius, 1.0], 3)


THESIS = Mechanism()
"""The mechanism of the thesis."""


@dataclass(frozen=True)
class Kinematics:
    """First-order kinematics at one pose.

    Attributes:
        mechanism: dimensions of the robot.
        Q: attitude of the platform, shape (3, 3).
        position: position of S, shape (3,) [m].
        limbs: coordinates of the limbs.
    """

    mechanism: Mechanism
    Q: np.ndarray
    position: np.ndarray
    limbs: Limbs

    @classmethod
    def at(cls, posture: Posture, mechanism: Mechanism = THESIS) -> "Kinematics":
        """Return the kinematics at a posture.

        Raises:
            ModelError: a singular posture, with its condition number; a tube beyond the end of its side of the base,
                with its slide.
        """
        return cls.of(posture.matrix, np.array(posture.position), mechanism)

    @classmethod
    def of(cls, Q: np.ndarray, position: np.ndarray, mechanism: Mechanism = THESIS) -> "Kinematics":
        """Return the kinematics at attitude `Q` and position of S; errors as in `at`."""
        kinematics = cls(mechanism, Q, position, limbs_at(mechanism.geometry, Q, position))
        reach, farthest = mechanism.geometry.reach, int(np.argmax(np.abs(kinematics.limbs.slide)))
        if not abs(kinematics.limbs.slide[farthest]) <= reach:
            raise ModelError(
                f"posture with rotation {_text(angles(Q))} deg and position {_text(position)} m is out of reach: tube "
                f"{farthest + 1} would slide by {kinematics.limbs.slide[farthest]:.4g} m, expected at most "
                f"{reach:.4g} m either way, half a side of the base"
            )
        condition = kinematics.condition_number
        if not condition <= CONDITION_LIMIT:
            raise ModelError(
                f"posture with rotation {_text(angles(Q))} deg and position {_text(position)} m is singular: condition "
                f"number {condition:.3g} from platform to tubes, expected at most {CONDITION_LIMIT:g}"
            )
        return kinematics

    @property
    def lever(self) -> np.ndarray:
        """Diagonal of L, shape (6,) [1 and m]."""
        return _pairs(np.ones(3), self.limbs.length)

    def rows(self, offset: np.ndarray = _ORIGIN) -> np.ndarray:
        """Return N about the reference point S + `offset` (world axes) [m], shape (6, 6) (eq 3.17)."""
        p = self.mechanism.geometry.joints @ self.Q.T - offset
        across = np.outer(np.cos(self.limbs.angle), UP) - np.sin(self.limbs.angle)[:, None] * INWARDS
        N = np.empty((6, 6))
        N[0::2] = np.hstack([np.cross(p, C_AXES), C_AXES])
        N[1::2] = np.hstack([np.cross(p, across), across])
        return N

    def tubes_to_pose(self, offset: np.ndarray = _ORIGIN) -> np.ndarray:
        """Return N^-1 L, from tubes [u_1, phi_1, ...] to the pose of the reference point S + `offset`, shape (6, 6)."""
        return np.linalg.solve(self.rows(offset), np.diag(self.lever))

    def jacobian(self, offset: np.ndarray = _ORIGIN) -> np.ndarray:
        """Return T, from motor angles to the pose of the reference point S + `offset`, shape (6, 6)."""
        return self.tubes_to_pose(offset) @ self.mechanism.drives_matrix

    @property
    def condition_number(self) -> float:
        """Condition number of L^-1 N at S, with rotations of platform and tubes weighted by the platform's radius.

        It is infinite if the platform can move while the tubes are locked, and for a limb of length zero.
        """
        if self.limbs.length.min() == 0:
            return np.inf
        tubes = np.tile([1.0, self.mechanism.geometry.platform_radius], 3) / self.lever
        return float(np.linalg.cond(tubes[:, None] * self.rows() / self.mechanism.lengths))

    @property
    def determinant(self) -> float:
        """Determinant of N about S [m3]; its sign changes at singularities."""
        return float(np.linalg.det(self.rows()))

    @property
    def motor_angles(self) -> np.ndarray:
        """Motor angles, zero at the symmetric posture, shape (6,) [rad]."""
        home = self.mechanism.home
        tubes = _pairs(self.limbs.slide - home.slide, self.limbs.angle - home.angle)
        return np.linalg.solve(self.mechanism.drives_matrix, tubes)


def declare_tube_constants(m: Model, kinematics: Kinematics) -> None:
    """Declare the positions of the tubes at the posture as constants of a part whose `drive[j]` count from it."""
    limbs = kinematics.limbs
    m.constant("drive[1..3].slide_at_posture", limbs.slide.tolist(), "m", "Slide of the tube at the posture")
    m.constant("drive[1..3].angle_at_posture", limbs.angle.tolist(), "rad", "Angle of the tube at the posture")


def declare_motor_constants(m: Model, kinematics: Kinematics, terminal: str) -> None:
    """Declare the motor angles at the posture as constants of a part whose `terminal[i]` count from it."""
    angles_there = kinematics.motor_angles.tolist()
    m.constant(f"{terminal}[1..6].angle_at_posture", angles_there, "rad", "Motor angle at the posture, 0 if symmetric")


def by_drive(slide: ca.SX | np.ndarray, angle: ca.SX | np.ndarray) -> ca.SX:
    """Return the column [slide_1, angle_1, slide_2, ...], shape (6, 1), from two columns of three."""
    return ca.vec(ca.horzcat(ca.SX(slide), ca.SX(angle)).T)


def _pairs(slide: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return slide and angle of each drive, one drive after the other, shape (6,)."""
    return np.column_stack([slide, angle]).ravel()


def _text(values: np.ndarray) -> str:
    """Return a column of numbers as text for a message."""
    return f"({', '.join(f'{value + 0.0:.9g}' for value in values)})"
