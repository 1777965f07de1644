"""Pictures of a stage on beams: modes are those of `analyze`, and in a run beams follow the platform they carry."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hfsa.components._mechanics.beam_spring import SpringDesign
from hfsa.components._mechanics.rigid_body import Body
from hfsa.components._mechanics.screws import skew
from hfsa.components.beam_stage import analyze, moving, picture

HEAVY = Body(0.4, (1e-4, 3e-4, 2e-4), (0.02, -0.01, 0.015))
KINDS = ["three_beam", "double", "four_sheet"]


@pytest.mark.parametrize("platform", [Body(), HEAVY], ids=["disc", "eccentric"])
@pytest.mark.parametrize("kind", KINDS)
def test_modes_have_the_frequencies_of_analyze(kind, platform):
    design = SpringDesign(kind)
    found = analyze(module=design, platform=platform)["natural_frequencies_hz"]
    titles = [panel.title for panel in picture(module=design, platform=platform).panels[1:]]
    assert [title.partition(",")[0] for title in titles] == [f"mode {i}: {f:.4g} Hz" for i, f in enumerate(found, 1)]


def test_the_platform_of_a_mode_moves_as_a_rigid_body_along_its_shape():
    """Displacements of three points of the platform give back the screw, which is the shape of `analyze`."""
    shapes = analyze(platform=HEAVY)["shapes"]
    for shape, panel in zip(shapes.T, picture(platform=HEAVY).panels[1:], strict=True):
        (hull,) = [layer for layer in panel.layers if layer.role == "moved" and len(layer.points) == 3]
        matrix = np.vstack([np.hstack([np.eye(3), -skew(point)]) for point in hull.rest])
        screw, *_ = np.linalg.lstsq(matrix, (hull.points - hull.rest).ravel(), rcond=None)
        np.testing.assert_allclose(matrix @ screw, (hull.points - hull.rest).ravel(), atol=1e-12)
        np.testing.assert_allclose(screw / screw[np.argmax(np.abs(shape))], shape, atol=1e-8)


@settings(max_examples=15)
@given(st.lists(st.floats(-1e-4, 1e-4), min_size=6, max_size=6), st.sampled_from(KINDS))
def test_in_a_run_beams_are_clamped_to_base_and_platform(pose, kind):
    it = moving(module=SpringDesign(kind))
    found = it.displacements({name: np.array([0.0, value]) for name, value in zip(it.signals, pose, strict=True)})
    moved = {}
    for layer, shift in zip(it.panel.layers, found, strict=True):
        if shift is None:
            continue
        assert not shift[0].any()
        moved |= {layer.name or "sheets": (layer.points, shift[1])}
    points, shifts = moved["platform"]
    rigid = np.array(pose[:3]) + np.cross(pose[3:], points)
    np.testing.assert_allclose(shifts, rigid, atol=1e-12)
    along, shift = moved["beams"]
    middle = (along[:17] + along[17:34]) / 2  # of the first beam, whose end the platform holds
    assert np.linalg.norm(points - middle[-1], axis=1).min() < 1e-12
    tip = (shift[16] + shift[33]) / 2
    np.testing.assert_allclose(tip, np.array(pose[:3]) + np.cross(pose[3:], middle[-1]), atol=1e-12)
