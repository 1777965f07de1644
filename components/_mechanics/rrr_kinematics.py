"""Kinematics of the planar 3-RRR stage: three cranks, driven by stacks, carry a platform on three couplers.

Frame: origin at the centre of the platform at rest, X through C2, counter-clockwise positive. Leg i = 1, 2, 3 lies at
the polar angle o_i = 120, 0, -120 degrees: fixed hinge A_i, crank A_i B_i, coupler B_i C_i, corner C_i of the platform.
Stack i pushes on an arm R0 of its crank and turns it clockwise, by dtheta_i = -l_i / R0. With the pose q = (x, y, yaw)

    C_i = (x, y) + Rot(yaw) C_i0,   B_i = A_i + Rot(dtheta_i) (B_i0 - A_i),   |C_i - B_i| = L_BC

give l(q) in closed form, and about rest q ~ J0 l. Every stack turns the platform clockwise: the last row of J0 is
negative.

Source: thesis of 2000 on the 3-RRR stage, whose equation numbers are cited. The constraint is derived anew here,
because its expansion in (2.14) to (2.16) is wrong.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Literal, NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._modelling.documents import Document
from hfsa.components._modelling.model import ModelError, one_of

Kinematics = Literal["nominal", "calibrated", "measured"]
LinkSet = Literal["nominal", "calibrated"]
"""Parameter sets with link dimensions; `measured` is a Jacobian only."""

OFFSETS = 2 * np.pi * np.array([1, 0, -1]) / 3
"""o_i: polar angles of the legs, shape (3,) [rad]."""

_ALIGNED = 1e-6
"""Sine of an angle below which two directions are in line."""
_ITERATIONS = 20
_CONVERGED = 1e-14
"""Largest last step of Newton's method, relative to the largest coordinate [m, rad]."""


@dataclass(frozen=True)
class Links:
    """Lengths and angles of the links at rest; shapes (3, 2) hold one point per leg.

    Attributes:
        crank: L_AB [m].
        coupler: L_BC [m].
        radius: R, from the centre of the platform to a corner [m].
        psi1: direction from A2 to C2 [rad].
        psi2: angle of triangle A B C at C [rad].
        arm: R0, arm of the stack on the crank [m].

    Raises:
        ModelError: a value that is not finite; a length that is not above 0; an angle at C that is not between 0 and
            pi; links that do not close, or whose cranks and couplers are in line; couplers that meet in one point.
    """

    crank: float
    coupler: float
    radius: float
    psi1: float
    psi2: float
    arm: float = 3.5e-3

    def __post_init__(self):
        for name in ("crank", "coupler", "radius", "arm"):
            length = getattr(self, name)
            if not (np.isfinite(length) and length > 0):
                raise ModelError(f"links.{name} is {length:g} m, expected a finite length above 0")
        if not np.isfinite(self.psi1):
            raise ModelError(f"links.psi1 is {self.psi1:g} rad, expected a finite angle")
        if not 0 < self.psi2 < np.pi:
            raise ModelError(f"links.psi2 is {self.psi2:g} rad, the angle at C, expected between 0 and pi")
        if not self.closure > 0:
            raise ModelError(
                f"the links do not close: a coupler of {self.coupler:g} m at {self.psi2:g} rad from A C (links.psi2) "
                f"takes a crank longer than {self.crank * (1 - self.closure):.6g} m, links.crank is {self.crank:g} m"
            )
        if abs(np.sin(self.psi)) < _ALIGNED or abs(np.sin(self.psi3)) < _ALIGNED:
            raise ModelError(
                f"the links are singular at rest: psi1 + psi2 = {self.psi:g} rad, crank and coupler at "
                f"{self.psi3:.6g} rad; a multiple of pi puts the couplers through the centre of the platform, or in "
                "line with their cranks"
            )

    @property
    def closure(self) -> float:
        """1 - shortest crank that closes the triangle A B C / crank, above 0 where it is one."""
        is_obtuse = self.psi2 >= np.pi / 2
        return 1 - self.coupler * (1.0 if is_obtuse else np.sin(self.psi2)) / self.crank

    @property
    def psi(self) -> float:
        """Direction from B2 to C2 [rad]."""
        return self.psi1 + self.psi2

    @property
    def psi3(self) -> float:
        """Angle from a crank to its coupler [rad]."""
        return self.psi2 + np.arcsin(self.coupler * np.sin(self.psi2) / self.crank)

    @cached_property
    def corners(self) -> np.ndarray:
        """C_i0: corners of the platform [m]."""
        return self.radius * _directions(OFFSETS)

    @cached_property
    def crank_ends(self) -> np.ndarray:
        """B_i0: hinges between cranks and couplers [m]."""
        return self.corners - self.coupler * _directions(self.psi + OFFSETS)

    @cached_property
    def base_hinges(self) -> np.ndarray:
        """A_i: fixed hinges [m]."""
        return self.crank_ends - self.crank * _directions(self.psi - self.psi3 + OFFSETS)

    @property
    def cranks(self) -> np.ndarray:
        """A_i B_i at rest [m]."""
        return self.crank_ends - self.base_hinges

    @property
    def couplers(self) -> np.ndarray:
        """B_i C_i at rest [m]."""
        return self.corners - self.crank_ends

    @cached_property
    def jacobian(self) -> np.ndarray:
        """J0, elongations to pose about rest, shape (3, 3) [m/m, m/m, rad/m] (eqs 2.21, 2.22)."""
        along = _directions(self.psi + OFFSETS)
        rows = np.column_stack([along, np.full(3, self.radius * np.sin(self.psi))])
        return -self.crank * np.sin(self.psi3) / self.arm * np.linalg.inv(rows)


NOMINAL = Links(17.720e-3, 11e-3, 29.546e-3, 1.1733, 0.81569)
"""Dimensions as designed (eq 2.1)."""
CALIBRATED = Links(16.3333e-3, 10.7105e-3, 31.2969e-3, 1.0951, 0.3366)
"""Dimensions fitted to the measured pose at l = (12, 0, 12) um (sec. 2.5); the largest error over 0 to 12 um is
11.06 um, at l = (0, 12, 12) um."""

_MEASURED = np.array(
    [
        [1.610797127, -1.298942876, -0.164324634],
        [-0.6056938677, -1.42884239, 1.37702048],
        [-32.69206385, -28.30203574, -20.19743117],
    ]
)
"""Measured Jacobian J in the axes of the measurement [m/m, m/m, rad/m] (app. A)."""


class Legs(NamedTuple):
    """Rotations of the links from rest at a pose, columns of three [rad]: `crank` dtheta_i, `coupler` dalpha_i."""

    crank: ca.SX
    coupler: ca.SX


@dataclass(frozen=True)
class LinkChanges:
    """Dimensions in place of those of a parameter set of the links, with the names and units of `Links`.

    Attributes:
        crank: L_AB [m].
        coupler: L_BC [m].
        radius: R, from the centre of the platform to a corner [m].
        psi1: direction from A2 to C2 [rad].
        psi2: angle of triangle A B C at C [rad].
        arm: R0, arm of the stack on the crank [m].
    """

    crank: float | None = None
    coupler: float | None = None
    radius: float | None = None
    psi1: float | None = None
    psi2: float | None = None
    arm: float | None = None

    @property
    def given(self) -> dict[str, float]:
        """Dimensions that are given, by name."""
        return {field.name: value for field in fields(self) if (value := getattr(self, field.name)) is not None}


AS_NAMED = LinkChanges()
"""The dimensions of the parameter set itself."""


@dataclass(frozen=True)
class SavedLinks(Links, Document):
    """Parameter set of the links in a file, as `hfsa calibrate rrr_stage` writes it."""

    def __str__(self) -> str:
        return "of a file"


KinematicsSet = Kinematics | SavedLinks
"""Parameter set of the links: its name, or the path of a .toml file."""


def links(kinematics: str | SavedLinks, changes: LinkChanges = AS_NAMED) -> Links:
    """Return the links of a parameter set with changes.

    Raises:
        ModelError: an unknown set; `measured`, which has no link dimensions; dimensions that cannot be built.
    """
    if kinematics == "measured":
        raise ModelError(
            "rrr_stage: kinematics 'measured' is a Jacobian without link dimensions and valid at level jacobian only; "
            "the other levels take nominal or calibrated, and a jacobian beside them"
        )
    if isinstance(kinematics, SavedLinks):
        return replace(kinematics, **changes.given)
    sets = {"nominal": NOMINAL, "calibrated": CALIBRATED}
    return replace(sets[one_of(kinematics, sets, "rrr_stage: kinematics")], **changes.given)


def jacobian(kinematics: str | SavedLinks, changes: LinkChanges = AS_NAMED) -> np.ndarray:
    """Return J0 of a parameter set with changes, shape (3, 3).

    The measured one is rotated by psi - 60 deg into the stage's axes; `ModelError` for changes of its links.
    """
    if kinematics != "measured":
        return links(kinematics, changes).jacobian
    if changes.given:
        raise ModelError(
            f"rrr_stage: links.{next(iter(changes.given))} is given, but kinematics 'measured' is a Jacobian without "
            "link dimensions; take nominal or calibrated"
        )
    turn = NOMINAL.psi - np.pi / 3
    to_stage = np.eye(3)
    to_stage[:2, :2] = _rotation(turn)
    return to_stage @ _MEASURED


def corner_motion(geometry: Links, pose: ca.SX) -> ca.SX:
    """Return the displacements of the corners C_i from rest at a pose (3, 1), columns of shape (2, 3) [m]."""
    sine, less_one = ca.sin(pose[2]), _cosine_less_one(pose[2])
    turn = ca.vertcat(ca.horzcat(less_one, -sine), ca.horzcat(sine, less_one))
    return ca.repmat(pose[:2], 1, 3) + turn @ columns(geometry.corners)


def legs(geometry: Links, pose: ca.SX) -> Legs:
    """Return the rotations of cranks and couplers at a pose (3, 1); NaN for an unreachable pose.

    Every quantity is computed as its change from rest, so the rotations at rest are exactly zero.
    """
    moved = corner_motion(geometry, pose)
    diagonals = geometry.corners - geometry.base_hinges
    crank = ca.vertcat(*[_crank(geometry, diagonal, moved[:, i]) for i, diagonal in enumerate(diagonals)])
    return Legs(crank, coupler_turns(geometry, coupler_motion(geometry, pose, crank)))


def coupler_motion(geometry: Links, pose: ca.SX, crank: ca.SX) -> ca.SX:
    """Return the changes of the vectors B_i C_i at a pose and rotations of the cranks, columns of shape (2, 3) [m]."""
    at_B = ca.horzcat(*[_swing(rest, crank[i]) for i, rest in enumerate(geometry.cranks)])
    return corner_motion(geometry, pose) - at_B


def coupler_turns(geometry: Links, change: ca.SX) -> ca.SX:
    """Return the rotations dalpha_i of the couplers from the changes of the vectors B_i C_i, shape (3, 1) [rad]."""
    return ca.vertcat(*[_turn(rest, change[:, i]) for i, rest in enumerate(geometry.couplers)])


def elongations(geometry: Links, pose: ca.SX) -> ca.SX:
    """Return the elongations l_i at a pose (3, 1), shape (3, 1) [m]: inverse kinematics."""
    return -geometry.arm * legs(geometry, pose).crank


def forward(geometry: Links, elongation: Sequence[float]) -> np.ndarray:
    """Return the pose, shape (3,) [m, m, rad], at elongations [m]; `ModelError` if there is none."""
    pose = ca.SX.sym("pose", 3)
    wanted = np.asarray(elongation, dtype=float)
    residual = elongations(geometry, pose) - ca.DM(wanted)
    failure = f"rrr_stage: no pose has the elongations {elongation} m; the stacks reach 0 to 12e-6 m"
    return newton(pose, residual, geometry.jacobian @ wanted, failure)


def inverse(geometry: Links, pose: Sequence[float], part: str) -> np.ndarray:
    """Return the elongations, shape (3,) [m], at a pose [m, m, rad]; `ModelError` of a part if it is out of reach."""
    symbol = ca.SX.sym("pose", 3)
    found = np.array(ca.Function("elongation", [symbol], [elongations(geometry, symbol)])(pose)).ravel()
    if not np.all(np.isfinite(found)):
        x, y, yaw = pose
        raise ModelError(
            f"{part}: pose {x:g} m, {y:g} m, {yaw:g} rad is out of the legs' reach; the stage moves by some 1e-5 m and "
            "1e-3 rad"
        )
    return found


def newton(unknowns: ca.SX, residual: ca.SX, start: np.ndarray, failure: str) -> np.ndarray:
    """Return the root of `residual` (n, 1) in `unknowns` (n, 1) near `start` (n,), shape (n,), by Newton's method.

    Raises `ModelError` with the message `failure` if the iteration does not converge.
    """
    step = ca.Function("step", [unknowns], [ca.solve(ca.jacobian(residual, unknowns), residual)])
    value = np.asarray(start, dtype=float)
    for _ in range(_ITERATIONS):
        change = np.array(step(value)).ravel()
        value = value - change
        if not np.all(np.isfinite(value)):
            break
        if np.abs(change).max() <= _CONVERGED * max(1.0, np.abs(value).max()):
            return value
    raise ModelError(failure)


def rotated(vector: np.ndarray, angle: ca.SX) -> ca.SX:
    """Return a constant vector (2,) rotated by an angle, shape (2, 1); exactly the vector at angle zero."""
    return ca.vertcat(*vector) + _swing(vector, angle)


def columns(vectors: Any) -> Any:
    """Return vectors of the plane (n, 2), numbers or expressions, as columns (2, n)."""
    return ca.horzcat(*[ca.vertcat(*vector) for vector in vectors])


def _swing(vector: np.ndarray, angle: ca.SX) -> ca.SX:
    """Return the change of a constant vector (2,) rotated by an angle, shape (2, 1); exactly zero at angle zero."""
    return _cosine_less_one(angle) * ca.vertcat(*vector) + ca.sin(angle) * ca.vertcat(-vector[1], vector[0])


def _cosine_less_one(angle: ca.SX) -> ca.SX:
    """Return cos(angle) - 1, accurate to all digits for small angles."""
    return -2 * ca.sin(angle / 2) ** 2


def _crank(geometry: Links, rest: np.ndarray, moved: ca.SX) -> ca.SX:
    """Return the rotation of a crank when its vector A C changes from `rest` (2,) to `rest + moved`.

    It is the rotation of A C minus the change of the angle at A.
    """
    crank, coupler = geometry.crank, geometry.coupler
    length = np.linalg.norm(rest)
    growth = 2 * ca.dot(ca.DM(rest), moved) + ca.sumsqr(moved)
    now = ca.sqrt(length**2 + growth)
    cosine = (crank**2 + length**2 - coupler**2) / (2 * crank * length)
    change = growth / (now + length) * (1 - (crank**2 - coupler**2) / (now * length)) / (2 * crank)
    square = 1 - cosine**2
    less = change * (2 * cosine + change)
    sine = np.sqrt(square)
    growth_of_sine = -less / (ca.sqrt(square - less) + sine)
    widening = ca.atan2(growth_of_sine * cosine - change * sine, 1 + growth_of_sine * sine + change * cosine)
    return _turn(rest, moved) - widening


def _turn(rest: np.ndarray, moved: ca.SX) -> ca.SX:
    """Return the angle from `rest` (2,) to `rest + moved`."""
    across = rest[0] * moved[1] - rest[1] * moved[0]
    return ca.atan2(across, rest @ rest + ca.dot(ca.DM(rest), moved))


def _directions(angles: np.ndarray) -> np.ndarray:
    """Return the unit vectors at polar angles, shape (n, 2)."""
    return np.column_stack([np.cos(angles), np.sin(angles)])


def _rotation(angle: float) -> np.ndarray:
    """Return the matrix of a rotation by an angle, shape (2, 2)."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
