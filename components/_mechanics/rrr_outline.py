"""Dimensions of the plate that the 3-RRR stage is cut from, beside those of its links and hinges.

Source: appendix of the thesis of 2000 on the 3-RRR stage, its finite element model. Derived: width of the couplers,
from their printed mass. Assumed: corners of the end blocks, without effect on statics, with one on frequencies.
"""

import math
from dataclasses import dataclass, fields
from typing import Literal

from hfsa.components._mechanics.rrr_contact import Bolts, Contact
from hfsa.components._modelling.arguments import ArgumentGroup
from hfsa.components._modelling.errors import ModelError

_DENSITIES = (1.0, 1e5)
"""Densities of what a plate may be made of [kg/m3]."""


@dataclass(frozen=True)
class Outline:
    """Dimensions of the plate beside those of links and hinges, and its material beside Young's modulus.

    Attributes:
        coupler_width: h, width of a coupler [m].
        outer_radius: radius of the body [m].
        slot_face: distance of the face on which a stack stands from the line through O along x' [m].
        center_hole: radius of the hole at O [m].
        fixed_hole: radius of the holes at which the body is fixed [m].
        fixed_distance: distance of their centres from O [m].
        bolt_hole: radius of the hole in an end block [m].
        bolt_distance: distance of its centre from the notches of neck C [m].
        lever_width: width of a lever [m].
        foot: depth of the body below A [m].
        drive_height: height of the lever's shoulder above A, on which neck D stands [m].
        pad_width: width of the contact pad [m].
        pad_height: height of the contact pad above the notches of neck D [m].
        block_left: width of the end block to the left of C [m].
        block_right: width of the end block to the right of C, and of the lever to the right of B [m].
        block_height: height of the end block above the notches of neck C [m].
        poisson: Poisson's ratio.
        density: density [kg/m3].
        plane: `stress` for a plate that is free to become thinner, `strain` for one of constant thickness.

    Raises:
        ModelError: a length or density that is not finite or not above 0; a Poisson's ratio that is not between 0 and
            0.5.
    """

    coupler_width: float = 10e-3
    outer_radius: float = 32e-3
    slot_face: float = 1e-3
    center_hole: float = 2.5e-3
    fixed_hole: float = 2.5e-3
    fixed_distance: float = 20e-3
    bolt_hole: float = 2.5e-3
    bolt_distance: float = 5e-3
    lever_width: float = 8e-3
    foot: float = 4e-3
    drive_height: float = 4e-3
    pad_width: float = 5e-3
    pad_height: float = 2e-3
    block_left: float = 5e-3
    block_right: float = 5e-3
    block_height: float = 10e-3
    poisson: float = 0.3
    density: float = 8250.0
    plane: Literal["stress", "strain"] = "stress"

    def __post_init__(self):
        for field in fields(self):
            if field.name in ("poisson", "plane"):
                continue
            value = getattr(self, field.name)
            least = -math.inf if field.name == "slot_face" else 0
            if not (math.isfinite(value) and value > least):
                words = "a finite number" if field.name == "slot_face" else "a finite number above 0"
                raise ModelError(f"outline.{field.name} is {value:g}, expected {words}")
        if not _DENSITIES[0] <= self.density <= _DENSITIES[1]:
            raise ModelError(
                f"outline.density is {self.density:g} kg/m3, expected {_DENSITIES[0]:g} to {_DENSITIES[1]:g} kg/m3"
            )
        if not 0 <= self.poisson < 0.5:
            raise ModelError(f"outline.poisson is {self.poisson:g}, expected a number from 0 to below 0.5")
        if self.plane not in ("stress", "strain"):
            raise ModelError(f"outline.plane is {self.plane!r}, expected stress or strain")


THESIS_OUTLINE = Outline()
"""Outline of the source."""


@dataclass(frozen=True)
class Plate(ArgumentGroup):
    """What the levels `flexible_hinges` and `continuum` know of a stage beside its links, hinges and masses.

    Attributes:
        contact: contact of stack and lever, `locked`, `slide`, `ball` or `stack` (`rrr_contact.py`).
        bolts: joint of an end block and the platform, `pin`, free to turn about the bolt, or `rigid`.
        outline: dimensions of the plate.
    """

    contact: Contact = "stack"
    bolts: Bolts = "pin"
    outline: Outline = THESIS_OUTLINE


THESIS_PLATE = Plate()
"""The plate of the source, on flat stacks."""
