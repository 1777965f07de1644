"""Studies and pictures of beam modules: closed forms and laws of size for slopes, rigid bodies in displaced modules."""

import numpy as np
import pytest
from parts_by_name import part

from hfsa.components import ModelError
from hfsa.components._mechanics.beam_kinds import KINDS
from hfsa.components._modelling.study import optimum, response_map, slopes

PART = part("beam_module")
KIND = pytest.mark.parametrize("kind", KINDS)
LIST = {
    "material": {"steel": {"E": 210e9, "nu": 0.3}, "brass": {"E": 100e9, "G": 37e9}},
    "beam": [
        {"start": [0.01, 0, 0], "end": [0.06, 0.002, 0.01], "diameter": 2e-3, "material": "steel"},
        {
            "start": [0.01, 0.03, 0],
            "end": [0.06, 0.03, 0.02],
            "side": 2e-3,
            "material": "brass",
            "joins": ["base", "ring"],
        },
        {
            "end": [0.06, 0.02, 0.03],
            "direction": [1, 0.1, 0.2],
            "length": 0.05,
            "thickness": 1e-3,
            "width": 3e-3,
            "wide": [0, 0.3, 1],
            "material": "steel",
            "joins": ["ring", "platform"],
        },
    ],
}


def dimensional(kind: str) -> dict[str, str]:
    """A module of a kind with dimensions."""
    return {"kind": kind, "dimensions.length": "0.05"} | (
        {"dimensions.diameter": "2e-3"} if KINDS[kind].element == "beam" else {}
    )


# Slopes ---------------------------------------------------------------------------------------------------------------


def test_slopes_of_three_beams_are_those_of_the_closed_form():
    """Eq 8: C22 = (r^2 d + 8) / (36 (r^2 d + 2)), C44 = 1 / (3 delta + 36 r^2), C55 = 2 / (3 (r^2 d + 2))."""
    r, d, delta = 0.4, 3000.0, 0.7
    study = PART.design_study(radius=str(r), slenderness=str(d), torsion=str(delta))
    assert list(study.variables) == ["radius", "slenderness", "torsion"]
    x = r**2 * d
    by_x = {"C11": 0, "C22": x / (x + 8) - x / (x + 2), "C55": -x / (x + 2), "C35": -x / (x + 2)}
    for response, slope in by_x.items():
        assert list(slopes(study, response).values()) == pytest.approx(
            [2 * slope, slope - (response == "C11"), 0], abs=1e-7
        )
    twist = 3 * delta + 36 * r**2
    assert list(slopes(study, "C44").values()) == pytest.approx([-72 * r**2 / twist, 0, -3 * delta / twist], abs=1e-7)
    # the freedom that follows is the least compliant translation, the constraint a bend about its own centre
    bend = 2 / 3 / (x + 2)
    shift = 1 / 36 * (x + 8) / (x + 2) - (1 / 3 / (x + 2)) ** 2 / bend
    assert study.at(study.values)["separation"][0] == pytest.approx(shift / bend)
    assert study.at(study.values)["center"][0] == pytest.approx(-0.5)


@KIND
def test_slopes_obey_the_laws_of_size_and_of_stiffness(kind):
    """All lengths k times as large: C / k, C / k^2, C / k^3 by unit; a material k times as stiff: C / k."""
    study = PART.design_study(**dimensional(kind))
    lengths = [name for name, variable in study.variables.items() if variable.unit == "m"]
    moduli = [name for name, variable in study.variables.items() if variable.unit == "Pa"]
    powers = {"m/N": -1, "1/N": -2, "rad/(N.m)": -3, "1": 0, "m": 1}
    for name, response in study.responses.items():
        found = slopes(study, name)
        assert sum(found[length] for length in lengths) == pytest.approx(powers[response.unit], abs=2e-5), name
        is_compliance = name.startswith("C")
        assert sum(found[modulus] for modulus in moduli) == pytest.approx(-is_compliance, abs=1e-6), name


def test_slopes_of_a_list_obey_the_laws_too():
    study = PART.design_study(kind="assembly", beams=LIST)
    assert {"beam[1].end[2]", "beam[2].side", "beam[3].wide[2]", "material.brass.G"} <= set(study.variables)
    lengths, moduli = (
        [name for name, variable in study.variables.items() if variable.unit == unit] for unit in ("m", "Pa")
    )
    for name, power in {"C11": -1, "C33": -1, "C44": -3, "C66": -3, "separation": 0, "center": 1}.items():
        found = slopes(study, name)
        assert sum(found[length] for length in lengths) == pytest.approx(power, abs=1e-5)
        assert sum(found[modulus] for modulus in moduli) == pytest.approx(-(power < 0), abs=1e-5)


def test_the_responses_at_a_place_of_a_map_are_those_of_the_analysis_there():
    study = PART.design_study(kind="double_tilted", outer_tilt="50")
    found = response_map(study, {"radius": (0.3, 0.9), "outer_tilt": (0.0, 90.0)}, points=4)
    for i, radius in enumerate(found.axes["radius"]):
        for j, tilt in enumerate(found.axes["outer_tilt"]):
            values = {name: response[i, j] for name, response in found.responses.items()}
            if tilt == 0:
                assert np.all(np.isnan(list(values.values())))
                continue
            there = PART.analysis(kind="double_tilted", radius=radius, outer_tilt=tilt)
            assert values["C22"] == pytest.approx(there["compliance"][1, 1])
            assert values["C44"] == pytest.approx(there["compliance"][3, 3])
            assert values["center"] == pytest.approx(there["compliance_center"][0], abs=1e-9)
    assert found.failing == {"outer_tilt above 0 and up to 90 degrees": len(found.axes["radius"])}


def test_an_optimum_is_a_stationary_point_of_the_separation():
    study = PART.design_study(kind="tilted")
    fixed = {name: (value, value) for name, value in zip(study.variables, study.values, strict=True) if name != "tilt"}
    found = optimum(study, {**fixed, "tilt": (30.0, 70.0)})
    assert found.is_converged
    tilt = found.values["tilt"]
    around = [PART.analysis(kind="tilted", tilt=tilt + step)["separation"] for step in (-0.5, 0.0, 0.5)]
    assert around[1] > max(around[0], around[2])


# Pictures -------------------------------------------------------------------------------------------------------------


def lines(panel, role: str) -> list[np.ndarray]:
    """The polylines of beams in a panel, each (17, 3)."""
    layer = next(layer for layer in panel.layers if layer.role == role and layer.cells.shape[1] == 2)
    return list(layer.points.reshape(-1, 17, 3))


@KIND
def test_a_displaced_module_keeps_its_base_and_has_a_rigid_platform_that_moves_about_the_axis(kind):
    """To first order a rigid body keeps the distances of its points: (d_i - d_j) . (p_i - p_j) = 0."""
    drawing = PART.drawing(kind=kind)
    freedoms = PART.analysis(kind=kind)["freedoms"]
    assert len(drawing.panels) == 1 + len(freedoms)
    design = {"layers": KINDS[kind].layers, "count": KINDS[kind].count}
    for freedom, panel in zip(freedoms, drawing.panels[1:], strict=True):
        rest, moved = np.array(lines(panel, "rest")), np.array(lines(panel, "moved"))
        middle = (rest[0::2] + rest[1::2]) / 2  # the line between both edges of a beam
        shift = (moved[0::2] + moved[1::2]) / 2 - middle
        assert 0 < np.abs(shift).max() < 0.5
        on_base = slice(design["count"], None) if design["layers"] == 2 else slice(None)
        np.testing.assert_allclose(shift[on_base, 0], 0, atol=1e-12)
        tips, d = middle[: design["count"], -1], shift[: design["count"], -1]
        for i in range(len(tips)):
            stretch = np.sum((d - d[i]) * (tips - tips[i]), axis=1)
            np.testing.assert_allclose(stretch, 0, atol=1e-9 * np.abs(d).max())
        direction = np.array(freedom["direction"])
        if freedom["type"] == "T":
            np.testing.assert_allclose(np.cross(d, direction), 0, atol=0.11 * np.abs(d).max())
        else:
            arm = np.cross(direction, tips - np.array(freedom["point"]))
            factor = np.sum(d * arm) / np.sum(arm * arm)
            np.testing.assert_allclose(d, factor * arm, atol=0.05 * np.abs(d).max())


def test_a_picture_has_its_axes_and_is_in_metres_with_dimensions():
    flat, solid = PART.drawing(kind="tilted"), PART.drawing(**dimensional("tilted"))
    assert (flat.panels[0].unit, solid.panels[0].unit) == ("1", "m")
    for one, other in zip(flat.panels[0].layers, solid.panels[0].layers, strict=True):
        np.testing.assert_allclose(0.05 * one.points, other.points, rtol=1e-2, atol=1e-4)
    axes = [layer for layer in flat.panels[0].layers if layer.role == "axis"]
    assert [layer.texts[1] for layer in axes] == ["R"] * 3
    for layer in axes:
        np.testing.assert_allclose(layer.points.mean(axis=0), [0.59544, 0, 0], atol=1e-5)


def test_a_list_is_drawn_with_its_bodies():
    drawing = PART.drawing(kind="assembly", beams=LIST)
    names = {layer.name for layer in drawing.panels[0].layers}
    assert {"beams", "base", "ring", "centre of compliance"} <= names
    with pytest.raises(ModelError, match="a picture has no argument 'tlt'; did you mean tilt"):
        PART.drawing(tlt=5)
