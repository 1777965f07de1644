"""Scenes with the stage at level `continuum`: their response on FMUs, and the choice of a level."""

import numpy as np
import pytest

pytest.importorskip("gmsh")
pytest.importorskip("skfem")

from dataclasses import replace

from hfsa.components import rrr_stage
from hfsa.components._mechanics.pzt import TOKIN
from hfsa.components._mechanics.rrr_outline import Plate
from hfsa.cosim import sweep
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.assembly.native_loop import stepping_library
from hfsa.cosim.fidelity import levels
from hfsa.cosim.systems.system import System


def test_without_the_extra_the_ladder_ends_below(monkeypatch):
    from conftest import PARTS

    part = PARTS["rrr_stage"]
    assert part.ladder[-1] == "continuum"
    monkeypatch.setattr(rrr_stage, "UNAVAILABLE", {"continuum": "it needs an extra"})
    assert part.ladder == ("jacobian", "constant_jacobian", "flexible_hinges")


@pytest.mark.slow
@pytest.mark.parametrize("contact", ["locked", "stack"])
def test_a_volt_moves_the_biased_stage_as_its_analysis_says(contact, tmp_path):
    """At 1 Hz, J (K + k)^-1 alpha of the excited stack; the amplifiers take part by less than 0.1 %."""
    words = {"stage": "continuum", "contact": contact}
    bode = sweep("stage_bode", words, method="linear", low=1.0, high=2.0, points=2, path=tmp_path / "bode.h5")
    found = rrr_stage.analyze(level="continuum", plate=Plate(contact))
    K = found["stiffness"] + TOKIN.stiffness * np.eye(3)
    expected = found["jacobian"] @ np.linalg.inv(K) * TOKIN.coupling
    outputs = [f"stage.platform.{name}" for name in ("position[1]", "position[2]", "rotation")]
    moved = np.array([[bode.entry(o, f"stack[{k}].command.voltage")[0] for k in (1, 2, 3)] for o in outputs])
    np.testing.assert_allclose(moved.real, expected, rtol=2e-3, atol=2e-3 * np.abs(expected).max(axis=1).min())


@pytest.mark.slow
def test_auto_names_the_level_that_is_not_there(monkeypatch):
    monkeypatch.setattr(rrr_stage, "UNAVAILABLE", {"continuum": "it needs an extra"})
    scene = load_scene("stage_bode", {})
    stage = replace(scene.system["stage"], level="auto")
    system = System([stage, *scene.system.components[1:]], scene.system.connections)
    choice = levels.choose(replace(scene, system=system, band=(1.0, 20.0)), stepping_library())["stage"]
    assert choice.level == "flexible_hinges"
    assert "continuum: it needs an extra" in choice.sentence("stage")
