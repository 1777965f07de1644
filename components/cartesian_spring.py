"""A body on springs that is given by its stiffness and mass matrices: any machine with a rigid platform, linear.

    M xdd = w - D (xd - rd) - K (x - r)

x = [rotation; position] is the displacement of the reference point from rest, r the commanded one, of the platform that
would follow its drives exactly, w = [torque; force] the wrench at that point, all in the axes of the matrices. D gives
every mode the same damping ratio, or is D = alpha M + beta K with `damping_model=rayleigh`.

`analyze` answers with all that the two matrices tell: eigenscrews, compliant axes, frequency matrix, modes and their
axes, at the reference point and, for the mass matrix of a rigid body, at its centre of mass C.

Ports: in `base.rotation` [rad], `base.position` [m], their rates `base.angular_velocity` and `base.velocity`,
`wrench.torque` [N.m] and `wrench.force` [N]; out `platform.rotation`, `.position`, `.angular_velocity`, `.velocity`,
`.angular_acceleration` and `.acceleration`.

Bode plot, with the default matrices, from `base.position[3]` to `platform.position[3]`: 0 dB at low frequency, one
resonance of 34 dB at 50.3 Hz, and -20 dB per decade far above it, as damping sits in the springs.
"""

from typing import Any, get_args

import casadi as ca
import numpy as np

from hfsa.components import Model
from hfsa.components._mechanics import cartesian_numbers as cartesian
from hfsa.components._mechanics.cartesian_body import center_of_mass, length_of, symmetric_matrix
from hfsa.components._mechanics.modes import Damping, damping_matrix
from hfsa.components._mechanics.rigid_body import ACCELERATION, POSE, TWIST, WRENCH, declare_vector, output_vector
from hfsa.components._modelling.model import one_of

Entries = tuple[float, ...]

STIFFNESS: Entries = tuple(np.diag([1e3, 1e3, 1e3, 1e5, 1e5, 1e5]).ravel().tolist())
"""Default stiffness: [N.m/rad] about and [N/m] along each axis."""
MASS: Entries = tuple(np.diag([0.01, 0.01, 0.02, 1.0, 1.0, 1.0]).ravel().tolist())
"""Default mass: a body of 1 kg about its centre of mass."""

_CENTER = "_C"

UNITS = cartesian.units("", _CENTER, center=_CENTER) | {"center_of_mass": "m", "body": "1"}
"""Units of the numbers, in the notation of `_modelling/parts.py`."""


def cartesian_spring(
    *, stiffness: Entries = STIFFNESS, mass: Entries = MASS, damping_model: Damping = "modal"
) -> Model:
    """Return the body on its springs.

    Args:
        stiffness: K by rows, 36 numbers, rotation first, symmetric and positive definite [N.m/rad, N; N, N/m].
        mass: M about the same point and axes, likewise [kg.m2, kg.m; kg.m, kg].
        damping_model: `modal`, the same ratio in every mode, or `rayleigh`, this ratio in the first and fourth mode.

    Raises:
        ModelError: a matrix that is not of 36 numbers, not symmetric or not positive definite.
    """
    one_of(damping_model, get_args(Damping), "cartesian_spring: damping_model")
    M, K = _matrices(mass, stiffness)
    m = Model("CartesianSpring", "Rigid body on a six-dimensional spring")
    zeta = m.parameter("damping_ratio", 0.01, "1", "Damping ratio of the modes", min=0)
    command = declare_vector(m.input, "base", POSE.rotation_first, "of the commanded platform")
    command_rate = declare_vector(m.input, "base", TWIST.rotation_first, "of the commanded platform")
    wrench = declare_vector(m.input, "wrench", WRENCH.rotation_first, "on the platform at the reference point")
    x = declare_vector(m.state, "body", POSE.rotation_first, "of the platform from rest")
    v = declare_vector(m.state, "body", TWIST.rotation_first, "of the platform")
    D = zeta * ca.DM(damping_matrix(M, K, damping_model))
    force = wrench - D @ (v - command_rate) - ca.DM(K) @ (x - command)
    acceleration = ca.DM(np.linalg.inv(M)) @ force
    m.der[x], m.der[v] = v, acceleration
    for six, column in ((POSE, x), (TWIST, v), (ACCELERATION, acceleration)):
        output_vector(m, "platform", six.rotation_first, column, "of the platform")
    return m


def analyze(*, stiffness: Entries = STIFFNESS, mass: Entries = MASS) -> dict[str, Any]:
    """Return the elastostatic and elastodynamic properties of the body, in SI units, rotation first.

    Arguments and errors as in `cartesian_spring`.

    Returns:
        The numbers of `analyze sdelta` that follow from the two matrices, without an ending at their reference point
        and with `_C` at the centre of mass; also

        center_of_mass: C from the reference point, (3,) [m].
        body: `rigid`, or a sentence on a mass matrix that is not that of a rigid body; then there is no C and nothing
            that is defined there only, such as the frequency matrix.
    """
    M, K = _matrices(mass, stiffness)
    center = center_of_mass(M)
    places = {"": np.zeros(3)} | ({} if center is None else {_CENTER: center})
    length = length_of(M)
    return {
        **({} if center is None else {"center_of_mass": center}),
        "body": "rigid" if center is not None else "not rigid: the mass matrix has no centre of mass",
        **cartesian.static_numbers(K, places, length),
        **cartesian.modal_numbers(M, K, places, "" if center is None else _CENTER, length),
    }


def _matrices(mass: Entries, stiffness: Entries) -> tuple[np.ndarray, np.ndarray]:
    """Return M and K, shape (6, 6)."""
    return (
        symmetric_matrix(mass, "cartesian_spring: mass", "kg.m2 and kg"),
        symmetric_matrix(stiffness, "cartesian_spring: stiffness", "N.m/rad and N/m"),
    )
