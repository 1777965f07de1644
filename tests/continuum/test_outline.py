"""Outline of a third of the stage: its key points, its area in closed form, and the dimensions that cannot be built."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hfsa.components import ModelError
from hfsa.components._continuum.boundary import Boundary, Edge, check_simple, circle, line, starts
from hfsa.components._continuum.outline import NECKS, centers, pad, third
from hfsa.components._mechanics.rrr_hinge import Hinge
from hfsa.components._mechanics.rrr_kinematics import CALIBRATED, NOMINAL
from hfsa.components._mechanics.rrr_outline import Outline

MM = 1e-3


def area(boundary: Boundary) -> float:
    """Area by Green's theorem, the integral of (x dy - y dx) / 2, exact along arcs; holes are subtracted."""
    outer, *holes = (abs(sum(swept(start, edge) for start, edge in starts(loop))) for loop in boundary.loops)
    return outer - sum(holes)


def swept(start, edge: Edge) -> float:
    (x0, y0), (x1, y1) = start, edge.end
    if edge.center is None:
        return (x0 * y1 - x1 * y0) / 2
    cx, cy = edge.center
    turned = np.angle(complex(x1 - cx, y1 - cy) / complex(x0 - cx, y0 - cy))
    return ((x0 - cx) ** 2 + (y0 - cy) ** 2) * turned / 2 + (cx * (y1 - y0) - cy * (x1 - x0)) / 2


def test_the_source_has_round_coordinates():
    at = centers(NOMINAL, Hinge(), Outline())
    for found, expected in ((at.A, (10, -28)), (at.B, (27, -23)), (at.C, (27, -12)), (at.D, (13.5, -23))):
        np.testing.assert_allclose(np.array(found) / MM, expected, atol=2e-3)
    np.testing.assert_allclose(np.array(at.bolt) / MM, (27, -6), atol=2e-3)
    np.testing.assert_allclose(np.array(pad(NOMINAL, Hinge(), Outline())) / MM, (13.5, -20), atol=2e-3)


def test_the_area_and_the_mass_are_those_of_the_source():
    found = 3 * area(third(NOMINAL, Hinge(), Outline()))
    assert found == pytest.approx(2595.3 * MM**2, rel=1e-5)
    assert found * 10 * MM * 8250 == pytest.approx(0.214112, rel=5e-6)


def test_the_couplers_have_the_printed_mass():
    """Rho b [(L_BC - 2 r) h + 2 a], a = r (t + 2 r) - pi r^2 / 2 of a neck, is .7628e-2 kg for h = 10 mm."""
    neck = 1.0 * (0.8 + 2.0) - math.pi / 2
    assert 8250 * 10e-9 * ((11 - 2) * Outline().coupler_width / MM + 2 * neck) == pytest.approx(0.7628e-2, rel=1e-4)


def test_every_edge_is_counted_once():
    """46 of the outline, of which two are cuts, and the arcs of three kinds of holes."""
    boundary = third(NOMINAL, Hinge(), Outline())
    labels = [edge.label for edge in boundary.outer]
    assert len(labels) == 46 - 2 + 4 + 4 + 1
    assert {label: labels.count(label) for label in ("contact", "cut", "turned cut", "fixed")} == {
        "contact": 1,
        "cut": 2,
        "turned cut": 2,
        "fixed": 4,
    }
    assert {label: labels.count(label) for label in NECKS} == dict.fromkeys(NECKS, 4)


@settings(max_examples=20)
@given(st.floats(0.1, 1.2), st.floats(0.6, 1.3), st.floats(3.2, 4.5))
def test_a_thicker_neck_adds_the_area_of_its_notches(thickness, radius, arm):
    """Half of the change over 2 r at each of the eight notches, and a triangle where the flank above A is aslant."""
    hinge, links = Hinge(thickness=thickness * MM, radius=radius * MM), replace(NOMINAL, arm=arm * MM)
    more = replace(hinge, thickness=1.05 * hinge.thickness)
    gained = area(third(links, more, Outline())) - area(third(links, hinge, Outline()))
    change = more.thickness - hinge.thickness
    aslant = links.arm - Outline().pad_width / 2 - hinge.radius
    assert gained == pytest.approx(8 * hinge.radius * change + aslant * change / 4, rel=1e-6)


@pytest.mark.parametrize(
    ("links", "hinge", "outline", "words"),
    [
        (CALIBRATED, Hinge(), Outline(), "outline.slot_face is 1 mm, expected more than 15.339 mm, the top of the end"),
        (NOMINAL, Hinge(), Outline(coupler_width=2.7e-3), "outline.coupler_width is 2.7 mm, expected more than 2.8 mm"),
        (replace(NOMINAL, coupler=2e-3), Hinge(), Outline(), "links.coupler is 2 mm, expected more than 2 mm"),
        (NOMINAL, Hinge(), Outline(slot_face=-2e-3), "outline.slot_face is -2 mm, expected more than -0.99"),
        (NOMINAL, Hinge(), Outline(foot=1.3e-3), "outline.foot is 1.3 mm, expected more than 1.4 mm"),
        (replace(NOMINAL, arm=15e-3), Hinge(), Outline(), "the x' of the left notch of neck B is 25.6"),
        (NOMINAL, Hinge(), Outline(bolt_hole=5e-3), "the end block about its bolt is 5 mm, expected more than 5 mm"),
        (NOMINAL, Hinge(), Outline(fixed_distance=30e-3), "outline.outer_radius is 32 mm, expected more than 32.5 mm"),
        (replace(NOMINAL, arm=1.5e-3), Hinge(), Outline(), "the outline of the stage crosses itself near x' = "),
    ],
    ids=["calibrated", "coupler", "short", "face", "foot", "arm", "bolt", "fixed", "crossing"],
)
def test_a_shape_that_cannot_be_built_is_refused_with_the_dimension(links, hinge, outline, words):
    with pytest.raises(ModelError) as refusal:
        third(links, hinge, outline)
    assert words in str(refusal.value)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"block_left": 0.0}, "outline.block_left is 0, expected a finite number above 0"),
        ({"density": math.nan}, "outline.density is nan, expected a finite number above 0"),
        ({"poisson": 0.5}, "outline.poisson is 0.5, expected a number from 0 to below 0.5"),
        ({"plane": "shell"}, "outline.plane is 'shell', expected stress or strain"),
    ],
    ids=["length", "density", "poisson", "plane"],
)
def test_an_inadmissible_number_is_refused(fields, words):
    with pytest.raises(ModelError, match=words):
        Outline(**fields)


def test_crossing_and_touching_edges_are_found():
    square = line((1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0))
    check_simple(Boundary(square, (circle((0.5, 0.5), 0.4, ""),)), "a plate")
    with pytest.raises(ModelError, match="a plate crosses itself"):
        check_simple(Boundary(line((1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (0.0, 0.0))), "a plate")
    with pytest.raises(ModelError, match="a plate crosses itself"):
        check_simple(Boundary(square, (circle((0.5, 0.5), 0.5, ""),)), "a plate")
