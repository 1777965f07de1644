"""Level `generalized` of `sdelta`: printed frequencies, an assembly of its own, its limits, and the drives it needs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial.legendre import leggauss
from parts_by_name import part
from random_postures import postures
from robot_response import ACCELERATION, AXES, POSE, REACTION, TUBES, TWIST, WRENCH, A, Response

from hfsa.components import ModelError
from hfsa.components._mechanics.modes import modes
from hfsa.components._mechanics.screws import exponential, numbers
from hfsa.components._mechanics.sdelta_generalized import generalized_modes, mass_matrix, minimum_energy, ritz_mass
from hfsa.components._mechanics.sdelta_geometry import C_AXES, INWARDS, SYMMETRIC, UP
from hfsa.components._mechanics.sdelta_inertia import CUBE
from hfsa.components._mechanics.sdelta_limbs import LimbInertia
from hfsa.components._mechanics.sdelta_robot import Machine, Robot
from hfsa.components._mechanics.sdelta_stiffness import Rods, Shafts
from hfsa.components._modelling.compose import compose
from hfsa.components._modelling.linearize import linearize
from hfsa.components.c_drive import c_drive
from hfsa.components.sdelta_reference import sdelta_reference

analyze, sdelta = part("sdelta").analysis, part("sdelta").model

TWISTS = [f"shaft[{i}]/twist" for i in range(1, 7)]
TIPS = [f"rod[{j}]/deflection[{i}]" for j in AXES for i in (1, 2)]


def robot_at(posture=SYMMETRIC, preset="ch4_full", extra_inertia=1.0, **machine) -> Robot:
    return Robot.at(posture, preset, CUBE, Machine(**machine), extra_inertia)


def kinetic_mass(robot: Robot) -> np.ndarray:
    """Mass matrix by the Hessian of the kinetic energy: points of rods by quadrature, velocities by differences.

    The pose that goes with q is found by Newton on the closure of the limbs, not by the Jacobians of the model.
    """
    geometry, limbs, rods = robot.machine.mechanism.geometry, robot.machine.limbs, robot.machine.rods
    at, J_C = robot.kinematics, robot.machine.mechanism.transmission.matrix
    nodes, weights = leggauss(12)
    along, share = rods.length * (nodes + 1) / 2, weights / 2
    shape = (3 * rods.length * along**2 - along**3) / (2 * rods.length**3)

    def places(q: np.ndarray) -> np.ndarray:
        """Square roots of masses times all that moves, at shafts q[:6] and tips q[6:]."""
        tubes = np.concatenate([J_C @ q[2 * j : 2 * j + 2] for j in range(3)])
        slide, angle = at.limbs.slide + tubes[0::2], at.limbs.angle + tubes[1::2]
        e_l = np.cos(angle)[:, None] * INWARDS + np.sin(angle)[:, None] * UP
        e_n = np.cross(C_AXES, e_l)
        tips = q[6:].reshape(3, 2)
        Q, a = at.Q, at.position
        for _ in range(6):
            joints = a + geometry.joints @ Q.T - geometry.middles - slide[:, None] * C_AXES
            gap = np.column_stack([np.sum(joints * C_AXES, axis=1), np.sum(joints * e_n, axis=1)]) - tips
            p = geometry.joints @ Q.T
            rows = np.empty((6, 6))
            rows[0::2] = np.hstack([np.cross(p, C_AXES), C_AXES])
            rows[1::2] = np.hstack([np.cross(p, e_n), e_n])
            step = -np.linalg.solve(rows, gap.ravel())
            Q, a = numbers(exponential(step[:3])) @ Q, a + step[3:]
        found = [np.sqrt(limbs.screw_inertia) * q[:6]]
        found += [np.sqrt(limbs.tube_mass) * slide, np.sqrt(limbs.tube_inertia) * angle]
        joints = a + geometry.joints @ Q.T - geometry.middles - slide[:, None] * C_AXES
        reach = np.sum(joints * e_l, axis=1)
        for j in range(3):
            root = at.limbs.length[j] - rods.length
            point = (slide[j] * np.ones_like(along))[:, None] * C_AXES[j] + (root + along)[:, None] * e_l[j]
            point = point + shape[:, None] * (tips[j, 0] * C_AXES[j] + tips[j, 1] * e_n[j])
            point = point + (reach[j] - at.limbs.length[j]) * e_l[j]  # the piston slides along the limb
            found.append((np.sqrt(rods.mass * share)[:, None] * point).ravel())
        body = robot.body
        vertices = np.linalg.cholesky(body.tensor.trace() / 2 * np.eye(3) - body.tensor).T  # second moments of the body
        found.append((vertices @ Q.T).ravel())
        found.append(np.sqrt(body.mass) * (a + Q @ body.center))
        return np.concatenate(found)

    step = np.repeat([1e-5, 1e-6], 6)
    columns = [(places(h) - places(-h)) / (2 * s) for h, s in zip(np.diag(step), step, strict=True)]
    J = np.column_stack(columns)
    return J.T @ J


# Frequencies ----------------------------------------------------------------------------------------------------------


def test_printed_frequencies_of_twelve_and_of_six_degrees_of_freedom():
    found = analyze(level="generalized")
    twelve = [22.862611, 22.862611, 23.868764, 90.321458, 90.321458, 155.236806]
    twelve += [677.6015, 677.6015, 677.7656, 692.8443, 693.0759, 693.0759]
    digits = np.repeat([6, 4], 6)
    for value, expected, places in zip(found["natural_frequencies_hz"], twelve, digits, strict=True):
        assert value == pytest.approx(expected, abs=0.6 * 10.0**-places)
    ritz = [22.862611, 22.862611, 23.868765, 90.322036, 90.322036, 155.238951]
    assert found["ritz_frequencies_hz"] == pytest.approx(ritz, abs=0.6e-6)
    assert found["cartesian_frequencies_hz"] == pytest.approx(analyze(stiffness="ch4_full")["natural_frequencies_hz"])


def test_printed_frequencies_without_a_part_of_the_limbs():
    rods_only = LimbInertia(screw_inertia=0.0, tube_mass=0.0, tube_inertia=0.0)
    assert analyze(level="generalized", limbs=rods_only)["natural_frequencies_hz"][0] == pytest.approx(
        22.862706, abs=0.6e-6
    )
    screws_only = LimbInertia(tube_mass=0.0, tube_inertia=0.0)
    light = Rods(density=1e-12)
    found = analyze(level="generalized", limbs=screws_only, rods=light)["natural_frequencies_hz"]
    assert found[0] == pytest.approx(23.504933, abs=0.6e-6)


@pytest.mark.parametrize(
    ("eps", "printed", "places"),
    [
        (1, 4.81e-2, 4),
        (0.3, 1.565e-2, 5),
        (0.1, 5.346e-3, 6),
        (0.03, 1.618e-3, 6),
        (0.01, 5.406e-4, 7),
        (1e-3, 5.41e-5, 7),
        (1e-4, 5.41e-6, 8),
    ],
    ids=str,
)
def test_printed_convergence_to_six_degrees_of_freedom(eps, printed, places):
    found = analyze(level="generalized", extra_inertia=eps)
    six, twelve = found["cartesian_frequencies_hz"], found["natural_frequencies_hz"][:6]
    assert np.abs(twelve / six - 1).max() == pytest.approx(printed, abs=0.6 * 10.0**-places)


def test_printed_convergence_to_rigid_shafts():
    for factor, printed in ((10, 23.581161), (1e2, 23.588813), (1e4, 23.589655)):
        shafts = Shafts(shear_modulus=75e9 * factor, coupling=3400.0 * factor)
        found = analyze(stiffness="ch4_full", shafts=shafts)["natural_frequencies_hz"][0]
        assert found == pytest.approx(printed, abs=0.6e-6)


@pytest.mark.parametrize("posture", [SYMMETRIC, A], ids=["symmetric", "A"])
def test_the_mass_matrix_is_the_hessian_of_the_kinetic_energy(posture):
    robot = robot_at(posture)
    expected, found = kinetic_mass(robot), mass_matrix(robot)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(found / scale, expected / scale, atol=1e-7)


@given(postures(), st.sampled_from(["ch3_full", "ch4_full"]), st.floats(0.01, 3.0))
def test_ritz_frequencies_are_never_below_and_modes_are_normalised(posture, preset, eps):
    robot = robot_at(posture, preset, extra_inertia=eps)
    M_E = mass_matrix(robot)
    omega, shapes = generalized_modes(robot, M_E)
    assert np.all(modes(ritz_mass(robot, M_E), robot.stiffness).omega >= omega[:6] * (1 - 1e-12))
    np.testing.assert_allclose(shapes.T @ M_E @ shapes, np.eye(12), atol=1e-10)
    springs = shapes.T @ (shapes / robot.springs.compliance[:, None])
    np.testing.assert_allclose(springs / np.outer(omega, omega), np.eye(12), atol=1e-10)
    F = minimum_energy(robot)
    np.testing.assert_allclose(F.T @ (F / robot.springs.compliance[:, None]), robot.stiffness, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(robot.of_limbs @ F, np.eye(6), atol=1e-9)


def test_without_inertia_of_the_limbs_the_rank_is_six():
    found = analyze(level="generalized", extra_inertia=0.0)
    assert np.isinf(found["natural_frequencies_hz"][6:]).all()
    np.testing.assert_allclose(
        found["natural_frequencies_hz"][:6], analyze(stiffness="ch4_full")["natural_frequencies_hz"], rtol=1e-10
    )
    assert found["mode_shapes"].shape == (12, 6)


# Response -------------------------------------------------------------------------------------------------------------


def response_by_matrices(robot: Robot, s: complex, ratio: float) -> tuple[np.ndarray, np.ndarray]:
    """From wrench at C and motors (12 columns) to pose of C and torque on the motors, in physical coordinates."""
    M, K = mass_matrix(robot), np.diag(1 / robot.springs.compliance)
    omega, shapes = generalized_modes(robot, M)
    D = M @ shapes @ np.diag(2 * ratio * omega) @ shapes.T @ M
    to_x, springs = robot.of_limbs, s * D + K
    moved = np.vstack([np.eye(6), np.zeros((6, 6))])
    q = np.linalg.solve(M * s**2 + springs, np.hstack([to_x.T, -(s**2) * M @ moved]))  # relative to the motors
    absolute = q + np.hstack([np.zeros((12, 6)), moved])
    return to_x @ absolute, (springs @ q)[:6]


@pytest.mark.parametrize("hertz", [2.0, 7.0, 23.0, 90.0, 680.0, 5e3])
def test_the_model_is_the_matrix_formula(hertz):
    robot, s = robot_at(A, "ch3_full"), 2j * np.pi * hertz
    found = Response(sdelta(level="generalized", posture=A, stiffness="ch3_full", reference_point="C"))
    to_motors = np.linalg.inv(robot.machine.mechanism.drives_matrix)
    pose, torque = response_by_matrices(robot, s, 0.01)
    expected = np.vstack([pose, to_motors.T @ torque])
    expected = np.hstack([expected[:, :6], expected[:, 6:] @ to_motors])
    outputs = POSE + REACTION
    moved = found(s, outputs, TUBES[0]) + s * found(s, outputs, TUBES[1])
    both = np.hstack([found(s, outputs, WRENCH), moved])
    scale = np.abs(expected).max(axis=1, keepdims=True)
    np.testing.assert_allclose(both / scale, expected / scale, atol=1e-9)


def test_deflections_close_the_limbs():
    """N x = D_J (q + [theta; 0]): the pose follows from tubes and deflections."""
    robot, s = robot_at(A), 2j * np.pi * 200.0
    found = Response(sdelta(level="generalized", posture=A, reference_point="C"), damping_ratio=0.0)
    q = found(s, TWISTS + TIPS, WRENCH)
    np.testing.assert_allclose(robot.of_limbs @ q, found(s, POSE, WRENCH), rtol=1e-9)


def test_rates_and_accelerations_are_derivatives():
    found, s = Response(sdelta(level="generalized", posture=A)), 2j * np.pi * 60.0
    pose = found(s, POSE, WRENCH)
    np.testing.assert_allclose(found(s, TWIST, WRENCH), s * pose, rtol=1e-9)
    np.testing.assert_allclose(found(s, ACCELERATION, WRENCH), s**2 * pose, rtol=1e-9)


def test_it_tends_to_cartesian_with_shafts_as_the_inertia_vanishes():
    """The error at 20 Hz is proportional to the inertia, and 0 inertia is that level, deflections included."""
    s, signals = 2j * np.pi * 20.0, (POSE + REACTION + TWISTS + TIPS, WRENCH)
    exact = Response(sdelta(posture=A, stiffness="ch4_full"))(s, *signals)
    scale, errors = np.abs(exact).max(axis=1, keepdims=True), []
    for eps in (1e-2, 1e-3, 1e-4):
        found = Response(sdelta(level="generalized", posture=A, extra_inertia=eps))(s, *signals)
        errors.append(np.abs((found - exact) / scale).max())
    assert np.divide(errors[:-1], errors[1:]) == pytest.approx([10, 10], rel=0.05)
    none = Response(sdelta(level="generalized", posture=A, extra_inertia=0.0))
    np.testing.assert_array_equal(none(s, *signals), exact)


def test_rayleigh_damping_gives_the_ratio_to_the_first_and_the_fourth_mode():
    """At every level, with the printed ratios of the others at `cartesian`."""
    for level, others in (("cartesian", {2: 0.0097674, 5: 0.0146535}), ("generalized", {})):
        poles = np.linalg.eigvals(linearize(sdelta(level=level, damping_model="rayleigh")).A)
        poles = np.array(sorted(poles[poles.imag > 0], key=abs))
        ratios = -poles.real / np.abs(poles)
        assert ratios[[0, 3]] == pytest.approx([0.01, 0.01], rel=1e-7)
        for mode, printed in others.items():
            assert ratios[mode] == pytest.approx(printed, abs=0.6e-7)


def test_a_mode_without_inertia_is_refused():
    with pytest.raises(ModelError, match="have no inertia beyond rounding at extra_inertia 1e-300"):
        sdelta(level="generalized", extra_inertia=1e-300)
    with pytest.raises(ModelError, match="extra_inertia is -1, expected a finite number, 0 or more"):
        sdelta(level="generalized", extra_inertia=-1.0)


# With drives ----------------------------------------------------------------------------------------------------------


def free_motor_frequencies(drive: str, **arguments) -> np.ndarray:
    """Natural frequencies above 1 Hz of the undamped robot with three drives whose motors are free, ascending [Hz]."""
    members = {"robot": sdelta(**arguments), **{f"drive[{j}]": c_drive(level=drive) for j in AXES}}
    motions = [f"{word}{order}" for word in ("slide", "angle") for order in ("", "_rate")]
    joined = [(f"drive[{j}].tube.{name}", f"robot.drive[{j}].{name}") for j in AXES for name in motions]
    joined += [(f"robot.drive[{j}].{load}", f"drive[{j}].tube.{load}") for j in AXES for load in ("force", "torque")]
    undamped = {"robot.damping_ratio": 0.0}
    if drive == "compliant_shaft":
        undamped |= {f"drive[{j}].shaft.damping_ratio": 0.0 for j in AXES}
    poles = np.linalg.eigvals(linearize(compose("Whole", members, joined), undamped).A)
    found = np.sort(np.abs(poles[poles.imag > 0])) / (2 * np.pi)
    return found[found > 1]


def of_matrices(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Natural frequencies above 1 Hz of M and K, ascending [Hz]."""
    inverse = np.linalg.inv(np.linalg.cholesky(M))
    squares = np.linalg.eigvalsh(inverse @ K @ inverse.T)
    return np.sqrt(squares[squares > (2 * np.pi) ** 2]) / (2 * np.pi)


def test_rotors_and_generalized_are_eighteen_degrees_of_freedom():
    robot = robot_at()
    k = 1 / robot.springs.compliance
    M, K = np.zeros((2, 18, 18))
    M[:6, :6], M[6:, 6:] = robot.machine.limbs.rotor_inertia * np.eye(6), mass_matrix(robot)
    K[6:, 6:], K[:6, :6] = np.diag(k), np.diag(k[:6])
    K[:6, 6:12] = K[6:12, :6] = -np.diag(k[:6])
    expected = of_matrices(M, K)
    assert len(expected) == 12
    np.testing.assert_allclose(free_motor_frequencies("rotor", level="generalized"), expected, rtol=1e-7)


def test_compliant_shafts_and_rods_are_the_same_as_rotors_and_generalized_without_rods():
    """Screws and tubes in the drives on shafts of their own, or in the robot: massless rods are at `cartesian`."""
    from_drives = free_motor_frequencies("compliant_shaft", stiffness="ch4")
    robot = robot_at(rods=Rods(density=1e-9))
    from_robot = free_motor_frequencies("rotor", level="generalized", rods=robot.machine.rods)
    np.testing.assert_allclose(from_drives, from_robot, rtol=1e-6)


@pytest.mark.parametrize(
    ("drive", "stiffness", "printed"),
    [
        ("rigid_shaft", "ch4", [47.70929, 47.70929, 95.00686, 129.88789, 129.88789, 164.05113]),
        ("rigid_shaft", "ch4_full", [47.60643, 47.60643, 93.78678, 128.30099, 128.30099, 163.80098]),
        ("rigid_shaft", "ch3_full", [43.79158, 43.79158, 86.41306, 118.20215, 118.20215, 150.66041]),
        ("rotor", "ch4", [69.18269, 69.18269, 163.66083, 170.30484, 184.96034, 184.96034]),
        ("rotor", "ch4_full", [69.06690, 69.06690, 161.55910, 170.04515, 182.61230, 182.61230]),
        ("rotor", "ch3_full", [63.52763, 63.52763, 148.85697, 156.40366, 168.25105, 168.25105]),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_free_motor_resonances_are_those_printed(drive, stiffness, printed):
    assert free_motor_frequencies(drive, stiffness=stiffness) == pytest.approx(printed, abs=0.6e-5)


@pytest.mark.parametrize(
    ("side", "hertz", "printed"),
    [
        *((3, 10, 0.182), (3, 20, 1.728), (3, 30, 1.835), (3, 50, 3.008)),
        *((5, 10, 0.234), (5, 20, 2.246), (5, 30, 3.240), (5, 50, 1.136)),
        *((0, 10, 0.010), (0, 20, 0.093), (0, 30, 0.075), (0, 50, 0.062)),
    ],
    ids=str,
)
def test_printed_torques_of_a_forced_motion(side, hertz, printed):
    """Largest of the motors for 1 mm or 1 mrad at S, ideal drives on the springs of chapter 4 (section 11)."""
    members = {"reference": sdelta_reference(), "robot": sdelta()}
    members |= {f"drive[{j}]": c_drive(level="ideal") for j in AXES}
    motions = [f"{word}{order}" for word in ("slide", "angle") for order in ("", "_rate", "_acceleration")]
    joined = [(f"reference.drive[{j}].{name}", f"drive[{j}].command.{name}") for j in AXES for name in motions]
    joined += [(f"drive[{j}].tube.{name}", f"robot.drive[{j}].{name}") for j in AXES for name in motions]
    joined += [(f"robot.drive[{j}].{load}", f"drive[{j}].tube.{load}") for j in AXES for load in ("force", "torque")]
    system, s = linearize(compose("Whole", members, joined)), 2j * np.pi * hertz
    kind, i = ("rotation", "position")[side // 3], side % 3 + 1
    columns = [
        system.input_labels.index(f"reference/command/{kind}{order}[{i}]") for order in ("", "_rate", "_acceleration")
    ]
    rows = [system.output_labels.index(f"drive[{j}]/motor[{k}]/required_torque") for j in AXES for k in (1, 2)]
    torque = np.atleast_2d(system(s))[np.ix_(rows, columns)] @ [1, s, s**2]
    assert 1e-3 * np.abs(torque).max() == pytest.approx(printed, abs=0.6e-3)
