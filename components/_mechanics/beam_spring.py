"""A beam module as a spring in SI units: default sizes of beams, and the outputs that monitor the linear range.

`displacement` is the largest entry of the displacement (x, y, z, thx, thy, thz) of the stage's reference point, with
translations divided by the length of a beam; beams are linear up to 0.1.
"""

from dataclasses import dataclass, replace

import casadi as ca

from hfsa.components._mechanics.beam_arguments import NORMALISED, Dimensions, Normalised
from hfsa.components._mechanics.beam_kinds import ASSEMBLY, KINDS, KindName
from hfsa.components._mechanics.beam_list import BeamList
from hfsa.components._mechanics.beam_module import Module, compliant_module
from hfsa.components._mechanics.beam_section import ALUMINIUM, Material
from hfsa.components._modelling.arguments import ArgumentGroup
from hfsa.components._modelling.model import Model, one_of

LENGTH, DIAMETER = 0.05, 2e-3
"""Default length and diameter of a beam [m]."""
DAMPING_RATIO = 0.01
"""Default damping ratio of the platform's modes (assumed)."""
SMALL = 0.1
"""Largest normalised displacement of linear beams."""


@dataclass(frozen=True)
class SpringDesign(ArgumentGroup):
    """Arguments of a module with dimensions, by default of round beams of length `LENGTH` and diameter `DIAMETER`.

    Attributes:
        kind: kind of the module, see `beam_kinds.py`.
        tilt, outer_tilt: angles of the beams [deg], as in `beam_module`.
        count: number of beams between two bodies.
        length_error: relative length error of each beam, as in `beam_module`.
        material: material of the beams; default aluminium.
        dimensions: dimensions of the module [m]; others as in `beam_module`, relative to the length.
        beams: with kind `assembly`, the .toml file that lists its beams, see `beam_list.py`.
    """

    kind: KindName = "three_beam"
    tilt: float | None = None
    outer_tilt: float | None = None
    count: int | None = None
    length_error: tuple[float, ...] | None = None
    material: Material = ALUMINIUM
    dimensions: Dimensions = NORMALISED
    beams: BeamList | None = None

    def module(self, label: str) -> Module:
        """Return the module.

        Raises `ModelError` as `compliant_module`; the message for an unknown kind begins with `label`.
        """
        one_of(self.kind, [*KINDS, ASSEMBLY], f"{label}: kind")
        dimensions = self.dimensions
        if self.kind != ASSEMBLY and dimensions.length is None:
            dimensions = replace(dimensions, length=LENGTH)
        is_beam = self.kind != ASSEMBLY and KINDS[self.kind].element == "beam"
        if is_beam and dimensions.diameter is None and dimensions.side is None:
            dimensions = replace(dimensions, diameter=DIAMETER)
        given = Normalised(tilt=self.tilt, outer_tilt=self.outer_tilt, count=self.count, length_error=self.length_error)
        return compliant_module(self.kind, given, self.material, dimensions, self.beams)


USUAL = SpringDesign()
"""Three round beams of aluminium."""


def displacement_outputs(m: Model, module: Module, q: ca.SX) -> None:
    """Declare the outputs `displacement` and `displacement_warning` of a module with dimensions; q is (6, 1)."""
    assert module.size is not None
    largest = ca.mmax(ca.fabs(ca.vertcat(q[:3] / module.size.length, q[3:])))
    text = "Largest displacement, translations divided by the length of a beam"
    m.output("displacement", largest, "1", text, nominal=1e-3)
    m.output("displacement_warning", largest > SMALL, "1", "1 while displacement is above 0.1, beyond the linear range")
