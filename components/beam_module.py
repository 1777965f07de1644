"""Modules of slender beams or sheets between a base and a stage: compliance, number and axes of the freedoms.

    hfsa analyze beam_module -p kind=tilted -p radius=0.6 -p tilt=45
    hfsa analyze beam_module -p kind=three_beam -p length_error=0,-0.05,0
    hfsa analyze beam_module -p kind=three_beam -p dimensions.length=0.05 -p dimensions.diameter=2e-3
    hfsa analyze beam_module -p kind=assembly -p beams=FILE.toml

Linear, for displacements below a tenth of the length L of a beam. The compliance C maps loads (p, fy, fz, mx, my, mz)
to displacements (x, y, z, thx, thy, thz) at the centre of the tips of the beams on the stage, X from base to stage.
Lengths are normalised by L, forces by EI / L^2, moments by EI / L of one beam (E' I of one sheet, E' = E / (1 - nu^2)).

In `_mechanics/`, `beam.py` contains the beam and the sheet (eqs 1, 2, A.1), `beam_assembly.py` their assembly,
`beam_kinds.py` the kinds and `mobility.py` the count of freedoms. A tilted module of radius r turns about points near
x = r / tan(tilt): under a force about C22 / |C26|, under a moment about the centre of compliance -C26 / C66. At r = 0.6
and 45 degrees the ideal value is 0.6; with d = 1e4 the two points are at 0.6070 and 0.5954.

Source: the paper of 2013 on beam modules. Not in it: the count of freedoms, which unlike that of the paper does not
depend on axes and reference point; the smallest slenderness (length / thickness = 10), outer_radius, outer_spacing.
"""

from typing import Any

import numpy as np

from hfsa.components._mechanics.beam_arguments import NORMALISED, Dimensions, Normalised
from hfsa.components._mechanics.beam_kinds import KindName
from hfsa.components._mechanics.beam_list import Beams
from hfsa.components._mechanics.beam_module import compliant_module
from hfsa.components._mechanics.beam_reading import Screw, as_read, motions, screws
from hfsa.components._mechanics.beam_section import ALUMINIUM, Material
from hfsa.components._mechanics.mobility import Freedom, mobility

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
    kind: KindName = "three_beam",
    radius: float | None = None,
    outer_radius: float | None = None,
    tilt: float | None = None,
    outer_tilt: float | None = None,
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
    beams: Beams | None = None,
) -> dict[str, Any]:
    """Return a module's compliance and mobility.

    Args:
        kind: kind of the module, see `_mechanics/beam_kinds.py`.
        radius: radius of the circle of tips / L; default 0.6.
        outer_radius: radius of the outer circle of tips / L; default 1.
        tilt: angle beta of the beams [deg]; default 45.
        outer_tilt: angle of the beams on the base of a double_tilted [deg]; default the tilt.
        slenderness: d = A L^2 / I, at least 1200; default 1e4.
        torsion: delta = G J / EI; default 0.7536.
        count: number of beams between two bodies, 3 or more; default 3.
        length_error: relative length error e of each beam, of length (1 + e) L; beams on the stage first; three beams
            are at 120, 0 and -120 degrees.
        thickness: thickness of a sheet / L; default 0.02.
        width: width of a sheet / L; default 0.4.
        spacing: distance of opposite sheets, centre to centre / L; default 1.
        outer_spacing: distance of the outer sheets / L; default 2.
        poisson: Poisson's ratio of a sheet; default 0.3, with dimensions that of the material.
        material: with `dimensions`, E and one of G and nu; default aluminium.
        dimensions: lengths [m] instead of normalised ones; a beam with `length` requires its diameter or side.
        beams: with kind `assembly`, the .toml file that lists its beams, see `_mechanics/beam_list.py`.

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
    given = Normalised(
        radius=radius,
        outer_radius=outer_radius,
        tilt=tilt,
        outer_tilt=outer_tilt,
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
    module = compliant_module(kind, given, material, dimensions, beams)
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
