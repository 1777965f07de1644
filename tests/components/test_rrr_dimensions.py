"""Stages that nobody has published: links, hinges and masses against arithmetic of one's own, laws of similarity."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from parts_by_name import part
from stage_by_hand import Linkage, frequencies

from hfsa.components import ModelError
from hfsa.components._mechanics.pzt import Stack
from hfsa.components._mechanics.rrr_hinge import Hinge
from hfsa.components._mechanics.rrr_kinematics import LinkChanges
from hfsa.components._mechanics.rrr_masses import Masses
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind

analyze, rrr_stage = part("rrr_stage").analysis, part("rrr_stage").model
analyze_reference, analyze_loop = part("stage_reference").analysis, part("stage_closed_loop").analysis
stage_feed_forward = part("stage_feed_forward").model

DESIGNS = {
    "slim": Linkage(
        22e-3, 9e-3, 35e-3, 1.05, 0.6, 5e-3, 71e9, 8e-3, 0.5e-3, 2e-3, 0.25, 3e-5, 0.02, 2.4e-6, 0.011
    ),
    "stout": Linkage(
        12e-3, 14e-3, 21e-3, 0.9, 0.7, 2.5e-3, 205e9, 12e-3, 0.9e-3, 1.2e-3, 0.08, 5e-6, 0.03, 9e-7, 0.02
    ),
}  # fmt: skip
DESIGN = pytest.mark.parametrize("name", DESIGNS)
LEVEL = pytest.mark.parametrize("level", ["constant_jacobian", "exact"])
MOVE = (7e-6, 2e-6, 10e-6)


def arguments(linkage: Linkage) -> dict[str, Any]:
    """Return a linkage as arguments of the stage."""
    return {
        "links": LinkChanges(linkage.L_AB, linkage.L_BC, linkage.R, linkage.psi1, linkage.psi2, linkage.R0),
        "hinge": Hinge(linkage.E, linkage.b, linkage.t, linkage.r),
        "masses": Masses(linkage.M_e, linkage.I_e, linkage.M_ab, linkage.I_ab, linkage.M_bc),
    }


def rows(matrix: np.ndarray) -> tuple[float, ...]:
    """Return a matrix row by row."""
    return tuple(matrix.ravel().tolist())


# Against arithmetic ---------------------------------------------------------------------------------------------------


@DESIGN
@LEVEL
def test_rest_is_that_of_the_linkage(name, level):
    linkage = DESIGNS[name]
    found = analyze(level=level, **arguments(linkage))
    np.testing.assert_allclose(found["jacobian"], linkage.jacobian, rtol=1e-6)
    np.testing.assert_allclose(found["stiffness"], linkage.stiffness, rtol=1e-6)
    np.testing.assert_allclose(found["inertia"], linkage.mass, rtol=1e-6)
    np.testing.assert_allclose(found["natural_frequencies_hz"], frequencies(linkage.mass, linkage.stiffness), rtol=1e-6)
    assert found["hinge_stiffness"] == pytest.approx(linkage.K_b, rel=1e-12)


@DESIGN
def test_a_moved_stage_is_that_of_the_linkage(name):
    linkage = DESIGNS[name]
    found = analyze(level="exact", elongation=MOVE, **arguments(linkage))
    pose = linkage.pose(np.array(MOVE))
    np.testing.assert_allclose(found["pose"], pose, rtol=1e-8)
    np.testing.assert_allclose(list(found["hinge_angle"].values()), linkage.hinges(pose), rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(found["force"], linkage.force(np.array(MOVE)), rtol=1e-6)
    stress = 6 * linkage.K_b * np.abs(linkage.hinges(pose)) / (linkage.b * linkage.t**2)
    np.testing.assert_allclose(list(found["hinge_stress"].values()), stress, rtol=1e-7)


@DESIGN
def test_the_fmu_moves_as_the_linkage(name):
    """Accelerations at rest under forces and a wrench: M l'' = F + J^T w."""
    linkage = DESIGNS[name]
    model = rrr_stage(causality="force", **arguments(linkage))
    names = [quantity.name for quantity in model.of(Kind.INPUT)]
    given = {f"stack[{i}].force": f for i, f in zip((1, 2, 3), (3.0, -1.0, 2.0), strict=True)}
    given |= {"wrench.force[1]": 0.5, "wrench.force[2]": -0.25, "wrench.torque": 0.01}
    u = [given.get(name, 0.0) for name in names]
    parameters = [quantity.start for quantity in model.of(Kind.PARAMETER)]
    rate = np.array(functions(model).rhs(0, [0.0] * 6, [], u, parameters)).ravel()
    force = np.array([3.0, -1.0, 2.0]) + linkage.jacobian.T @ [0.5, -0.25, 0.01]
    np.testing.assert_allclose(rate[3:], np.linalg.solve(linkage.mass, force), rtol=1e-6)


@DESIGN
def test_computed_torque_of_the_loop_takes_the_design(name):
    """The first force on a ramp is M Kv v, whatever the design."""
    linkage = DESIGNS[name]
    gains = {"law": "ctc", "proportional_gain": 1e6, "derivative_gain": 2e3}
    found = analyze_loop(**gains, elongation=(1e-6,) * 3, **arguments(linkage))
    np.testing.assert_allclose(found["start_force"], linkage.mass @ np.full(3, 2e3 * 3e-6), rtol=1e-6)


@DESIGN
def test_feed_forward_holds_the_linkage(name):
    linkage, stack = DESIGNS[name], Stack(blocking_force=2000.0)
    model = stage_feed_forward(model="exact", stack=stack, **arguments(linkage))
    parameters = [quantity.start for quantity in model.of(Kind.PARAMETER)]
    found = np.array(functions(model).out(0, [], [], list(MOVE), parameters)).ravel()
    force = linkage.force(np.array(MOVE))
    np.testing.assert_allclose(found[:3], force, rtol=1e-6)
    np.testing.assert_allclose(found[3:], (force + 2000 / 16e-6 * np.array(MOVE)) / (2000 / 150), rtol=1e-6)


@DESIGN
def test_the_reference_of_a_pose_is_that_of_the_linkage(name):
    linkage = DESIGNS[name]
    pose = tuple(linkage.pose(np.array(MOVE)).tolist())
    links = arguments(linkage)["links"]
    np.testing.assert_allclose(analyze_reference(pose=pose, links=links)["elongation"], MOVE, rtol=1e-7)
    given = analyze_reference(pose=pose, jacobian=rows(linkage.jacobian))["elongation"]
    np.testing.assert_allclose(linkage.jacobian @ given, pose, rtol=1e-12)


def test_a_pose_and_its_elongations_are_each_others():
    linkage = DESIGNS["slim"]
    pose = tuple(linkage.pose(np.array(MOVE)).tolist())
    found = analyze(level="exact", pose=pose, **arguments(linkage))
    np.testing.assert_allclose(found["elongation"], MOVE, rtol=1e-7)
    for level in ("jacobian", "constant_jacobian"):
        found = analyze(level=level, pose=pose, **arguments(linkage))
        np.testing.assert_allclose(found["elongation"], np.linalg.solve(linkage.jacobian, pose), rtol=1e-6)


# Similarity -----------------------------------------------------------------------------------------------------------


@LEVEL
def test_a_stage_twice_as_large_of_the_same_material(level):
    """Of lengths s: J of shifts 1, of the yaw 1 / s, K and M as s and s^3, frequencies 1 / s, angles and stress 1."""
    one = DESIGNS["slim"]
    lengths = {name: 2 * getattr(one, name) for name in ("L_AB", "L_BC", "R", "R0", "b", "t", "r")}
    masses = {
        "M_e": 8 * one.M_e,
        "M_ab": 8 * one.M_ab,
        "M_bc": 8 * one.M_bc,
        "I_e": 32 * one.I_e,
        "I_ab": 32 * one.I_ab,
    }
    large = replace(one, **lengths, **masses)
    small = analyze(level=level, elongation=MOVE, **arguments(one))
    found = analyze(level=level, elongation=tuple(2 * x for x in MOVE), **arguments(large))
    np.testing.assert_allclose(found["jacobian"], small["jacobian"] / [[1], [1], [2]], rtol=1e-9)
    np.testing.assert_allclose(found["pose"], small["pose"] * [2, 2, 1], rtol=1e-9)
    np.testing.assert_allclose(found["stiffness"], 2 * small["stiffness"], rtol=1e-9)
    np.testing.assert_allclose(found["inertia"], 8 * small["inertia"], rtol=1e-9)
    np.testing.assert_allclose(found["natural_frequencies_hz"], small["natural_frequencies_hz"] / 2, rtol=1e-9)
    np.testing.assert_allclose(found["force"], 4 * small["force"], rtol=1e-9)
    for key in ("hinge_angle", "hinge_stress"):
        np.testing.assert_allclose(list(found[key].values()), list(small[key].values()), rtol=1e-9)


def test_stiffness_follows_the_hinge():
    """K of hinges as E b t^2.5 / r^0.5, stress of an angle as E t^0.5 / r^0.5."""
    usual, other = analyze(elongation=MOVE), analyze(elongation=MOVE, hinge=Hinge(202e9, 5e-3, 0.4e-3, 4e-3))
    np.testing.assert_allclose(other["stiffness"], usual["stiffness"] * 0.5**2.5 / 2, rtol=1e-12)
    assert other["hinge_stress"]["A3"] == pytest.approx(usual["hinge_stress"]["A3"] * 2 * 0.5**0.5 / 2, rel=1e-12)


def test_an_inertia_that_is_not_given_follows_its_mass():
    assert Masses(platform=0.2646).platform_inertia == pytest.approx(2 * 9.622e-6, rel=1e-12)
    assert Masses(crank=0.01416 / 4).crank_inertia == pytest.approx(1.483e-6 / 4, rel=1e-12)
    assert Masses() == Masses(0.1323, 9.622e-6, 0.01416, 1.483e-6, 7.628e-3)


# Hinges ---------------------------------------------------------------------------------------------------------------


def test_the_allowable_angle_is_where_the_allowable_stress_is():
    found = analyze(elongation=(12e-6, 12e-6, 0.0))
    assert found["allowed_stress"] == pytest.approx(350e6 / 1.5)
    assert max(found["hinge_stress"].values()) == pytest.approx(368.6e6, rel=5e-3)
    worst = max(found["hinge_angle"], key=lambda name: abs(found["hinge_angle"][name]))
    share = abs(found["hinge_angle"][worst]) / found["allowed_angle"]
    assert f"hinge {worst} bends most" in found["hinge_limit"]
    assert f"beyond it from elongations of {12 / share:.4g}, {12 / share:.4g}, 0 um on" in found["hinge_limit"]
    within = analyze(elongation=tuple(np.array([12e-6, 12e-6, 0.0]) / share * 0.999))
    assert "beyond" not in within["hinge_limit"]
    assert max(within["hinge_stress"].values()) == pytest.approx(350e6 / 1.5, rel=3e-3)


def test_the_smallest_steps_are_the_sources():
    step = analyze()["step"]
    assert [f"{step[0] * 1e9:.1f}", f"{step[1] * 1e9:.1f}", f"{step[2] * 1e6:.1f}"] == ["13.2", "3.4", "0.6"]
    assert analyze(level="jacobian", resolution=5e-9)["step"] == pytest.approx(step / 2, rel=1e-12)
    decoupled = analyze(level="jacobian", jacobian=rows(np.diag([2.0, 3.0, 50.0])))["step"]
    assert decoupled == pytest.approx([20e-9, 30e-9, 500e-9], rel=1e-12)


# Matrices in place of the parts ---------------------------------------------------------------------------------------


@LEVEL
def test_given_matrices_are_those_of_the_stage(level):
    one, other = DESIGNS["slim"], DESIGNS["stout"]
    given = {"stiffness": rows(other.stiffness), "mass": rows(other.mass)}
    found = analyze(level=level, **arguments(one), **given)
    np.testing.assert_allclose(found["stiffness"], other.stiffness, rtol=1e-9)
    np.testing.assert_allclose(found["inertia"], other.mass, rtol=1e-9)
    np.testing.assert_allclose(found["jacobian"], one.jacobian, rtol=1e-6)
    np.testing.assert_allclose(found["natural_frequencies_hz"], frequencies(other.mass, other.stiffness), rtol=1e-9)


@LEVEL
def test_a_stages_own_matrices_change_nothing(level):
    own = analyze(level=level)
    given = {"stiffness": rows(own["stiffness"]), "mass": rows(own["inertia"])}
    if level == "constant_jacobian":
        given["jacobian"] = rows(own["jacobian"])
    usual, found = (analyze(level=level, elongation=MOVE, **matrices) for matrices in ({}, given))
    for key in ("pose", "inertia", "stiffness", "force", "natural_frequencies_bonded_hz"):
        np.testing.assert_allclose(found[key], usual[key], rtol=1e-9)


def test_a_given_stiffness_adds_a_linear_force():
    """H(l) + (K - K0) l, at any elongation."""
    usual, more = analyze(elongation=MOVE), np.diag([1e6, 2e6, 3e6]) + 5e5
    found = analyze(elongation=MOVE, stiffness=rows(analyze()["stiffness"] + more))
    np.testing.assert_allclose(found["force"], usual["force"] + more @ MOVE, rtol=1e-9)


def test_the_measured_jacobian_at_a_dynamic_level():
    """Half the motion of the platform, so that a mass of it has a quarter of the inertia."""
    measured = analyze(level="jacobian", kinematics="measured")["jacobian"]
    found = analyze(jacobian=rows(measured), elongation=MOVE)
    np.testing.assert_allclose(found["jacobian"], measured, rtol=1e-12)
    np.testing.assert_allclose(found["pose"], measured @ MOVE, rtol=1e-12)
    heavy = analyze(jacobian=rows(measured), masses=Masses(platform=1.1323, platform_inertia=9.622e-6))
    added = heavy["inertia"] - analyze(jacobian=rows(measured))["inertia"]
    np.testing.assert_allclose(added, measured[:2].T @ measured[:2], rtol=1e-9)


def test_the_stack_gives_the_defaults_of_the_fmu():
    model = rrr_stage(stack=Stack(blocking_force=2000.0, damping=7.0))
    starts = {quantity.name: quantity.start for quantity in model.of(Kind.PARAMETER)}
    assert starts["stack.stiffness"] == pytest.approx(2000 / 16e-6)
    assert starts["stack.damping"] == 7.0
    assert starts["stack.tip_mass"] == pytest.approx(1.283e-3 * 2000 / 833, rel=1e-3)


# Mistakes -------------------------------------------------------------------------------------------------------------

EYE = rows(np.eye(3))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (lambda: {"links": LinkChanges(crank=0.0)}, "links.crank is 0 m, expected a finite length above 0"),
        (lambda: {"links": LinkChanges(psi2=3.2)}, r"links.psi2 is 3.2 rad, the angle at C, expected between 0 and pi"),
        (lambda: {"links": LinkChanges(coupler=30e-3)}, "do not close: a coupler of 0.03 m .*links.crank is 0.01772 m"),
        (lambda: {"links": LinkChanges(psi1=np.pi - 0.81569)}, "links are singular at rest"),
        (lambda: {"hinge": Hinge(thickness=-1e-3)}, "hinge.thickness is -0.001, expected a finite number above 0"),
        (lambda: {"hinge": Hinge(safety_factor=0.5)}, "hinge.safety_factor is 0.5, expected 1 or more"),
        (lambda: {"masses": Masses(platform=0.0)}, "masses.platform is 0, expected a finite number, above 0"),
        (lambda: {"masses": Masses(coupler=-1.0)}, "masses.coupler is -1, expected a finite number, 0 or more"),
        (lambda: {"jacobian": rows(np.ones((3, 3)))}, "jacobian is .* which is singular"),
        (lambda: {"stiffness": rows(np.arange(9.0).reshape(3, 3))}, "stiffness is .* expected a symmetric matrix"),
        (lambda: {"mass": rows(np.diag([1.0, -2.0, 3.0]))}, "mass has the eigenvalue -2 kg, expected all above 0"),
        (lambda: {"jacobian": EYE, "level": "exact"}, "a jacobian is given, but at level exact"),
        (
            lambda: {"kinematics": "measured", "level": "jacobian", "links": LinkChanges(radius=0.03)},
            "links.radius is given, but kinematics 'measured' is a Jacobian",
        ),
        (lambda: {"pose": (1e-6, 0.0, 0.0), "elongation": (1e-6, 0.0, 0.0)}, "elongation and pose are given"),
        (lambda: {"pose": (1e-2, 0.0, 0.0), "level": "exact"}, "rrr_stage: pose 0.01 m, 0 m, 0 rad is out of"),
        (lambda: {"resolution": 0.0}, "resolution is 0 m"),
    ],
    ids=[
        "no length", "no triangle", "coupler too long", "couplers through the centre", "negative thickness", "safety",
        "no mass", "negative mass", "singular Jacobian", "asymmetric", "indefinite", "Jacobian at exact",
        "measured links", "pose and elongation", "far pose", "no resolution",
    ],
)  # fmt: skip
def test_mistakes_are_named(given, message):
    with pytest.raises(ModelError, match=message):
        analyze(**given())


# Parameters of the FMU ------------------------------------------------------------------------------------------------


@LEVEL
@pytest.mark.parametrize(
    "matrices",
    [{}, {"stiffness": rows(4e7 * np.eye(3) - 1e6), "mass": rows(2.0 * np.eye(3))}],
    ids=["of links", "given"],
)
def test_tuned_hinges_and_masses_are_those_of_another_design(level, matrices):
    """At rest and moved; what a given matrix adds stays that to the design's own."""
    hinge = Hinge(thickness=0.7e-3)
    masses = {"platform": 0.2, "platform_inertia": 2e-5, "crank": 0.02, "crank_inertia": 3e-6, "coupler": 0.01}
    tuned = rrr_stage(level=level, **matrices)
    tuned.set_start("hinge.stiffness", hinge.stiffness)
    for name, value in masses.items():
        tuned.set_start(f"masses.{name}", value)
    own, other = analyze(level=level), analyze(level=level, hinge=hinge, masses=Masses(**masses))
    keys = {"stiffness": "stiffness", "mass": "inertia"}
    expected = {n: rows(other[keys[n]] + np.array(g).reshape(3, 3) - own[keys[n]]) for n, g in matrices.items()}
    made = rrr_stage(level=level, hinge=hinge, masses=Masses(**masses), **expected)
    one, two = linearize(tuned), linearize(made)
    for name in "ABCD":
        a, b = getattr(one, name), getattr(two, name)
        np.testing.assert_allclose(a, b, rtol=1e-7, atol=1e-9 * max(np.abs(b).max(), 1e-300))


def test_stress_follows_the_tuned_hinge():
    model, moved = rrr_stage(), np.array([5e-6, 2e-6, 0, 0, 0, 0])
    parameters = {quantity.name: quantity.start for quantity in model.of(Kind.PARAMETER)}
    outputs = [quantity.name for quantity in model.of(Kind.OUTPUT)]
    inputs = [quantity.start for quantity in model.of(Kind.INPUT)]
    found = [
        np.array(functions(model).out(0, moved, [], inputs, [*values.values()])).ravel()[outputs.index("hinge.stress")]
        for values in (parameters, parameters | {"hinge.stiffness": 2 * parameters["hinge.stiffness"]})
    ]
    assert found[1] == pytest.approx(2 * found[0], rel=1e-12)
