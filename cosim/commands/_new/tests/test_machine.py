"""The parts become FMUs that keep every rule, and the scene responds as the equations say."""

from math import pi
from pathlib import Path

import pytest

from hfsa.cosim import sweep
from hfsa.fmus.export import export
from my_machine.position_controller import position_controller
from my_machine.stage import analyze, stage
from my_machine.voice_coil import voice_coil

SCENE = Path(__file__).parents[1] / "scene.toml"


@pytest.mark.parametrize("part", [stage, voice_coil, position_controller])
def test_a_part_becomes_an_fmu_that_passes_the_check(part, tmp_path):
    """The check of the FMU is a part of the export."""
    (file,) = export(part(), tmp_path, (2,))
    assert file.is_file()


def test_the_resonance_is_that_of_mass_and_stiffness():
    """The parameters of the model and the analysis agree."""
    model = stage()
    assert model["stiffness"].start == pytest.approx(model["mass"].start * (2 * pi * analyze()["resonance"]) ** 2)


def test_slow_motions_follow_the_controller_against_the_springs(tmp_path):
    """In the limit of low frequency, position = gain / (gain + stiffness) reference."""
    bode = sweep(SCENE, method="linear", low=0.1, high=1.0, points=2, path=tmp_path / "slow.h5")
    gain, stiffness = position_controller()["proportional_gain"].start, stage()["stiffness"].start
    response = bode.entry("stage.position", "controller.reference")
    assert abs(response[0]) == pytest.approx(gain / (gain + stiffness), rel=1e-3)
