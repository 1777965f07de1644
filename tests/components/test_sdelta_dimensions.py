"""Dimensions of the SDelta as arguments: similar machines, agreement between the parts, and what cannot be built."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from parts_by_name import part
from robot_response import A

from hfsa.components import ModelError
from hfsa.components._mechanics.sdelta_direct import direct_kinematics
from hfsa.components._mechanics.sdelta_geometry import Geometry, Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE, Payload, Platform
from hfsa.components._mechanics.sdelta_kinematics import Kinematics, Mechanism, Transmission
from hfsa.components._mechanics.sdelta_limbs import LimbInertia
from hfsa.components._mechanics.sdelta_stiffness import Rods, Shafts

analyze, sdelta = part("sdelta").analysis, part("sdelta").model
analyze_drive, c_drive = part("c_drive").analysis, part("c_drive").model
tune = part("sdelta_tuning").analysis

LEVELS = ("cartesian", "generalized")


def scaled(factor: float) -> dict:
    """The thesis' machine with all lengths multiplied, of the same materials; angles of gears stay."""
    cube, platform = CUBE, Platform()
    return {
        "posture": Posture(A.rotation, tuple(factor * np.array(A.position))),
        "geometry": Geometry(0.45 * factor, 0.15 * factor),
        "rods": Rods(0.115 * factor, 0.0115 * factor),
        "shafts": Shafts(0.04 * factor, 0.016 * factor, coupling=3400.0 * factor**3),
        "limbs": LimbInertia(0.672e-4 * factor**5, 1e-4 * factor**5, factor**3, 3e-3 * factor**5),
        "platform": Platform(platform.mass * factor**3, tuple(factor**5 * np.array(platform.inertia))),
        "payload": Payload(
            cube.mass * factor**3, tuple(factor * np.array(cube.center)), tuple(factor**5 * np.array(cube.inertia))
        ),
        "pitch": 0.06 * factor,
    }


@given(st.floats(0.05, 20.0), st.sampled_from(LEVELS), st.sampled_from(["ch3_full", "ch4"]))
@pytest.mark.slow
def test_a_machine_of_another_size_has_frequencies_inverse_to_it(factor, level, preset):
    small = analyze(level=level, stiffness=preset, posture=A)["natural_frequencies_hz"]
    large = analyze(level=level, stiffness=preset, **scaled(factor))["natural_frequencies_hz"]
    np.testing.assert_allclose(large * factor, small, rtol=1e-8)


@given(st.floats(0.3, 0.8), st.floats(0.2, 0.38), st.floats(0.01, 0.2), st.floats(1.0, 50.0))
def test_direct_kinematics_invert_the_inverse_ones(base, share, pitch, gear):
    mechanism = Mechanism(Geometry(base, share * base), Transmission(pitch, gear))
    posture = Posture((2.0, -1.0, 1.5), (0.004, -0.003, 0.156))
    Q, a = direct_kinematics(Kinematics.at(posture, mechanism).motor_angles, mechanism=mechanism)
    np.testing.assert_allclose(Q, posture.matrix, atol=1e-11)
    np.testing.assert_allclose(a, posture.position, atol=1e-12)


def test_a_dimension_changes_what_it_should():
    """The tip of a rod is stiffer as d^4, shafts count with their presets only, the gear scales tube angles."""
    thin, thick = (analyze(rods=Rods(diameter=d))["stiffness_S"] for d in (0.0115, 0.023))
    np.testing.assert_allclose(thick, 16 * thin, rtol=1e-12)
    soft = Shafts(coupling=340.0)
    np.testing.assert_array_equal(analyze(shafts=soft)["stiffness_S"], analyze()["stiffness_S"])
    full = [analyze(stiffness="ch4_full", shafts=s)["kappa"] for s in (soft, Shafts())]
    assert full[0] < 0.95 * full[1]
    J, geared = analyze_drive()["jacobian"], analyze_drive(gear=12.0, pitch=0.03)["jacobian"]
    np.testing.assert_allclose(geared, J / 2, rtol=1e-15)
    given_tip = analyze(rods=Rods(tip_stiffness=1e5), stiffness="ch3_rods")
    np.testing.assert_allclose(given_tip["stiffness_S"], analyze(rods=Rods(tip_stiffness=1e5))["stiffness_S"])


def test_gains_and_robot_follow_the_same_machine():
    """M_rb of the tuning is M_th + T^T M T of the robot's own numbers."""
    machine = scaled(1.7)
    rigid = {name: machine[name] for name in ("posture", "geometry", "limbs", "platform", "payload", "pitch")}
    numbers = analyze(**machine)
    drive = analyze_drive(pitch=machine["pitch"], limbs=machine["limbs"])["inertia"]
    body = numbers["mass_C"]
    T = Kinematics.at(machine["posture"], Mechanism(machine["geometry"], Transmission(machine["pitch"])))
    center = machine["payload"].mass * np.array(machine["payload"].center) / body[5, 5]
    T = T.jacobian(machine["posture"].matrix @ center)
    expected = np.kron(np.eye(3), drive) + T.T @ body @ T
    np.testing.assert_allclose(tune(**rigid)["motor_inertia"], expected, rtol=1e-10)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"rods": Rods(length=0.2)}, r"rods.length is 0.2 m, but limb \d is 0.1677 m long at this posture"),
        ({"posture": Posture(position=(0.4, 0, 0.15))}, r"out of reach: tube 1 would slide by 0.4 m, expected at most"),
        ({"posture": Posture((90.0, 0, 0))}, r"is singular: condition number"),
        ({"gear": 0.0}, r"^gear is 0, expected a finite number above 0"),
        ({"pitch": -0.06}, r"^pitch is -0.06 m, expected a finite number above 0"),
        ({"extra_inertia": np.nan}, r"extra_inertia is nan, expected a finite number, 0 or more"),
    ],
    ids=["rods", "reach", "singular", "gear", "pitch", "extra_inertia"],
)
def test_a_machine_that_cannot_be_built_is_refused_with_the_number(arguments, sentence):
    with pytest.raises(ModelError, match=sentence):
        sdelta(**arguments)


@pytest.mark.parametrize(
    ("dataclass", "name"),
    [
        (Geometry, "base_radius"),
        (Rods, "diameter"),
        (Shafts, "coupling"),
        (LimbInertia, "rotor_inertia"),
        (Platform, "mass"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
@pytest.mark.parametrize("value", [0.0, -1.0, np.inf, np.nan], ids=str)
def test_a_dimension_that_is_not_positive_is_refused(dataclass, name, value):
    with pytest.raises(ModelError, match=f"{name} is {value:g}"):
        dataclass(**{name: value})


def test_a_platform_must_be_a_rigid_body():
    with pytest.raises(ModelError, match="no moment can exceed the sum of the others"):
        Platform(inertia=(1.0, 1.0, 3.0))
    with pytest.raises(ModelError, match=r"level compliant_shaft needs limbs\.screw_inertia above 0"):
        c_drive(level="compliant_shaft", limbs=LimbInertia(screw_inertia=0.0, tube_mass=0.0))
