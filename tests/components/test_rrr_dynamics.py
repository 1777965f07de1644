"""Dynamics of the 3-RRR stage: the equations as written, against Lagrange's from the positions of the bodies."""

import casadi as ca
import numpy as np
import pytest

from hfsa.components._mechanics import rrr_dynamics as dynamics
from hfsa.components._mechanics.rrr_hinge import THESIS_HINGE
from hfsa.components._mechanics.rrr_kinematics import CALIBRATED, NOMINAL, Links, corner_motion, elongations, legs
from hfsa.components._mechanics.rrr_masses import THESIS_MASSES

SETS = pytest.mark.parametrize("geometry", [NOMINAL, CALIBRATED], ids=["nominal", "calibrated"])
LEVEL = pytest.mark.parametrize("level", ["constant_jacobian", "exact"])

p, v = ca.SX.sym("p", 3), ca.SX.sym("v", 3)
RNG = np.random.default_rng(3)
POINTS = [(np.array([3e-5, 3e-5, 1.5e-3]), np.array([3e-2, 3e-2, 1.5])) * RNG.standard_normal((2, 3)) for _ in range(5)]
"""Poses and their rates, as large as the stage's and of a motion at 150 Hz."""


def bodies(geometry: Links) -> dynamics.Terms:
    """Terms over the pose by differentiating positions: platform, cranks about A, couplers at their middles."""
    turns, C = legs(geometry, p), corner_motion(geometry, p) + geometry.corners.T
    B = ca.horzcat(*[_turned(arm, turns.crank[i]) for i, arm in enumerate(geometry.cranks)]) + geometry.base_hinges.T
    middles, cranks = (B + C) / 2, (B + geometry.base_hinges.T) / 2
    rate = {name: ca.jtimes(ca.vec(x), p, v) for name, x in (("middle", middles), ("crank", cranks))}
    coupler_inertia = THESIS_MASSES.coupler * geometry.coupler**2 / 12
    kinetic = THESIS_MASSES.platform * ca.sumsqr(v[:2]) + THESIS_MASSES.platform_inertia * v[2] ** 2
    kinetic += THESIS_MASSES.crank_inertia * ca.sumsqr(ca.jtimes(turns.crank, p, v))
    kinetic += THESIS_MASSES.coupler * ca.sumsqr(rate["middle"])
    kinetic += coupler_inertia * ca.sumsqr(ca.jtimes(turns.coupler, p, v))
    kinetic /= 2
    bends = ca.vertcat(turns.crank, turns.crank - turns.coupler, turns.coupler - p[2])
    momentum = THESIS_MASSES.platform * v[:2]
    for mass, name in ((THESIS_MASSES.coupler, "middle"), (THESIS_MASSES.crank, "crank")):
        momentum += mass * ca.sum2(ca.reshape(rate[name], 2, 3))
    mass = ca.hessian(kinetic, v)[0]
    z = ca.vertcat(p, elongations(geometry, p))
    slope = ca.jacobian(z, p)
    return dynamics.Terms(
        mass,
        ca.jtimes(mass @ v, p, v) - ca.gradient(kinetic, p),
        ca.gradient(THESIS_HINGE.stiffness / 2 * ca.sumsqr(bends), p),
        ca.jacobian(momentum, v).T,
        slope,
        ca.jtimes(slope @ v, p, v),
    )


def _turned(arm: np.ndarray, angle: ca.SX) -> ca.SX:
    """A vector turned by an angle, (2, 1)."""
    c, s = ca.cos(angle), ca.sin(angle)
    return ca.vertcat(c * arm[0] - s * arm[1], s * arm[0] + c * arm[1])


def function(terms: dynamics.Terms) -> ca.Function:
    return ca.Function("terms", [p, v], [ca.densify(term) for term in ca.cse([*terms])])


@SETS
def test_exact_is_lagranges_equation_of_the_bodies(geometry):
    ours = function(dynamics.terms(dynamics.exact(geometry, p, v)))
    theirs = function(bodies(geometry))
    for at, rates in POINTS:
        for name, found, wanted in zip(dynamics.Terms._fields, ours(at, rates), theirs(at, rates), strict=True):
            size = np.abs(np.array(wanted)).max()
            np.testing.assert_allclose(np.array(found), np.array(wanted), rtol=0, atol=3e-12 * size, err_msg=name)


@LEVEL
def test_the_map_is_the_derivative_of_pose_and_elongations(level):
    mechanism = getattr(dynamics, level)(NOMINAL, p, v)
    terms, z = dynamics.terms(mechanism), ca.vertcat(mechanism.pose, mechanism.elongation)
    slope = ca.jacobian(z, p)
    ours = ca.Function("ours", [p, v], [terms.slope, terms.bias])
    theirs = ca.Function("theirs", [p, v], [slope, mechanism.rate(slope @ v)])
    for at, rates in POINTS:
        for found, wanted in zip(ours(at, rates), theirs(at, rates), strict=True):
            np.testing.assert_allclose(np.array(found), np.array(wanted), rtol=1e-10)


@LEVEL
def test_the_inertia_is_symmetric_to_the_last_bit(level):
    mass = dynamics.terms(getattr(dynamics, level)(NOMINAL, p, v)).mass
    M = np.array(ca.Function("M", [p], [mass])(POINTS[0][0]))
    assert np.array_equal(M, M.T)
    assert np.linalg.eigvalsh(M).min() > 0


def test_exact_costs_less_than_twice_the_constant_jacobian():
    """Operations of all terms together: what decides on the time of a step."""
    constant, exact = (
        function(dynamics.terms(level(NOMINAL, p, v))) for level in (dynamics.constant_jacobian, dynamics.exact)
    )
    assert exact.n_instructions() < 2 * constant.n_instructions() < 2000
