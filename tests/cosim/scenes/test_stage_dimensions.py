"""Scenes around a stage that nobody has published: one place for its design, tracking, gains, and who differs."""

import numpy as np
import pytest
from stage_by_hand import Linkage

from hfsa.components import ModelError
from hfsa.components._mechanics.rrr_design import Design
from hfsa.components.rrr_stage import analyze
from hfsa.cosim.assembly.agreement import conflicts, disagreements
from hfsa.cosim.assembly.build import build
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.linear.linearize import linear_response
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.systems.errors import StructureError

SLIM = Linkage(22e-3, 9e-3, 35e-3, 1.05, 0.6, 5e-3, 71e9, 8e-3, 0.5e-3, 2e-3, 0.25, 3e-5, 0.02, 2.4e-6, 0.011)
TYPED = {
    "links.crank": "22e-3", "links.coupler": "9e-3", "links.radius": "35e-3", "links.psi1": "1.05",
    "links.psi2": "0.6", "links.arm": "5e-3", "hinge.elastic_modulus": "71e9", "hinge.width": "8e-3",
    "hinge.thickness": "0.5e-3", "hinge.radius": "2e-3", "masses.platform": "0.25",
    "masses.platform_inertia": "3e-5", "masses.crank": "0.02", "masses.crank_inertia": "2.4e-6",
    "masses.coupler": "0.011",
}  # fmt: skip
"""`SLIM` as arguments of a scene."""
ERRORS = [f"tracking.axis[{i}].error" for i in (1, 2, 3)]
POSE = ["stage.platform.position[1]", "stage.platform.position[2]", "stage.platform.rotation"]
TOKIN = 833 / 16e-6, 833 / 150
"""Stiffness [N/m] and force per volt [N/V] of the stacks."""


@pytest.fixture
def ran(opened, library):
    """Run a scene with its own step; returns the signals as rows."""

    def run(name: str, seconds: float, signals: list[str], **arguments) -> np.ndarray:
        scene = load_scene(name, arguments)
        master = make_master(opened(build(scene.system).files), scene.system, "gauss_seidel", scene.step_size, library)
        steps = round(seconds / scene.step_size)
        recording = master.record(signals, rows=steps + 1)
        master.initialize()
        master.advance(steps)
        return np.array([recording[name] for name in signals])

    return run


def response(opened, name: str, frequency: float, **arguments) -> np.ndarray:
    scene = load_scene(name, arguments)
    files = opened(build(scene.system).files)
    return linear_response(scene.system, files, scene.inputs, scene.outputs, np.array([frequency]))[0]


# One design in every part ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("level", ["constant_jacobian", "exact"])
def test_the_gain_at_a_bias_is_that_of_the_linkage(opened, level):
    """J (K + k)^-1 alpha per volt; without a bias K is that of rest."""
    k, alpha = TOKIN
    gain = response(opened, "stage_bode", 1.0, stage=level, bias=0.0, **TYPED)
    expected = alpha * SLIM.jacobian @ np.linalg.inv(SLIM.stiffness + k * np.eye(3))
    np.testing.assert_allclose(gain.real, expected, rtol=1e-4, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("model", ["constant_jacobian", pytest.param("exact", marks=pytest.mark.slow)])
@pytest.mark.slow
def test_computed_torque_knows_the_design(ran, model):
    """Three axes by a fifth of a nanometre, as the stage of the source; with thinner hinges in the model by more."""
    drive = {"law": "ctc", "actuator": "force", "motion": "three_axis", "stage": model, "model": model}
    usual, known = (np.abs(ran("stage_tracking", 0.1, ERRORS, **drive, **typed)).max() for typed in ({}, TYPED))
    assert known < 2 * usual < 0.5e-9
    other = ran("stage_tracking", 0.1, ERRORS, **drive, **TYPED, **{"controller.hinge.thickness": "0.45e-3"})
    assert np.abs(other).max() > 100 * known


@pytest.mark.slow
@pytest.mark.parametrize("law", ["ctc", "pd_ff"])
def test_a_step_ends_at_its_pose(ran, law):
    """Reference, feed-forward and stage convert by the same links."""
    pose = (2e-6, 1e-6, -8e-5)
    step = {"law": law, "motion": "step", "pose": pose, "sample_time": 5e-6, "stage": "exact", "model": "exact"}
    found = ran("stage_tracking", 0.02, [*ERRORS, *POSE], **step, **TYPED)
    assert np.abs(found[:3, -1]).max() < 2e-9
    assert found[3:5, -1] == pytest.approx(pose[:2], abs=5e-9)
    assert found[5, -1] == pytest.approx(pose[2], abs=1e-7)


def test_calibrated_links_track_as_nominal_ones(ran):
    """On stacks, along a ramp, as far as the voltage goes."""
    drive = {"law": "ctc", "motion": "ramp"}
    peaks = [
        np.abs(ran("stage_tracking", 0.05, ERRORS, kinematics=links, **drive)).max()
        for links in ("nominal", "calibrated")
    ]
    assert peaks[1] == pytest.approx(peaks[0], rel=0.02)


@pytest.mark.slow
def test_given_matrices_reach_the_law(ran):
    """A stage with the stiffness and inertia of another one is tracked as that one."""
    matrices = {
        "stiffness": SLIM.stiffness.ravel().tolist(),
        "mass": SLIM.mass.ravel().tolist(),
        "jacobian": analyze(level="jacobian", design=Design("measured"))["jacobian"].ravel().tolist(),
    }
    drive = {"law": "ctc", "actuator": "force", "motion": "three_axis", **matrices}
    assert np.abs(ran("stage_tracking", 0.1, ERRORS, **drive)).max() < 0.5e-9
    alone = {**drive, "controller.mass": np.diag([1.0, 2.0, 3.0]).ravel().tolist()}
    assert np.abs(ran("stage_tracking", 0.1, ERRORS, **alone)).max() > 1e-9


# Stacks ---------------------------------------------------------------------------------------------------------------


def test_stacks_by_argument_are_stacks_by_the_scene(opened):
    """`stack.` of every part gives the gain that `pzt.` of the scene does."""
    parts = {f"{part}.stack.{name}": v for part in ("stage", "stack[1..3]") for name, v in STACK.items()}
    scene = {f"pzt.{name}": value for name, value in STACK.items()}
    by_part, by_scene = (response(opened, "stage_bode", 1.0, bias=0.0, **typed) for typed in (parts, scene))
    np.testing.assert_allclose(by_part, by_scene, rtol=1e-12)


STACK = {"blocking_force": "2000", "stroke": "20e-6"}


def test_a_stack_of_one_part_alone_is_reported():
    system = load_scene("stage_bode", {"stage.stack.blocking_force": "2000"}).system
    assert "stiffness of the stacks" in [conflict.fact.name for conflict in conflicts(system)]
    with pytest.raises((ModelError, StructureError), match="stack: blocking_force"):
        build(load_scene("stage_bode", {"stage.stack.blocking_force": "-1"}).system)


# Who differs ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ({"stage.links.crank": "20e-3"}, "links of the stage differs"),
        ({"controller.hinge.thickness": "0.7e-3"}, "hinges of the stage differs"),
        ({"stage.masses.platform": "0.2"}, "masses of the stage differs"),
        (
            {"controller.stiffness": np.diag([3e7] * 3).ravel().tolist()},
            "stiffness of the stage differs: 3e+07,0,0",
        ),
        ({"stage.mass": np.diag([2.0] * 3).ravel().tolist()}, "inertia of the stage differs: none in controller"),
    ],
    ids=["links", "hinge", "masses", "stiffness", "mass"],
)
def test_a_design_of_one_part_alone_is_reported_with_its_owner(typed, said):
    (sentence,) = disagreements("stage_tracking", typed, load_scene("stage_tracking", typed))
    owner = next(iter(typed)).partition(".")[2]
    assert sentence.startswith(said)
    assert f"-p {owner}=VALUE" in sentence


def test_pd_at_its_extremes_asks_for_a_sample_time_of_another_stage():
    with pytest.raises(StructureError, match="known for the published links and masses only; give a sample_time"):
        load_scene("stage_extremes", {"law": "pd", "masses.platform": "0.2"})
    assert load_scene("stage_extremes", {"law": "pd", "masses.platform": "0.2", "sample_time": "5e-11"})
    assert load_scene("stage_extremes", {"law": "pd", "hinge.thickness": "0.7e-3"})


def test_links_that_do_not_close_are_refused_by_a_scene():
    with pytest.raises((ModelError, StructureError), match=r"the links do not close: .*links.crank is 0.005 m"):
        build(load_scene("stage_bode", {"links.crank": "5e-3"}).system)
