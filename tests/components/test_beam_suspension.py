"""The parts `beam_suspension` and `rigid_body`: balance, rigid motion, other origins, together a `beam_stage`."""

import control
import numpy as np
import pytest
from parts_by_name import part

from hfsa.components import Model, ModelError
from hfsa.components._mechanics.beam_kinds import KINDS
from hfsa.components._mechanics.rigid_body import Body
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind
from hfsa.components.rigid_body import rigid_body

stage = part("beam_stage")
PART = part("beam_suspension")
analyze, beam_suspension = PART.analysis, PART.model
KIND = pytest.mark.parametrize("kind", KINDS)
OFF_CENTRE = Body(0.3, (2e-4, 1e-4, 3e-4), (0.01, -0.02, 0.03))
FROM_BASE, FROM_PLATFORM = (0.08, 0.01, -0.02), (-0.03, 0.02, 0.05)
LENGTH = 0.05


def gains(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Return wrenches on base and platform, (12,), by their poses, and by their twists, (12, 12) each."""
    D = np.array(linearize(model).D)[:12]
    return D[:, [*range(6), *range(12, 18)]], D[:, [*range(6, 12), *range(18, 24)]]


def shifted(q: np.ndarray, lever) -> np.ndarray:
    """Return the pose of a point of a body that turns by little."""
    return np.concatenate([q[:3] + np.cross(q[3:], lever), q[3:]])


def moment_about_world(wrench: np.ndarray, origin) -> np.ndarray:
    return np.concatenate([wrench[:3], wrench[3:] + np.cross(origin, wrench[:3])])


@KIND
def test_the_wrenches_are_those_of_the_stiffness_and_of_the_damping_of_the_stage(kind):
    poses, twists = gains(beam_suspension(kind=kind, platform=OFF_CENTRE))
    K = stage.analysis(kind=kind, platform=OFF_CENTRE)["stiffness"]
    system = linearize(stage.model(kind=kind, platform=OFF_CENTRE))
    M = stage.analysis(kind=kind, platform=OFF_CENTRE)["mass"]
    for found, expected in ((poses, K), (twists, -M @ system.A[6:, 6:])):
        size = np.sqrt(np.diag(expected))
        for rows, columns, sign in ((0, 0, -1), (0, 6, 1), (6, 0, 1), (6, 6, -1)):
            block = found[rows : rows + 6, columns : columns + 6]
            np.testing.assert_allclose(block / np.outer(size, size), sign * expected / np.outer(size, size), atol=1e-9)


def test_with_other_origins_wrenches_balance_and_rigid_motion_costs_nothing():
    found = gains(beam_suspension(kind="tilted", from_base=FROM_BASE, from_platform=FROM_PLATFORM))
    between = np.array(FROM_BASE) - FROM_PLATFORM  # from the base's origin to the platform's
    for matrix in found:
        for column in matrix.T:
            both = column[:6] + moment_about_world(column[6:], between)
            assert np.abs(both).max() < 1e-12 * np.abs(column).max()
        for q in np.eye(6):
            together = matrix @ np.concatenate([q, shifted(q, between)])
            assert np.abs(together).max() < 1e-12 * np.abs(matrix).max()


def test_other_origins_are_rigid_levers():
    away, here = (
        gains(beam_suspension(**arguments))[0]
        for arguments in ({"from_base": FROM_BASE, "from_platform": FROM_PLATFORM}, {})
    )
    q_base, q_platform = np.array([1, -2, 3, 4, 5, -6.0]), np.array([3, 1, -1, 2, -4, 1.0])
    q = np.concatenate([q_base, q_platform])
    w = here @ np.concatenate([shifted(q_base, FROM_BASE), shifted(q_platform, FROM_PLATFORM)])
    expected = [moment_about_world(w[:6], FROM_BASE), moment_about_world(w[6:], FROM_PLATFORM)]
    np.testing.assert_allclose(away @ q, np.concatenate(expected), rtol=1e-12)


@KIND
def test_it_is_the_stage_with_a_rigid_body(kind):
    """Joined without a step between, wrench of the beams on the body, pose and twist of the body to the beams."""
    body, beams = linearize(rigid_body(body=OFF_CENTRE)), linearize(beam_suspension(kind=kind, platform=OFF_CENTRE))
    back = control.ss([], [], [], beams.D[6:12, 12:24])
    closed = control.feedback(body[:12, :6], back, sign=1)
    expected = linearize(stage.model(kind=kind, platform=OFF_CENTRE))
    scale = np.abs(expected.A).max()
    np.testing.assert_allclose(closed.A, expected.A, atol=1e-9 * scale)
    np.testing.assert_allclose(body.B, expected.B, atol=1e-9)
    np.testing.assert_allclose(body.D[12:18], expected.D[12:18], atol=1e-9)


def test_bode_plots():
    """The sentences of the two docstrings."""
    poses, twists = gains(beam_suspension())
    assert poses[6, 6] == pytest.approx(-1.30e7, rel=1e-3)
    assert poses[9, 9] == pytest.approx(-16.5, rel=1e-3)
    assert twists[6, 6] == pytest.approx(-22.8, rel=1e-3)
    system = linearize(rigid_body())
    for column, static in ((0, -0.2533), (6, 0.02533)):
        at = [(system.C @ np.linalg.solve(2j * np.pi * f * np.eye(12) - system.A, system.B))[0] for f in (1, 10)]
        assert at[0][column] == pytest.approx(static, rel=1e-3)
        assert at[1][column] == pytest.approx(static / 100, rel=1e-3)


def test_the_analysis_is_that_of_the_stage_and_its_limits_are_two_c_by_k():
    found, expected = analyze(damping_ratio=0.02), stage.analysis()
    np.testing.assert_array_equal(found["stiffness"], expected["stiffness"])
    np.testing.assert_array_equal(found["natural_frequencies_hz"], expected["natural_frequencies_hz"])
    H = expected["shapes"]
    c, k = (np.diag(H.T @ A @ H) for A in (found["damping"], expected["stiffness"]))
    np.testing.assert_allclose(found["step_limits"], 2 * c / k, rtol=1e-9)
    assert analyze()["step_limits"].min() == pytest.approx(2.48e-6, rel=2e-3)
    assert analyze(damping_ratio=0.0)["step_limits"].max() == 0


@pytest.mark.parametrize(
    ("ends", "value", "expected", "warned"),
    [(["platform"], 4e-3, 0.08, 0), (["base"], 6e-3, 0.12, 1), (["base", "platform"], 6e-3, 0.0, 0)],
)
def test_a_displacement_above_a_tenth_is_warned_of(ends, value, expected, warned):
    model = beam_suspension()
    moved = [f"{end}.position[2]" for end in ends]
    u = [value if q.name in moved else 0.0 for q in model.of(Kind.INPUT)]
    found = np.array(functions(model).out(0.0, [], [], u, [0.01])).ravel()
    outputs = dict(zip([q.name for q in model.of(Kind.OUTPUT)], found, strict=True))
    assert outputs["displacement"] == pytest.approx(expected)
    assert outputs["displacement_warning"] == warned


def test_a_turned_base_displaces_what_is_far_from_it():
    model = beam_suspension(from_base=(0.0, 0.2, 0.0))
    u = [0.01 if q.name == "base.rotation[3]" else 0.0 for q in model.of(Kind.INPUT)]
    found = np.array(functions(model).out(0.0, [], [], u, [0.01])).ravel()
    assert found[-2] == pytest.approx(0.2 * 0.01 / LENGTH)


@pytest.mark.parametrize(
    ("name", "arguments", "message"),
    [
        ("beam_suspension", {"dimensions.length": 0}, "dimensions.length is 0 m, expected above 0"),
        ("beam_suspension", {"dimensions.diameter": 0.01}, "slenderness d .* is 400, expected at least 1200"),
        ("beam_suspension", {"kind": "inverted", "tilt": 0}, "tilt is 0 degrees, expected above 0"),
        ("beam_suspension", {"kind": "sheet"}, "beam_suspension: kind is 'sheet', expected one of three_beam"),
        ("beam_suspension", {"platform.mass": -1}, "beam_suspension: platform has mass -1 kg"),
        ("beam_suspension", {"from_base": "0,nan,0"}, "from_base is .*expected three finite numbers"),
        ("rigid_body", {"body.inertia": "0,1,1"}, "rigid_body: body has .*mass and inertia above 0"),
        ("rigid_body", {"body.center": "inf,0,0"}, "expected finite numbers"),
    ],
)
def test_mistakes_are_named(name, arguments, message):
    with pytest.raises(ModelError, match=message):
        part(name).model(**arguments)


def test_an_analysis_with_negative_damping_is_refused():
    with pytest.raises(ModelError, match=r"damping_ratio is -0\.1, expected 0 or more"):
        PART.analysis(damping_ratio=-0.1)
