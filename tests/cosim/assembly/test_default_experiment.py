"""Step and stop of a scene that states none are those of its foreign FMUs, and told."""

from pathlib import Path

import pytest

from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.experiments.setup import set_up
from hfsa.cosim.systems.errors import StructureError


@pytest.fixture
def scene(foreign, rewritten, tmp_path):
    """Write a scene of two foreign FMUs with default experiments, and lines of its own."""

    def write(lines: str = "", version: int = 2, *experiments: str) -> Path:
        parts = []
        for name, experiment in zip("ab", experiments, strict=False):
            made = rewritten(foreign[version], "<ModelVariables>", f"{experiment}<ModelVariables>")
            parts.append(made.rename(tmp_path / f"{name}.fmu").name)
        components = "".join(f'[[components]]\nname = "{part[0]}"\npart = "{part}"\n' for part in parts)
        file = tmp_path / "scene.toml"
        file.write_text(f'inputs = []\noutputs = ["a.y"]\nquiet_inputs = true\n{lines}\n{components}')
        return file

    return write


FINE = '<DefaultExperiment stepSize="0.01" stopTime="2" tolerance="1e-5"/>'
COARSE = '<DefaultExperiment startTime="0" stepSize="0.05" stopTime="3.5"/>'


@pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
def test_the_smallest_step_and_the_latest_stop_are_taken_and_told(scene, version):
    file = scene("", version, FINE, COARSE)
    found = load_scene(file)
    assert (found.step_size, found.stop_time) == (0.01, 3.5)
    assert [s for s in set_up(file).disagreements if "default experiment" in s] == [
        "step_size is 0.01 s, of the default experiment of a.fmu, as the scene states none",
        "stop_time is 3.5 s, of the default experiment of b.fmu, as the scene states none",
    ]


def test_what_the_scene_or_an_option_states_stands(scene):
    file = scene("step_size = 0.02", 2, FINE, COARSE)
    setup = set_up(file, stop_time=1.0)
    assert (setup.scene.step_size, setup.scene.stop_time) == (0.02, 1.0)
    assert not [s for s in setup.disagreements if "default experiment" in s]


def test_a_start_other_than_zero_is_told(scene):
    file = scene("", 2, '<DefaultExperiment startTime="0.5" stepSize="0.1" stopTime="2"/>')
    assert "the default experiment of a.fmu starts at 0.5 s; runs start at 0 s" in set_up(file).disagreements


@pytest.mark.parametrize("experiment", ["", '<DefaultExperiment stepSize="0" stopTime="2"/>'], ids=["none", "zero"])
def test_without_a_proposal_the_key_is_missing(scene, experiment):
    with pytest.raises(StructureError, match=r"scene\.toml lacks the key 'step_size'"):
        load_scene(scene("", 2, experiment))


def test_the_file_of_results_holds_the_values(scene, hfsa, tmp_path):
    code, _, err = hfsa("run", scene("", 3, FINE), "-o", tmp_path / "run.h5")
    assert code == 0
    assert "step_size is 0.01 s, of the default experiment of a.fmu" in " ".join(err.split())
