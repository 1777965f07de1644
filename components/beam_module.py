"""Modules of slender beams or sheets between a base and a stage: compliance, number and axes of the freedoms.

    hfsa analyze beam_module -p kind=tilted -p radius=0.6 -p tilt=45
    hfsa analyze beam_module -p kind=three_beam -p length_error=0,-0.05,0
    hfsa analyze beam_module -p kind=three_beam -p dimensions.length=0.05 -p dimensions.diameter=2e-3
    hfsa analyze beam_module -p kind=assembly -p beams=FILE.toml

Linear, for displacements below a tenth of the length L of a beam. The compliance C maps loads (p, fy, fz, mx, my, mz)
to displacements (x, y, z, thx, thy, thz) at the centre of the tips of the beams on the stage, X from base to stage.
Lengths are normalised by L, forces by EI / L^2, moments by EI / L of one beam (E' I of one sheet, E' = E / (1 - nu^2)).

In `_mechanics/`, `beam.py` contains the beam and the sheet (eqs 1, 2, A.1), `beam_assembly.py` their assembly,
`beam_kinds.py` the kinds, `beam_list.py` lists of beams in a file, `mobility.py` the count of freedoms,
`beam_reading.py` what the source reads in the entries, `beam_study.py` and `beam_picture.py` studies and pictures.

A tilted module of radius r turns about points near x = r / tan(tilt): under a force about C22 / |C26|, under a moment
about the centre of compliance -C26 / C66. At r = 0.6 and 45 degrees the ideal value is 0.6; with d = 1e4 the two points
are at 0.6070 and 0.5954.

Source: the paper of 2013 on beam modules. Not in it: the count of freedoms, which unlike that of the paper does not
depend on axes and reference point; the smallest slenderness (length / thickness = 10), outer_radius, outer_spacing,
outer_tilt; the assembly of any beams, rectangular sections, and sheet_ring with other than four sheets.
"""

from typing import Any

import numpy as np

from hfsa.components._mechanics.beam_module import PUBLISHED, Design
from hfsa.components._mechanics.beam_picture import module_drawing
from hfsa.components._mechanics.beam_reading import Screw, as_read, motions, screws
from hfsa.components._mechanics.beam_study import design_study
from hfsa.components._mechanics.mobility import Freedom, mobility
from hfsa.components._modelling.drawing import Drawing
from hfsa.components._modelling.study import Study

NO_CLEAR_SEPARATION = "no clear separation"
"""Result in place of the number of freedoms if the separation is below 10."""


UNITS = {
    "compliance": "1",
    "compliance_dimensional": "m/N, 1/N; 1/N, rad/(N.m)",
    "compliance_as_read": "1",
    "motions_as_read": "1",
    "screws": "1",
    "mobility": "1",
    "freedoms": "1",
    "compliance_center": "1",
    "separation": "1",
}
"""Units of the results of `analyze`, in the notation of `_modelling/parts.py`."""


def analyze(
    *,
    design: Design = PUBLISHED,
) -> dict[str, Any]:
    """Return a module's compliance and mobility.

    Args:
        design: kind, positions, sections, material, dimensions or list of the beams.

    Returns:
        compliance: normalised compliance, (6, 6).
        compliance_dimensional: compliance in SI units, (6, 6) [m, rad] / [N, N.m]; only with `dimensions`.
        mobility: number of freedoms, or "no clear separation" for a separation below 10.
        freedoms: freedoms, the most compliant first; `type` R, T or H, `pitch` and `point` of the axis (`None` for a T)
            and `direction`; pitches and points / L, from the reference point.
        compliance_center: centre of compliance / L, at which the coupling of translation and rotation is symmetric,
            (3,).
        separation: ratio of the least compliant freedom to the most compliant constraint, at that centre.
        compliance_as_read: `compliance` with entries below 0.01 of the largest as 0, as the source reads it
            (eqs 10, 23), (6, 6).
        motions_as_read: displacements on its diagonal that are not 0. Their number depends on axes and reference point,
            and is that of the freedoms only where no two of its columns are proportional.
        screws: its columns as screws (eqs 24 to 26): `load`, `pitch` and `radius` of rotation / L (`None` of a
            translation), `direction`.

    Raises:
        ModelError: an unknown kind; arguments of another kind, given twice or missing; a length of zero; a beam that is
            not slender; a tilt at which the axes do not meet; a wrong number of length errors.
    """
    module = design.module
    found = mobility(module.compliance)
    dimensional = {} if module.size is None else {"compliance_dimensional": module.dimensional_compliance()}
    return {
        "compliance": module.compliance,
        **dimensional,
        "mobility": len(found.freedoms) if found.is_clear else NO_CLEAR_SEPARATION,
        "freedoms": [_shown(freedom) for freedom in found.freedoms] if found.is_clear else [],
        "compliance_center": np.array(_rounded(found.center)),
        "separation": found.separation,
        "compliance_as_read": (reading := as_read(module.compliance)),
        "motions_as_read": motions(reading),
        "screws": [_shown_screw(screw) for screw in screws(reading)],
    }


def study(*, design: Design = PUBLISHED) -> Study:
    """Return the design study over the numbers that define the module; arguments and errors as `analyze`."""
    return design_study(design)


def picture(*, design: Design = PUBLISHED) -> Drawing:
    """Return the module at rest with the axes of its freedoms, and displaced along each; errors as `analyze`."""
    return module_drawing(design.module, f"Beam module {design.kind}")


def _shown(freedom: Freedom) -> dict[str, Any]:
    """Return a freedom as plain data, rounded."""
    return {
        "type": freedom.type,
        "pitch": None if freedom.pitch is None else _rounded(freedom.pitch),
        "point": None if freedom.point is None else _rounded(freedom.point),
        "direction": _rounded(freedom.direction),
    }


def _shown_screw(screw: Screw) -> dict[str, Any]:
    """Return a screw as plain data, rounded."""
    numbers = {
        name: None if value is None else _rounded(value) for name, value in screw._asdict().items() if name != "load"
    }
    return {"load": screw.load, **numbers}


def _rounded(value: Any) -> Any:
    """Return numbers of the order of one, rounded to 10 digits to remove rounding errors."""
    return (np.round(value, 10) + 0.0).tolist()
