"""PD gains and holding torques of the SDelta's six motors at a posture, from its rigid-body model.

    M_rb = M_th + T^T M T                               inertia on the motor angles (rigid limit of the motor plant)
    Kp_i = M_rb,ii w_c^2,  Kd_i = 2 z_c w_c M_rb,ii     with w_c = 2 pi bandwidth, z_c = damping
    tau_g = T^T [0; m g Z]                              torques that balance the weight

T maps motor angles to the pose of the centre of mass C, M is the platform's mass matrix there, M_th the inertia of the
drives. The default bandwidth, 6 Hz, is a quarter of the first natural frequency at the symmetric posture, well below
the elastic modes.

An analysis, not a model: `hfsa analyze sdelta_tuning`. Motors are ordered L1, R1, L2, R2, L3, R3.
"""

from typing import Any

import numpy as np

from hfsa.components import ModelError
from hfsa.components._mechanics.sdelta_facts import GEAR, GEOMETRY, GRAVITY, LIMBS, PAYLOAD, PITCH, PLATFORM, POSTURE
from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC, Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE, THESIS_PLATFORM, Payload, Platform
from hfsa.components._mechanics.sdelta_kinematics import THESIS, Kinematics, Mechanism
from hfsa.components._mechanics.sdelta_limbs import THESIS_LIMBS, LimbInertia
from hfsa.components._mechanics.sdelta_robot import Machine
from hfsa.components._modelling.facts import Known

FACTS = {
    POSTURE: Known("posture"),
    PAYLOAD: Known("payload", results=("motor_inertia", "proportional_gain", "derivative_gain", "holding_torque")),
    GEOMETRY: Known("geometry"),
    GEAR: Known("gear"),
    PITCH: Known("pitch"),
    LIMBS: Known("limbs", results=("motor_inertia", "proportional_gain", "derivative_gain")),
    PLATFORM: Known("platform", results=("motor_inertia", "proportional_gain", "derivative_gain", "holding_torque")),
    GRAVITY: Known("gravity", results=("holding_torque",)),
}

UNITS = {
    "motor_angles": "rad",
    "motor_inertia": "kg.m2",
    "proportional_gain": "N.m/rad",
    "derivative_gain": "N.m.s/rad",
    "holding_torque": "N.m",
}
"""Units of the results of `analyze`, in the notation of `_modelling/parts.py`."""


def analyze(
    *,
    posture: Posture = SYMMETRIC,
    payload: Payload = CUBE,
    bandwidth: float = 6.0,
    damping: float = 0.7,
    gravity: float = 9.81,
    mechanism: Mechanism = THESIS,
    limbs: LimbInertia = THESIS_LIMBS,
    platform: Platform = THESIS_PLATFORM,
) -> dict[str, Any]:
    """Return gains and torques at a posture, in SI units.

    Args:
        posture: rotation in degrees, position of S in metres.
        payload: payload of the platform.
        bandwidth: bandwidth of the rigid closed loop [Hz].
        damping: damping ratio of the rigid closed loop.
        gravity: gravitational acceleration along -Z [m/s2].
        mechanism: `geometry`, circumradii of the triangles of base and platform [m], `gear`, motor turns per turn of a
            tube, and `pitch`, travel of a nut per turn of its motor [m].
        limbs: inertia of rotors, screws and tubes.
        platform: mass [kg] and moments of inertia [kg.m2] of the platform without payload.

    Returns:
        motor_angles: motor angles at the posture, (6,) [rad].
        motor_inertia: M_rb, (6, 6) [kg.m2].
        proportional_gain, derivative_gain: Kp_i, Kd_i, (6,) [N.m/rad], [N.m.s/rad].
        holding_torque: tau_g, (6,) [N.m].

    Raises:
        ModelError: a singular posture; a bandwidth or damping below 0.
    """
    for name, value in (("bandwidth", bandwidth), ("damping", damping)):
        if not (np.isfinite(value) and value >= 0):
            raise ModelError(f"sdelta_tuning: {name} is {value:g}, expected 0 or more")
    machine = Machine(mechanism, platform=platform, limbs=limbs)
    kinematics, body = Kinematics.at(posture, machine.mechanism), machine.body(payload)
    T = kinematics.jacobian(posture.matrix @ body.center)
    M_rb = machine.drive_inertia + T.T @ body.matrix(posture.matrix) @ T
    w_c, diagonal = 2 * np.pi * bandwidth, np.diag(M_rb)
    return {
        "motor_angles": kinematics.motor_angles,
        "motor_inertia": M_rb,
        "proportional_gain": diagonal * w_c**2,
        "derivative_gain": 2 * damping * w_c * diagonal,
        "holding_torque": body.mass * gravity * T[5],
    }
