"""Arguments of a stage at level `continuum`, the size of its mesh, and the stages that follow from them."""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from hfsa.components._continuum.outline import Outline, centers
from hfsa.components._continuum.reduced import Reduced, reduced
from hfsa.components._continuum.solution import Shape, Solution, solution
from hfsa.components._continuum.stage import Joints, Stage
from hfsa.components._mechanics.pzt import Stack
from hfsa.components._mechanics.rrr_contact import Bolts, Contact
from hfsa.components._mechanics.rrr_hinge import Hinge
from hfsa.components._mechanics.rrr_kinematics import Links
from hfsa.components._mechanics.rrr_masses import Masses
from hfsa.components._modelling.errors import ModelError

MODES = {"pin": 6, "rigid": 3}
"""Modes of the small model: a pinned end block swings about its bolt, three of them near 3 kHz."""

_COARSEST, _FINEST = 1 / 4, 1 / 100
"""Bounds of the size of a mesh at the necks, by the radius of their notches."""


@dataclass(frozen=True)
class Continuum:
    """A stage at level `continuum`.

    Attributes:
        links, hinge, outline: dimensions and material.
        masses: of which the platform's are used; the mass of the piece is that of its material.
        contact, bolts: how the piece is joined to stacks and platform.
        stack: data sheet of the stacks.
        mesh: size of the triangles at the necks [m]; `None` for an eighth of their thickness, in bounds.

    Raises:
        ModelError: a size of the mesh out of bounds.
    """

    links: Links
    hinge: Hinge
    outline: Outline
    masses: Masses
    contact: Contact
    bolts: Bolts
    stack: Stack
    mesh: float | None = None

    def __post_init__(self):
        radius = self.hinge.radius
        if not (math.isfinite(self.size) and _FINEST * radius <= self.size <= _COARSEST * radius):
            raise ModelError(
                f"mesh is {self.size:g} m, expected {_FINEST * radius:g} to {_COARSEST * radius:g} m, a hundredth to a "
                "quarter of hinge.radius"
            )

    @property
    def size(self) -> float:
        """Size of the triangles at the necks [m]."""
        if self.mesh is not None:
            return self.mesh
        radius = self.hinge.radius
        return max(min(self.hinge.thickness / 8, radius / 10), _FINEST * radius)

    @cached_property
    def shape(self) -> Shape:
        """Dimensions and material of the piece."""
        return Shape(self.links, self.hinge, self.outline)

    def solved(self, size: float) -> "Solved":
        """Return the stage with triangles of a size [m] at the necks; errors as of `solution`."""
        found = _solution(self.shape, size)
        joints = Joints(self.contact, self.bolts, self.stack)
        return Solved(found, Stage(found.piece, centers(*self.shape).bolt, self.links, self.masses, joints))

    def elongations(self, pose: np.ndarray) -> np.ndarray:
        """Return the elongations (3,) [m] at a pose (3,) [m, m, rad] without a wrench."""
        return np.linalg.solve(self.solved(self.size).stage.statics.jacobian, pose)

    def small(self, stage: Stage) -> Reduced:
        """Return the small model of a stage on its stacks."""
        return reduced(stage, self.stack, MODES[self.bolts])


class Solved(NamedTuple):
    """A solved piece, and the stage that it is part of."""

    solution: Solution
    stage: Stage


@lru_cache(maxsize=4)
def _solution(shape: Shape, size: float) -> Solution:
    """Return a solution, kept in memory for the next use."""
    return solution(shape, size)
