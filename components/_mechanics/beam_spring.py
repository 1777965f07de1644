"""A beam module as a spring in SI units: beams of the usual size, and where what it carries leaves their linear range.

`displacement` is the largest entry of a displacement of the stage's reference point, (x, y, z, thx, thy, thz), with
translations by the length of a beam; beams are linear up to a tenth.
"""

from dataclasses import replace

import casadi as ca

from hfsa.components._mechanics.beam_kinds import KINDS
from hfsa.components._mechanics.beam_module import Dimensions, Material, Module, Normalised, compliant_module
from hfsa.components._modelling.model import Model, one_of

LENGTH, DIAMETER = 0.05, 2e-3
"""Of a beam, unless said otherwise [m]."""
DAMPING_RATIO = 0.01
"""Of the platform's modes, unless said otherwise: assumed."""
SMALL = 0.1
"""Largest normalised displacement of linear beams."""


def spring(
    label: str,
    kind: str,
    tilt: float | None,
    count: int | None,
    length_error: tuple[float, ...] | None,
    material: Material,
    dimensions: Dimensions,
) -> Module:
    """Return a module with dimensions, its beams of the usual length and diameter where nothing is said of them.

    `ModelError` as of `compliant_module`; of an unknown kind with `label`.
    """
    one_of(kind, KINDS, f"{label}: kind")
    if dimensions.length is None:
        dimensions = replace(dimensions, length=LENGTH)
    if KINDS[kind].element == "beam" and dimensions.diameter is None and dimensions.side is None:
        dimensions = replace(dimensions, diameter=DIAMETER)
    given = Normalised(tilt=tilt, count=count, length_error=length_error)
    return compliant_module(kind, given, material, dimensions)


def displacement_outputs(m: Model, module: Module, q: ca.SX) -> None:
    """Declare `displacement` and `displacement_warning` of a module of dimensions; q is a column of six."""
    assert module.size is not None
    largest = ca.mmax(ca.fabs(ca.vertcat(q[:3] / module.size.length, q[3:])))
    m.output("displacement", largest, "1", "Largest displacement, translations by the length of a beam", nominal=1e-3)
    m.output("displacement_warning", largest > SMALL, "1", "1 where it is above 0.1 and the beams are not linear")
