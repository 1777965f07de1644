"""Level `nonlinear` of `sdelta`, against the energy of its springs by hand, the printed tables, and its laws."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from parts_by_name import part
from random_postures import numbers_in, postures
from robot_response import A
from scipy.integrate import solve_ivp
from sdelta_by_hand import ByHand, Machine, Shaken, cross_matrix, rotation, tube_inputs, vector

from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC, Geometry, Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE, Payload, with_payload
from hfsa.components._mechanics.sdelta_stiffness import Rods, Shafts
from hfsa.components._modelling.linearize import linearize

analyze, sdelta = part("sdelta").analysis, part("sdelta").model

FINITE_ELEMENTS = 100 / 6.6506e-4
BEAM = ByHand()
PRESETS = {
    "ch4": BEAM,
    "ch4_full": replace(BEAM, k_s=(1 / (75e9 * np.pi * 0.016**4 / 32 / 0.040) + 1 / 3400) ** -1),
    "ch3_rods": replace(BEAM, k_r=FINITE_ELEMENTS),
    "ch3_full": replace(BEAM, k_r=FINITE_ELEMENTS, k_s=(1 / (75e9 * np.pi * 0.016**4 / 32 / 0.040) + 1 / 3400) ** -1),
}
OTHER = {"geometry": Geometry(0.5, 0.12), "rods": Rods(tip_stiffness=9e4), "shafts": Shafts(coupling=900.0)}
OTHER_BY_HAND = ByHand(
    0.5, 0.12, 9e4, (1 / (75e9 * np.pi * 0.016**4 / 32 / 0.040) + 1 / 900) ** -1, pitch=0.04, gear=9.0
)
VARIANTS = [
    *((preset, {"stiffness": preset}, hand) for preset, hand in PRESETS.items()),
    ("other", {**OTHER, "pitch": 0.04, "gear": 9.0, "stiffness": "ch4_full"}, OTHER_BY_HAND),
]
VARIANT = pytest.mark.parametrize(("arguments", "hand"), [v[1:] for v in VARIANTS], ids=[v[0] for v in VARIANTS])

STATES = 12
small = st.tuples(numbers_in(-0.3, 0.3, 3), numbers_in(-0.01, 0.01, 3), numbers_in(-0.01, 0.01, 3))


def state(turn=(0, 0, 0), move=(0, 0, 0), angular_velocity=(0, 0, 0), velocity=(0, 0, 0)) -> np.ndarray:
    """State of the robot for a rotation vector and a displacement of C from the posture, and the twist of C."""
    angle = np.linalg.norm(turn)
    s = np.asarray(turn) * (4 * np.tan(angle / 4) / angle if angle else 1)
    return np.concatenate([s, move, angular_velocity, velocity])


def arm_of(posture: Posture, payload: Payload = CUBE) -> np.ndarray:
    """C - S in the platform's axes."""
    return with_payload(payload).center


def by_hand(hand, posture, turn, move, slides, angles):
    """Pose of S and place of the tubes, for deviations from a posture."""
    Q, arm = rotation(turn) @ posture.matrix, arm_of(posture)
    a = np.array(posture.position) + posture.matrix @ arm + move - Q @ arm
    u, phi = hand.tubes(posture.matrix, np.array(posture.position))
    return Q, a, u + slides, phi + angles


# Forces and motion ----------------------------------------------------------------------------------------------------


@VARIANT
def test_forces_are_the_derivatives_of_the_energy(arguments, hand):
    """On the platform, as accelerations, and on the tubes, in finite motion, with gyroscopic torque, wrench, weight."""

    @given(postures(), small, numbers_in(-3, 3, 6), numbers_in(-20, 20, 6), st.sampled_from("SC"))
    @settings(max_examples=4)
    def check(posture, moved, twist, wrench, point):
        turn, move, tubes = moved
        slides, angles = tubes, tubes[::-1] * 10
        machine = Machine(
            sdelta(level="nonlinear", posture=posture, reference_point=point, **arguments),
            damping_ratio=0.0,
            gravity=9.81,
        )
        values = {f"wrench.torque[{i + 1}]": wrench[i] for i in range(3)}
        values |= {f"wrench.force[{i + 1}]": wrench[3 + i] for i in range(3)}
        out = machine.out(state(turn, move, twist[:3], twist[3:]), tube_inputs(slides, angles) | values)
        Q, a, u, phi = by_hand(hand, posture, turn, move, slides, angles)
        body = with_payload(CUBE)
        arm = Q @ body.center
        slope = hand.gradient(Q, a, u, phi, body.center)

        on_tubes = np.array(
            [*[out[f"drive[{j}].force"] for j in (1, 2, 3)], *[out[f"drive[{j}].torque"] for j in (1, 2, 3)]]
        )
        rounding = 1e-16 * 2e5  # of the energy by hand, whose lengths are near 0.1 m: m times N/m
        np.testing.assert_allclose(
            on_tubes, -slope[6:], rtol=1e-10, atol=10 * rounding + 1e-12 * np.abs(slope[6:]).max()
        )

        omega, inertia = twist[:3], Q @ body.tensor @ Q.T
        lever = -arm if point == "S" else np.zeros(3)
        n = -slope[:3] + wrench[:3] + np.cross(lever, wrench[3:]) - np.cross(omega, inertia @ omega)
        f = -slope[3:6] + wrench[3:] - [0, 0, 9.81 * body.mass]
        alpha, of_C = np.linalg.solve(inertia, n), f / body.mass
        seen = of_C + np.cross(alpha, lever) + np.cross(omega, np.cross(omega, lever))
        for name, expected in (("angular_acceleration", alpha), ("acceleration", seen)):
            found = vector(out, f"platform.{name}")
            np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e3 * rounding + 1e-11 * np.abs(expected).max())
        slack = 1e2 * rounding + 1e-11 * np.abs(slope[:6]).max()
        np.testing.assert_allclose(vector(out, "limbs.force"), -slope[3:6], atol=slack)
        moment = -slope[:3] + np.cross(-lever, -slope[3:6])
        np.testing.assert_allclose(vector(out, "limbs.torque"), moment, atol=slack)
        np.testing.assert_allclose(vector(out, "platform.velocity"), twist[3:] + np.cross(omega, lever), atol=1e-12)
        np.testing.assert_allclose(vector(out, "platform.rotation"), turn, atol=1e-14)
        place = a - posture.position if point == "S" else move
        np.testing.assert_allclose(vector(out, "platform.position"), place, atol=1e-14)

    check()


@VARIANT
def test_stiffness_is_the_hessian_of_the_energy(arguments, hand):
    """Differences of exact derivatives of the energy by hand, and K of the analysis."""

    @given(postures())
    @settings(max_examples=4)
    def check(posture):
        K = analyze(level="nonlinear", posture=posture, **arguments)["stiffness_C"]
        arm, h, columns = arm_of(posture), 1e-6, []
        for k in range(6):
            step = h * np.eye(6)[k]
            forces = []
            for sign in (1, -1):
                Q, a, u, phi = by_hand(hand, posture, sign * step[:3], sign * step[3:], 0, 0)
                forces.append(hand.gradient(Q, a, u, phi, arm)[:6])
            columns.append((forces[0] - forces[1]) / (2 * h))
        scale = np.sqrt(np.outer(np.diag(K), np.diag(K)))
        np.testing.assert_allclose(np.array(columns).T / scale, K / scale, atol=1e-6)

    check()


@pytest.mark.parametrize("kind", ["modal", "rayleigh"])
@pytest.mark.parametrize("point", ["S", "C"])
def test_small_motions_are_those_of_cartesian(point, kind):
    """All matrices of the linearisation, at random postures and presets."""

    @given(postures(), st.sampled_from(list(PRESETS)))
    @settings(max_examples=3)
    def check(posture, preset):
        common = {"posture": posture, "stiffness": preset, "reference_point": point, "damping_model": kind}
        one, other = (linearize(sdelta(level=level, **common), {}) for level in ("nonlinear", "cartesian"))
        rows = [one.output_labels.index(label) for label in other.output_labels]
        assert len(rows) == len(one.output_labels) - 1
        for name in "ABCD":
            found, expected = getattr(one, name), getattr(other, name)
            found = found[rows] if name in "CD" else found
            scale = np.abs(expected).max(axis=1, keepdims=True)
            assert (np.abs(found - expected) <= 1e-11 * scale + 1e-18).all(), name

    check()


@given(postures(), small, numbers_in(-1, 1, 6), numbers_in(-1, 1, 6))
@settings(max_examples=5)
def test_power_balance(posture, moved, twist, rates):
    """Tubes and weight do the work that goes into motion, springs and damper; the damper takes, and never gives."""
    turn, move, tubes = moved
    slides, angles, ratio = tubes, tubes[::-1] * 10, 0.05
    machine = Machine(
        sdelta(level="nonlinear", posture=posture, stiffness="ch4_full", reference_point="C"), damping_ratio=ratio
    )
    out = machine.out(state(turn, move, twist[:3], twist[3:]), tube_inputs(slides, angles, rates[:3], rates[3:]))
    hand, body = PRESETS["ch4_full"], with_payload(CUBE)
    Q, a, u, phi = by_hand(hand, posture, turn, move, slides, angles)
    slope = hand.gradient(Q, a, u, phi, body.center)
    inertia, omega = Q @ body.tensor @ Q.T, twist[:3]
    alpha, acceleration = (vector(out, f"platform.{name}") for name in ("angular_acceleration", "acceleration"))
    kinetic = omega @ inertia @ alpha + body.mass * twist[3:] @ acceleration
    stored = slope @ np.concatenate([twist, rates])
    from_tubes = sum(
        out[f"drive[{j + 1}].force"] * rates[j] + out[f"drive[{j + 1}].torque"] * rates[3 + j] for j in range(3)
    )
    lost = -from_tubes - kinetic - stored
    assert lost >= -1e-9
    numbers = analyze(posture=posture, stiffness="ch4_full")
    M = numbers["mass_C"]
    values, V = np.linalg.eigh(M)
    root = V * np.sqrt(values) @ V.T
    D = 2 * ratio * root @ numbers["frequency_matrix_C"] @ root
    # T of the posture, from the rates of the tubes by those of the platform
    one = np.array(
        [np.concatenate(hand.moving(posture.matrix, np.array(posture.position), row)) for row in np.eye(6)]
    ).T
    to_S = np.eye(6)
    to_S[3:, :3] = cross_matrix(posture.matrix @ body.center)
    slip = twist - np.linalg.solve(one @ to_S, rates)
    assert lost == pytest.approx(slip @ D @ slip, rel=1e-7, abs=float(1e-9 + 1e-11 * abs(stored)))


@pytest.mark.parametrize("size", [1e-9, 1e-12, 1e-15], ids=["1 nm", "1 pm", "1 fm"])
def test_motion_of_picometres_keeps_its_digits(size):
    """Everything per size is the linear answer; a difference of numbers near 0.1 m would have noise of 1e-17 m."""
    random = np.random.default_rng(3)
    x = size * random.normal(size=STATES)
    moved = size * random.normal(size=12)
    u = dict(zip(Machine(sdelta()).inputs[:12], moved, strict=True))
    common = {"posture": A, "stiffness": "ch4_full"}
    one, other = (Machine(sdelta(level=level, **common)) for level in ("nonlinear", "cartesian"))
    expected, found = other.out(x, u), one.out(x, u)
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e3 * size + 1e-11), name
    assert found["platform.workspace_left"] == 0
    np.testing.assert_allclose(one.rhs(x, u), other.rhs(x, u), rtol=1e3 * size + 1e-11)


@given(postures(), small)
@settings(max_examples=5)
def test_no_force_where_tubes_follow(posture, moved):
    """The energy is zero wherever the tubes are at the inverse kinematics of the pose, up to 60 degrees away."""
    turn, move, _ = moved
    turn = turn / 0.3 * np.deg2rad(60) / np.sqrt(3)
    Q, a, u0, phi0 = by_hand(BEAM, posture, turn, move, 0, 0)
    u, phi = BEAM.tubes(Q, a)
    change = (phi - phi0 + np.pi) % (2 * np.pi) - np.pi
    out = Machine(sdelta(level="nonlinear", posture=posture)).out(state(turn, move), tube_inputs(u - u0, change))
    assert np.abs([out[f"drive[{j}].force"] for j in (1, 2, 3)]).max() < 1e-9
    assert np.abs([out[f"rod[{j}].deflection[{i}]"] for j in (1, 2, 3) for i in (1, 2)]).max() < 1e-14
    assert np.abs(vector(out, "platform.acceleration")).max() < 1e-8
    np.testing.assert_allclose(vector(out, "platform.rotation"), turn, atol=1e-14)


# Printed numbers ------------------------------------------------------------------------------------------------------


def frequencies(machine: Machine, x: np.ndarray, u: dict[str, float]) -> np.ndarray:
    """Undamped natural frequencies about a state, ascending [Hz]."""
    poles = np.linalg.eigvals(machine.slope(x, u))
    return np.sort(np.abs(poles.imag))[::2] / (2 * np.pi)


def rest(machine: Machine, u: dict[str, float]) -> np.ndarray:
    """Equilibrium by Newton's method."""
    x = np.zeros(STATES)
    for _ in range(30):
        step = np.linalg.solve(machine.slope(x, u), machine.rhs(x, u))
        x = x - step
        if np.abs(step).max() < 1e-13:
            return x
    raise AssertionError("no equilibrium")


@pytest.mark.parametrize(("preset", "sag"), [("ch4", 0.412e-3), ("ch3_full", 0.499e-3)], ids=["ch4", "ch3_full"])
def test_sag_under_gravity(preset, sag):
    machine = Machine(sdelta(level="nonlinear", stiffness=preset), gravity=9.81, damping_ratio=0.0)
    out = machine.out(rest(machine, {}), {})
    assert -out["platform.position[3]"] == pytest.approx(sag, abs=0.0006e-3)


def test_motors_hold_the_weight_of_a_stiff_robot():
    """The printed torque is that of the posture; the sag, here 0.1 um, would change the lever arms."""
    machine = Machine(sdelta(level="nonlinear", rods=Rods(tip_stiffness=1e9)), gravity=9.81)
    out = machine.out(rest(machine, {}), {})
    slide, turn = 0.06 / (4 * np.pi), 1 / 12
    for j in (1, 2, 3):
        force, torque = out[f"drive[{j}].force"], out[f"drive[{j}].torque"]
        for sign in (1, -1):
            assert -(sign * slide * force + turn * torque) == pytest.approx(0.458382, abs=1e-6)


def test_gravity_raises_the_frequencies():
    """About the loaded equilibrium, motors at the symmetric angles."""
    machine = Machine(sdelta(level="nonlinear"), gravity=9.81, damping_ratio=0.0)
    expected = [23.6696, 23.6696, 24.5454, 95.9846, 95.9846, 161.1714]
    np.testing.assert_allclose(frequencies(machine, rest(machine, {}), {}), expected, atol=5.1e-5)


@pytest.mark.parametrize(
    ("turn", "move", "printed"),
    [
        ((0, 0, 0), (10, 0, 0), 21.983),
        ((0, 0, 0), (50, 0, 0), 12.048),
        ((0, 0, 0), (0, 0, 10), 22.841),
        ((0, 0, 0), (0, 0, -10), 24.373),
        ((5, 0, 0), (0, 0, 0), 19.234),
        ((0, 5, 0), (0, 0, 0), 18.679),
        ((0, 0, 30), (0, 0, 0), 26.321),
    ],
    ids=["x+10", "x+50", "z+10", "z-10", "Rx5", "Ry5", "Rz30"],
)
def test_first_frequency_where_the_tubes_have_moved_to(turn, move, printed):
    """The FMU is built at the symmetric posture; its tubes go to another one, and so does its platform."""
    machine = Machine(sdelta(level="nonlinear"), damping_ratio=0.0)
    Q, a = rotation(np.deg2rad(turn)), np.array(SYMMETRIC.position) + 1e-3 * np.array(move)
    (u0, phi0), (u, phi) = BEAM.tubes(np.eye(3), np.array(SYMMETRIC.position)), BEAM.tubes(Q, a)
    arm = arm_of(SYMMETRIC)
    x = state(np.deg2rad(turn), a + Q @ arm - SYMMETRIC.position - arm)
    inputs = tube_inputs(u - u0, phi - phi0)
    np.testing.assert_allclose(machine.rhs(x, inputs), 0, atol=1e-9)
    assert frequencies(machine, x, inputs)[0] == pytest.approx(printed, abs=5.1e-4)


@pytest.mark.parametrize(("size", "printed"), [(0.1, 1.03e-3), (1, 1.05e-2), (4, 4.57e-2)], ids=["0.1", "1", "4"])
def test_static_difference_to_the_linear_answer(size, printed):
    """Pose of C under a wrench at C, norm of the difference, rotations weighted by 0.1 m."""
    machine = Machine(sdelta(level="nonlinear", reference_point="C"))
    wrench = size * np.array([2, -1, 3, 30, -20, 50])
    u = {f"wrench.torque[{i + 1}]": wrench[i] for i in range(3)}
    u |= {f"wrench.force[{i + 1}]": wrench[3 + i] for i in range(3)}
    out = machine.out(rest(machine, u), u)
    found = np.concatenate([vector(out, "platform.rotation"), vector(out, "platform.position")])
    linear = np.linalg.solve(analyze()["stiffness_C"], wrench)
    weight = np.repeat([0.1, 1.0], 3)
    assert np.linalg.norm(weight * (found - linear)) / np.linalg.norm(weight * linear) == pytest.approx(
        printed, rel=5.1e-3
    )


def shaken(axis: int, amplitude: float, frequency: float) -> np.ndarray:
    """Amplitudes / A of mean to third harmonic, (4, 6); the mean with its sign."""
    found = Shaken(Machine(sdelta(level="nonlinear")), BEAM, SYMMETRIC, axis, amplitude, frequency).harmonics()
    return np.array([found[0].real, *np.abs(found[1:])])


TH_X, TH_Y, U_X, U_Y, U_Z = 0, 1, 3, 4, 5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("axis", "amplitude", "frequency", "printed"),
    [
        (U_X, 1e-4, 10, {(1, U_X): 1.110238, (1, TH_Y): 2.015770, (2, U_Z): 3.09e-4, (0, U_Z): -1.02e-4}),
        (
            U_X,
            1e-3,
            10,
            {(1, U_X): 1.110244, (1, TH_Y): 2.016165, (2, U_Z): 3.09e-3, (0, U_Z): -1.02e-3, (0, TH_X): -2.91e-3},
        ),
        (U_X, 5e-3, 10, {(1, U_X): 1.110398, (1, TH_Y): 2.025748, (2, U_Z): 1.55e-2, (0, U_Z): -5.1e-3}),
        (U_Z, 1e-3, 10, {(1, U_Z): 1.199017, (2, U_Z): 3.158e-3, (0, U_Z): 1.061e-3, (1, U_X): 0.0}),
        (U_Z, 1e-3, 20, {(1, U_Z): 2.972337, (2, U_Z): 6.358e-3, (0, U_Z): 1.05e-2, (1, TH_Y): 0.0}),
        (U_X, 1e-3, 20, {(1, U_X): 2.250675, (1, TH_Y): 24.5185, (2, TH_X): 0.277, (0, TH_X): 0.813}),
        (U_X, 1e-3, 40, {(1, U_X): 0.381333, (1, TH_Y): 16.8745, (2, TH_X): 0.253, (0, TH_X): 0.525}),
        (TH_X, 1e-2, 10, {(1, TH_X): 1.120299, (1, U_Y): 0.005375, (2, TH_X): 9.81e-3, (0, TH_X): -3.14e-3}),
    ],
    ids=["ux0.1@10", "ux1@10", "ux5@10", "uz1@10", "uz1@20", "ux1@20", "ux1@40", "thx10@10"],
)
def test_periodic_motion_of_the_printed_table(axis, amplitude, frequency, printed):
    """Every entry to its printed digits, the last one within 1.6 units: the printed ones are cut, not rounded."""
    found = shaken(axis, amplitude, frequency)
    for (harmonic, coordinate), number in printed.items():
        digits = len(f"{number!r}".rpartition(".")[2]) if "e" not in f"{number!r}" else 0
        unit = 10.0**-digits if digits else 10.0 ** (np.floor(np.log10(abs(number))) - 2)
        assert found[harmonic, coordinate] == pytest.approx(number, abs=1.6 * unit if number else 1e-9), (
            harmonic,
            coordinate,
        )


@pytest.mark.slow
def test_tends_to_the_linear_answer():
    """Second harmonic and mean per amplitude grow as A, the change of the fundamental as A^2."""
    first, second, third = (shaken(U_Z, amplitude, 10) for amplitude in (2e-4, 1e-3, 2e-3))
    for one, other, ratio in ((first, second, 5), (second, third, 2)):
        assert other[2, U_Z] / one[2, U_Z] == pytest.approx(ratio, rel=1e-3)
        assert other[0, U_Z] / one[0, U_Z] == pytest.approx(ratio, rel=1e-3)
    linear = 1.198997
    bend = (third[1, U_Z] - second[1, U_Z]) / 3
    assert second[1, U_Z] - bend == pytest.approx(linear, abs=6e-7)
    assert first[1, U_Z] == pytest.approx(second[1, U_Z] - bend * (1 - 0.04), abs=2e-8)


# Laws -----------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_energy_is_constant_for_a_thousand_periods():
    """Without damping, motors locked, from a large deflection that excites all modes."""
    machine = Machine(sdelta(level="nonlinear"), damping_ratio=0.0)
    x = state((5e-3, -3e-3, 8e-3), (1e-3, 2e-3, -1e-3), (0.2, 0.1, -0.3), (0.05, 0.02, -0.04))
    body = with_payload(CUBE)

    def energy(x: np.ndarray) -> float:
        angle = 4 * np.arctan(np.linalg.norm(x[:3]) / 4)
        turn = x[:3] * angle / np.linalg.norm(x[:3])
        Q, a, u, phi = by_hand(BEAM, SYMMETRIC, turn, x[3:6], 0, 0)
        w = Q.T @ x[6:9]
        return float(BEAM.energy(Q, a, u, phi).real + w @ body.tensor @ w / 2 + body.mass * x[9:] @ x[9:] / 2)

    fixed = (0, x, [], np.zeros(24), machine.parameters)
    rhs = machine.functions.rhs
    run = solve_ivp(
        lambda _, x: rhs(0, x, *fixed[2:]).full().ravel(),
        (0, 1000 / 23.59),
        x,
        method="DOP853",
        rtol=1e-12,
        atol=1e-15,
        t_eval=np.linspace(0, 1000 / 23.59, 101),
    )
    energies = np.array([energy(column) for column in run.y.T])
    np.testing.assert_allclose(energies, energies[0], rtol=1e-8)


@pytest.mark.parametrize(
    ("turn", "move"),
    [
        ((-22.61986, 0, 0), (0, 0, 0)),
        ((24.42523, 0, 0), (0, 0, 0)),
        ((0, 23.41266, 0), (0, 0, 0)),
        ((0, -23.41266, 0), (0, 0, 0)),
        ((0, 0, 90), (0, 0, 0)),
        ((0, 0, -90), (0, 0, 0)),
        ((0, 0, 0), (86.60254, 0, 0)),
        ((0, 0, 0), (0, -75, 0)),
    ],
    ids=["Rx-", "Rx+", "Ry+", "Ry-", "Rz+", "Rz-", "x", "y"],
)
def test_flag_beyond_the_printed_singular_poses(turn, move):
    """0 just before, 1 just beyond, where the tubes follow."""
    machine = Machine(sdelta(level="nonlinear"))
    arm, at = arm_of(SYMMETRIC), np.array(SYMMETRIC.position)
    u0, phi0 = BEAM.tubes(np.eye(3), at)
    for share, flag in ((0.5, 0), (0.99, 0), (1.001, 1), (1.05, 1)):
        vector_there = share * np.deg2rad(turn)
        Q, a = rotation(vector_there), at + share * 1e-3 * np.array(move)
        u, phi = BEAM.tubes(Q, a)
        x = state(vector_there, a + Q @ arm - at - arm)
        assert machine.out(x, tube_inputs(u - u0, phi - phi0))["platform.workspace_left"] == flag, share


def test_flag_where_a_limb_is_as_short_as_its_rod():
    """Lowering the platform shortens all limbs: sqrt(0.075^2 + h^2) is 0.115 m at a height of 87.2 mm."""
    machine = Machine(sdelta(level="nonlinear"))
    at = np.array(SYMMETRIC.position)
    u0, phi0 = BEAM.tubes(np.eye(3), at)
    edge = np.sqrt(0.115**2 - 0.075**2)
    for height, flag in ((edge + 1e-6, 0), (edge - 1e-6, 1)):
        u, phi = BEAM.tubes(np.eye(3), np.array([0, 0, height]))
        out = machine.out(state((0, 0, 0), (0, 0, height - at[2])), tube_inputs(u - u0, phi - phi0))
        assert out["platform.workspace_left"] == flag
