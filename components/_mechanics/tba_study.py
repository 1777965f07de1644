"""Design study of the triangular biaxial accelerometer: f3/f1 as a function of its dimensions, by the design formulas.

    f3/f1 = f_out / f_in = sqrt(K_out M_in / (K_in M_out))

With the rule `minus`, k_out = 1 / (2 / k_xft - 1 / k_xlt) has a pole where a leg is as soft in torsion as its two feet
in series: f3/f1 is unbounded, and an optimiser converges to the pole. The rule `plus` has no pole. An optimisation is
therefore constrained to properties of all published designs (assumed): with `minus`, legs no softer in torsion than one
foot, k_xlt >= k_xft; a leg that fits in its link with both feet, e + 2 l <= h.

Source: technical report of 2016 on the accelerometer, sections on sensitivity and optimisation, table 2. Its bounds and
requirements on the dimensions are not known.
"""

import math

from hfsa.components._mechanics import tba_design as designs
from hfsa.components._mechanics.tba_design import DESIGNS, DIMENSIONS, LIMBS, Shape
from hfsa.components._modelling.study import Response, Study, Variable

_DESCRIPTIONS = {
    "a": "Side of the proof mass",
    "s": "Side of the frame",
    "e": "Length of a leg",
    "b": "Length of a bar",
    "c": "Width of a leg across its corner",
    "d": "Width of a bar",
    "tm": "Thickness of a foot",
    "l": "Length of a foot",
    "w": "Thickness of the sensor",
}
_FIGURE_4 = (
    "What the source says of these sensitivities (sec. 5.2, figure 4) does not follow from its formulas. The "
    "influence of l is 0.14 (mems), 0.16 (optimum) and 0.75 (rapid_prototype) of that of tm, in words one third; that "
    "of c is 0.18, 0.40 and 1.02 of it, in words below 15 %; and d raises f3/f1, in words it lowers it. w, which the "
    "source holds, has the largest influence."
)
_OTHER_FEET = {"tm": 15.2e-6, "l": 59.5e-6}
"""Dimensions of feet for which the formulas reproduce the finite-element stiffness of table 2 [m]."""


def design_study(shape: Shape, rule: str, title: str, limbs: int = LIMBS) -> Study:
    """Return the study of the dimensions of a feasible shape, its material constant."""
    p = Shape(*designs.symbols()[: len(DIMENSIONS)], *shape[len(DIMENSIONS) :])
    found = designs.formulas(p, rule, limbs)
    foot, leg = designs.torsional_stiffnesses(p)
    conditions = {f"{name} above 0": getattr(p, name) / getattr(shape, name) for name in DIMENSIONS}
    conditions["a frame larger than the proof mass (s > a)"] = 1 - p.a / p.s
    requirements = {
        "a leg and its two feet no longer than a link (e + 2 l <= h)": 1 - (p.e + 2 * p.l) / found.bodies.link
    }
    if rule == "minus":
        conditions["legs that twist less easily than their feet (k_xlt > k_xft / 2)"] = 1 - foot / (2 * leg)
        requirements["a leg no softer in twist than one foot (k_xlt >= k_xft)"] = 1 - foot / leg
    return Study(
        title,
        {n: Variable(getattr(p, n), getattr(shape, n), "m", _DESCRIPTIONS[n]) for n in DIMENSIONS},
        {
            "frequency_ratio": Response(found.f_out / found.f_in, "1", "f3/f1, by the formulas"),
            "f_in": Response(found.f_in, "Hz", "Natural frequency in the plane, by the formulas"),
            "f_out": Response(found.f_out, "Hz", "Natural frequency out of the plane, by the formulas"),
        },
        conditions,
        requirements,
        _references(rule) if limbs == LIMBS else {},
        _remarks(rule),
        slope_remarks=[_FIGURE_4] if limbs == LIMBS and rule == "minus" else [],
    )


def _references(rule: str) -> dict[str, dict[str, float]]:
    """Return the responses of the printed optimum, with the stiffness of the formulas and of finite elements."""
    design = DESIGNS["optimum"]
    assert design.stiffness is not None
    printed = designs.formulas(design.shape, rule)
    by_elements = printed._replace(K_in=design.stiffness[0], K_out=design.stiffness[2])
    other_feet = designs.formulas(design.shape._replace(**_OTHER_FEET), rule)
    return {
        "printed optimum (table 2), by the formulas": _responses(printed),
        "printed optimum, stiffness by finite elements": _responses(by_elements),
        "printed optimum with feet tm = 15.2 um, l = 59.5 um, by the formulas": _responses(other_feet),
    }


def _responses(found: designs.Formulas) -> dict[str, float]:
    """Return the responses of a design by name."""
    values = {"frequency_ratio": found.f_out / found.f_in, "f_in": found.f_in, "f_out": found.f_out}
    assert all(map(math.isfinite, values.values()))
    return values


def _remarks(rule: str) -> list[str]:
    """Return the remarks on an optimum under a rule."""
    remarks = [
        "The source's bounds and requirements on its dimensions are not known; the bounds here are a choice. "
        "An optimum is constrained to legs that fit in their links with both feet (assumed; true for all tables).",
        "The printed optimum does not follow from the printed formulas: the printed f3/f1 of 2.90 is based on finite "
        "elements alone. With feet of tm = 15.2 um, l = 59.5 um the formulas would reproduce that stiffness, but the "
        "text gives 30 and 94.051 um.",
    ]
    if rule == "minus":
        remarks.append(
            "With k_out_rule=minus, the rule of the source, f3/f1 is unbounded: it has a pole at k_xlt = k_xft / 2. An "
            "optimum is constrained to k_xlt >= k_xft (assumed). With k_out_rule=plus, springs in series, there is no "
            "pole."
        )
    return remarks
