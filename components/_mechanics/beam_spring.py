"""A beam module as a spring in SI units: default sizes of beams, and the outputs that monitor the linear range.

`displacement` is the largest entry of the displacement (x, y, z, thx, thy, thz) of the stage's reference point, with
translations divided by the length of a beam; beams are linear up to 0.1.
"""

from dataclasses import replace

import casadi as ca

from hfsa.components._mechanics.beam_arguments import Dimensions, Normalised
from hfsa.components._mechanics.beam_kinds import ASSEMBLY, KINDS
from hfsa.components._mechanics.beam_list import Beams
from hfsa.components._mechanics.beam_module import Module, compliant_module
from hfsa.components._mechanics.beam_section import Material
from hfsa.components._modelling.model import Model, one_of

LENGTH, DIAMETER = 0.05, 2e-3
"""Default length and diameter of a beam [m]."""
DAMPING_RATIO = 0.01
"""Default damping ratio of the platform's modes (assumed)."""
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
    beams: Beams | None,
) -> Module:
    """Return a module with dimensions, by default with beams of length `LENGTH` and diameter `DIAMETER`.

    Raises `ModelError` as `compliant_module`; the message for an unknown kind begins with `label`.
    """
    one_of(kind, [*KINDS, ASSEMBLY], f"{label}: kind")
    given = Normalised(tilt=tilt, count=count, length_error=length_error)
    if kind == ASSEMBLY:
        return compliant_module(kind, given, material, dimensions, beams)
    if dimensions.length is None:
        dimensions = replace(dimensions, length=LENGTH)
    if KINDS[kind].element == "beam" and dimensions.diameter is None and dimensions.side is None:
        dimensions = replace(dimensions, diameter=DIAMETER)
    return compliant_module(kind, given, material, dimensions, beams)


def displacement_outputs(m: Model, module: Module, q: ca.SX) -> None:
    """Declare the outputs `displacement` and `displacement_warning` of a module with dimensions; q is (6, 1)."""
    assert module.size is not None
    largest = ca.mmax(ca.fabs(ca.vertcat(q[:3] / module.size.length, q[3:])))
    text = "Largest displacement, translations divided by the length of a beam"
    m.output("displacement", largest, "1", text, nominal=1e-3)
    m.output("displacement_warning", largest > SMALL, "1", "1 while displacement is above 0.1, beyond the linear range")
