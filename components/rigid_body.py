"""A rigid body under a wrench, in coordinates relative to a moving base; linear, for small motion.

    M q'' = w - M b

q = (x, y, z, thx, thy, thz) is the displacement of the body's reference point and its rotation from rest, relative to
the base, w = (force, torque) the wrench at that point, b = (a, alpha) the acceleration of the coincident point of the
base, M the mass matrix. With a base at rest it is a free body in space. This body and a `beam_suspension` together are
equivalent to a `beam_stage`.

Ports: in `wrench.force` [N], `wrench.torque` [N.m], `base.acceleration` [m/s2], `base.angular_acceleration` [rad/s2];
out `platform.position` [m], `.rotation` [rad], `.velocity`, `.angular_velocity`, `.acceleration` and
`.angular_acceleration`, all relative to the base. The two accelerations have direct feedthrough from all inputs.

Bode plot: from `wrench.force[1]` to `platform.position[1]` 1 / (mass omega^2), 0.2533 m/N at 1 Hz for 0.1 kg, and -40
dB per decade, with 180 degrees; from `base.acceleration[1]` 1 / omega^2, 0.02533 s2 at 1 Hz for any mass, with 0
degrees.
"""

import casadi as ca
import numpy as np

from hfsa.components import Model
from hfsa.components._mechanics.beam_module import without_rounding
from hfsa.components._mechanics.body_facts import BODY_CENTER, BODY_INERTIA, BODY_MASS
from hfsa.components._mechanics.rigid_body import (
    ACCELERATION,
    DISC,
    POSE,
    TWIST,
    WRENCH,
    Body,
    declare_vector,
    mass_matrix,
    output_vector,
)
from hfsa.components._modelling.facts import Known

FACTS = {BODY_MASS: Known("body.mass"), BODY_INERTIA: Known("body.inertia"), BODY_CENTER: Known("body.center")}


def rigid_body(*, body: Body = DISC) -> Model:
    """Return the body, at rest at the start.

    Args:
        body: mass, inertia and mass centre.

    Raises:
        ModelError: a body without mass or inertia.
    """
    M = mass_matrix(body, "rigid_body: body")
    m = Model("RigidBody", "Rigid body in small motion")
    load = declare_vector(m.input, "wrench", WRENCH, "on the body at the reference point")
    base = declare_vector(m.input, "base", ACCELERATION, "of the base at the reference point")
    q = declare_vector(m.state, "center", POSE, "of the reference point, relative to the base")
    rate = declare_vector(m.state, "center", TWIST, "of the reference point, relative to the base")
    acceleration = ca.sparsify(ca.DM(without_rounding(np.linalg.inv(M)))) @ load - base
    m.der[q], m.der[rate] = rate, acceleration
    for six, column in ((POSE, q), (TWIST, rate), (ACCELERATION, acceleration)):
        output_vector(m, "platform", six, column, "of the body, relative to the base")
    return m
