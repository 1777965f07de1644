"""Design study of the 3-RRR stage: responses and slopes against `analyze` and arithmetic, optima, empty points."""

import numpy as np
import pytest
from parts_by_name import part
from stage_by_hand import Linkage, frequencies

from hfsa.components import ModelError
from hfsa.components._mechanics.rrr_hinge import Hinge
from hfsa.components._mechanics.rrr_kinematics import LinkChanges
from hfsa.components._mechanics.rrr_masses import Masses
from hfsa.components._modelling.study import bounds, optimum, response_map, slopes

analyze, study = part("rrr_stage").analysis, part("rrr_stage").design_study

BOX = 12e-6 * np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
NOMINAL = (17.720e-3, 11e-3, 29.546e-3, 1.1733, 0.81569, 3.5e-3)
REST = (101e9, 10e-3, 0.8e-3, 1e-3, 0.1323, 9.622e-6, 0.01416, 1.483e-6, 7.628e-3)
PLAIN = Linkage(*NOMINAL, *REST)


def answers(**arguments) -> dict[str, float]:
    """Return the responses by `analyze`."""
    found = analyze(**arguments)
    stress = max(
        max(analyze(elongation=tuple(corner), **arguments)["hinge_stress"].values()) for corner in BOX.tolist()
    )
    x, y, yaw = found["range"]
    return {
        "yaw_range": yaw,
        "x_range": x,
        "y_range": y,
        "f1": found["natural_frequencies_hz"][0],
        "f1_bonded": found["natural_frequencies_bonded_hz"][0],
        "peak_stress": stress,
        "safety": arguments.get("hinge", Hinge()).yield_strength / stress,
    }


@pytest.mark.parametrize("kinematics", ["nominal", "calibrated"])
def test_a_map_is_that_of_direct_calls(kinematics):
    ranges = {"links.arm": (3e-3, 5e-3), "hinge.thickness": (0.5e-3, 0.9e-3)}
    found = response_map(study(kinematics=kinematics), ranges, points=3)
    arms, necks = found.axes.values()
    for i, j in ((0, 0), (1, 2), (2, 1)):
        arguments = {"links": LinkChanges(arm=arms[i]), "hinge": Hinge(thickness=necks[j])}
        for name, value in answers(kinematics=kinematics, **arguments).items():
            assert found.responses[name][i, j] == pytest.approx(value, rel=1e-9), name


def test_masses_bring_their_inertia():
    found = response_map(study(), {"masses.platform": (0.05, 0.2), "masses.crank": (0.01, 0.02)}, points=2)
    heavy = {"masses": Masses(platform=0.2, crank=0.01)}
    assert found.responses["f1"][-1, 0] == pytest.approx(answers(**heavy)["f1"], rel=1e-9)


def test_frequencies_are_those_of_arithmetic():
    at = study().at(study().values[:, None])
    assert at["f1"][0] == pytest.approx(frequencies(PLAIN.mass, PLAIN.stiffness)[0], rel=1e-6)
    assert at["f1_bonded"][0] == pytest.approx(904.65, abs=0.01)
    assert at["yaw_range"][0] == pytest.approx(2.16e-3, abs=5e-6)


def test_slopes_follow_closed_forms():
    """K_b of E b t^2.5 / r^0.5, stress of E t^0.5 / r^0.5, yaw of 1 / (R R0)."""
    frequency, stress, yaw = (slopes(study(), name) for name in ("f1", "peak_stress", "yaw_range"))
    hinge = {"hinge.elastic_modulus": 1.0, "hinge.width": 1.0, "hinge.thickness": 2.5, "hinge.radius": -0.5}
    assert {n: frequency[n] for n in hinge} == pytest.approx({n: v / 2 for n, v in hinge.items()}, abs=1e-9)
    strain = {"hinge.elastic_modulus": 1.0, "hinge.width": 0.0, "hinge.thickness": 0.5, "hinge.radius": -0.5}
    assert {n: stress[n] for n in strain} == pytest.approx(strain, abs=1e-9)
    assert (yaw["links.arm"], yaw["links.radius"], yaw["hinge.width"]) == pytest.approx((-1, -1, 0), abs=1e-9)


def test_slopes_agree_with_differences_of_analyze():
    h = 1e-4
    up, down = (answers(links=LinkChanges(psi2=0.81569 * f)) for f in (1 + h, 1 - h))
    for name in ("yaw_range", "x_range", "f1", "f1_bonded", "peak_stress"):
        found = slopes(study(), name)["links.psi2"]
        assert found == pytest.approx(np.log(up[name] / down[name]) / np.log((1 + h) / (1 - h)), rel=1e-5, abs=1e-7)


def test_an_optimum_goes_to_the_bounds_of_what_is_monotone():
    """Yaw = l L_AB sin(psi3) / (R0 R sin(psi)): the least arm and radius; with goals, on these goals."""
    free = optimum(study(), bounds(study(), 0.1))
    assert free.values["links.arm"] == pytest.approx(0.9 * 3.5e-3, rel=1e-5)
    assert free.values["links.radius"] == pytest.approx(0.9 * 29.546e-3, rel=1e-5)
    held = study(largest_stress=350e6, least_frequency=529.0)
    found = optimum(held, bounds(held, 0.1))
    assert found.responses["yaw_range"] < free.responses["yaw_range"]
    assert found.responses["peak_stress"] <= 350e6 * 1.000001
    assert found.responses["f1"] >= 529.0 * 0.999999
    built = answers(
        links=LinkChanges(**{n[6:]: v for n, v in found.values.items() if n.startswith("links.")}),
        hinge=Hinge(**{n[6:]: v for n, v in found.values.items() if n.startswith("hinge.")}),
        masses=Masses(**{n[7:]: v for n, v in found.values.items() if n.startswith("masses.")}),
    )
    assert built["yaw_range"] == pytest.approx(found.responses["yaw_range"], rel=1e-9)
    assert built["peak_stress"] == pytest.approx(found.responses["peak_stress"], rel=1e-9)


def test_an_optimum_of_the_frequency_is_one_of_both_modes():
    """Where yaw and shifts cross, neither alone."""
    wanted = study(objective="f1")
    found = optimum(wanted, bounds(wanted, 0.2))
    assert found.responses["f1"] > 1.5 * 529.05
    assert found.values["hinge.thickness"] == pytest.approx(0.96e-3, rel=1e-4)
    assert found.values["masses.platform"] == pytest.approx(0.8 * 0.1323, rel=1e-4)


def test_a_map_is_empty_where_links_do_not_close():
    """A crank shorter than L_BC sin(psi2) = 8.01 mm."""
    found = response_map(study(), {"links.crank": (5e-3, 12e-3), "links.arm": (3e-3, 4e-3)}, points=15)
    cranks = found.axes["links.crank"]
    empty = np.isnan(found.responses["f1"]).all(axis=1)
    assert (empty == (cranks <= 11e-3 * np.sin(0.81569))).all()
    assert list(found.failing) == ["links that close"]


def test_mistakes_are_named():
    with pytest.raises(ModelError, match=r"objective is 'yaw', expected one of .* \(did you mean yaw_range\?\)"):
        study(objective="yaw")
    with pytest.raises(ModelError, match="rrr_stage: largest_stress is -1, expected a finite number above 0"):
        study(largest_stress=-1.0)
    with pytest.raises(ModelError, match="the links do not close"):
        study(links=LinkChanges(crank=7e-3))
