"""A rigid body in small motion: its mass matrix, and the ports for its pose, twist, acceleration and wrench.

    M = [[m 1, -m skew(c)], [m skew(c), J - m skew(c)^2]]

is the mass matrix at a reference point, with the mass m, the inertia J about the mass centre and the vector c from the
reference point to the mass centre. Columns of six have translations before rotations and forces before torques; as
ports they are two vectors of three.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._mechanics.screws import skew
from hfsa.components._modelling.model import Model, ModelError

Triple = tuple[float, float, float]


class SixVector(NamedTuple):
    """Names, units and nominal values of the two halves of a column of six.

    The nominal values are those of micrometre motion at hundreds of hertz, some centimetres from the axis.
    """

    names: tuple[str, str]
    units: tuple[str, str]
    nominals: tuple[float, float]

    @property
    def rotation_first(self) -> "SixVector":
        """The same vector with its halves exchanged."""
        (a, b), (c, d), (e, f) = self
        return SixVector((b, a), (d, c), (f, e))


POSE = SixVector(("position", "rotation"), ("m", "rad"), (1e-6, 1e-5))
TWIST = SixVector(("velocity", "angular_velocity"), ("m/s", "rad/s"), (1e-3, 1e-2))
ACCELERATION = SixVector(("acceleration", "angular_acceleration"), ("m/s2", "rad/s2"), (1.0, 10.0))
WRENCH = SixVector(("force", "torque"), ("N", "N.m"), (0.1, 1e-2))


@dataclass(frozen=True)
class Body:
    """A rigid body; by default a disc of 0.1 kg and 30 mm radius, its axis along X, its centre the reference point.

    Attributes:
        mass: mass [kg].
        inertia: moments of inertia about the mass centre, Jxx, Jyy, Jzz [kg.m2].
        center: mass centre from the reference point [m].
    """

    mass: float = 0.1
    inertia: Triple = (4.5e-5, 2.25e-5, 2.25e-5)
    center: Triple = (0.0, 0.0, 0.0)


DISC = Body()
"""The default body, a disc."""


def mass_matrix(body: Body, label: str) -> np.ndarray:
    """Return M at the reference point, shape (6, 6); `ModelError` with `label` unless mass and inertia are above 0."""
    values = np.array([body.mass, *body.inertia, *body.center])
    if not (np.all(np.isfinite(values)) and np.all(values[:4] > 0)):
        raise ModelError(
            f"{label} has mass {body.mass:g} kg, inertia {body.inertia} kg.m2 and center {body.center} m, expected "
            f"finite numbers, mass and inertia above 0"
        )
    offset = body.mass * skew(np.array(body.center))
    inertia = np.diag(body.inertia) - offset @ skew(np.array(body.center))
    M = np.block([[body.mass * np.eye(3), -offset], [offset, inertia]])
    return M + 0.0  # no zero is negative


def declare_vector(declare: Callable[..., ca.SX], terminal: str, six: SixVector, text: str) -> ca.SX:
    """Declare a column of six at a terminal by `Model.input` or `Model.state` and return its symbols, shape (6, 1).

    `text` completes the descriptions: name of the body and reference point.
    """
    halves = zip(six.names, six.units, six.nominals, strict=True)
    return ca.vertcat(
        *[declare(f"{terminal}.{name}[1..3]", unit, _description(name, text), nominal=n) for name, unit, n in halves]
    )


def output_vector(m: Model, terminal: str, six: SixVector, column: ca.SX, text: str) -> None:
    """Declare a column of six as outputs at a terminal; `text` as in `declare_vector`."""
    for i, (name, unit, nominal) in enumerate(zip(six.names, six.units, six.nominals, strict=True)):
        half = column[3 * i : 3 * i + 3]
        m.output(f"{terminal}.{name}[1..3]", half, unit, _description(name, text), nominal=nominal)


def _description(name: str, text: str) -> str:
    return f"{name.replace('_', ' ').capitalize()} {text}"
