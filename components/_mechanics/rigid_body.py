"""A rigid body in small motion: its mass matrix, and its pose, twist, acceleration and wrench as ports.

    M = [[m 1, -m skew(c)], [m skew(c), J - m skew(c)^2]]

at a reference point of the body, with its mass m, inertia J about its mass centre and c, from the reference point to
there. Columns of six are translations before rotations, forces before torques; as ports they are two vectors of three.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._mechanics.screws import skew
from hfsa.components._modelling.model import Model, ModelError

Triple = tuple[float, float, float]


class Six(NamedTuple):
    """What a column of six is: names, units and sizes of its two halves.

    The sizes are those of micrometre motion at hundreds of hertz, some centimetres from the axis.
    """

    names: tuple[str, str]
    units: tuple[str, str]
    sizes: tuple[float, float]


POSE = Six(("position", "rotation"), ("m", "rad"), (1e-6, 1e-5))
TWIST = Six(("velocity", "angular_velocity"), ("m/s", "rad/s"), (1e-3, 1e-2))
ACCELERATION = Six(("acceleration", "angular_acceleration"), ("m/s2", "rad/s2"), (1.0, 10.0))
WRENCH = Six(("force", "torque"), ("N", "N.m"), (0.1, 1e-2))


@dataclass(frozen=True)
class Body:
    """A rigid body; by default a disc of 0.1 kg and 30 mm radius, its axis along X, its centre the reference point.

    Attributes:
        mass: [kg].
        inertia: about its mass centre, Jxx, Jyy, Jzz [kg.m2].
        center: of mass, from the reference point [m].
    """

    mass: float = 0.1
    inertia: Triple = (4.5e-5, 2.25e-5, 2.25e-5)
    center: Triple = (0.0, 0.0, 0.0)


DISC = Body()
"""The default."""


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


def declared(declare: Callable[..., ca.SX], terminal: str, six: Six, text: str) -> ca.SX:
    """Declare a column of six at a terminal by `Model.input` or `Model.state`; `text` says whose and where."""
    halves = zip(six.names, six.units, six.sizes, strict=True)
    return ca.vertcat(
        *[declare(f"{terminal}.{name}[1..3]", unit, _sentence(name, text), nominal=size) for name, unit, size in halves]
    )


def put_out(m: Model, terminal: str, six: Six, column: ca.SX, text: str) -> None:
    """Declare a column of six as outputs of a terminal; `text` as in `declared`."""
    for i, (name, unit, size) in enumerate(zip(six.names, six.units, six.sizes, strict=True)):
        half = column[3 * i : 3 * i + 3]
        m.output(f"{terminal}.{name}[1..3]", half, unit, _sentence(name, text), nominal=size)


def _sentence(name: str, text: str) -> str:
    return f"{name.replace('_', ' ').capitalize()} {text}"
