"""Mobility of beam modules: counts and types, in every frame; axes; equal freedoms; no clear separation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hfsa.components._mechanics.beam_assembly import at_point
from hfsa.components._mechanics.beam_kinds import KINDS
from hfsa.components._mechanics.beam_module import compliant_module
from hfsa.components._mechanics.mobility import Mobility, mobility

EXPECTED = {
    "three_beam": ("RTT", 150, -0.5),
    "double": ("RTT", 221, -0.5),
    "tilted": ("RRR", 145, 0.5954),
    "inverted": ("RRR", 145, -1.3025),
    "double_tilted": ("RRR", 145, 0.6),
    "double_tilted_four": ("RRR", 145, 0.6),
    "parallelogram": ("T", 30, -0.5),
    "four_sheet": ("R", 498, -0.5),
    "double_four_sheet": ("R", 331, -0.5),
    "sheet_ring": ("R", 498, -0.5),
    "double_sheet_ring": ("R", 498, -0.5),
}
"""Types, separation, x of the centre of compliance; those of double, double_four_sheet and rings are not printed."""

KIND = pytest.mark.parametrize("kind", EXPECTED)
coordinate = st.floats(-5, 5)
points = st.tuples(coordinate, coordinate, coordinate).map(np.array)
rotations = st.integers(0, 2**32 - 1).map(lambda seed: Rotation.random(rng=np.random.default_rng(seed)))
hundred = settings(max_examples=100)


def seen_from(C: np.ndarray, point: np.ndarray, rotation: Rotation) -> np.ndarray:
    """The same compliance at another point, along other axes."""
    X = at_point(point, rotation.as_matrix())
    return X @ C @ X.T


def types(found: Mobility) -> str:
    return "".join(sorted(freedom.type for freedom in found.freedoms))


def moved(x: np.ndarray, point: np.ndarray, rotation: Rotation) -> np.ndarray:
    """A point's coordinates in the other frame."""
    return rotation.apply(x - point)


def span(found: Mobility) -> np.ndarray:
    """The projector onto the displacements at the centre that the freedoms make up, shape (6, 6)."""
    columns = []
    for f in found.freedoms:
        if f.type == "T":
            columns.append([*f.direction, 0, 0, 0])
        else:
            assert f.point is not None
            slide = np.cross(f.point - found.center, f.direction) + f.pitch * f.direction
            columns.append([*slide, *f.direction])
    Q, _ = np.linalg.qr(np.transpose(columns))
    return Q @ Q.T


def test_every_kind_is_expected():
    assert list(EXPECTED) == list(KINDS)


@KIND
def test_number_types_separation_and_centre(kind):
    found = mobility(compliant_module(kind).compliance)
    expected, separation, x = EXPECTED[kind]
    assert types(found) == expected
    assert found.is_clear
    assert round(found.separation) == separation
    np.testing.assert_allclose(found.center, [x, 0, 0], atol=5e-5)


@KIND
@given(point=points, rotation=rotations)
@hundred
def test_it_is_the_same_in_every_frame_and_at_every_point(kind, point, rotation):
    C = compliant_module(kind).compliance
    here, there = mobility(C), mobility(seen_from(C, point, rotation))
    assert [f.type for f in there.freedoms] == [f.type for f in here.freedoms]
    np.testing.assert_allclose(there.eigenvalues, here.eigenvalues, rtol=1e-7)
    np.testing.assert_allclose(there.center, moved(here.center, point, rotation), atol=1e-8)
    turn = np.kron(np.eye(2), rotation.as_matrix())
    np.testing.assert_allclose(span(there), turn @ span(here) @ turn.T, atol=1e-6)
    np.testing.assert_allclose([f.pitch or 0 for f in there.freedoms], [f.pitch or 0 for f in here.freedoms], atol=1e-7)


@pytest.mark.parametrize("kind", ["three_beam", "double"])
def test_the_two_translations_are_across_and_the_rotation_is_about_the_axis(kind):
    turn, *slides = mobility(compliant_module(kind).compliance).freedoms
    assert turn.type == "R"
    np.testing.assert_allclose(turn.direction, [1, 0, 0], atol=1e-9)
    np.testing.assert_allclose(turn.point[1:], 0, atol=1e-9)
    np.testing.assert_allclose([f.direction for f in slides], np.eye(3)[1:], atol=1e-9)


@pytest.mark.parametrize("kind", ["tilted", "inverted", "double_tilted", "double_tilted_four"])
def test_three_axes_meet_in_the_centre_of_compliance(kind):
    found = mobility(compliant_module(kind).compliance)
    for freedom in found.freedoms:
        np.testing.assert_allclose(freedom.point, found.center, atol=1e-9)
    np.testing.assert_allclose([f.direction for f in found.freedoms], np.eye(3), atol=1e-9)


def compliant(screws: list[list[float]], values: list[float]) -> np.ndarray:
    """A compliance with the first screws (translation, rotation) as its freedoms at the centre."""
    stiff = 1e-5
    X, _ = np.linalg.qr(np.hstack([np.transpose(screws), np.eye(6)]))
    return X @ np.diag([*values, *[stiff] * (6 - len(values))]) @ X.T


@pytest.mark.parametrize(
    ("pitch", "kind"), [(0.0, "R"), (0.09, "R"), (0.11, "H"), (-0.5, "H"), (9.9, "H"), (10.1, "T")]
)
@given(point=points, rotation=rotations)
@settings(max_examples=10)
def test_a_freedom_is_a_rotation_a_helix_or_a_translation_by_its_pitch(pitch, kind, point, rotation):
    C = compliant([[pitch, 0, 0, 1, 0, 0]], [1.0])
    (freedom,) = mobility(seen_from(C, point, rotation)).freedoms
    assert freedom.type == kind
    np.testing.assert_allclose(np.abs(freedom.direction @ rotation.apply([1, 0, 0])), 1, atol=1e-7)
    if kind != "T":
        assert freedom.pitch == pytest.approx(pitch, abs=1e-7)
        np.testing.assert_allclose(freedom.point, moved(np.zeros(3), point, rotation), atol=1e-7)


@given(point=points, rotation=rotations)
@hundred
def test_equally_compliant_freedoms_are_told_apart(point, rotation):
    """A rotation, a helix and two translations, of which any mixture is an eigenvector."""
    screws = [[0, 0, 0, 1, 0, 0], [0, 0, 0.5, 0, 0, 1], [0, 1, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0]]
    found = mobility(seen_from(compliant(screws, [1.0] * 4), point, rotation))
    assert types(found) == "HRTT"


def test_a_joint_as_compliant_in_one_way_as_in_the_next_has_no_clear_separation():
    found = mobility(np.diag([1.0, 2, 4, 8, 16, 144]))
    assert found.separation == pytest.approx(9)
    assert not found.is_clear
    assert mobility(np.diag([1.0, 2, 4, 8, 16, 161])).is_clear
