"""BeamList that a file lists: where each one is, its section and material, and which bodies it joins; in SI units.

    [material.steel]
    E = 210e9
    nu = 0.3

    [[beam]]                              # from the base to the platform
    start = [0, 0, 0]                     # its end on the base
    end = [0.05, 0, 0]                    # its end on the platform
    diameter = 2e-3                       # round; side = 2e-3 is square
    material = "steel"                    # without, the argument `material`

    [[beam]]
    end = [0.05, 0.03, 0]
    direction = [1, 0, 0]                 # from base to platform, with its length instead of `start`
    length = 0.05
    thickness = 1e-3                      # rectangular, `width` along the direction `wide` across the beam
    width = 4e-3
    wide = [0, 0, 1]
    joins = ["base", "ring"]              # other bodies may have any name; the next beam joins ring and platform

With `sheet = true` a rectangle is a sheet, which bends as a plate about its wide side. `reference` is the point of
loads and displacements, by default the centre of the ends on the platform; axes are those of the file. Numbers are
normalised by `length`, by default that of the first beam, and by its EI (E' I of a sheet) about the soft side.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hfsa.components._mechanics.beam import of_length, prismatic
from hfsa.components._mechanics.beam_arguments import SLENDER, Size, beam_section
from hfsa.components._mechanics.beam_assembly import BASE, PLATFORM, Place, Placed
from hfsa.components._mechanics.beam_section import (
    ALUMINIUM,
    Elastic,
    Material,
    Section,
    elastic,
    rectangular_section,
    sheet_section,
)
from hfsa.components._mechanics.rigid_body import Triple
from hfsa.components._modelling.documents import Document
from hfsa.components._modelling.errors import ModelError, one_of

_ALONG = 1e-6
"""Sine of the angle between a beam and its wide side below which that is along the beam."""
_HALF = 0.5
"""Poisson's ratio of a material that cannot be compressed."""


@dataclass(frozen=True)
class Beam:
    """One beam: `end` and `start`, or `end`, `direction` and `length`; and one of the sections.

    Attributes:
        end: its end on the second of the bodies that it joins [m].
        start: its end on the first [m].
        direction: direction from start to end, of any length.
        length: its length [m].
        joins: names of the two bodies.
        diameter: of a round section [m].
        side: of a square section [m].
        thickness, width: of a rectangular section [m].
        wide: direction of the width, of any length; its part along the beam does not count.
        sheet: whether a rectangle is a sheet.
        material: name of its material.

    Raises:
        ModelError: too few or too many of these; a beam without length, that is not slender, or joins a body to itself.
    """

    end: Triple
    start: Triple | None = None
    direction: Triple | None = None
    length: float | None = None
    joins: tuple[str, str] = (BASE, PLATFORM)
    diameter: float | None = None
    side: float | None = None
    thickness: float | None = None
    width: float | None = None
    wide: Triple | None = None
    sheet: bool = False
    material: str | None = None

    def __post_init__(self):
        self._check_place()
        self._check_section()
        if self.joins[0] == self.joins[1]:
            raise ModelError(f"joins {self.joins[0]} to itself, expected the names of two bodies")

    @property
    def vector(self) -> np.ndarray:
        """The vector from start to end [m], shape (3,)."""
        if self.start is not None:
            return np.subtract(self.end, self.start)
        assert self.direction is not None
        assert self.length is not None
        return self.length * np.array(self.direction) / np.linalg.norm(self.direction)

    @property
    def axes(self) -> np.ndarray:
        """Its axes as rows, shape (3, 3): along it, across, and along its width."""
        along = self.vector / np.linalg.norm(self.vector)
        # of equal sides any direction across is as good
        wide = np.eye(3)[np.argmin(np.abs(along))] if self.wide is None else np.array(self.wide)
        across = np.cross(wide, along)
        across /= np.linalg.norm(across)
        return np.array([along, across, np.cross(along, across)])

    def section(self, m: Elastic) -> Section:
        """Return its section, of a material."""
        for outline in ("diameter", "side"):
            if (size := getattr(self, outline)) is not None:
                return beam_section(outline, size, m)
        assert self.thickness is not None
        assert self.width is not None
        return (sheet_section if self.sheet else rectangular_section)(self.thickness, self.width, m)

    def _check_place(self) -> None:
        """Raise `ModelError` unless its ends are given, once, and apart."""
        ways = {"start": self.start, "direction": self.direction, "length": self.length}
        stated = [name for name, value in ways.items() if value is not None]
        if stated not in (["start"], ["direction", "length"]):
            words = f"has {' and '.join(stated)}" if stated else "has its end alone"
            raise ModelError(f"{words}, expected start, or direction and length, beside end")
        for name in ("end", "start", "direction", "wide"):
            point = getattr(self, name)
            if point is not None and not np.all(np.isfinite(point)):
                raise ModelError(f"{name} is {list(point)}, expected three finite numbers")
        for name in ("length", "diameter", "side", "thickness", "width"):
            size = getattr(self, name)
            if size is not None and not (np.isfinite(size) and size > 0):
                raise ModelError(f"{name} is {size:g} m, expected above 0")
        if self.direction is not None and not np.any(self.direction):
            raise ModelError("direction is [0, 0, 0], expected a vector of any length but 0")
        if not np.any(self.vector):
            raise ModelError(f"start and end are both {list(self.end)}, expected two points")

    def _check_section(self) -> None:
        """Raise `ModelError` unless it has one section, and is as long as beam theory needs."""
        names = ("diameter", "side", "thickness", "width")
        stated = [name for name in names if getattr(self, name) is not None]
        if stated not in (["diameter"], ["side"], ["thickness", "width"]):
            words = " and ".join(stated) or "no section"
            raise ModelError(f"has {words}, expected one of diameter, side, and thickness with width")
        length = float(np.linalg.norm(self.vector))
        is_flat = "width" in stated
        if not is_flat and (self.sheet or self.wide is not None):
            raise ModelError(f"has {'sheet' if self.sheet else 'wide'} with {stated[0]}, expected it with width alone")
        if is_flat:
            self._check_width(length)
        for name in stated:
            if name == "width" and self.sheet:
                continue
            share = getattr(self, name) / length
            if not share <= (1 + 1e-9) / SLENDER:
                hint = "; a sheet, which may be wide, has sheet = true" if name == "width" else ""
                raise ModelError(f"{name} is {share:.3g} of its length, expected at most {1 / SLENDER:g}{hint}")

    def _check_width(self, length: float) -> None:
        """Raise `ModelError` unless the width of a rectangle has a direction across the beam."""
        assert self.thickness is not None
        assert self.width is not None
        if self.sheet and not self.width > self.thickness:
            raise ModelError(
                f"width is {self.width:g} m, expected more than the thickness, {self.thickness:g} m, of a sheet"
            )
        if self.wide is None:
            raise ModelError("lacks wide, the direction of its width across the beam, such as [0, 0, 1]")
        across = np.linalg.norm(np.cross(self.wide, self.vector))
        if not across > _ALONG * np.linalg.norm(self.wide) * length:
            raise ModelError(f"wide is {list(self.wide)}, which is along the beam, expected a direction across it")


@dataclass(frozen=True)
class BeamList(Document):
    """BeamList between a base, a platform, and other bodies.

    Attributes:
        beam: all beams; their order has no effect but on normalised numbers.
        material: materials by name.
        reference: point of loads and displacements [m]; by default the centre of the ends on the platform.
        length: length that normalises [m]; by default that of the first beam.

    Raises:
        ModelError: no beams; an unknown material; beams that do not join base and platform, or carry no load.
    """

    beam: tuple[Beam, ...]
    material: Mapping[str, Material] = field(default_factory=dict)
    reference: Triple | None = None
    length: float | None = None

    def __post_init__(self):
        if not self.beam:
            raise ModelError("beam is empty, expected one beam or more, written [[beam]]")
        for name, material in self.material.items():
            elastic(material, f"material.{name}")
        for i, beam in enumerate(self.beam, 1):
            if beam.material is not None:
                one_of(beam.material, self.material, f"beam[{i}].material")
        if self.reference is not None and not np.all(np.isfinite(self.reference)):
            raise ModelError(f"reference is {list(self.reference)}, expected three finite numbers")
        if self.length is not None and not (np.isfinite(self.length) and self.length > 0):
            raise ModelError(f"length is {self.length:g} m, expected above 0")
        _check_joined([beam.joins for beam in self.beam])

    @property
    def center(self) -> np.ndarray:
        """The centre of the ends on the platform [m], shape (3,)."""
        ends = [
            np.array(beam.end) - (beam.joins[0] == PLATFORM) * beam.vector
            for beam in self.beam
            if PLATFORM in beam.joins
        ]
        return np.mean(ends, axis=0)

    def of_material(self, beam: Beam, usual: Material) -> Elastic:
        """Return the constants of a beam's material, of `usual` where it names none."""
        return elastic(usual if beam.material is None else self.material[beam.material], "beam module: material")


def placed(beams: BeamList, material: Material = ALUMINIUM) -> tuple[list[Placed], Size]:
    """Return listed beams, normalised, and what they are normalised by; `material` is that of beams that name none.

    Raises `ModelError` for a material that is wrong, or that no sheet can have.
    """
    first = beams.beam[0]
    length = beams.length or float(np.linalg.norm(first.vector))
    rigidity = min(first.section(beams.of_material(first, material))[2:])
    reference = beams.center if beams.reference is None else np.array(beams.reference)
    found = []
    for i, beam in enumerate(beams.beam, 1):
        m = beams.of_material(beam, material)
        if beam.sheet and not m.nu < _HALF:
            raise ModelError(f"beam module: beam[{i}] is a sheet of nu = {m.nu:g}, expected below {_HALF}")
        section = beam.section(m)
        own = float(np.linalg.norm(beam.vector)) / length
        rigidities = Section(section.axial * length**2, *section[1:])
        stiffness = of_length(prismatic(Section(*(value / rigidity for value in rigidities))), own)
        place = Place((np.array(beam.end) - reference) / length, beam.axes, *beam.joins)
        found.append(Placed(place, own, stiffness, (beam.width or 0.0) / length))
    return found, Size(length, rigidity)


def _check_joined(joins: list[tuple[str, str]]) -> None:
    """Raise `ModelError` unless beams join base and platform, and every other body lies between two others."""
    bodies = list(dict.fromkeys([name for pair in joins for name in pair]))
    for name in (BASE, PLATFORM):
        if name not in bodies:
            raise ModelError(
                f"no beam joins the {name}; they join {' and '.join(bodies)}; name {name} in `joins` of one or more"
            )
    if PLATFORM not in (held := _reached(BASE, joins)):
        free = [name for name in bodies if name not in held]
        raise ModelError(
            f"the beams do not join base and platform: {' and '.join(sorted(held))} are joined, and so are "
            f"{' and '.join(free)}, but no beam leads from one to the other; add one, such as "
            f'joins = ["{BASE}", "{free[0]}"]'
        )
    for body in bodies:
        for cut in bodies:
            ends = {BASE, PLATFORM} - {cut}
            if body != cut and not _reached(body, [pair for pair in joins if cut not in pair]) & ends:
                idle = ", ".join(f"beam[{i}]" for i, pair in enumerate(joins, 1) if body in pair)
                raise ModelError(
                    f"{body} is joined to {cut} alone, so that {idle} carry no load; join {body} to another body as "
                    f"well, or leave them out"
                )


def _reached(body: str, joins: list[tuple[str, str]]) -> set[str]:
    """Return the bodies that beams join to a body, itself included."""
    found, added = set[str](), {body}
    while added:
        found |= added
        added = {name for pair in joins if found & set(pair) for name in pair} - found
    return found
