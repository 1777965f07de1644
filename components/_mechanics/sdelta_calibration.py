"""Calibration of the SDelta's triangles and drives from motor angles at measured postures.

The inverse kinematics is closed: a platform joint a + Q s_j, seen from the middle m_j of its side of the base, is u_j
along the side, and at the angle phi_j about it. The motor angles are J_C^-1 of their changes from the symmetric
posture, at whose height `home_height` they are zero.
"""

import math

import casadi as ca
import numpy as np

from hfsa.components._mechanics.sdelta_geometry import C_AXES, HEIGHT, INWARDS, SYMMETRIC
from hfsa.components._mechanics.sdelta_kinematics import Mechanism
from hfsa.components._modelling.calibration import Calibration
from hfsa.components._modelling.study import Response, Study, Variable

FREE = ("geometry.base_radius", "geometry.platform_radius", "gear", "pitch")
MOTORS = ("L1", "R1", "L2", "R2", "L3", "R3")
_ERROR = 1e-3
"""Error of a motor angle in units of which residuals count [rad]."""


def calibration_of(mechanism: Mechanism) -> Calibration:
    """Return the calibration over motor angles at postures x, y, z [m], rz, rx, ry [deg]."""
    geometry, transmission = mechanism.geometry, mechanism.transmission
    middles, joints = geometry.middles / geometry.base_radius, geometry.joints / geometry.platform_radius
    variables = {
        "geometry.base_radius": _variable("R", geometry.base_radius, "m", "Circumradius of the base"),
        "geometry.platform_radius": _variable("r", geometry.platform_radius, "m", "Circumradius of the platform"),
        "gear": _variable("gear", transmission.gear, "1", "Motor turns per turn of a tube"),
        "pitch": _variable("pitch", transmission.pitch, "m", "Travel of a nut per turn of its motor"),
        "home_height": _variable("home_height", HEIGHT, "m", "Height of S at which all motor angles are zero"),
        **{n: _variable(n, v, "m", f"Position of S, {n}") for n, v in zip("xyz", SYMMETRIC.position, strict=True)},
        **{n: _variable(n, 0.0, "1", f"Rotation about {n[1]} [deg]") for n in ("rz", "rx", "ry")},
    }
    R, r, gear, pitch, home, *position = (v.symbol for v in list(variables.values())[:8])
    turns = [math.pi / 180 * variables[name].symbol for name in ("rz", "rx", "ry")]
    Q, level = _attitude(*turns), ca.SX.eye(3)
    expressions = []
    for middle, joint, along, inwards in zip(middles, joints, C_AXES, INWARDS, strict=True):
        there = _tube(ca.vertcat(*position) + Q @ (r * ca.DM(joint)) - R * ca.DM(middle), along, inwards)
        at_home = _tube(ca.vertcat(0, 0, home) + level @ (r * ca.DM(joint)) - R * ca.DM(middle), along, inwards)
        slide, turn = ((one - other) for one, other in zip(there, at_home, strict=True))
        half_slide, half_turn = 2 * math.pi * slide / pitch, gear * turn
        expressions += [half_turn + half_slide, half_turn - half_slide]
    responses = {
        f"motor_{name}": Response(expression, "rad", f"Motor angle {name}")
        for name, expression in zip(MOTORS, expressions, strict=True)
    }
    conditions = {f"{name} above 0": variables[name].symbol / variables[name].value for name in FREE}
    study = Study("sdelta", variables, responses, conditions, {}, {}, [])
    return Calibration(study, FREE, dict.fromkeys(responses, _ERROR))


def _variable(name: str, value: float, unit: str, text: str) -> Variable:
    """Return a variable with a symbol of its own."""
    return Variable(ca.SX.sym(name), value, unit, text)


def _tube(reach: ca.SX, along: np.ndarray, inwards: np.ndarray) -> tuple[ca.SX, ca.SX]:
    """Return slide and angle of the tube whose limb reaches from the middle of its side."""
    return ca.dot(ca.DM(along), reach), ca.atan2(reach[2], ca.dot(ca.DM(inwards), reach))


def _attitude(rz: ca.SX, rx: ca.SX, ry: ca.SX) -> ca.SX:
    """Return Rz Rx Ry [rad]."""
    c, s = ca.cos, ca.sin
    about_z = ca.vertcat(ca.horzcat(c(rz), -s(rz), 0), ca.horzcat(s(rz), c(rz), 0), ca.horzcat(0, 0, 1))
    about_x = ca.vertcat(ca.horzcat(1, 0, 0), ca.horzcat(0, c(rx), -s(rx)), ca.horzcat(0, s(rx), c(rx)))
    about_y = ca.vertcat(ca.horzcat(c(ry), 0, s(ry)), ca.horzcat(0, 1, 0), ca.horzcat(-s(ry), 0, c(ry)))
    return about_z @ about_x @ about_y
