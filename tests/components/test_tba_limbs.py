"""Mechanics of the accelerometer's limbs: at home the source's, away from it Lagrange's of the bodies' positions."""

import math

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hfsa.components._mechanics import tba_limbs as limbs
from hfsa.components._mechanics.tba_design import DESIGNS, Formulas, coriolis, formulas

DESIGN = pytest.mark.parametrize("design", DESIGNS)
COUNT = pytest.mark.parametrize("count", [3, 4, 5, 8])

q, v = ca.SX.sym("q", 3), ca.SX.sym("v", 3)


def numbers(design: str, count: int = 3) -> Formulas:
    return formulas(DESIGNS[design].shape, limbs=count)


def states(found: Formulas, size: float, count: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Displacements up to `size`, and rates as large as at the natural frequency."""
    rng = np.random.default_rng(4)
    omega = 2 * math.pi * found.f_in
    return [size * np.array([1, omega])[:, None] * rng.uniform(-1, 1, (2, 3)) for _ in range(count)]


def ours(found: Formulas) -> ca.Function:
    return ca.Function("ours", [q, v], ca.cse([ca.densify(t) for t in limbs.terms(*elastic(found), q, v)]))


def elastic(found: Formulas) -> tuple:
    return found.bodies, found.k_in, found.k_out


def turn(angle: float) -> ca.DM:
    c, s = math.cos(angle), math.sin(angle)
    return ca.DM([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def of_positions(found: Formulas) -> ca.Function:
    """M, c, Gamma^T, dV/dq by differentiating positions and angles of all bodies, with the inverse by arcus cosine."""
    bodies, h = found.bodies, found.bodies.link
    kinetic, momentum, energy = bodies.proof_mass * ca.sumsqr(v) / 2, bodies.proof_mass * v, ca.SX(0)
    for angle in 2 * math.pi * np.arange(bodies.limbs) / bodies.limbs:
        x, y, z = ca.vertsplit(turn(angle).T @ q)
        Y = y + math.sqrt(2) * h
        r, phi = ca.sqrt(x**2 + Y**2), ca.atan2(Y, x)
        a1, a2, b = phi + ca.acos(r / (2 * h)), phi - ca.acos(r / (2 * h)), ca.asin(z / Y)
        link1, link2 = (h * ca.vertcat(ca.cos(a), ca.sin(a), ca.sin(a) * ca.sin(b)) for a in (a1, a2))
        still = ca.SX.zeros(1)
        members = [(bodies.bar, link1, ca.vertcat(b, 0, 0), 0.0, np.array([bodies.bar_x, 0, 0]))]
        own = np.array([bodies.leg_x, bodies.leg_y, bodies.leg_z])
        for _ in range(2):
            members.append((bodies.leg, link1 / 2, ca.vertcat(b, still, a1), math.pi / 4, own))
            members.append((bodies.leg, link1 + link2 / 2, ca.vertcat(b, still, a2), -math.pi / 4, own))
        for mass, position, angles, axes, inertia in members:
            velocity, spin = ca.jtimes(position, q, v), turn(axes).T @ ca.jtimes(angles, q, v)
            kinetic += (mass * ca.sumsqr(velocity) + ca.dot(ca.DM(inertia), spin**2)) / 2
            momentum += mass * turn(angle) @ velocity
        energy += found.k_in * ((a1 - 3 * math.pi / 4) ** 2 + (a2 - math.pi / 4) ** 2) + 2 * found.k_out * b**2
    M = ca.hessian(kinetic, v)[0]
    c = ca.jtimes(M @ v, q, v) - ca.gradient(kinetic, q)
    return ca.Function("theirs", [q, v], [M, c, ca.jacobian(momentum, v), ca.gradient(energy, q)])


@DESIGN
@COUNT
def test_at_home_the_twist_shaping_matrices_give_92_and_93(design, count):
    """With other numbers of limbs they are isotropic in the plane as well, and have no velocity terms."""
    found = numbers(design, count)
    for rates in np.random.default_rng(2).uniform(-1, 1, (5, 3)):
        M, c, driven, force = (np.array(x) for x in ours(found)(np.zeros(3), rates))
        x, y, _ = rates
        c1, c2 = coriolis(found.bodies)
        C = [[c1 * x - c2 * y, -c2 * x - c1 * y, 0], [-c2 * x - c1 * y, c2 * y - c1 * x, 0], [0, 0, 0]]
        size = found.driven_mass
        np.testing.assert_allclose(M, np.diag([found.M_in, found.M_in, found.M_out]), rtol=1e-12, atol=1e-14 * size)
        assert (c2 == 0) == (count > 3)
        np.testing.assert_allclose(c.ravel(), C @ rates, rtol=0, atol=1e-13 * max(c2, size / found.bodies.link))
        np.testing.assert_allclose(driven, found.driven_mass * np.eye(3), rtol=1e-12, atol=1e-14 * size)
        assert not force.any()
    stiffness = ca.jacobian(limbs.terms(*elastic(found), q, v).elastic, q)
    K = np.array(ca.Function("K", [q], [stiffness])(0))
    np.testing.assert_allclose(K, np.diag([found.K_in, found.K_in, found.K_out]), rtol=1e-12, atol=1e-12 * found.K_in)


@DESIGN
@COUNT
@pytest.mark.parametrize("share", [0.0125, 1.0], ids=["5 % of the travel", "twenty times the travel"])
def test_away_from_home_they_are_lagranges_equations_of_the_bodies_positions(design, count, share):
    """The travel is a quarter of a foot's thickness."""
    found = numbers(design, count)
    size = share * (DESIGNS[design].shape.tm if share < 1 else 5 * DESIGNS[design].shape.tm)
    mine, theirs = ours(found), of_positions(found)
    for at, rates in states(found, size, 20):
        for name, got, wanted in zip(limbs.Terms._fields, mine(at, rates), theirs(at, rates), strict=True):
            scale = np.abs(np.array(wanted)).max()
            if name == "velocity":  # what cancels between four limbs and more leaves rounding errors of its own size
                scale = max(scale, 1e-2 * found.driven_mass * np.sum(rates**2) / found.bodies.link)
            np.testing.assert_allclose(np.array(got), np.array(wanted), rtol=0, atol=3e-10 * scale, err_msg=name)


def test_a_tiny_displacement_keeps_all_its_digits():
    """A picometre, 1e-9 of a link: the elastic force is K q, of which angles near 3 pi / 4 would leave seven digits."""
    found = numbers("mems")
    at = 1e-12 * np.array([0.3, -0.5, 0.8])
    force = np.array(ours(found)(at, np.zeros(3))[3]).ravel()
    np.testing.assert_allclose(force, np.array([found.K_in, found.K_in, found.K_out]) * at, rtol=2e-9)


def test_the_inertia_is_symmetric_to_the_last_bit():
    found = numbers("mems")
    at, rates = states(found, 50e-6, 1)[0]
    M = np.array(ours(found)(at, rates)[0])
    assert np.array_equal(M, M.T)
    assert np.linalg.eigvalsh(M).min() > 0


def test_the_sources_velocity_terms_differ_by_what_does_no_work_and_vanishes_at_home():
    """By Kane: T' (M T' + W M T) q' of every body; the last member turns axes of inertia that the model leaves."""
    found = numbers("mems")
    bodies, h = found.bodies, found.bodies.link
    own = ca.diag(ca.DM([bodies.leg_x, bodies.leg_y, bodies.leg_z]))
    legs = [2 * turn(angle) @ own @ turn(angle).T for angle in (math.pi / 4, -math.pi / 4)]
    members = [(bodies.bar, ca.diag(ca.DM([bodies.bar_x, 0, 0])), (1, 0, 0, 0))]
    members += [(2 * bodies.leg, legs[0], (1 / 2, 0, 1, 0)), (2 * bodies.leg, legs[1], (1, 1 / 2, 0, 1))]
    kane, gyroscopic = ca.SX.zeros(3), ca.SX.zeros(3)
    for angle in (0, 2 * math.pi / 3, -2 * math.pi / 3):
        z = ca.DM([3 * math.pi / 4, math.pi / 4, 0]) + limbs._bends(h, turn(angle).T @ q)
        for mass, inertia, shares in members:
            T = limbs._shaping(h, z, *shares) @ limbs._rates(h, z) @ turn(angle).T
            spin = (T @ v)[:3]
            kane += T.T @ ca.diagcat(inertia, mass * ca.DM.eye(3)) @ ca.jtimes(T @ v, q, v)
            gyroscopic += T[:3, :].T @ ca.cross(spin, inertia @ spin)
    both = ca.Function("both", [q, v], [kane, gyroscopic, ours(found)(q, v)[1]])
    for at, rates in [(np.zeros(3), np.ones(3)), *states(found, 5e-6, 5)]:
        first, second, mine = (np.array(x).ravel() for x in both(at, rates))
        size = np.abs(first).max()
        np.testing.assert_allclose(mine, first, rtol=0, atol=1e-12 * size)
        assert np.abs(second).max() < (1e-2 if at.any() else 1e-12) * size
        assert abs(second @ rates) < 1e-10 * np.abs(second * rates).max() + 1e-14 * size


def test_the_elastic_force_by_a_stiffness_matrix_is_off_as_stated():
    """At 20 um in the plane: 0.25 % with the source's K(q) = sum T' k T, 0.74 % with the K of home."""
    found = numbers("mems")
    h, matrix = found.bodies.link, ca.SX.zeros(3, 3)
    for angle in (0, 2 * math.pi / 3, -2 * math.pi / 3):
        bends = limbs._bends(h, turn(angle).T @ q)
        slope = ca.jacobian(bends, q)
        matrix += slope.T @ ca.diag(ca.DM([2 * found.k_in, 2 * found.k_in, 4 * found.k_out])) @ slope
    by_matrix = ca.Function("by_matrix", [q], [matrix @ q])
    for direction in np.deg2rad([0, 90, 200]):
        at = 20e-6 * np.array([np.cos(direction), np.sin(direction), 0])
        force = np.array(ours(found)(at, np.zeros(3))[3]).ravel()
        for wrong, percent in ((np.array(by_matrix(at)).ravel(), 0.25), (found.K_in * at, 0.74)):
            assert 100 * np.linalg.norm(wrong - force) / np.linalg.norm(force) == pytest.approx(percent, rel=0.05)


@DESIGN
def test_across_the_axis_the_displacement_is_of_second_order(design):
    """Under a force along x, by Newton on dV/dq; 3.7e2 1/m for mems."""
    found = numbers(design)
    h = found.bodies.link
    slope = ca.gradient(limbs.potential(*elastic(found), q), q)
    both = ca.Function("both", [q], [slope, ca.jacobian(slope, q)])
    at, force = np.zeros(3), np.array([1e-4 * h * found.K_in, 0, 0])
    for _ in range(5):
        residual, K = (np.array(x) for x in both(at))
        at = at - np.linalg.solve(K, residual.ravel() - force)
    assert at[1] / at[0] ** 2 == pytest.approx(limbs.cross_axis(found.bodies), rel=1e-3)
    if design == "mems":
        assert f"{limbs.cross_axis(found.bodies):.1e}" == "3.7e+02"


@pytest.mark.parametrize("count", [4, 5, 6, 7])
def test_across_the_axis_more_than_three_limbs_move_by_less_than_second_order(count):
    """Under a force along x and along 17 degrees, by Newton on dV/dq: y / x^2 tends to 0 with x."""
    found = numbers("mems", count)
    h = found.bodies.link
    slope = ca.gradient(limbs.potential(*elastic(found), q), q)
    both = ca.Function("both", [q], [slope, ca.jacobian(slope, q)])
    for angle in (0.0, 0.3):
        along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        ratios = []
        for size in (1e-2, 1e-3):
            at, force = np.zeros(3), size * h * found.K_in * np.array([*along, 0])
            for _ in range(6):
                residual, K = (np.array(x) for x in both(at))
                at = at - np.linalg.solve(K, residual.ravel() - force)
            ratios.append(abs(across @ at[:2]) / (along @ at[:2]) ** 2)
        assert ratios[1] < max(0.2 * ratios[0], 1e-3 * limbs.cross_axis(numbers("mems").bodies))
    assert limbs.cross_axis(found.bodies) == 0.0


@DESIGN
def test_without_damping_energy_is_kept(design):
    """Twenty periods from a tenth of a link away, by an integrator that knows nothing of energy."""
    found = numbers(design)
    h, omega = found.bodies.link, 2 * math.pi * found.f_in
    terms = limbs.terms(*elastic(found), q, v)
    energy = ca.Function("energy", [q, v], [v.T @ terms.mass @ v / 2 + limbs.potential(*elastic(found), q)])
    motion = ca.Function("motion", [q, v], ca.cse([ca.solve(terms.mass, -terms.velocity - terms.elastic)]))

    def scaled(_, state):
        """Lengths by h, time by 1 / omega."""
        acceleration = np.array(motion(h * state[:3], h * omega * state[3:])).ravel()
        return np.concatenate([state[3:], acceleration / (h * omega**2)])

    run = solve_ivp(
        scaled, (0, 40 * math.pi), [0.1, -0.03, 0.05, 0.02, 0.05, -0.04], method="DOP853", rtol=1e-11, atol=1e-13
    )
    kept = np.array([float(energy(h * s[:3], h * omega * s[3:])) for s in run.y.T])
    assert np.ptp(kept) < 1e-9 * kept[0]
