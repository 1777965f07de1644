"""Outline of a third of the 3-RRR stage, cut from one plate: body, slot, lever, coupler, end block, four necks.

The frame is that of leg 2: x' along the contact edge of its stack, which pushes along -y'; O is the centre of the
platform. The corner C is at R (sin psi, cos psi), B below C, A beside B; the hinge D of the stack is on the lever, at
the arm R0 beside A. Notches of radius r on both sides make the necks, of thickness t. The body is fixed at holes on the
cuts, and the platform is bolted to the end block. The piece is the union of the third and its copies turned by 120
degrees.

Source: appendix of the thesis of 2000 on the 3-RRR stage, its finite element model. Derived: width of the couplers,
from their printed mass. Assumed: corners of the end blocks, without effect on statics, with one on frequencies.
"""

import math
from dataclasses import dataclass, fields

from hfsa.components._continuum.boundary import Boundary, Edge, Point, arcs, check_simple, circle, line
from hfsa.components._mechanics.rrr_hinge import Hinge
from hfsa.components._mechanics.rrr_kinematics import Links
from hfsa.components._mechanics.rrr_outline import Outline
from hfsa.components._modelling.errors import ModelError

_LARGEST = 10.0
"""Largest dimension of the plate, by the radius of the links: beyond, a mesh of small necks has no end."""

NECKS = ("A", "B", "C", "D")
"""The necks of a third, which are the labels of their notches; D is between the stack and the lever."""

_RIGHT, _UP, _LEFT, _DOWN = 0.0, math.pi / 2, math.pi, -math.pi / 2
_CUTS = (-math.pi / 2, math.pi / 6)
"""Polar angles of the two cuts; the first one turned by 120 degrees is the second."""


@dataclass(frozen=True)
class Centers:
    """Centres of the necks and of the bolt in the frame of the leg [m]."""

    A: Point
    B: Point
    C: Point
    D: Point
    bolt: Point


def centers(links: Links, hinge: Hinge, outline: Outline) -> Centers:
    """Return the centres of the necks and of the bolt."""
    r, beta = hinge.radius, math.pi - float(links.psi3)
    C = (links.radius * math.sin(links.psi), links.radius * math.cos(links.psi))
    B = (C[0], C[1] - links.coupler)
    A = (B[0] - links.crank * math.sin(beta), B[1] + links.crank * math.cos(beta))
    D = (A[0] + links.arm, A[1] + outline.drive_height + r)
    return Centers(A, B, C, D, (C[0], C[1] + r + outline.bolt_distance))


def pad(links: Links, hinge: Hinge, outline: Outline) -> Point:
    """Return the midpoint of the contact edge in the frame of the leg [m]."""
    x, y = centers(links, hinge, outline).D
    return (x, y + hinge.radius + outline.pad_height)


def third(links: Links, hinge: Hinge, outline: Outline) -> Boundary:
    """Return the boundary of a third; its labels are NECKS, `cut`, `turned cut`, `fixed`, `contact` and `bolt`.

    Raises:
        ModelError: dimensions that cannot be built, with the check that fails.
    """
    at = centers(links, hinge, outline)
    _check(at, links, hinge, outline)
    boundary = Boundary(
        [*_base(at, hinge, outline), *_lever(at, hinge, outline), *_slot(at, hinge, outline), *_cuts(outline)],
        (circle(at.bolt, outline.bolt_hole, "bolt"),),
    )
    check_simple(boundary, "the outline of the stage")
    return boundary


def _base(at: Centers, hinge: Hinge, outline: Outline) -> list[Edge]:
    """Return the edges from the rim at the first cut to the shoulder of the lever beside B."""
    (x, y), r = at.A, hinge.radius
    bottom = line((x - r, y - outline.foot), (x - r, y - _offset(hinge)))
    return [
        *bottom,
        *_notch((x, y - _offset(hinge)), hinge, _LEFT, "A"),
        *line(
            (x + r, y - outline.foot),
            (at.B[0] + outline.block_right, at.B[1] - r - outline.lever_width),
            (at.B[0] + outline.block_right, at.B[1] - r),
        ),
    ]


def _lever(at: Centers, hinge: Hinge, outline: Outline) -> list[Edge]:
    """Return the edges around coupler, end block and contact pad, from the lever beside B to the lever above A."""
    r, g, h = hinge.radius, _offset(hinge), outline.coupler_width
    (bx, by), (cx, cy), (dx, dy) = at.B, at.C, at.D
    top = cy + r + outline.block_height
    pad_half, pad_top = outline.pad_width / 2, dy + r + outline.pad_height
    return [
        *line((bx + g, by - r)),
        *_notch((bx + g, by), hinge, _DOWN, "B"),
        *line((bx + h / 2, by + r), (cx + h / 2, cy - r), (cx + g, cy - r)),
        *_notch((cx + g, cy), hinge, _DOWN, "C"),
        *line(
            (cx + outline.block_right, cy + r),
            (cx + outline.block_right, top),
            (cx - outline.block_left, top),
            (cx - outline.block_left, cy + r),
            (cx - g, cy + r),
        ),
        *_notch((cx - g, cy), hinge, _UP, "C"),
        *line((cx - h / 2, cy - r), (bx - h / 2, by + r), (bx - g, by + r)),
        *_notch((bx - g, by), hinge, _UP, "B"),
        *line((dx + g, dy - r)),
        *_notch((dx + g, dy), hinge, _DOWN, "D"),
        *line((dx + pad_half, dy + r), (dx + pad_half, pad_top)),
        *line((dx - pad_half, pad_top), label="contact"),
        *line((dx - pad_half, dy + r), (dx - g, dy + r)),
        *_notch((dx - g, dy), hinge, _UP, "D"),
        *line((dx - pad_half, dy - r)),
    ]


def _slot(at: Centers, hinge: Hinge, outline: Outline) -> list[Edge]:
    """Return the edges from the lever above A over the face of the slot to the rim at the second cut."""
    (x, y), r, g = at.A, hinge.radius, _offset(hinge)
    radius, face = outline.outer_radius, outline.slot_face
    return [
        *line((x + r, y + g)),
        *_notch((x, y + g), hinge, _RIGHT, "A"),
        *line((x - r, face), (math.sqrt(radius**2 - face**2), face)),
        *arcs((0.0, 0.0), radius, [_CUTS[1]], ""),
    ]


def _cuts(outline: Outline) -> list[Edge]:
    """Return the edges along the second cut to the hole at O, around it, and along the first cut to the rim."""
    near, far = outline.fixed_distance - outline.fixed_hole, outline.fixed_distance + outline.fixed_hole
    first, second = _CUTS

    def at(distance: float, angle: float) -> Point:
        return (distance * math.cos(angle), distance * math.sin(angle))

    return [
        *line(at(far, second), label="turned cut"),
        *arcs(at(outline.fixed_distance, second), outline.fixed_hole, [second - _UP, second - _LEFT], "fixed"),
        *line(at(outline.center_hole, second), label="turned cut"),
        *arcs((0.0, 0.0), outline.center_hole, [first], ""),
        *line(at(near, first), label="cut"),
        *arcs(at(outline.fixed_distance, first), outline.fixed_hole, [first + _UP, first], "fixed"),
        *line(at(outline.outer_radius, first), label="cut"),
    ]


def _offset(hinge: Hinge) -> float:
    """Return the distance of the centre of a notch from that of its neck [m]."""
    return hinge.thickness / 2 + hinge.radius


def _notch(center: Point, hinge: Hinge, start: float, label: str) -> list[Edge]:
    """Return the notch about a centre, half a turn clockwise from a polar angle."""
    return arcs(center, hinge.radius, [start - math.pi / 2, start - math.pi], label)


def _check(at: Centers, links: Links, hinge: Hinge, outline: Outline) -> None:
    """Raise `ModelError` with the first dimension that is out of its bounds."""
    r, t, g = hinge.radius, hinge.thickness, _offset(hinge)
    (ax, _), (bx, _), (_, cy), (dx, dy) = at.A, at.B, at.C, at.D
    face, block = outline.slot_face, outline.block_height
    lengths = {
        f.name: getattr(outline, f.name) for f in fields(outline) if f.name not in ("poisson", "plane", "density")
    }
    largest = max(lengths, key=lambda name: lengths[name])
    if not lengths[largest] <= _LARGEST * links.radius:
        raise ModelError(
            f"the stage cannot be cut from a plate: outline.{largest} is {lengths[largest]:g} m, expected at most "
            f"{_LARGEST * links.radius:g} m, {_LARGEST:g} times links.radius"
        )
    inside_block = min(outline.bolt_distance, block - outline.bolt_distance, outline.block_left, outline.block_right)
    for name, found, least, why in (
        ("outline.coupler_width", outline.coupler_width, t + 2 * r, "hinge.thickness + 2 hinge.radius, its necks"),
        ("links.coupler", links.coupler, 2 * r, "2 hinge.radius, the notches of necks B and C"),
        (
            "outline.slot_face",
            face,
            cy + r + block,
            "the top of the end block above C",
        ),
        ("outline.slot_face", face, dy + r + outline.pad_height, "the top of the contact pad"),
        ("the x' of neck A", ax, r, "hinge.radius, as the body is on its left"),
        ("outline.foot", outline.foot, g, "hinge.thickness / 2 + hinge.radius, the notch of neck A"),
        ("outline.drive_height", outline.drive_height, g, "hinge.thickness / 2 + hinge.radius, the notch of neck A"),
        ("outline.pad_width", outline.pad_width, t + 2 * r, "hinge.thickness + 2 hinge.radius, neck D"),
        ("outline.block_left", outline.block_left, g, "hinge.thickness / 2 + hinge.radius, the notch of neck C"),
        ("outline.block_right", outline.block_right, g, "hinge.thickness / 2 + hinge.radius, the notch of neck C"),
        ("the x' of the left notch of neck B", bx - g, dx + g, "that of the right notch of neck D"),
        ("outline.outer_radius", outline.outer_radius, abs(face), "outline.slot_face"),
        ("the end block about its bolt", inside_block, outline.bolt_hole, "outline.bolt_hole"),
        (
            "outline.fixed_distance",
            outline.fixed_distance,
            outline.center_hole + outline.fixed_hole,
            "outline.center_hole + outline.fixed_hole",
        ),
        (
            "outline.outer_radius",
            outline.outer_radius,
            outline.fixed_distance + outline.fixed_hole,
            "outline.fixed_distance + outline.fixed_hole",
        ),
    ):
        if not found > least:
            raise ModelError(
                f"the stage cannot be cut from a plate: {name} is {1e3 * found:.5g} mm, expected more than "
                f"{1e3 * least:.5g} mm, {why}"
            )
