"""Modules of slender beams or sheets between a base and a stage: their compliance, freedoms, and axes of freedoms.

    hfsa analyze beam_module -p kind=tilted -p radius=0.6 -p tilt=45
    hfsa analyze beam_module -p kind=three_beam -p length_error=0,-0.05,0
    hfsa analyze beam_module -p kind=three_beam -p dimensions.length=0.05 -p dimensions.diameter=2e-3

Linear, for displacements below a tenth of the length L of a beam. Order of C: displacements (x, y, z, thx, thy, thz) by
loads (p, fy, fz, mx, my, mz), at the centre of the tips of the beams on the stage, X from base to stage. Lengths are by
L, forces by EI / L^2, moments by EI / L of one beam (E' I of one sheet, E' = E / (1 - nu^2)).

`_beam` has the beam and the sheet (eqs 1, 2, A.1), `_beam_assembly` how they are joined, `_beam_kinds` the kinds,
`_mobility` how freedoms are counted. A tilted module of radius r turns about points near x = r / tan(tilt): under a
force alone about C22 / |C26|, under a moment alone about the centre of compliance -C26 / C66; by theory 0.6 at r = 0.6
and 45 degrees, with d = 1e4 0.6070 and 0.5954.

Source: the paper of 2013 on beam modules. Not in it: the way to count freedoms, which does not depend on axes and
reference point as its entries do; the least slenderness (ten times as long as thick), outer_radius and outer_spacing.
"""

from typing import Any

import numpy as np

from hfsa.components._mechanics.beam_kinds import KindName
from hfsa.components._mechanics.beam_module import (
    ALUMINIUM,
    NORMALISED,
    Dimensions,
    Material,
    Normalised,
    compliant_module,
)
from hfsa.components._mechanics.mobility import Freedom, mobility

NO_CLEAR_SEPARATION = "no clear separation"
"""Instead of a number of freedoms."""


UNITS = {
    "compliance": "1",
    "compliance_dimensional": "m/N, 1/N; 1/N, rad/(N.m)",
    "mobility": "1",
    "freedoms": "1",
    "compliance_center": "1",
    "separation": "1",
}
"""Units of the results of `analyze`, in the notation of `_modelling/parts.py`."""


def analyze(
    *,
    kind: KindName = "three_beam",
    radius: float | None = None,
    outer_radius: float | None = None,
    tilt: float | None = None,
    slenderness: float | None = None,
    torsion: float | None = None,
    count: int | None = None,
    length_error: tuple[float, ...] | None = None,
    thickness: float | None = None,
    width: float | None = None,
    spacing: float | None = None,
    outer_spacing: float | None = None,
    poisson: float | None = None,
    material: Material = ALUMINIUM,
    dimensions: Dimensions = NORMALISED,
) -> dict[str, Any]:
    """Return a module's compliance and mobility.

    Args:
        kind: see `_beam_kinds`.
        radius: of the circle of tips, by L; 0.6.
        outer_radius: of the outer circle of tips; 1.
        tilt: beta [deg]; 45.
        slenderness: d = A L^2 / I, at least 1200; 1e4.
        torsion: delta = G J / EI; 0.7536.
        count: beams between two bodies, from 3 on; 3.
        length_error: of each beam, whose length is (1 + e) L; those on the stage first; a ring of three is at 120, 0
            and -120 degrees.
        thickness: of a sheet, by L; 0.02.
        width: of a sheet; 0.4.
        spacing: of opposite sheets, centre to centre, by L; 1.
        outer_spacing: of the outer sheets; 2.
        poisson: of a sheet; 0.3, with dimensions that of the material.
        material: with `dimensions`, E and one of G and nu; aluminium.
        dimensions: lengths [m] instead of normalised ones; with `length` a beam needs its diameter or side.

    Returns:
        compliance: normalised, (6, 6).
        compliance_dimensional: [m, rad] by [N, N.m], (6, 6); only with `dimensions`.
        mobility: number of freedoms, or "no clear separation" where the separation is below 10.
        freedoms: the most compliant first; `type` R, T or H, `pitch` and `point` of its axis (none of a T) and
            `direction`; points and pitches by L, from the reference point.
        compliance_center: where forces alone translate and moments alone rotate, if anywhere, by L, (3,).
        separation: ratio of the least compliant freedom to the most compliant constraint, at that centre.

    Raises:
        ModelError: an unknown kind; arguments of another kind, given twice or missing; a length of zero; a beam that is
            not slender; a tilt at which the axes do not meet; a wrong number of length errors.
    """
    given = Normalised(
        radius=radius,
        outer_radius=outer_radius,
        tilt=tilt,
        slenderness=slenderness,
        torsion=torsion,
        count=count,
        length_error=length_error,
        thickness=thickness,
        width=width,
        spacing=spacing,
        outer_spacing=outer_spacing,
        poisson=poisson,
    )
    module = compliant_module(kind, given, material, dimensions)
    found = mobility(module.compliance)
    dimensional = {} if module.size is None else {"compliance_dimensional": module.dimensional_compliance()}
    return {
        "compliance": module.compliance,
        **dimensional,
        "mobility": len(found.freedoms) if found.is_clear else NO_CLEAR_SEPARATION,
        "freedoms": [_shown(freedom) for freedom in found.freedoms] if found.is_clear else [],
        "compliance_center": np.array(_rounded(found.center)),
        "separation": found.separation,
    }


def _shown(freedom: Freedom) -> dict[str, Any]:
    """Return a freedom as plain data, without rounding errors."""
    return {
        "type": freedom.type,
        "pitch": None if freedom.pitch is None else _rounded(freedom.pitch),
        "point": None if freedom.point is None else _rounded(freedom.point),
        "direction": _rounded(freedom.direction),
    }


def _rounded(value: Any) -> Any:
    """Return a number or numbers of the order of one, without the last digits, where there is only rounding error."""
    return (np.round(value, 10) + 0.0).tolist()
