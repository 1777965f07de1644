"""Arguments of a stage at level `continuum`, the size of its mesh, and the stages that follow from them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple, get_args

import numpy as np

from hfsa.components._continuum.outline import centers
from hfsa.components._continuum.reduced import Reduced, reduced
from hfsa.components._continuum.solution import Shape, Solution, solution
from hfsa.components._continuum.stage import Joints, Stage
from hfsa.components._mechanics.pzt import Stack
from hfsa.components._mechanics.rrr_contact import Bolts, Contact
from hfsa.components._mechanics.rrr_design import Design, Dimensions
from hfsa.components._mechanics.rrr_outline import Plate
from hfsa.components._modelling.errors import ModelError, one_of

MODES = {"pin": 6, "rigid": 3}
"""Modes of the small model: a pinned end block swings about its bolt, three of them near 3 kHz."""

_COARSEST, _FINEST = 1 / 4, 1 / 100
"""Bounds of the size of a mesh at the necks, by the radius of their notches."""


@dataclass(frozen=True)
class Continuum:
    """A stage at level `continuum`.

    Attributes:
        dimensions: of the masses those of the platform are used; the piece has that of its material.
        plate: contacts, bolts and outline.
        stack: data sheet of the stacks.
        mesh: size of the triangles at the necks [m]; `None` for an eighth of their thickness, within bounds.

    Raises:
        ModelError: an unknown contact or joint, a size of the mesh out of bounds.
    """

    dimensions: Dimensions
    plate: Plate
    stack: Stack
    mesh: float | None = None

    def __post_init__(self):
        one_of(self.plate.contact, get_args(Contact), "rrr_stage: contact")
        one_of(self.plate.bolts, get_args(Bolts), "rrr_stage: bolts")
        radius = self.dimensions.hinge.radius
        if not (math.isfinite(self.size) and _FINEST * radius <= self.size <= _COARSEST * radius):
            raise ModelError(
                f"rrr_stage: mesh is {self.size:g} m, expected {_FINEST * radius:g} to {_COARSEST * radius:g} m, a "
                "hundredth to a quarter of hinge.radius"
            )

    @property
    def size(self) -> float:
        """Size of the triangles at the necks [m]."""
        if self.mesh is not None:
            return self.mesh
        hinge = self.dimensions.hinge
        return max(min(hinge.thickness / 8, hinge.radius / 10), _FINEST * hinge.radius)

    @cached_property
    def shape(self) -> Shape:
        """Dimensions and material of the piece."""
        return Shape(self.dimensions.links_at_rest, self.dimensions.hinge, self.plate.outline)

    def solved(self, size: float) -> "Solved":
        """Return the stage with triangles of a size [m] at the necks; errors as of `solution`."""
        found = _solution(self.shape, size)
        joints = Joints(self.plate.contact, self.plate.bolts, self.stack)
        bolt = centers(*self.shape).bolt
        return Solved(found, Stage(found.piece, bolt, self.shape.links, self.dimensions.masses, joints))

    def elongations(self, pose: Sequence[float]) -> tuple[float, float, float]:
        """Return the elongations [m] at a pose (3,) [m, m, rad] without a wrench."""
        return tuple(np.linalg.solve(self.solved(self.size).stage.statics.jacobian, pose).tolist())

    def small(self, stage: Stage) -> Reduced:
        """Return the small model of a stage on its stacks."""
        return reduced(stage, self.stack, MODES[self.plate.bolts])


class Solved(NamedTuple):
    """A solved piece, and the stage that it is part of."""

    solution: Solution
    stage: Stage


def continuum(dimensions: Dimensions, causality: str, stack: Stack, plate: Plate, mesh: float | None) -> Continuum:
    """Return the arguments of level `continuum`.

    Raises:
        ModelError: as `Continuum`; stacks outside the stage; matrices in place of those that follow from the plate.
    """
    if causality != "source":
        raise ModelError(
            f"rrr_stage: causality is {causality}, but the modes of level continuum are those of a stage on its "
            "stacks; expected source"
        )
    for name in ("jacobian", "stiffness", "mass"):
        if isinstance(dimensions, Design) and getattr(dimensions, name) is not None:
            raise ModelError(
                f"rrr_stage: {name} is given, but at level continuum it follows from the plate; leave it out"
            )
    return Continuum(dimensions, plate, stack, mesh)


@lru_cache(maxsize=4)
def _solution(shape: Shape, size: float) -> Solution:
    """Return a solution, kept in memory for the next use."""
    return solution(shape, size)
