"""Arguments that are files, in scenes: a scene holds the content, wherever the file lies and whatever becomes of it."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from hfsa.components import ModelError
from hfsa.cosim.assembly.fmu_cache import key_of, own_parts
from hfsa.cosim.assembly.load_scene import load_scene, with_arguments
from hfsa.cosim.assembly.models import model_of
from hfsa.cosim.cli import main
from hfsa.cosim.systems.scene_file import read_scene_text, scene_text
from hfsa.cosim.systems.system import Component

PART = '''
"""A mass on springs that a file lists."""

from dataclasses import dataclass
from typing import Any

from hfsa.components import Document, Model


@dataclass(frozen=True)
class Spring:
    """A spring."""

    stiffness: float
    note: str | None = None


@dataclass(frozen=True)
class Springs(Document):
    """Springs side by side."""

    spring: tuple[Spring, ...]


def springs(*, springs: Springs = Springs((Spring(1.0),))) -> Model:
    """Return it."""
    m = Model("Springs", "A mass on springs")
    u = m.input("force", "N", "Force")
    x = m.state("mass.position", "m", "Position")
    v = m.state("mass.velocity", "m/s", "Velocity")
    k = m.parameter("stiffness", sum(s.stiffness for s in springs.spring), "N/m", "Stiffness")
    m.der[x], m.der[v] = v, u - k * x - v
    m.output("position", x, "m", "Position")
    return m


def analyze(*, springs: Springs = Springs((Spring(1.0),))) -> dict[str, Any]:
    """Return the sum."""
    return {"stiffness": sum(s.stiffness for s in springs.spring)}
'''
SCENE = """
inputs = ["mass.force"]
outputs = ["mass.position"]
step_size = 1e-3
stop_time = 1.0
band = [0.1, 1.0]
amplitude = { N = 1.0 }

[[components]]
name = "mass"
part = "./springs.py"
arguments = { springs = "two.toml" }

[[components]]
name = "other"
part = "./springs.py"
start = { stiffness = { part = "./springs.py", key = "stiffness", arguments = { springs = "two.toml" } } }
"""
TWO = "[[spring]]\nstiffness = 2\n[[spring]]\nstiffness = 3\nnote = 'soft'\n"
CONTENT = {"spring": [{"stiffness": 2.0}, {"stiffness": 3.0, "note": "soft"}]}


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """A folder with part, document and scene; the working folder is another."""
    machine, here = tmp_path / "machine", tmp_path / "here"
    machine.mkdir()
    here.mkdir()
    for name, text in {"springs.py": PART, "scene.toml": SCENE, "two.toml": TWO}.items():
        (machine / name).write_text(text)
    (here / "one.toml").write_text("[[spring]]\nstiffness = 7\n")
    monkeypatch.chdir(here)
    monkeypatch.setenv("HFSA_CACHE", str(tmp_path / "cache"))
    return machine


def stiffness(component: Component) -> float:
    """The stiffness of a component's springs."""
    return component.start.get("stiffness", model_of(component)["stiffness"].start)


def test_a_scene_holds_the_content_of_a_file_beside_it(folder):
    scene = load_scene(folder / "scene.toml")
    assert scene.system["mass"].arguments["springs"] == CONTENT
    assert [stiffness(component) for component in scene.system.components] == [5.0, 5.0]
    assert read_scene_text(scene_text(scene)) == scene
    (folder / "two.toml").unlink()
    assert stiffness(scene.system["mass"]) == 5.0


def test_a_typed_path_counts_from_the_working_folder(folder):
    scene = load_scene(folder / "scene.toml", {"mass.springs": "one.toml"})
    assert stiffness(scene.system["mass"]) == 7.0
    with pytest.raises(ModelError, match=r"two\.toml cannot be read: No such file"):
        load_scene(folder / "scene.toml", {"mass.springs": "two.toml"})
    again = with_arguments(scene, {"other.springs": "one.toml"})
    assert again.system["other"].arguments == {"springs": {"spring": [{"stiffness": 7.0}]}}


def test_a_file_that_has_changed_gives_another_fmu(folder):
    """Also for a component that names the file itself."""
    component = Component("mass", str(folder / "springs.py"), None, {"springs": str(folder / "two.toml")})
    scene = load_scene(folder / "scene.toml")
    before = key_of(component), key_of(scene.system["mass"]), own_parts(scene)
    (folder / "two.toml").write_text(TWO.replace("2", "4"))
    changed = load_scene(folder / "scene.toml")
    after = key_of(component), key_of(changed.system["mass"]), own_parts(changed)
    assert all(one != other for one, other in zip(before, after, strict=True))
    assert key_of(scene.system["mass"]) == before[1]


def test_the_content_is_information_in_the_model(folder):
    assert model_of(load_scene(folder / "scene.toml").system["mass"]).information == {
        "springs.spring[1].stiffness": 2.0,
        "springs.spring[2].stiffness": 3.0,
        "springs.spring[2].note": "soft",
    }


def test_a_sweep_resumes_only_with_the_same_content(folder, capsys):
    command = ["sweep", str(folder / "scene.toml"), "--method", "linear", "-o", "it.h5", "--points", "3"]
    assert main(command) == 0
    assert main([*command, "--resume"]) == 0
    (folder / "two.toml").write_text("# the same\n" + TWO)
    assert main([*command, "--resume"]) == 0
    capsys.readouterr()
    (folder / "two.toml").write_text(TWO.replace("3", "4"))
    assert main([*command, "--resume"]) == 2
    assert "it.h5" in capsys.readouterr().err


def test_an_analysis_takes_a_file(folder, capsys):
    assert main(["analyze", str(folder / "springs.py"), "-p", "springs=one.toml"]) == 0
    assert "7" in capsys.readouterr().out
    assert main(["analyze", str(folder / "springs.py"), "-p", "springs=no.toml"]) == 2
    assert "error: " in (error := capsys.readouterr().err)
    assert "no.toml cannot be read: No such file or directory" in error


@pytest.mark.slow
def test_the_map_of_a_list_holds_its_content(folder, capsys):
    command = ["analyze", "beam_module", "-p", "kind=assembly", "-p", "beams=rod.toml"]
    Path("rod.toml").write_text("[[beam]]\nstart = [0, 0, 0]\nend = [0.1, 0, 0]\ndiameter = 1e-3\n")
    assert main([*command, "--map", "beam[1].diameter=1e-3:2e-3,beam[1].end[1]=0.05:0.2", "-o", "map.h5"]) == 0
    with h5py.File("map.h5") as file:
        assert "'diameter': 0.001" in file["system"].attrs["scene"]
        C, width = file["map/C22"][:], file["map/beam[1].diameter"][:]
        length = file["map/beam[1].end[1]"][:]
    expected = np.divide.outer(1 / (np.pi / 64 * width**4), 3 * 69e9 / length**3)
    np.testing.assert_allclose(C[np.isfinite(C)], expected[np.isfinite(C)], rtol=1e-9)
    assert 0.9 < np.mean(np.isfinite(C)) <= 1
