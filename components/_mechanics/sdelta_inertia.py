"""Inertia of the SDelta's moving platform with its payload.

The thesis prints the inertia of the platform with a steel cube of 3 kg; subtracting the cube gives the platform alone.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hfsa.components._mechanics.screws import skew
from hfsa.components._modelling.follows import follows
from hfsa.components._modelling.model import ModelError

_CUBE_MASS = 3.0
_CUBE_EDGE = 0.072
_CUBE_HEIGHT = 0.04225
"""Height of the cube's centre above S: half its edge plus a plate of 12.5 mm (inferred from eq 4.31) [m]."""

_TOTAL_MASS = 4.4857
"""Platform and cube [kg] (eq 4.31)."""
_TOTAL_HEIGHT = _CUBE_MASS * _CUBE_HEIGHT / _TOTAL_MASS
_TOTAL_INERTIA = (0.0089432, 0.0089432, 0.0117172)
"""Platform and cube about their centre of mass, platform axes [kg.m2] (inferred from eqs 4.33 to 4.37)."""


class Inertia(NamedTuple):
    """Inertia of a rigid body in the platform's axes.

    Attributes:
        mass: mass [kg].
        center: centre of mass from S, shape (3,) [m].
        tensor: moments of inertia about the centre of mass, shape (3, 3) [kg.m2].
    """

    mass: float
    center: np.ndarray
    tensor: np.ndarray

    def about(self, point: np.ndarray) -> np.ndarray:
        """Return the inertia tensor about a point, given from S, shape (3, 3) [kg.m2]."""
        arm = skew(self.center - point)
        return self.tensor - self.mass * arm @ arm

    @property
    def parameters(self) -> np.ndarray:
        """Inertia about S: m, m cx, m cy, m cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz, shape (10,) [kg], [kg.m], [kg.m2]."""
        return np.array([self.mass, *(self.mass * self.center), *self.about(np.zeros(3))[np.triu_indices(3)]])

    def matrix(self, Q: np.ndarray) -> np.ndarray:
        """Return the mass matrix about the centre of mass at attitude `Q`, blkdiag(Q I Q^T, m 1), shape (6, 6)."""
        M = self.mass * np.eye(6)
        M[:3, :3] = Q @ self.tensor @ Q.T
        return M


@dataclass(frozen=True)
class Payload:
    """Payload of the platform; by default the thesis' steel cube of 3 kg.

    A payload given by its mass alone is a steel cube of that mass in the middle of the platform: center and inertia
    are computed from the mass unless they are given.

    Attributes:
        mass: mass [kg]; 0 for the platform alone.
        center: centre of mass from S in the platform's axes [m]; by default that of the cube.
        inertia: moments of inertia about the payload's centre of mass, along the platform's axes [kg.m2]; by default
            those of the cube.

    Raises:
        ModelError: a negative mass or inertia; moments of inertia that violate the triangle inequality; values that are
            not finite.
    """

    mass: float = _CUBE_MASS
    center: tuple[float, float, float] = follows("mass")
    inertia: tuple[float, float, float] = follows("mass")

    def __post_init__(self):
        if not (np.isfinite(self.mass) and self.mass >= 0):
            raise ModelError(f"payload.mass is {self.mass} kg, expected 0 or more")
        edge = _CUBE_EDGE * float(np.cbrt(self.mass / _CUBE_MASS))
        if self.center is None:
            object.__setattr__(self, "center", (0.0, 0.0, _CUBE_HEIGHT + (edge - _CUBE_EDGE) / 2))
        if self.inertia is None:
            object.__setattr__(self, "inertia", (self.mass * edge**2 / 6,) * 3)
        for name, values in (("center", self.center), ("inertia", self.inertia)):
            if len(values) != 3 or not np.all(np.isfinite(values)):
                raise ModelError(f"payload.{name} is {values}, expected three finite numbers")
        if min(self.inertia) < 0:
            raise ModelError(f"payload.inertia is {self.inertia} kg.m2, expected 0 or more")
        if 2 * max(self.inertia) > sum(self.inertia) * (1 + 1e-9):
            raise ModelError(f"payload.inertia is {self.inertia} kg.m2, but no moment can exceed the sum of the others")
        if self.mass == 0 and any(self.inertia):
            raise ModelError(f"payload.inertia is {self.inertia} kg.m2 with no mass, expected 0,0,0")

    @property
    def body(self) -> Inertia:
        """The payload as a rigid body."""
        return Inertia(self.mass, np.array(self.center), np.diag(self.inertia))


CUBE = Payload()
"""The specimen of the thesis: a steel cube of 72 mm in the middle of the platform."""


def _thesis_platform() -> Inertia:
    """Return the inertia of the thesis' platform alone; its centre of mass is S."""
    total = Inertia(_TOTAL_MASS, np.array([0.0, 0.0, _TOTAL_HEIGHT]), np.diag(_TOTAL_INERTIA))
    S = np.zeros(3)
    return Inertia(_TOTAL_MASS - _CUBE_MASS, S, total.about(S) - CUBE.body.about(S))


@dataclass(frozen=True)
class Platform:
    """Moving platform without payload; by default that of the thesis. Its centre of mass is S.

    Attributes:
        mass: mass [kg].
        inertia: moments of inertia about S along the platform's axes [kg.m2].

    Raises:
        ModelError: a mass or inertia that is not positive and finite; moments of inertia that violate the triangle
            inequality.
    """

    mass: float = _TOTAL_MASS - _CUBE_MASS
    inertia: tuple[float, float, float] = tuple(np.diag(_thesis_platform().tensor).tolist())

    def __post_init__(self):
        values = np.array([self.mass, *self.inertia])
        if not (values.shape == (4,) and np.all(np.isfinite(values)) and np.all(values > 0)):
            raise ModelError(
                f"platform.mass is {self.mass} kg and platform.inertia {self.inertia} kg.m2, expected finite numbers "
                f"above 0"
            )
        if 2 * max(self.inertia) > sum(self.inertia) * (1 + 1e-9):
            raise ModelError(
                f"platform.inertia is {self.inertia} kg.m2, but no moment can exceed the sum of the others"
            )

    @property
    def body(self) -> Inertia:
        """The platform as a rigid body."""
        return Inertia(self.mass, np.zeros(3), np.diag(self.inertia))


THESIS_PLATFORM = Platform()
"""The platform of the thesis."""


def with_payload(payload: Payload, platform: Platform = THESIS_PLATFORM) -> Inertia:
    """Return the inertia of the platform with its payload."""
    bodies = (platform.body, payload.body)
    mass = sum(body.mass for body in bodies)
    center = sum((body.mass * body.center for body in bodies), np.zeros(3)) / mass
    return Inertia(mass, center, sum((body.about(center) for body in bodies), np.zeros((3, 3))))
