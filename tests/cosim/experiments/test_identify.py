"""Identification of the SDelta's inertia from runs and sweeps, end to end, and what is said where it cannot be."""

import dataclasses
from pathlib import Path

import h5py
import numpy as np
import pytest

from hfsa.components.sdelta import analyze
from hfsa.cosim import identify, load_scene, run, sweep
from hfsa.cosim.results.inertia import Identification
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.systems.errors import StructureError

TILTED = {"posture.rotation": (10.0, 5.0, 8.0), "posture.position": (0.005, 0.003, 0.155)}
LOADED = {"payload.mass": 2.0, "payload.center": (0.01, -0.02, 0.05), "payload.inertia": (0.003, 0.002, 0.004)}
PAYLOAD = [2, 0.02, -0.04, 0.1, 0.0088, 0.0004, -0.001, 0.0072, 0.002, 0.005]
"""Its inertia parameters about S, by hand: 0.003 + 2 (0.02^2 + 0.05^2) and so on."""
SIGNALS = [
    *(f"robot.limbs.{kind}[1..3]" for kind in ("torque", "force")),
    *(f"robot.platform.{kind}acceleration[1..3]" for kind in ("angular_", "")),
]
POSE = [f"robot.platform.{kind}[1..3]" for kind in ("rotation", "position")]
QUIET = {"warn": lambda _: None}


def written(folder: Path, name: str, arguments: dict, **options) -> Path:
    """The file of a short manoeuvre."""
    return run("sdelta_manoeuvre", arguments, path=folder / name, **{"stop_time": 0.5, **QUIET, **options}).path


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("manoeuvres")


@pytest.fixture(scope="module")
def loaded(folder) -> Path:
    """Transient from rest, with an off-centre payload in a tilted posture, while the platform sags."""
    return written(folder, "loaded.h5", {**TILTED, **LOADED, "gravity": 9.81})


@pytest.fixture(scope="module")
def plain(folder) -> Path:
    """The default scene to its end."""
    return written(folder, "plain.h5", {}, stop_time=None)


@pytest.fixture(scope="module")
def swept(folder) -> Path:
    bode = sweep(
        "sdelta_shaker", {**TILTED, **LOADED}, method="linear", outputs=[*SIGNALS, *POSE], path=folder / "swept.h5"
    )
    return bode.path


def truth(arguments: dict) -> np.ndarray:
    """Inertia parameters of the platform with its payload."""
    from hfsa.cosim import available_parts

    return available_parts()["sdelta"].analysis(**arguments)["inertia_parameters_S"]


def assert_equal(found: np.ndarray, expected: np.ndarray, relative: float = 1e-12) -> None:
    np.testing.assert_allclose(found, expected, rtol=relative, atol=relative * abs(expected[0]))


def test_a_transient_run_gives_the_body_and_the_payload(loaded, tmp_path):
    whole = identify(loaded, path=tmp_path / "whole.h5")
    assert (whole.rank, whole.regressor, whole.body, whole.unseen) == (10, "linear", "robot", [])
    assert_equal(whole.value, truth({**TILTED, **LOADED}))
    assert_equal(whole.model, truth({**TILTED, **LOADED}))
    carried = identify(loaded, of="payload", path=tmp_path / "payload.h5")
    assert_equal(carried.value, np.array(PAYLOAD))
    assert_equal(carried.model, np.array(PAYLOAD))
    np.testing.assert_allclose(carried.center, LOADED["payload.center"], rtol=1e-11)
    assert any("platform alone is that of the model" in sentence for sentence in carried.sentences)


@pytest.mark.slow
def test_the_platform_alone_may_be_identified_as_well(loaded, folder, tmp_path):
    """In another posture, with or without gravity; variances add."""
    empty = written(folder, "empty.h5", {"payload.mass": 0})
    noise = {"torque_noise": 0.01, "force_noise": 0.1}
    carried = identify(loaded, of="payload", alone=empty, path=tmp_path / "payload.h5", **noise)
    assert_equal(carried.value, np.array(PAYLOAD))
    assert_equal(carried.alone, truth({"payload.mass": 0}))
    parts = [identify(file, path=tmp_path / f"{file.stem}.h5", **noise) for file in (loaded, empty)]
    np.testing.assert_allclose(carried.covariance, sum(part.covariance for part in parts))
    np.testing.assert_allclose(carried.whole - carried.alone, carried.value)


def test_a_linear_sweep_gives_the_body(swept, tmp_path):
    measured = identify(swept, path=tmp_path / "measured.h5")
    assert_equal(measured.value, truth(LOADED), 1e-10)
    assert measured.residuals.time is None
    assert np.iscomplexobj(measured.residuals.values)
    from_pose = identify(swept, motion="pose", path=tmp_path / "pose.h5")
    assert_equal(from_pose.value, truth(LOADED), 1e-10)
    low = identify(swept, low=2.0, high=10.0, path=tmp_path / "low.h5")
    assert_equal(low.value, truth(LOADED), 1e-10)
    assert (low.residuals.frequency.min() >= 2, low.residuals.frequency.max() <= 10) == (True, True)


@pytest.mark.slow
def test_an_applied_wrench_is_part_of_the_equations(folder, tmp_path):
    """The platform shaken by forces and moments on it: what the limbs exert alone would not accelerate it."""
    inputs = [f"robot.wrench.{kind}[1..3]" for kind in ("torque", "force")]
    how = {"method": "linear", "amplitude": 1.0, "low": 20.0, "points": 50}
    bode = sweep("sdelta_shaker", LOADED, inputs=inputs, outputs=SIGNALS, path=folder / "pushed.h5", **how)
    assert_equal(identify(bode.path, path=tmp_path / "it.h5").value, truth(LOADED), 1e-10)
    pushed = run(
        "sdelta_shaker",
        LOADED,
        input="robot.wrench.force[3]",
        amplitude=10.0,
        frequency=20.0,
        record=[*SIGNALS, "robot.platform.angular_velocity[1..3]"],
        stop_time=0.2,
        path=folder / "pushed_run.h5",
        **QUIET,
    )
    found = identify(pushed.path, path=tmp_path / "run.h5")
    assert found.value[0] == pytest.approx(truth(LOADED)[0], rel=1e-9)


@pytest.mark.slow
def test_a_stepped_sweep_gives_the_body(folder, tmp_path):
    """The lock-in amplifier is linear and the same for motion and wrench, so that its errors cancel."""
    bode = sweep("sdelta_shaker", LOADED, outputs=SIGNALS, points=3, low=8, high=18, path=folder / "steps.h5", **QUIET)
    assert_equal(identify(bode.path, path=tmp_path / "it.h5").value, truth(LOADED), 1e-8)


@pytest.mark.slow
def test_the_differentiated_pose_errs_by_the_fourth_power_of_the_step(plain, tmp_path):
    """At steps of 0.2 ms: the tone of 17 Hz, and the free vibration at 24 Hz."""
    found = identify(plain, motion="pose", path=tmp_path / "it.h5")
    expected = (0.2e-3 * 2 * np.pi * 17) ** 4 / 90
    assert 0.3 * expected < abs(found.value[0] / analyze()["inertia_parameters_S"][0] - 1) < 10 * expected
    assert len(found.residuals.time) == 10_001 - 4


@pytest.mark.slow
def test_the_commanded_motion_makes_a_body_that_is_too_heavy(tmp_path, folder):
    """After the free vibration has decayed: mass 69 %, moments of inertia by up to 14.5 % of Izz, with a warning."""
    long = written(folder, "long.h5", {"damping": 0.05}, stop_time=3.0)
    said: list[str] = []
    found = identify(long, motion="commanded", low=2.0, path=tmp_path / "it.h5", warn=said.append)
    true = analyze()["inertia_parameters_S"]
    assert 0.6 < found.value[0] / true[0] - 1 < 0.7
    assert 0.13 < np.abs((found.value - true)[4:]).max() / true[9] < 0.15
    assert len(said) == 1
    assert "assumed to be the commanded one" in said[0]
    assert found.force_residual > 1.0  # and the residuals show it


def test_the_smaller_residuals_choose_the_equations(plain, tmp_path):
    """The robot of the scene is linear; the full equations leave a part of a percent and err by as much."""
    chosen = identify(plain, path=tmp_path / "it.h5")
    assert chosen.regressor == "linear"
    assert any(sentence.startswith("regressor linear: residuals of full 0.9") for sentence in chosen.sentences)
    full = identify(plain, regressor="full", path=tmp_path / "full.h5")
    true = analyze()["inertia_parameters_S"]
    assert 1e-5 < np.abs(full.value - true)[4:].max() / true[9] < 1e-2


def test_data_of_a_turning_body_take_the_full_equations(plain, tmp_path):
    """Wrenches by Newton and Euler in place of the recorded ones, in the same file."""
    file = tmp_path / "turning.h5"
    file.write_bytes(plain.read_bytes())
    from hfsa.cosim.signals.rigid_body import full_regressor, turned

    true = truth(LOADED)
    with h5py.File(file, "r+") as h5:
        group = h5["time"]

        def of(name: str) -> np.ndarray:
            return np.stack([group[f"robot.platform.{name}[{i}]"][:] for i in (1, 2, 3)], axis=1)

        Q = turned(of("rotation")) + np.eye(3)
        body = [
            np.einsum("nji,nj->ni", Q, of(name))
            for name in ("acceleration", "angular_acceleration", "angular_velocity")
        ]
        wrench = full_regressor(*body) @ true
        for k, kind in enumerate(("torque", "force")):
            world = np.einsum("nij,nj->ni", Q, wrench[:, 3 * k : 3 * k + 3])
            for i in (1, 2, 3):
                group[f"robot.limbs.{kind}[{i}]"][:] = world[:, i - 1]
    found = identify(file, path=tmp_path / "it.h5")
    assert found.regressor == "full"
    assert_equal(found.value, true, 1e-12)


def test_given_and_estimated_standard_deviations(plain, tmp_path):
    """Noise on the recorded wrench: its size is found in the residuals, and both say the same of the parameters."""
    file = tmp_path / "noisy.h5"
    file.write_bytes(plain.read_bytes())
    random = np.random.default_rng(3)
    with h5py.File(file, "r+") as h5:
        for kind, size in (("torque", 0.01), ("force", 0.1)):
            for i in (1, 2, 3):
                signal = h5["time"][f"robot.limbs.{kind}[{i}]"]
                signal[:] = signal[:] + size * random.normal(size=signal.shape)
    estimated = identify(file, path=tmp_path / "estimated.h5")
    known = identify(file, torque_noise=0.01, force_noise=0.1, path=tmp_path / "known.h5")
    assert (estimated.torque_noise, estimated.force_noise) == pytest.approx((0.01, 0.1), rel=0.03)
    np.testing.assert_allclose(estimated.standard_deviation, known.standard_deviation, rtol=0.03)
    error = known.value - analyze()["inertia_parameters_S"]
    assert np.abs(error / known.standard_deviation).max() < 4.5
    assert not any("exceed" in sentence for sentence in known.sentences)
    trusting = identify(file, torque_noise=0.001, force_noise=0.1, path=tmp_path / "trusting.h5")
    assert any(sentence.startswith("the residuals of moments, 0.0") for sentence in trusting.sentences)


@pytest.mark.parametrize(
    ("moved", "unseen"),
    [
        ({"rotation": (0, 0, 0), "position": (0, 0, 1e-3)}, ["mcz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"]),
        ({"rotation": (0, 0, 0.01), "position": (0, 0, 0)}, ["m", "mcz", "Ixx", "Ixy", "Iyy"]),
    ],
    ids=["vertical", "about the vertical"],
)
@pytest.mark.slow
def test_what_a_motion_of_one_degree_of_freedom_does_not_see(moved, unseen, folder, tmp_path):
    file = written(folder, f"{len(unseen)}.h5", moved, stop_time=0.2)
    found = identify(file, regressor="linear", path=tmp_path / "it.h5")
    assert sorted(name for group in found.unseen for name in group) == sorted(unseen)
    assert found.rank == 10 - len(unseen)
    assert not found.is_complete
    seen = [i for i, name in enumerate(found.parameters) if name not in unseen]
    np.testing.assert_allclose(found.value[seen], found.model[seen], atol=1e-12)
    assert np.isnan(np.delete(found.value, seen)).all()


def test_the_file_holds_what_is_returned(loaded, tmp_path):
    found = identify(loaded, path=tmp_path / "it.h5")
    again = Identification.read(found.path)
    for field in dataclasses.fields(found):
        one, other = getattr(found, field.name), getattr(again, field.name)
        if field.name == "residuals":
            np.testing.assert_array_equal(one.values, other.values)
            np.testing.assert_array_equal(one.time, other.time)
        elif isinstance(one, np.ndarray):
            np.testing.assert_array_equal(one, other)
        else:
            assert one == other, field.name
    with h5py.File(found.path) as h5:
        assert h5.attrs["status"].startswith(b"complete")
        assert h5["identification"]["residual"].shape == (2501, 6)


@pytest.mark.parametrize("file", ["loaded", "plain", "swept"])
def test_without_noise_the_standard_deviations_are_of_rounding(file, request, tmp_path):
    """They cover the errors and are all but none."""
    found = identify(request.getfixturevalue(file), path=tmp_path / "it.h5")
    assert np.all(np.abs(found.value - found.model) < 20 * found.standard_deviation)
    assert found.standard_deviation.max() < 1e-12


def test_the_default_file_is_beside_the_manoeuvre(loaded):
    found = identify(loaded)
    assert found.path == loaded.with_name("loaded_inertia.h5")
    with pytest.raises(ResultsError, match=r"loaded_inertia\.h5 is a results file already"):
        identify(loaded)
    with pytest.raises(StructureError, match="is the file of the manoeuvre, expected another"):
        identify(loaded, path=loaded, force=True)
    with pytest.raises(ResultsError, match="holds no sweep"):
        identify(found.path, path=loaded.with_name("other.h5"))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"alone": "x.h5"}, "expected --of payload beside it"),
        ({"body": "robt"}, "has no platform of a component 'robt'; did you mean robot?"),
        ({"motion": "guessed"}, "expected one of measured, pose, commanded"),
        ({"force_noise": 0.0}, "force_noise is 0.0, expected a positive number"),
        ({"low": 0.3, "high": 0.2}, "no finished row of a run or point of a sweep from 0.3 to 0.2"),
        ({"motion": "pose", "low": 0.1, "high": 0.1004}, "has 3 rows, expected five or more"),
    ],
    ids=["alone", "body", "motion", "noise", "window", "rows"],
)
def test_wrong_options_are_named(loaded, tmp_path, options, words):
    with pytest.raises((StructureError, ResultsError), match=words.replace("?", r"\?")):
        identify(loaded, path=tmp_path / "it.h5", **options)
    assert not (tmp_path / "it.h5").exists()


@pytest.mark.parametrize("options", [{"regressor": "full"}, {"gravity": 9.81}], ids=["full", "gravity"])
def test_what_responses_do_not_have_is_refused(swept, tmp_path, options):
    with pytest.raises(StructureError, match=r"swept\.h5 is a sweep, .* takes a run$"):
        identify(swept, path=tmp_path / "it.h5", **options)


def test_missing_signals_are_named_with_what_records_them(tmp_path):
    bode = sweep("sdelta_shaker", method="linear", points=2, path=tmp_path / "s.h5")
    with pytest.raises(StructureError, match=r"--signal robot\.limbs\.torque\[1\.\.3\] --signal robot\.limbs\.force"):
        identify(bode.path)
    outputs = [*SIGNALS[:2], *POSE]
    bode = sweep("sdelta_shaker", method="linear", points=2, outputs=outputs, path=tmp_path / "p.h5")
    with pytest.raises(StructureError, match=r"lacks robot\.platform\.acc.*--motion pose differentiates a recorded"):
        identify(bode.path)
    mass = sweep("mass_on_spring", method="linear", points=2, path=tmp_path / "m.h5")
    with pytest.raises(StructureError, match="has no platform, expected signals"):
        identify(mass.path)


def test_uneven_steps_have_no_differences_but_equations(loaded, tmp_path):
    file = tmp_path / "uneven.h5"
    file.write_bytes(loaded.read_bytes())
    with h5py.File(file, "r+") as h5:
        h5["time"]["time"][7:] += 1e-4
    with pytest.raises(StructureError, match=r"steps from 0\.0002 to 0\.0003 s, expected equal ones to differentiate"):
        identify(file, motion="pose", path=tmp_path / "it.h5")
    assert_equal(identify(file, path=tmp_path / "measured.h5").value, truth(LOADED))


@pytest.mark.slow
def test_the_exact_reference_moves_the_robot_elsewhere_and_changes_no_inertia(folder, tmp_path):
    exact = written(folder, "exact.h5", {"reference": "exact", **LOADED})
    assert_equal(identify(exact, path=tmp_path / "it.h5").value, truth(LOADED))
    linear = written(folder, "linear.h5", LOADED)
    with h5py.File(exact) as one, h5py.File(linear) as other:
        motor = "reference.motor[1].angle"
        difference = np.abs(one["time"][motor][:] - other["time"][motor][:]).max()
    assert 1e-5 < difference < 1e-2


def test_the_scene_takes_amplitudes_and_frequencies_of_each_tone():
    scene = load_scene("sdelta_manoeuvre", {"position": (1e-3, 2e-3, 3e-3), "rotation_frequency": (3, 4, 5)})
    tones = [scene.system[f"tone[{i}]"].start for i in range(1, 7)]
    assert [tone["amplitude"] for tone in tones] == [0.01, 0.01, 0.01, 1e-3, 2e-3, 3e-3]
    assert [tone["frequency"] for tone in tones] == [3, 4, 5, 13, 15, 17]
