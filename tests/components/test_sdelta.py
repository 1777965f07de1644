"""The part `sdelta`: its response, reactions, gravity, levels and extremes."""

import casadi as ca
import numpy as np
import pytest
from robot_response import ACCELERATION, AXES, POSE, REACTION, TUBE_ACCELERATIONS, TUBES, TWIST, WRENCH, A, Response

from hfsa.components import Model, ModelError
from hfsa.components._mechanics.screws import shift
from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC, Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE, Payload, with_payload
from hfsa.components._mechanics.sdelta_kinematics import THESIS, Kinematics
from hfsa.components._mechanics.sdelta_robot import Machine
from hfsa.components._mechanics.sdelta_stiffness import Rods
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind
from hfsa.components.sdelta import analyze, sdelta

NEARLY_SINGULAR = Posture(position=(0, -0.0749, 0.150))
LEVELS = ("rigid", "cartesian")
"""Levels joined to tubes that have inertia of their own, or none."""


def damping(numbers: dict, ratio: float = 0.01) -> np.ndarray:
    """Damping matrix of equal ratios, as 2 zeta M^1/2 Omega M^1/2 instead of by the modes."""
    values, V = np.linalg.eigh(numbers["mass_C"])
    root = V * np.sqrt(values) @ V.T
    return 2 * ratio * root @ numbers["frequency_matrix_C"] @ root


# Response -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("point", ["S", "C"])
@pytest.mark.parametrize("preset", ["ch4", "ch3_full"])
def test_response_is_the_closed_form(preset, point):
    """Of pose and reaction, to the dictated pose and to the wrench, within 1e-9 of each entry's maximum."""
    numbers = analyze(posture=A, stiffness=preset)
    M, K = numbers["mass_C"], numbers["stiffness_C"]
    D = damping(numbers)
    kinematics = Kinematics.at(A)
    offset = A.matrix @ with_payload(CUBE).center
    X = shift(offset) if point == "S" else np.eye(6)
    back = np.linalg.inv(X)
    to_pose = kinematics.tubes_to_pose(offset if point == "C" else np.zeros(3))
    to_reaction = kinematics.tubes_to_pose(offset).T
    response = Response(sdelta(posture=A, stiffness=preset, reference_point=point))
    found, expected = [], []
    for s in 2j * np.pi * np.geomspace(0.1, 1e3, 60):
        G = np.linalg.inv(M * s**2 + D * s + K)
        spring = D * s + K
        found.append(
            [
                response.from_pose(s, POSE, to_pose),
                response.from_pose(s, TWIST, to_pose),
                response.from_pose(s, ACCELERATION, to_pose),
                response(s, POSE, WRENCH),
                response.from_pose(s, REACTION, to_pose),
                response(s, REACTION, WRENCH),
            ]
        )
        pose, wrench = X @ G @ spring @ back, X @ G @ X.T
        reaction = to_reaction @ spring @ (G @ spring - np.eye(6)) @ back
        expected.append([pose, s * pose, s**2 * pose, wrench, reaction, to_reaction @ spring @ G @ X.T])
    found, expected = np.array(found), np.array(expected)
    assert (np.abs(found - expected).max(axis=0) <= 1e-9 * np.abs(expected).max(axis=0)).all()


def test_bode_plot_is_what_the_docstring_says():
    f = np.linspace(0.5, 200, 8000)
    to_pose = Kinematics.at(SYMMETRIC).tubes_to_pose()
    response = Response(sdelta())
    H = np.array([np.abs(response.from_pose(2j * np.pi * x, POSE, to_pose)) for x in f])
    dB = 20 * np.log10(np.diagonal(H, axis1=1, axis2=2))
    assert np.abs(dB[0]).max() < 0.01
    peaks = [f[1:-1][(y[1:-1] > y[:-2]) & (y[1:-1] > y[2:])] for y in dB.T]
    dips = [f[1:-1][(y[1:-1] < y[:-2]) & (y[1:-1] < y[2:])] for y in dB.T]
    for i, dip in ((0, 33.1), (1, 33.1), (3, 31.8), (4, 31.8)):
        np.testing.assert_allclose(peaks[i], [23.6, 95.9], atol=0.05)
        np.testing.assert_allclose(dips[i], [dip], atol=0.05)
    np.testing.assert_allclose(peaks[2], [161.1], atol=0.05)
    np.testing.assert_allclose(peaks[5], [24.5], atol=0.06)
    assert dB[:, 5].max() == pytest.approx(34, abs=0.05)
    assert len(dips[2]) == len(dips[5]) == 0


@pytest.mark.parametrize("ratio", [0.0, 0.001, 0.01, 0.3, 1.0, 5.0])
@pytest.mark.parametrize("posture", [A, NEARLY_SINGULAR])
def test_every_mode_has_the_damping_ratio(posture, ratio):
    poles = np.linalg.eigvals(linearize(sdelta(posture=posture), {"damping_ratio": ratio}).A)
    omega = 2 * np.pi * analyze(posture=posture)["natural_frequencies_hz"]
    expected = np.concatenate([omega * (-ratio + sign * np.sqrt(complex(ratio**2 - 1))) for sign in (1, -1)])
    for pole in expected:
        # Poles of critical damping are double: they carry the square root of the rounding error.
        tolerance = 1e-4 if ratio == 1 else 1e-7
        assert np.abs(poles - pole).min() < tolerance * abs(pole)


# Forces ---------------------------------------------------------------------------------------------------------------


def values_of(model: Model, kind: Kind, values) -> dict[str, float]:
    """Values by signal name, spelt as in a linearisation."""
    return dict(zip([q.name.replace(".", "/") for q in model.of(kind)], np.array(values).ravel(), strict=True))


@pytest.mark.parametrize("point", ["S", "C"])
def test_power_balance(point):
    """Wrench and tubes do the work that goes into motion, springs and damper, at random states and inputs.

    `force` and `torque` act on the tubes, so that the platform receives -(force slide_rate + torque angle_rate).
    """
    model = sdelta(posture=A, reference_point=point)
    f, random = functions(model), np.random.default_rng(1)
    starts = values_of(model, Kind.INPUT, [q.start for q in model.of(Kind.INPUT)])
    inputs = {name: start + random.normal() * (1 if "wrench" in name else 1e-4) for name, start in starts.items()}
    x, v = 1e-4 * random.normal(size=(2, 6))
    point_of_work = (0, np.concatenate([x, v]), [], [*inputs.values()], [0.01, 0.0])
    a = np.array(f.rhs(*point_of_work)).ravel()[6:]
    outputs = values_of(model, Kind.OUTPUT, f.out(*point_of_work))

    numbers = analyze(posture=A)
    follow = Kinematics.at(A).tubes_to_pose(A.matrix @ with_payload(CUBE).center)
    stretch = x - follow @ [inputs[name] - starts[name] for name in TUBES[0]]
    slip = v - follow @ [inputs[name] for name in TUBES[1]]
    stored = v @ numbers["mass_C"] @ a + stretch @ numbers["stiffness_C"] @ slip
    lost = slip @ damping(numbers) @ slip
    work = [(inputs[w], outputs[t], 1) for w, t in zip(WRENCH, TWIST, strict=True)]
    work += [(inputs[r], outputs[q], -1) for r, q in zip(TUBES[1], REACTION, strict=True)]
    assert stored + lost == pytest.approx(sum(np.prod(factors) for factors in work), rel=1e-10)
    assert lost > 0


def test_the_reactions_of_both_levels_carry_the_weight():
    """J_L^T of them is what the motors hold, T^T of the weight."""
    model, rigid, body = sdelta(), sdelta(level="rigid"), with_payload(CUBE)
    f, u, p = functions(model), [q.start for q in model.of(Kind.INPUT)], [0.01, 9.81]
    standing = np.zeros(12)
    rest = -np.linalg.solve(np.array(f.jacobian(0, standing, [], u, p)), np.array(f.rhs(0, standing, [], u, p))).ravel()
    held = body.mass * 9.81 * Kinematics.at(SYMMETRIC).jacobian(body.center)[5]
    for outputs in (f.out(0, rest, [], u, p), functions(rigid).out(0, [], [], u, p)):
        found = values_of(model, Kind.OUTPUT, outputs)
        np.testing.assert_allclose(-THESIS.drives_matrix.T @ [found[name] for name in REACTION], held, rtol=1e-9)


def test_without_gravity_the_posture_is_an_equilibrium():
    model = sdelta(posture=A)
    f, u = functions(model), [q.start for q in model.of(Kind.INPUT)]
    assert np.abs(np.array(f.rhs(0, np.zeros(12), [], u, [0.01, 0.0]))).max() < 1e-9


# Levels ---------------------------------------------------------------------------------------------------------------


def test_cartesian_tends_to_rigid_as_the_stiffness_grows():
    """The error falls as 1 / stiffness, at 10 Hz and a posture without symmetry."""
    s = 2j * np.pi * 10
    rigid = Response(sdelta(level="rigid", posture=A))
    to_pose = Kinematics.at(A).tubes_to_pose()
    exact = rigid.from_pose(s, POSE, to_pose)
    np.testing.assert_allclose(exact, np.eye(6), atol=1e-12)
    errors = []
    for factor in (1e2, 1e3, 1e4):
        cartesian = Response(sdelta(posture=A, machine=Machine(rods=Rods(tip_stiffness=factor * Rods().as_beam))))
        errors.append(np.abs(cartesian.from_pose(s, POSE, to_pose) - exact).max())
    assert errors[0] / errors[1] == pytest.approx(10, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(10, rel=0.005)


def test_the_rigid_level_follows_the_tubes():
    response, T = Response(sdelta(level="rigid", posture=A)), Kinematics.at(A).tubes_to_pose()
    for outputs, inputs in ((POSE, TUBES[0]), (TWIST, TUBES[1]), (ACCELERATION, TUBE_ACCELERATIONS)):
        np.testing.assert_allclose(response(0, outputs, inputs), T, rtol=1e-12, atol=1e-12)
    assert not response(0, POSE, WRENCH).any()


@pytest.mark.parametrize("point", ["S", "C"])
def test_static_reactions_are_the_same_at_both_levels(point):
    rigid, cartesian = (Response(sdelta(level=level, posture=A, reference_point=point)) for level in LEVELS)
    expected = rigid(0, REACTION, WRENCH)
    np.testing.assert_allclose(cartesian(0, REACTION, WRENCH), expected, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("level", [*LEVELS, "generalized"])
def test_levels_have_the_same_ports_and_are_linear(level):
    model, other = sdelta(level=level, posture=A), sdelta(posture=A)
    assert functions(model).is_linear
    for kind in (Kind.INPUT, Kind.OUTPUT, Kind.PARAMETER):
        ports, others = ([(q.name, q.unit, q.start, q.nominal) for q in m.of(kind)] for m in (model, other))
        assert ports == others


@pytest.mark.parametrize("level", [*LEVELS, "generalized"])
def test_where_the_tubes_stand_is_a_constant(level):
    model, numbers = sdelta(level=level, posture=A), analyze(level=level, posture=A)
    limbs = Kinematics.at(A).limbs
    for kind, key, expected in (("slide", "tube_slides", limbs.slide), ("angle", "tube_angles", limbs.angle)):
        shown = [model[f"drive[{j}].{kind}_at_posture"] for j in AXES]
        assert {q.kind for q in shown} == {Kind.CONSTANT}
        assert {q.unit for q in shown} == {model[f"drive[1].{kind}"].unit}
        np.testing.assert_array_equal([q.start for q in shown], expected)
        np.testing.assert_array_equal(numbers[key], expected)


def test_cartesian_does_not_depend_on_accelerations():
    model = sdelta(posture=A)
    accelerations = ca.vertcat(*[model[name.replace("/", ".")].expression for name in TUBE_ACCELERATIONS])
    everything = ca.vertcat(*model.der.values(), *[q.expression for q in model.of(Kind.OUTPUT)])
    assert not ca.depends_on(everything, accelerations)


def test_nominals_fit_micrometre_motion():
    """A static wrench of 1 N and 0.01 N.m moves the states by their nominals, to within two orders of magnitude."""
    model = sdelta()
    compliance = np.linalg.inv(analyze()["stiffness_C"])
    displacement = np.abs(compliance) @ [0.01, 0.01, 0.01, 1, 1, 1]
    nominal = [q.nominal for q in model.of(Kind.STATE)][:6]
    ratio = displacement / nominal
    assert (ratio < 100).all()
    assert (ratio > 0.01).all()


# Analysis and bad input -----------------------------------------------------------------------------------------------


def test_analysis_has_the_agreed_keys():
    kinematic = """motor_angles tube_slides tube_angles limb_lengths limb_rows_S drive_paths jacobian condition_number
        determinant assembly regularity attitude inertia_parameters_S"""
    anywhere = """eigenstiffness eigenpitch eigenscrew_directions translational_stiffness torsional_stiffness kappa
        kappa_t kappa_r wrench_compliant_directions wrench_compliant_pitches twist_compliant_directions
        twist_compliant_pitches rod_stiffness shaft_stiffness shaft_along shaft_across joint_stiffness minimum_energy_S
        frequency_matrix_C squared_frequency_matrix_cholesky_C natural_frequencies_hz modal_screws_C modal_kinds
        modal_directions modal_pitches relative_damping"""
    at_points = """stiffness compliance mass dynamic_matrix modal_matrix modal_points eigenscrew_points tracking_band_hz
        wrench_compliant_points twist_compliant_points"""
    elastic = {*anywhere.split(), *(f"{key}_{point}" for key in at_points.split() for point in "SC")}
    assert set(analyze()) == set(kinematic.split()) | elastic
    assert set(analyze(level="rigid")) == set(kinematic.split())
    for value in analyze(posture=A, stiffness="ch4_full").values():
        assert np.isfinite(value).all() if np.asarray(value).dtype.kind == "f" else value


def test_modal_screws_are_unit_rotations_or_translations():
    screws = analyze()["modal_screws_C"]
    np.testing.assert_allclose(np.linalg.norm(screws[:3], axis=0)[[0, 1, 3, 4, 5]], 1)
    np.testing.assert_allclose(screws[:, 2], [0, 0, 0, 0, 0, 1], atol=1e-9)


def test_motor_angles_of_the_posture():
    """They move the symmetric posture to this one: to first order near it, by the Jacobian."""
    assert np.abs(analyze()["motor_angles"]).max() < 1e-12
    near = analyze(posture=Posture(position=(0, 0, 0.1501)))
    np.testing.assert_allclose(near["jacobian"] @ near["motor_angles"], [0, 0, 0, 0, 0, 1e-4], atol=1e-7)


def test_near_a_singularity_the_robot_is_soft():
    soft, stiff = (analyze(posture=p)["natural_frequencies_hz"][0] for p in (NEARLY_SINGULAR, SYMMETRIC))
    assert 0 < soft < 0.02 * stiff


def test_payload_lowers_the_frequencies():
    loaded, bare = (analyze(payload=p)["natural_frequencies_hz"] for p in (CUBE, Payload(0, inertia=(0, 0, 0))))
    assert (loaded < bare).all()
    # The vertical mode knows the mass alone; it is the third with the cube, and among the lower three without.
    assert np.abs(bare / loaded[2] - np.sqrt(4.4857 / 1.4857)).min() < 1e-9


@pytest.mark.parametrize("function", [sdelta, analyze])
def test_bad_arguments_name_the_nearest(function):
    with pytest.raises(ModelError, match=r"level is 'cartesan'; did you mean cartesian"):
        function(level="cartesan")
    with pytest.raises(ModelError, match=r"stiffness is 'ch4full'; did you mean ch4_full"):
        function(stiffness="ch4full")
    with pytest.raises(ModelError, match=r"reference_point is 'B'"):
        function(reference_point="B")
    with pytest.raises(ModelError, match="condition number"):
        function(posture=Posture(rotation=(90, 0, 0)))


def test_negative_damping_is_refused():
    with pytest.raises(ModelError, match=r"damping_ratio is -0\.01"):
        sdelta().set_start("damping_ratio", -0.01)
