"""The C-drive: inertia, Bode sentence, energy, the ideal limit, and an encoder that rounds and hisses as told."""

import casadi as ca
import numpy as np
import pytest

from hfsa.components import ModelError
from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC, Posture
from hfsa.components._mechanics.sdelta_kinematics import THESIS, Kinematics
from hfsa.components._mechanics.sdelta_limbs import THESIS_LIMBS
from hfsa.components._mechanics.sdelta_stiffness import THESIS_SHAFTS, Shafts
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind
from hfsa.components._modelling.noise import _PRIME, _remainder, white_noise
from hfsa.components.c_drive import analyze, c_drive
from hfsa.components.sdelta import sdelta

INERTIA = THESIS_LIMBS.on_motors(THESIS.transmission)


def response(model, omega: float, outputs: list[str], inputs: list[str]) -> np.ndarray:
    system = linearize(model)
    rows = [system.output_labels.index(name) for name in outputs]
    columns = [system.input_labels.index(name) for name in inputs]
    return np.atleast_2d(system(1j * omega))[np.ix_(rows, columns)]


def values_of(model, **values) -> dict[str, float]:
    """Outputs at given inputs, states and parameters."""
    point = [[values.get(q.name, q.start) for q in model.of(kind)] for kind in (Kind.STATE, Kind.INPUT, Kind.PARAMETER)]
    out = functions(model).out(values.get("time", 0.0), point[0], [], point[1], point[2])
    return dict(zip([q.name for q in model.of(Kind.OUTPUT)], np.array(out).ravel(), strict=True))


def test_both_motors_have_the_same_inertia():
    assert INERTIA[1, 1] == INERTIA[0, 0]
    assert INERTIA[1, 0] == INERTIA[0, 1]
    np.testing.assert_array_equal(analyze()["inertia"], INERTIA)


@pytest.mark.parametrize("omega", [1.0, 300.0, 1e4])
def test_bode_sentence(omega):
    motors = ["motor[1]/angle", "motor[2]/angle"]
    H = response(c_drive(), omega, motors, ["motor[1]/torque", "motor[2]/torque"])
    M = INERTIA
    for direction, mass in (([1, 1], M[0, 0] + M[0, 1]), ([1, -1], M[0, 0] - M[0, 1])):
        np.testing.assert_allclose(H @ direction, np.array(direction) / (-(omega**2) * mass), rtol=1e-12)


def test_tube_motion_is_the_screws_and_gears():
    """Equal angles turn the tube by angle / iota, opposite ones slide it by p angle / (2 pi), also of 0.6 prad."""
    model = c_drive()
    assert set(values_of(model).values()) == {0.0}
    for angle in (0.6, 0.6e-12):
        turned = values_of(model, **{"shaft[1].angle": angle, "shaft[2].angle": angle})
        slid = values_of(model, **{"shaft[1].angle": angle, "shaft[2].angle": -angle})
        assert turned["tube.angle"] == pytest.approx(angle / 6, rel=1e-15)
        assert turned["tube.slide"] == 0
        assert slid["tube.slide"] == pytest.approx(0.060 * angle / (2 * np.pi), rel=1e-15)
        assert slid["tube.angle"] == 0
        assert slid["motor[1].angle"] == angle


def test_power_of_torques_and_loads_becomes_kinetic_energy():
    """d/dt (w^T M w / 2) = tau . w + F slide_rate + T angle_rate, at any state."""
    rng = np.random.default_rng(5)
    speed, torque, force, moment = rng.normal(size=2), rng.normal(size=2), *rng.normal(size=2)
    names = {"shaft[1].speed": speed[0], "shaft[2].speed": speed[1], "tube.force": force, "tube.torque": moment}
    out = values_of(c_drive(), **names, **{"motor[1].torque": torque[0], "motor[2].torque": torque[1]})
    acceleration = np.linalg.solve(
        THESIS.transmission.matrix, [out["tube.slide_acceleration"], out["tube.angle_acceleration"]]
    )
    power_in = torque @ speed + force * out["tube.slide_rate"] + moment * out["tube.angle_rate"]
    assert speed @ INERTIA @ acceleration == pytest.approx(power_in, rel=1e-12)


def test_ideal_moves_as_commanded_and_its_motors_follow():
    """From the symmetric posture to another one, by what lies between them."""
    start, at = Kinematics.at(SYMMETRIC), Kinematics.at(Posture((10.0, 5.0, 8.0), (0.005, 0.003, 0.155)))
    for j in range(3):
        slide, angle = at.limbs.slide[j] - start.limbs.slide[j], at.limbs.angle[j] - start.limbs.angle[j]
        commands = {"command.slide": slide, "command.angle": angle, "command.slide_rate": 0.3}
        out = values_of(c_drive(level="ideal"), **commands)
        assert (out["tube.slide"], out["tube.angle"]) == pytest.approx((slide, angle), rel=1e-13)
        motors = [out["motor[1].angle"], out["motor[2].angle"]]
        assert motors == pytest.approx(at.motor_angles[2 * j : 2 * j + 2], rel=1e-12)
        assert THESIS.transmission.matrix @ [out["motor[1].speed"], out["motor[2].speed"]] == pytest.approx(
            [0.3, 0.0], abs=1e-13
        )


def test_ports_fit_the_robots():
    """What the drive puts out starts where the robot's inputs start, in the same units."""
    drive, robot = c_drive(), sdelta(posture=SYMMETRIC)
    start = values_of(drive)
    for motion in ("slide", "angle", "slide_rate", "angle_rate", "slide_acceleration", "angle_acceleration"):
        assert robot[f"drive[1].{motion}"].start == pytest.approx(start[f"tube.{motion}"], abs=1e-15)
        assert robot[f"drive[1].{motion}"].unit == drive[f"tube.{motion}"].unit
    for load in ("force", "torque"):
        assert robot[f"drive[1].{load}"].unit == drive[f"tube.{load}"].unit


def test_the_encoder_is_off_by_default_and_rounds_to_its_resolution():
    assert values_of(c_drive(), **{"shaft[1].angle": 0.12345})["motor[1].angle"] == 0.12345
    for angle, shown in ((0.1234, 0.12), (0.1251, 0.13), (-0.1251, -0.13)):
        out = values_of(c_drive(), **{"shaft[1].angle": angle, "encoder.resolution": 0.01})
        assert out["motor[1].angle"] == pytest.approx(shown, abs=1e-15)


def test_the_encoders_steps_stand_still_on_the_motor():
    """At a posture of 1.2345 rad it shows whole steps of the absolute angle, less those 1.2345 rad."""
    offsets = {"encoder.offset[1]": 1.2345, "encoder.offset[2]": -0.7}
    for angle, shown in ((0.0, 1.23), (0.0006, 1.24), (-0.0096, 1.22), (-0.0094, 1.23)):
        states = {"shaft[1].angle": angle, "shaft[2].angle": angle}
        out = values_of(c_drive(), **states, **offsets, **{"encoder.resolution": 0.01})
        assert out["motor[1].angle"] + 1.2345 == pytest.approx(shown, abs=1e-15)
        steps = (out["motor[2].angle"] - 0.7) / 0.01
        assert steps == pytest.approx(round(steps), abs=1e-12)
        assert values_of(c_drive(), **states, **offsets)["motor[1].angle"] == angle


def test_encoder_noise_is_white_and_its_seed_counts():
    time, seed = ca.SX.sym("time"), ca.SX.sym("seed")
    noise = ca.Function("noise", [time, seed], [white_noise(time, 1e-3, seed)])
    instants = np.arange(100_000)[None, :] * 1e-3
    first, second = (np.array(noise(instants, s)).ravel() for s in (1, 2))
    n = len(instants[0])
    assert abs(first.mean()) < 4 / np.sqrt(n)
    assert first.std() == pytest.approx(1, abs=4 / np.sqrt(2 * n))
    assert (first**4).mean() == pytest.approx(3, abs=4 * np.sqrt(96 / n))
    for lag in (1, 2, 7, 1000):
        assert abs(np.corrcoef(first[:-lag], first[lag:])[0, 1]) < 4 / np.sqrt(n)
    assert abs(np.corrcoef(first, second)[0, 1]) < 4 / np.sqrt(n)
    assert float(noise(0.01234, 1)) == float(noise(0.01299, 1)) != float(noise(0.01301, 1))


def test_the_remainder_is_exact():
    number = ca.SX.sym("number")
    remainder = ca.Function("remainder", [number], [_remainder(number)])
    rng = np.random.default_rng(5)
    multiples = rng.integers(0, _PRIME, 10_000) * _PRIME
    numbers = np.concatenate([rng.integers(0, 2**53, 10_000), multiples, multiples + 1, multiples + _PRIME - 1])
    np.testing.assert_array_equal(np.array(remainder(numbers[None, :].astype(float))).ravel(), numbers % _PRIME)


def test_noise_reaches_the_encoder_only():
    quiet = values_of(c_drive(), time=0.5)
    noisy = values_of(c_drive(encoder_noise=True), time=0.5, **{"encoder.noise": 1e-3})
    assert 0 < abs(noisy["motor[1].angle"] - quiet["motor[1].angle"]) < 6e-3
    assert noisy["tube.slide"] == quiet["tube.slide"]
    assert noisy["motor[1].angle"] != noisy["motor[2].angle"]


def test_unknown_level():
    with pytest.raises(ModelError, match="level is 'rigid_shft'; did you mean rigid_shaft"):
        c_drive(level="rigid_shft")  # type: ignore[arg-type]


# Shafts ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("hertz", [3.0, 300.0, 2e3])
def test_compliant_shafts_are_two_inertias_on_a_spring(hertz):
    """Equal torques turn the tube, opposite ones slide it: each is one motor on one shaft, undamped here."""
    limbs, k, omega = THESIS_LIMBS, THESIS_SHAFTS.stiffness, 2 * np.pi * hertz
    system = linearize(c_drive(level="compliant_shaft"), {"shaft.damping_ratio": 0.0})
    names = [f"motor[{i}]/angle" for i in (1, 2)] + ["tube/slide", "tube/angle"]
    rows = [system.output_labels.index(name) for name in names]
    columns = [system.input_labels.index(f"motor[{i}]/torque") for i in (1, 2)]
    found = np.atleast_2d(system(1j * omega))[np.ix_(rows, columns)]
    far = INERTIA - limbs.rotor_inertia * np.eye(2)
    for sign, tube in ((1, 3), (-1, 2)):
        screw = far[0, 0] + sign * far[0, 1]
        matrix = np.array([[k - limbs.rotor_inertia * omega**2, -k], [-k, k - screw * omega**2]])
        motor, behind = np.linalg.solve(matrix, [1.0, 0.0])
        at = found @ [1.0, sign]
        assert at[0] == pytest.approx(motor, rel=1e-9)
        assert at[1] == pytest.approx(sign * motor, rel=1e-9)
        ratio = THESIS.transmission.matrix[tube - 2] @ [1.0, sign]
        assert at[tube] == pytest.approx(ratio * behind, rel=1e-9)


def test_shaft_frequencies_are_those_of_the_model():
    system = linearize(c_drive(level="compliant_shaft"), {"shaft.damping_ratio": 0.0})
    poles = np.linalg.eigvals(system.A)
    found = np.sort(np.abs(poles[poles.imag > 1])) / (2 * np.pi)
    np.testing.assert_allclose(found, analyze()["shaft_frequencies_hz"], rtol=1e-9)


def test_compliant_shafts_tend_to_rigid_ones_with_one_over_stiffness():
    motors, torques = ["motor[1]/angle", "motor[2]/angle"], ["motor[1]/torque", "motor[2]/torque"]
    exact = response(c_drive(), 300.0, motors, torques)
    errors = []
    for factor in (10, 100, 1000):
        stiff = Shafts(shear_modulus=75e9 * factor, coupling=3400.0 * factor)
        found = response(c_drive(level="compliant_shaft", shafts=stiff), 300.0, motors, torques)
        errors.append(np.abs(found / exact - 1).max())
    assert np.divide(errors[:-1], errors[1:]) == pytest.approx([10, 10], rel=0.02)


def test_printed_stiffnesses_of_the_shafts():
    """Equations 3.51 to 3.53 and 3.26c, k''_s at the symmetric posture."""
    assert THESIS_SHAFTS.alone == pytest.approx(1.2064e4, abs=0.5)
    found = analyze()
    assert found["shaft_stiffness"] == pytest.approx(2.6524e3, abs=0.06)
    assert found["slide_stiffness"] == pytest.approx(5.81746e7, rel=1e-6)
    assert found["angle_stiffness"] / 0.1677051**2 == pytest.approx(6.790256e6, rel=1e-6)
