"""Mechanics of the accelerometer's bodies by twist-shaping matrices, for large displacements.

n limbs, 360 / n degrees apart, carry the proof mass without rotation; the source has three, sixteen bodies in all. In
its own frame limb i is a chain of two links of length h at angles a1, a2, tilted by b:

    x_i = h (cos a1 + cos a2),  y_i = h (sin a1 + sin a2) - sqrt(2) h,  z = h (sin a1 + sin a2) sin b
    (a1', a2', b') = R Q_i^T q',    t = (omega; v) = T(f, g, p, r) (a1', a2', b')

Q_i transforms from the frame of limb i to that of the sensor. The twist t of a body has the shares f, g of the links'
motion and p, r of their rotation: bar 1, 0, 0, 0; lower legs 1/2, 0, 1, 0; upper legs 1, 1/2, 0, 1. With
T_k = T R Q_i^T of every body,

    M = sum T_k^T M_k T_k,    c = M' q' - 1/2 d(q'^T M q')/dq,    Gamma^T = sum m_k T_k,v,    n = dV/dq
    V = sum over limbs [k_in ((a1 - 3 pi/4)^2 + (a2 - pi/4)^2) + 2 k_out b^2]

As in the source, every leg keeps its axes of inertia at home and has the angular velocity (b', 0, a'). c follows from
the kinetic energy (Lagrange) and n from V, so the equations conserve energy exactly.

Source: technical report of 2016 on the accelerometer, secs 2 and 3. Its velocity terms, by Kane's method, are c plus
the gyroscopic terms T_k^T (omega x I omega). These vanish at home, do no work and are valid for axes of inertia that
rotate with the body; they are omitted here. Not in the source: the inverse in closed form, V, and Gamma away from home.
"""

import math
from typing import NamedTuple

import casadi as ca

from hfsa.components._mechanics.tba_design import LIMBS, Bodies


def _turn(angle: float) -> ca.DM:
    """Return the matrix of a rotation about Z, shape (3, 3)."""
    c, s = math.cos(angle), math.sin(angle)
    return ca.DM([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def turns(limbs: int) -> list[ca.DM]:
    """Return Q_i, from the frames of the limbs to that of the sensor, shape (3, 3) each."""
    return [_turn(2 * math.pi * i / limbs) for i in range(limbs)]


_LOWER, _UPPER = _turn(math.pi / 4), _turn(-math.pi / 4)
"""Rotations from the axes of a lower and of an upper leg to the limb's frame."""
_HOME = ca.DM([3 * math.pi / 4, math.pi / 4, 0])
"""a1, a2, b at home [rad]."""


class Terms(NamedTuple):
    """Terms of the equations of motion, functions of displacement q and rate q' of the proof mass.

    Attributes:
        mass: M, shape (3, 3).
        velocity: c, shape (3, 1).
        driven: Gamma^T, matrix from q' to the momentum of all bodies, shape (3, 3).
        elastic: n, shape (3, 1).
    """

    mass: ca.SX
    velocity: ca.SX
    driven: ca.SX
    elastic: ca.SX


def terms(bodies: Bodies, k_in: float, k_out: float, position: ca.SX, rate: ca.SX) -> Terms:
    """Return the terms as functions of the symbols of position and rate of the proof mass, each (3, 1) [m], [m/s].

    `k_in`, `k_out` [N.m/rad] are the stiffnesses of one leg in bending in the plane and in torsion.
    """
    limb = _limb_terms(bodies, k_in, k_out)
    mass, velocity, driven, elastic = (ca.SX.zeros(3, n) for n in (3, 1, 3, 1))
    for turn in turns(bodies.limbs):
        M, c, G, n = limb(turn.T @ position, turn.T @ rate)
        mass += turn @ M @ turn.T
        velocity += turn @ c
        driven += turn @ G @ turn.T
        elastic += turn @ n
    carried = bodies.proof_mass * ca.DM.eye(3)
    return Terms(ca.tril2symm(ca.tril(mass + carried)), velocity, driven + carried, elastic)


def potential(bodies: Bodies, k_in: float, k_out: float, position: ca.SX) -> ca.SX:
    """Return V [J] at a displacement of the proof mass, shape (3, 1) [m]."""
    energy = ca.SX(0)
    for turn in turns(bodies.limbs):
        lower, upper, tilt = ca.vertsplit(_bends(bodies.link, turn.T @ position))
        energy += k_in * (lower**2 + upper**2) + 2 * k_out * tilt**2
    return energy


def cross_axis(bodies: Bodies) -> float:
    """Return y / x^2 [1/m] of the proof mass under a small force along x, from the third derivatives of V at home.

    It is 0 for more than three limbs, as c1 and c2 (`tba_design.py`).
    """
    if bodies.limbs > LIMBS:
        return 0.0
    q = ca.SX.sym("q", 3)
    slope = ca.gradient(potential(bodies, 1.0, 0.0, q), q[:2])
    stiffness = ca.jacobian(slope, q[:2])
    values = ca.Function("at", [q], [stiffness[1, 1], ca.jacobian(stiffness[1, 0], q[0])])(0)
    return -float(values[1]) / (2 * float(values[0]))


def _limb_terms(bodies: Bodies, k_in: float, k_out: float) -> ca.Function:
    """Return the function (position, rate) -> terms of one limb in its own frame.

    They follow from Lagrange's equations over z = (a1, a2, b). With z' = R v, the limb's M is R^T I R and its c is
    R^T (I R' v + I' z' - 1/2 d(z'^T I z')/dz).
    """
    position, v, z, z_rate = (ca.SX.sym(name, 3) for name in ("p", "v", "z", "z_rate"))
    inertia, momentum = _inertia(bodies, z)
    rates = _rates(bodies.link, z)
    by_time = ca.jtimes(inertia @ z_rate, z, z_rate) - ca.gradient(z_rate.T @ inertia @ z_rate, z) / 2
    velocity = rates.T @ (inertia @ ca.jtimes(rates @ v, z, z_rate) + by_time)
    bends = _bends(bodies.link, position)
    found = [
        rates.T @ inertia @ rates,
        ca.substitute(velocity, z_rate, rates @ v),
        momentum @ rates,
        rates.T @ (ca.DM([2 * k_in, 2 * k_in, 4 * k_out]) * bends),
    ]
    return ca.Function("limb", [position, v], ca.substitute(found, [z], [_HOME + bends]))


def _bends(h: float, position: ca.SX) -> ca.SX:
    """Return (a1, a2, b) minus the angles at home [rad] at a displacement in the limb's frame, in closed form.

    The result is accurate to the last bit near home too: no small angle is the difference of two large ones.
    """
    x, y, z = ca.vertsplit(position)
    Y = y + math.sqrt(2) * h
    # a1 and a2 are phi +- acos(u): `turning` is phi - pi/2, `sine` the sine of acos(u) - pi/4.
    turning, u = -ca.atan2(x, Y), ca.sqrt(x**2 + Y**2) / (2 * h)
    sine = -(x**2 + y**2 + 2 * math.sqrt(2) * h * y) / (2 * math.sqrt(2) * h**2 * (u + ca.sqrt(1 - u**2)))
    return ca.vertcat(turning + ca.asin(sine), turning - ca.asin(sine), ca.asin(z / Y))


def _rates(h: float, z: ca.SX) -> ca.SX:
    """Return R, from the proof mass's velocity in the limb's frame to (a1', a2', b'), shape (3, 3)."""
    (c1, c2, cb), (s1, s2, sb) = (ca.vertsplit(function(z)) for function in (ca.cos, ca.sin))
    apart, reach = h * ca.sin(z[0] - z[1]), h * cb * (s1 + s2)
    return ca.vertcat(
        ca.horzcat(-c2 / apart, -s2 / apart, 0),
        ca.horzcat(c1 / apart, s1 / apart, 0),
        ca.horzcat(0, -sb / reach, 1 / reach),
    )


def _inertia(bodies: Bodies, z: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return inertia and momentum of a limb's five bodies, matrices on (a1', a2', b'), shape (3, 3) each."""
    leg = ca.diag(ca.DM([bodies.leg_x, bodies.leg_y, bodies.leg_z]))
    members = (
        (bodies.bar, ca.diag(ca.DM([bodies.bar_x, 0, 0])), _shaping(bodies.link, z, 1, 0, 0, 0)),
        (2 * bodies.leg, 2 * _LOWER @ leg @ _LOWER.T, _shaping(bodies.link, z, 1 / 2, 0, 1, 0)),
        (2 * bodies.leg, 2 * _UPPER @ leg @ _UPPER.T, _shaping(bodies.link, z, 1, 1 / 2, 0, 1)),
    )
    inertia, momentum = ca.SX.zeros(3, 3), ca.SX.zeros(3, 3)
    for mass, rotational, shaping in members:
        spin, move = shaping[:3, :], shaping[3:, :]
        inertia += spin.T @ rotational @ spin + mass * move.T @ move
        momentum += mass * move
    return inertia, momentum


def _shaping(h: float, z: ca.SX, f: float, g: float, p: float, r: float) -> ca.SX:
    """Return T, from (a1', a2', b') to the twist (omega; v) of a body, shape (6, 3)."""
    (c1, c2, cb), (s1, s2, sb) = (ca.vertsplit(function(z)) for function in (ca.cos, ca.sin))
    return ca.vertcat(
        ca.horzcat(0, 0, 1),
        ca.horzcat(0, 0, 0),
        ca.horzcat(p, r, 0),
        ca.horzcat(-f * h * s1, -g * h * s2, 0),
        ca.horzcat(f * h * c1, g * h * c2, 0),
        ca.horzcat(f * h * c1 * sb, g * h * c2 * sb, h * cb * (f * s1 + g * s2)),
    )
