"""Beam modules from their arguments: where the beams are, normalised compliance, and SI units if dimensions are given.

    module = compliant_module("tilted", Normalised(radius=0.6, tilt=45.0))
    module.compliance                                   normalised, (6, 6), order as in `beam.py`
    module = compliant_module("tilted", AS_PUBLISHED, ALUMINIUM, Dimensions(length=0.05, diameter=2e-3, radius=0.03))
    module.dimensional_stiffness()                      SI, at the platform's reference point
    module = compliant_module("assembly", beams=beams)  beams that a file lists, always with dimensions

With the length L and the bending stiffness EI of one beam, and S = diag(1/L, 1/L, 1/L, 1, 1, 1):

    K = EI / L S K_normalised S,   translations [m] and forces [N] before rotations [rad] and moments [N.m]

Source: the paper of 2013 on beam modules. Not in it: the assembly.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hfsa.components._mechanics.beam import of_length
from hfsa.components._mechanics.beam_arguments import (
    AS_PUBLISHED,
    NORMALISED,
    Dimensions,
    Normalised,
    Size,
    check_names,
    element_of,
    geometry_of,
    given,
    lengths_of,
    module_values,
)
from hfsa.components._mechanics.beam_assembly import Placed, compliance
from hfsa.components._mechanics.beam_kinds import ASSEMBLY, KINDS, KindName
from hfsa.components._mechanics.beam_list import BeamList, placed
from hfsa.components._mechanics.beam_section import ALUMINIUM, Material
from hfsa.components._modelling.arguments import ArgumentGroup
from hfsa.components._modelling.errors import ModelError, one_of

_ROUNDING = 1e-12


class Module:
    """BeamList of a module, and their compliance at the reference point of its platform.

    Attributes:
        beams: all beams or sheets, normalised.
        size: length and rigidity of one beam; `None` for a module without dimensions.
    """

    def __init__(self, beams: Sequence[Placed], size: Size | None):
        self.beams, self.size = beams, size

    @cached_property
    def compliance(self) -> np.ndarray:
        """The normalised compliance, shape (6, 6)."""
        C = compliance([beam.place for beam in self.beams], [beam.stiffness for beam in self.beams])
        return without_rounding((C + C.T) / 2)

    def dimensional_compliance(self) -> np.ndarray:
        """Return the compliance in SI units, from loads [N, N.m] to displacements [m, rad], shape (6, 6).

        Raises `ModelError` for a module without dimensions.
        """
        length, rigidity = self._size()
        scale = np.array([length] * 3 + [1.0] * 3)
        return length / rigidity * np.outer(scale, scale) * self.compliance

    def dimensional_stiffness(self) -> np.ndarray:
        """Return the stiffness in SI units, from displacements [m, rad] to loads [N, N.m], shape (6, 6).

        Raises `ModelError` for a module without dimensions.
        """
        length, rigidity = self._size()
        scale = np.array([1 / length] * 3 + [1.0] * 3)
        K = np.linalg.inv(self.compliance)
        return rigidity / length * np.outer(scale, scale) * (K + K.T) / 2

    def _size(self) -> Size:
        """Return length and rigidity of one beam; `ModelError` for a module without dimensions."""
        if self.size is None:
            raise ModelError(
                "a beam module without dimensions.length has no stiffness in SI units, only a normalised one"
            )
        return self.size


@dataclass(frozen=True)
class Design(ArgumentGroup):
    """Arguments of a module.

    Attributes:
        kind: kind of the module, see `beam_kinds.py`.
        normalised: positions and sections of named kinds, normalised.
        material: with `dimensions`, E and one of G and nu; default aluminium.
        dimensions: lengths [m] instead of normalised ones; a beam with `length` requires its diameter or side.
        beams: with kind `assembly`, the .toml file that lists its beams, see `beam_list.py`.
    """

    kind: KindName = "three_beam"
    normalised: Normalised = AS_PUBLISHED
    material: Material = ALUMINIUM
    dimensions: Dimensions = NORMALISED
    beams: BeamList | None = None

    @property
    def module(self) -> Module:
        """The module; errors as of `compliant_module`."""
        return compliant_module(self.kind, self.normalised, self.material, self.dimensions, self.beams)


PUBLISHED = Design()
"""Three beams of the source's first example."""


def compliant_module(
    kind: str,
    normalised: Normalised = AS_PUBLISHED,
    material: Material = ALUMINIUM,
    dimensions: Dimensions = NORMALISED,
    beams: BeamList | None = None,
) -> Module:
    """Return a module; missing values are those of `DEFAULTS`, except the section, which `dimensions.length` requires.

    A quantity is given either normalised or as a dimension. `material` is for modules with `dimensions.length`, and for
    beams of an assembly that name none. `beams` are those of an assembly, which has no other arguments.

    Raises:
        ModelError: an unknown kind; arguments of another kind, given twice or missing; a length of zero; a beam that is
            not slender; a tilt at which the axes do not meet; a wrong number of length errors; a wrong assembly.
    """
    one_of(kind, [*KINDS, ASSEMBLY], "beam module: kind")
    if kind == ASSEMBLY:
        return _assembly(normalised, material, dimensions, beams)
    if beams is not None:
        raise ModelError(f"beam module: beams is given with kind {kind}, which has its own; kind=assembly takes a list")
    check_names(kind, normalised, dimensions)
    values, size = module_values(kind, normalised, material, dimensions)
    geometry = geometry_of(kind, values, normalised.count)
    chosen = KINDS[kind]
    lengths = lengths_of(kind, normalised.length_error, chosen.layers * geometry.count)
    K = element_of(kind, values, min(lengths))
    width = values["width"] if chosen.element == "sheet" else 0.0
    found = zip(chosen.places(geometry), lengths, strict=True)
    return Module([Placed(place, length, of_length(K, length), width) for place, length in found], size)


def without_rounding(C: np.ndarray) -> np.ndarray:
    """Return a positive definite matrix with entries at rounding level, relative to their diagonal ones, set to 0."""
    size = np.sqrt(np.diag(C))
    return np.where(np.abs(C) < _ROUNDING * np.outer(size, size), 0.0, C)


def _assembly(normalised: Normalised, material: Material, dimensions: Dimensions, beams: BeamList | None) -> Module:
    """Return the module of listed beams; `ModelError` without a list, or with arguments of other kinds."""
    if beams is None:
        raise ModelError("beam module: assembly lacks beams, the list of them; give beams=FILE.toml")
    for name in [*given(normalised), *(f"dimensions.{name}" for name in given(dimensions))]:
        raise ModelError(f"beam module: assembly has no {name}; positions and sections stand in the list of its beams")
    return Module(*placed(beams, material))
