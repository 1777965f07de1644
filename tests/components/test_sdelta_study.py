"""Design studies of the SDelta: maps and slopes against `analyze`, closed forms, empty points, optima."""

import numpy as np
import pytest
from parts_by_name import part

from hfsa.components import ModelError
from hfsa.components._mechanics.elastostatics import indices
from hfsa.components._mechanics.sdelta_geometry import Geometry, Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE, Payload
from hfsa.components._mechanics.sdelta_stiffness import Rods
from hfsa.components._modelling.study import bounds, optimum, response_map, slopes

SDELTA = part("sdelta")
analyze, study, trajectory = SDELTA.analysis, SDELTA.design_study, SDELTA.path_study

A = Posture((10, 5, 8), (0.005, 0.003, 0.155))


def answers(**arguments) -> dict[str, float]:
    found = analyze(**arguments)
    return {"f1": found["natural_frequencies_hz"][0], **{k: found[k] for k in ("kappa", "kappa_t", "kappa_r")}} | {
        "condition_number": found["condition_number"]
    }


def test_a_map_over_the_workspace_is_that_of_direct_calls():
    ranges = {"posture.position[1]": (-0.03, 0.03), "posture.rotation[3]": (-10.0, 10.0)}
    found = response_map(study(posture=A), ranges, points=4)
    x, turn = found.axes.values()
    assert not found.failing
    for i in (0, 2, 4):
        for j in (0, 3):
            posture = Posture((10, 5, turn[j]), (x[i], 0.003, 0.155))
            for name, value in answers(posture=posture).items():
                assert found.responses[name][i, j] == pytest.approx(value, rel=1e-12)


def test_a_map_over_dimensions_is_that_of_direct_calls():
    ranges = {"geometry.base_radius": (0.4, 0.5), "payload.mass": (1.0, 4.0)}
    found = response_map(study(stiffness="ch4_full"), ranges, points=3)
    radii, masses = found.axes.values()
    for i, j in ((0, 0), (2, 3), (1, 2)):
        arguments = {"geometry": Geometry(base_radius=radii[i]), "payload": Payload(masses[j])}
        for name, value in answers(stiffness="ch4_full", **arguments).items():
            assert found.responses[name][i, j] == pytest.approx(value, rel=1e-12)


def test_a_map_is_empty_beyond_singularities_and_says_how_often():
    """Sideways the robot is singular at -75 mm in y, and at 86.6 mm in x."""
    ranges = {"posture.position[1]": (-0.1, 0.1), "posture.position[2]": (-0.1, 0.1)}
    found = response_map(study(), ranges, points=41)
    x, y = found.axes.values()
    empty = np.isnan(found.responses["f1"])
    assert not empty[x == 0][0, y > -0.075].any()
    assert empty[x == 0][0, y < -0.0751].all()
    assert empty[np.abs(x) > 0.0867][:, y == 0].all()
    assert not empty[np.abs(x) < 0.0865][:, y == 0].any()
    singular, other = "a posture that is not singular (condition number up to 10000)", "the present assembly"
    first, second = found.failing
    assert first == singular
    assert second.startswith(other)
    assert max(found.failing.values()) <= empty.sum() <= sum(found.failing.values())
    low = response_map(study(), {"posture.position[3]": (0.05, 0.15), "rods.length": (0.05, 0.15)}, points=11)
    assert list(low.failing) == ["rods shorter than the limbs"]


def test_slopes_follow_closed_forms():
    """At the symmetric posture k_r is proportional to d^4 E / l^3, and f1 to the square root of k_r."""
    found = slopes(study(), "f1")
    expected = {"rods.length": -1.5, "rods.diameter": 2.0, "rods.elastic_modulus": 0.5}
    assert {name: found[name] for name in expected} == pytest.approx(expected, abs=1e-7)
    # the indices do not depend on a mass
    assert slopes(study(), "kappa")["payload.mass"] == pytest.approx(0, abs=1e-9)
    with_masses = slopes(study(posture=A), "f1")
    assert with_masses["payload.mass"] < with_masses["platform.mass"] < 0


def test_slopes_agree_with_differences_of_analyze():
    found = slopes(study(posture=A, stiffness="ch4_full"), "kappa_r")
    h = 1e-4
    up, down = (
        answers(posture=Posture(A.rotation, (*A.position[:2], 0.155 * f)), stiffness="ch4_full")["kappa_r"]
        for f in (1 + h, 1 - h)
    )
    assert found["posture.position[3]"] == pytest.approx(np.log(up / down) / np.log((1 + h) / (1 - h)), rel=1e-5)


def test_dimensions_are_those_that_matter():
    assert "shafts.coupling" not in study().variables
    assert {"shafts.coupling", "gear", "pitch"} <= set(study(stiffness="ch3_full").variables)
    assert "rods.diameter" not in study(rods=Rods(tip_stiffness=1.6e5)).variables
    own = study(payload=Payload(3.0, CUBE.center, (0.01, 0.01, 0.01)))
    heavier = own.values.copy()
    heavier[list(own.variables).index("payload.mass")] = 4.0
    expected = analyze(payload=Payload(4.0, CUBE.center, (0.01, 0.01, 0.01)))["natural_frequencies_hz"][0]
    # the height of the cube follows its mass, an inertia of one's own stays
    followed = analyze(payload=Payload(4.0, inertia=(0.01, 0.01, 0.01)))["natural_frequencies_hz"][0]
    assert own.at(heavier)["f1"][0] == pytest.approx(followed, rel=1e-12)
    assert followed != pytest.approx(expected, rel=1e-6)


@pytest.mark.slow
def test_the_stiffest_rod_within_bounds_and_a_platform_between_them():
    """Only what is as stiff as it may be is at its bounds; the platform's radius has an optimum where modes cross."""
    found = optimum(study(), bounds(study(), 0.2, {"payload.mass": (3.0, 3.0)}))
    assert found.is_converged
    ends = {"rods.length": "lower", "rods.diameter": "upper", "rods.elastic_modulus": "upper", "payload.mass": "held"}
    assert {name: found.at_bound[name] for name in ends} == ends
    assert found.at_bound["geometry.platform_radius"] == ""
    radius = found.values["geometry.platform_radius"]
    machine = {"rods": Rods(0.092, 0.0138, 126e9), "payload": Payload(3.0)}
    machine |= {"posture": Posture(position=(0, 0, found.values["posture.position[3]"]))}
    base = found.values["geometry.base_radius"]
    tried = [answers(geometry=Geometry(base, r), **machine)["f1"] for r in (0.99 * radius, radius, 1.01 * radius)]
    assert tried[1] > max(tried[0], tried[2])


@pytest.mark.parametrize("posture", [Posture(), A], ids=["symmetric", "asymmetric"])
def test_indices_from_traces_are_those_of_the_eigenvalues(posture):
    found = analyze(posture=posture, stiffness="ch3_full")
    values = [found[key] for key in ("eigenstiffness", "translational_stiffness", "torsional_stiffness")]
    np.testing.assert_allclose(indices(found["stiffness_C"]), [np.sqrt(np.mean(v**2)) for v in values], rtol=1e-9)


def test_a_path_has_the_numbers_of_each_posture():
    along = trajectory()
    rows = np.array([[0, 0, 0.15, 0, 0, 0], [0.005, 0.003, 0.155, 10, 5, 8], [0.1, 0, 0.15, 0, 0, 0]]).T
    found = along.at(rows)
    numbers = analyze(posture=A)
    for i in range(6):
        assert found[f"f{i + 1}"][1] == pytest.approx(numbers["natural_frequencies_hz"][i], rel=1e-12)
    motors = [found[f"motor_{name}"][1] for name in ("L1", "R1", "L2", "R2", "L3", "R3")]
    np.testing.assert_allclose(motors, numbers["motor_angles"], rtol=1e-12)
    assert np.isnan(found["f1"][2])
    assert found["kappa"][1] == pytest.approx(numbers["kappa"], rel=1e-12)


def test_a_path_has_the_printed_frequencies():
    """How f1 falls away from the symmetric posture, by the specification."""
    printed = {
        (0.01, 0, 0.15, 0, 0, 0): 21.983,
        (0.05, 0, 0.15, 0, 0, 0): 12.048,
        (0, 0, 0.16, 0, 0, 0): 22.841,
        (0, 0, 0.14, 0, 0, 0): 24.373,
        (0, 0, 0.15, 0, 5, 0): 19.234,
        (0, 0, 0.15, 0, 0, 5): 18.679,
        (0, 0, 0.15, 30, 0, 0): 26.321,
    }
    found = trajectory().at(np.array(list(printed)).T)["f1"]
    np.testing.assert_allclose(found, list(printed.values()), atol=5.1e-4)


def test_bad_arguments_of_a_study_are_named():
    with pytest.raises(ModelError, match="objective is 'f2'"):
        study(objective="f2")  # type: ignore[arg-type]
    with pytest.raises(ModelError, match="condition number"):
        study(posture=Posture(rotation=(90, 0, 0)))
