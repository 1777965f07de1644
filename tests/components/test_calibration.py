"""Calibration: what is known is found again, what is not determined is told, the figures of the stage's source."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from parts_by_name import part

from hfsa.components import ModelError
from hfsa.components._mechanics.rrr_kinematics import CALIBRATED, Links
from hfsa.components._mechanics.sdelta_geometry import Geometry, Posture
from hfsa.components._mechanics.sdelta_kinematics import Kinematics, Mechanism, Transmission
from hfsa.components._modelling.fit import fit

MEASURED = np.array(
    [
        [1.610797127, -1.298942876, -0.164324634],
        [-0.6056938677, -1.42884239, 1.37702048],
        [-32.69206385, -28.30203574, -20.19743117],
    ]
)
TURN = 53.961
TRUTH = Links(16e-3, 12e-3, 28e-3, 1.25, 0.7)
SEEN = ("links.radius", "links.psi1", "links.crank")


def stage(**arguments):
    return part("rrr_stage").calibration_task(**arguments)


def rotated(J: np.ndarray) -> np.ndarray:
    """A Jacobian in axes that those of the stage are turned against."""
    c, s = np.cos(np.radians(TURN)), np.sin(np.radians(TURN))
    return np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ J


def poses(elongations: np.ndarray, J: np.ndarray, noise: float = 0.0, seed: int = 0) -> dict[str, np.ndarray]:
    """Table of poses for elongations (rows, 3), with errors of x, y [m] and 100 times as large ones of yaw [rad]."""
    errors = noise * np.random.default_rng(seed).normal(size=elongations.shape) * [1, 1, 100]
    values = np.column_stack([elongations, elongations @ J.T + errors])
    return dict(zip(("elongation_1", "elongation_2", "elongation_3", "x", "y", "yaw"), values.T, strict=True))


def combinations(links: Links) -> tuple[float, float, float]:
    """What poses determine: radius, psi1 + psi2, crank sin(psi3) / arm."""
    return links.radius, links.psi1 + links.psi2, links.crank * np.sin(links.psi3) / links.arm


# Figures of the source ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def published():
    task = stage(turn=TURN)
    return task, task.corners(MEASURED)


def test_the_worst_corner_is_that_of_the_source(published):
    task, table = published
    found = fit(task, table)
    weighted = found.weighted(found.before)
    worst = int(np.argmax(weighted))
    assert [table[f"elongation_{i}"][worst] for i in (1, 2, 3)] == [12e-6, 0.0, 12e-6]
    assert round(weighted[worst]) == 664


def test_the_printed_set_meets_the_worst_corner_and_this_one_all_better(published):
    _, table = published
    task = stage(turn=TURN, kinematics="calibrated")
    found = fit(task, table)
    rms = {word: [np.sqrt((errors[n] ** 2).mean()) for n in ("x", "y", "yaw")] for word, errors in
           (("printed", found.before), ("here", found.after))}  # fmt: skip
    np.testing.assert_allclose(rms["printed"], [2.40e-6, 6.42e-6, 0.0591e-3], rtol=2e-3)
    np.testing.assert_allclose(rms["here"], [1.54e-6, 4.99e-6, 0.0575e-3], rtol=3e-3)
    corner = np.flatnonzero((table["elongation_2"] == 0) & (table["elongation_1"] > 0) & (table["elongation_3"] > 0))[0]
    assert np.hypot(found.before["x"][corner], found.before["y"][corner]) < 2e-9
    assert abs(found.before["yaw"][corner]) < 1e-7


def test_the_best_fit_is_that_of_the_specification_by_either_objective(published):
    task, table = published
    least, largest = fit(task, table), fit(task, table, objective="largest")
    for found in (least, largest):
        assert found.is_converged
        assert found.values["links.radius"] == pytest.approx(31.0855e-3, abs=5e-8)
        assert found.others["psi1 + psi2"][0] == pytest.approx(1.67261, abs=5e-6)
        assert found.others["crank sin(psi3)"][0] == pytest.approx(8.788e-3, abs=5e-7)
    assert round(float(largest.weighted(largest.after).max()), 1) == 65.4
    assert fit(stage(turn=TURN, kinematics="calibrated"), table).weighted(
        fit(stage(turn=TURN, kinematics="calibrated"), table).before
    ).max() == pytest.approx(122.6, abs=0.05)


def test_a_pose_sees_three_combinations_of_five_dimensions(published):
    task, table = published
    found = fit(task, table)
    assert found.rank == 3
    assert found.singular_values[3] < 1e-12 * found.singular_values[0]
    assert np.isfinite(found.deviations["links.radius"])
    for name in ("crank", "coupler", "psi1", "psi2"):
        assert found.deviations[f"links.{name}"] == np.inf
    for name in ("psi1 + psi2", "crank sin(psi3)"):
        assert np.isfinite(found.others[name][1])
    for direction in found.directions:  # along which Jacobian and residuals stay
        start = {n: task.study.variables[n].value for n in found.values}
        moved = {n: v + 1e-7 * start[n] * direction.get(n, 0.0) for n, v in found.values.items()}
        J0, J1 = (Links(**{n.split(".")[1]: v for n, v in values.items()}).jacobian for values in (found.values, moved))
        np.testing.assert_allclose(J1, J0, rtol=1e-12)


# Synthetic measurements -----------------------------------------------------------------------------------------------


@given(
    st.floats(15e-3, 19e-3),
    st.floats(10.5e-3, 12e-3),
    st.floats(26e-3, 34e-3),
    st.floats(1.0, 1.3),
    st.floats(0.7, 0.9),
)
@settings(max_examples=15)
def test_known_links_are_found_again(crank, coupler, radius, psi1, psi2):
    links = Links(crank, coupler, radius, psi1, psi2)
    grid = 12e-6 * np.random.default_rng(5).random((6, 3))
    found = fit(stage(turn=TURN), poses(grid, rotated(links.jacobian)))
    fitted = Links(**{name.split(".")[1]: value for name, value in found.values.items()})
    np.testing.assert_allclose(combinations(fitted), combinations(links), rtol=1e-7)


def test_standard_deviations_cover_the_truth():
    """Of 80 tables with noise of 20 nm, 2 urad: errors over deviations have mean square 1, 95 % are within 2.1."""
    task, grid = (
        stage(turn=TURN, **{"links.coupler": 12e-3, "links.psi2": 0.7}),
        12e-6 * np.random.default_rng(3).random((9, 3)),
    )
    truth = {"links.radius": TRUTH.radius, "links.psi1": TRUTH.psi1, "links.crank": TRUTH.crank}
    scores = []
    for seed in range(80):
        found = fit(task, poses(grid, rotated(TRUTH.jacobian), 20e-9, seed), SEEN)
        scores.append([(found.values[name] - value) / found.deviations[name] for name, value in truth.items()])
    scores = np.array(scores)
    assert np.abs(scores.mean(axis=0)).max() < 0.35
    np.testing.assert_allclose((scores**2).mean(axis=0), 1.0, atol=0.45)
    assert 0.9 < (np.abs(scores) < 2.1).mean() < 0.985


def test_robot_geometry_from_motor_angles():
    rng, truth = np.random.default_rng(0), Mechanism(Geometry(0.46, 0.147), Transmission(0.0612, 6.1))
    rows = []
    for _ in range(8):
        position, rotation = rng.uniform([-0.02] * 2 + [0.13], [0.02] * 2 + [0.17]), rng.uniform(-8, 8, 3)
        there = Kinematics.at(Posture(tuple(rotation.tolist()), tuple(position.tolist())), truth)
        rows.append([*position, *rotation, *there.motor_angles])
    motors = [f"motor_{name}" for name in ("L1", "R1", "L2", "R2", "L3", "R3")]
    table = dict(zip(("x", "y", "z", "rz", "rx", "ry", *motors), np.array(rows).T, strict=True))
    found = fit(part("sdelta").calibration_task(), table)
    expected = {"geometry.base_radius": 0.46, "geometry.platform_radius": 0.147, "gear": 6.1, "pitch": 0.0612}
    assert found.values == pytest.approx(expected, rel=1e-9)
    assert found.rank == 4


def test_a_design_study_is_a_calibration_too():
    """Feet of the accelerometer from both frequencies: thickness and length."""
    sensor = part("tba_accelerometer")
    made = sensor.analysis(design="mems", **{"dimensions.tm": 22e-6, "dimensions.l": 290e-6})["natural_frequencies_hz"]
    table = {"f_in": np.array([made[0]]), "f_out": np.array([made[2]])}
    found = fit(sensor.calibration_task(design="mems"), table, ["tm", "l"])
    assert found.values == pytest.approx({"tm": 22e-6, "l": 290e-6}, rel=1e-6)
    assert all(np.isnan(value) for value in found.deviations.values())  # two numbers for two dimensions


def test_bounds_hold_and_are_told():
    found = fit(stage(turn=TURN), stage(turn=TURN).corners(MEASURED), bounds={"links.radius": (29e-3, 30e-3)})
    assert found.values["links.radius"] == pytest.approx(30e-3)
    assert found.at_bound["links.radius"] == "upper"


def test_the_calibrated_set_of_the_source_is_what_it_fits():
    """The one corner that the source fits, free of the rest: three numbers for three dimensions."""
    table = {name: values[-3:-2] for name, values in stage(turn=TURN).corners(MEASURED).items()}
    corner = [table[f"elongation_{i}"][0] for i in (1, 2, 3)]
    assert corner == [12e-6, 0.0, 12e-6]
    found = fit(stage(turn=TURN, kinematics="calibrated"), table, SEEN)
    assert found.values["links.radius"] == pytest.approx(CALIBRATED.radius, rel=1e-4)


# Mistakes -------------------------------------------------------------------------------------------------------------

ONE = {"elongation_1": np.array([1e-6]), "x": np.array([1e-6]), "y": np.array([0.0]), "yaw": np.array([-1e-5])}
MICRO = {name: 1e6 * values for name, values in ONE.items()}


@pytest.mark.parametrize(
    ("table", "options", "message"),
    [
        (ONE, {}, "1 row of x, y, yaw are 3 numbers for 5 free dimensions; measure more, or fit fewer"),
        ({**ONE, "z": ONE["x"]}, {}, "has no 'z'"),
        ({"elongation_1": ONE["x"]}, {}, "the table has no response of rrr_stage"),
        ({**ONE, "links.radius": ONE["x"]}, {}, "links.radius is a column of the table, and free"),
        ({**MICRO, "yaw": ONE["yaw"]}, {"free": SEEN}, "yaw is of the order of .* expected rad"),
        ({**ONE, "x": ONE["x"] * 1e6}, {"free": SEEN}, "x is of the order of 1 in the table, of .* m in the part"),
        (ONE, {"free": ["links.radiuss"]}, "no dimension 'links.radiuss'; did you mean links.radius"),
        (ONE, {"free": SEEN, "bounds": {"links.radius": (1.0, 2.0)}}, "links.radius is 0.029546 at the start"),
        (ONE, {"free": SEEN, "sizes": {"z": 1.0}}, "'z' is given a size, but is no measured response"),
        (ONE, {"free": SEEN, "sizes": {"x": 0.0}}, "the size of x is 0, expected a finite number above 0"),
    ],
    ids=[
        "few rows", "unknown column", "no response", "free and known", "all in um", "x in um", "unknown dimension",
        "bounds beside", "unknown size", "no size",
    ],
)  # fmt: skip
def test_mistakes_are_named(table, options, message):
    with pytest.raises(ModelError, match=message):
        fit(stage(), table, **options)


def test_a_jacobian_of_another_shape():
    with pytest.raises(ModelError, match=r"the Jacobian has shape \(2, 3\), expected \(3, 3\): x, y, yaw per"):
        stage().corners(MEASURED[:2])
    with pytest.raises(ModelError, match="sdelta has no Jacobian to calibrate by"):
        part("sdelta").calibration_task().corners(MEASURED)
