"""Parts and scenes of one's own at the command line: by path, by name within a folder, installed, and broken."""

import os
import re
import sys
import textwrap
from pathlib import Path

import pytest

from hfsa.cosim.assembly.fmu_cache import fmu_file
from hfsa.cosim.assembly.load_scene import available_scenes, load_scene
from hfsa.cosim.assembly.models import available_parts
from hfsa.cosim.experiments.run import run
from hfsa.cosim.results.files import read_run, read_sweep
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, System

SPRING = '''
"""A spring of the user's."""

from typing import Literal

from hfsa.components import Model
from magnet import CONSTANT


def spring(*, level: Literal["soft", "hard"] = "soft") -> Model:
    """It."""
    m = Model("Spring", "Mass on a spring")
    k = m.parameter("stiffness", CONSTANT * (2 if level == "hard" else 1), "N/m", "Stiffness", min=0)
    u = m.input("base", "m", "Base", nominal=1e-3)
    x = m.state("mass.position", "m", "Displacement", nominal=1e-3)
    v = m.state("mass.velocity", "m/s", "Velocity", nominal=0.1)
    m.der[x] = v
    m.der[v] = k * (u - x) - 20.0 * v
    m.output("position", x, "m", "Measured displacement", nominal=1e-3)
    return m


def analyze(*, force: float = 1.0) -> dict[str, float]:
    """Numbers."""
    return {"travel": force / CONSTANT}
'''
TOML = """
inputs = ["one.base"]
outputs = ["two.position"]
band = [1.0, 20.0]
amplitude = { m = 1e-4 }
step_size = 1e-3
stop_time = 0.1

[[components]]
name = "one"
part = "./spring.py"

[[components]]
name = "two"
part = "spring"
start = { stiffness = 2e3 }

[[connections]]
start = "one.position"
end = "two.base"
"""
PYTHON = '''
"""Two springs: a scene."""

from hfsa.cosim import Component, Connection, Scene, System
from magnet import CONSTANT


def pair(*, part: str = "spring") -> Scene:
    """They."""
    system = System([Component("one", "./spring.py"), Component("two", part)], [Connection("one.position", "two.base")])
    return Scene(
        system, ["one.base"], ["two.position"], band=(1, 20), amplitude={"m": 1e-4}, step_size=1e-3, stop_time=0.1,
        marks={"constant": CONSTANT},
    )
'''


def write(folder: Path, **texts: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (folder / f"{name}.py").write_text(textwrap.dedent(text).lstrip("\n"))
    return folder


@pytest.fixture
def machine(tmp_path) -> Path:
    folder = write(tmp_path / "machine", spring=SPRING, magnet="CONSTANT = 1e3\n", pair=PYTHON)
    (folder / "springs.toml").write_text(TOML)
    return folder


@pytest.fixture(autouse=True)
def fresh():
    """Names are looked up again, in what the test has installed."""
    available_parts.cache_clear(), available_scenes.cache_clear()
    yield
    available_parts.cache_clear(), available_scenes.cache_clear()


def test_verbs_of_a_part_take_a_path(hfsa, machine):
    assert hfsa("analyze", machine / "spring.py", "-p", "force=5")[:2] == (0, "travel = 0.005\n")
    code, out, _ = hfsa("export", "./machine/spring.py", "--level", "hard", "-o", ".", "--fmi", "2")
    assert (code, out) == (0, "Spring_hard.fmi2.fmu\n")
    code, out, _ = hfsa("list", "machine/spring.py")
    assert code == 0
    assert "spring (soft, hard)\n      A spring of the user's.\n      in   base" in out
    assert "-p stiffness=1000 N/m" in out


@pytest.mark.parametrize("scene", ["springs.toml", "pair.py"])
def test_a_scene_names_parts_of_its_folder(hfsa, machine, scene):
    loaded = load_scene(str(machine / scene))
    assert [component.part for component in loaded.system.components] == [str(machine / "spring.py")] * 2
    code, _, err = hfsa("run", f"machine/{scene}", "-p", "two.level=hard", "-o", "run.h5")
    assert (code, err) == (0, "")
    assert abs(read_run("run.h5")[0]["two.position"]).max() > 0


def test_the_folder_of_a_scene_is_a_scene(hfsa, machine):
    assert load_scene(str(machine)) == load_scene(str(machine / "pair.py"))
    write(machine, second=PYTHON.replace("def pair", "def second"))
    code, _, err = hfsa("run", "./machine")
    assert code == 2
    assert err.startswith("error: machine is a folder; name one of its files that define a scene: machine/pair.py, ")


def test_other_processes_find_the_parts(hfsa, machine):
    code, _, _ = hfsa("sweep", "machine/pair.py", "--points", "3", "-j", "2", "-o", "sweep.h5")
    assert code == 0
    assert read_sweep("sweep.h5").frequency.size == 3
    code, out, _ = hfsa("compare", "machine/springs.toml", "--over", "one.level=soft,hard", "-j", "2", "-o", "c.png")
    assert code == 0
    assert "one.level" in out


def test_level_auto_of_a_part_of_ones_own(hfsa, machine):
    code, _, err = hfsa("run", "machine/springs.toml", "-p", "one.level=auto", "-o", "run.h5")
    assert code == 0
    assert "one: level" in err


@pytest.mark.slow
def test_members_of_an_fmu_may_be_ones_own(hfsa, machine):
    code, out, _ = hfsa("export", "machine/springs.toml", "--fuse", "one,two", "--fmi", "2", "-o", ".")
    assert code == 0
    assert re.fullmatch(r"Spring_[0-9a-f]{8}\.fmi2\.fmu\n", out)
    assert hfsa("run", "machine/springs.toml", "--fuse", "one,two", "-o", "run.h5")[0] == 0


def test_a_scene_of_python_takes_paths_from_the_working_folder(machine, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    system = System([Component("it", "./machine/spring.py")])
    scene = Scene(system, ["it.base"], ["it.position"], amplitude={"m": 1e-4}, step_size=1e-3, stop_time=0.01)
    assert run(scene, path="run.h5").path.is_file()


def test_the_cache_knows_files_and_data_that_a_part_reads(machine):
    data = "from pathlib import Path\nCONSTANT = float(Path(__file__).with_name('data.txt').read_text())\n"
    component = Component("it", str(machine / "spring.py"))
    first = fmu_file(component)
    assert fmu_file(component) == first
    write(machine, magnet="CONSTANT = 2e3\n")
    os.utime(machine / "magnet.py", ns=(1, 1))
    second = fmu_file(component)
    assert second != first
    (machine / "data.txt").write_text("1e3")
    write(machine, magnet=data)
    assert fmu_file(component) == first, "the same FMU, wherever its numbers come from"


def test_a_bare_name_that_two_parts_have_is_an_error(hfsa, machine):
    write(machine, mass_on_spring=SPRING.replace("spring", "mass_on_spring"))
    (machine / "both.toml").write_text(TOML.replace('"spring"', '"mass_on_spring"'))
    code, _, err = hfsa("run", "machine/both.toml")
    assert code == 2
    assert "machine/both.toml: mass_on_spring is the name of machine/mass_on_spring.py and of " in err
    assert "rename the file, or write ./mass_on_spring.py" in err
    (machine / "both.toml").write_text(TOML.replace('"spring"', '"./mass_on_spring.py"'))
    assert load_scene(str(machine / "both.toml")).system["two"].part == str(machine / "mass_on_spring.py")


def test_a_scene_may_be_called_as_a_part_of_ours(machine):
    write(machine, mass_on_spring=PYTHON.replace("def pair", "def mass_on_spring"))
    (machine / "ours.toml").write_text(
        TOML.replace('"spring"', '"mass_on_spring"').replace("two.base", "two.base.position")
    )
    assert load_scene(str(machine / "ours.toml")).system["two"].part == "mass_on_spring"


def test_a_part_of_ones_own_declares_what_may_feed_it(hfsa, machine):
    joins = "JOINS = (Join('hard', 'ba', {'c_drive': ('ideal',)}, 'it is'),)\n"
    write(machine, spring=f"{SPRING}\n\nfrom hfsa.components import Join\n{joins}")
    assert hfsa("run", "machine/springs.toml", "-o", "run.h5")[0] == 0
    code, _, err = hfsa("run", "machine/springs.toml", "-p", "two.level=hard")
    assert code == 2
    assert err == (
        "error: one.position -> two.base: two is spring at level hard, which may be joined to c_drive (ideal) only: "
        "it is. one is spring at level soft\n"
    )


# Broken ones ----------------------------------------------------------------------------------------------------------


def test_a_broken_part_is_a_line_in_the_list_and_leaves_the_others(hfsa, machine):
    write(
        machine,
        broken="def (\n",
        empty="def empty(): ...\n",
        wrong='"""W."""\n\ndef wrong() -> "Scene":\n    return 1\n',
    )
    code, out, err = hfsa("list", "./machine")
    assert (code, err) == (0, "")
    assert "  broken\n      cannot be used: machine/broken.py:1: SyntaxError: " in out
    assert "  empty\n      cannot be used: machine/empty.py:1: empty() returned None, expected a Model\n" in out
    assert "  wrong\n      cannot be used: machine/wrong.py:3: wrong() returned an int, expected a Scene\n" in out
    assert "  spring (soft, hard)\n      A spring of the user's." in out
    assert "  springs\n" in out
    assert hfsa("run", "machine/springs.toml", "-o", "run.h5")[0] == 0
    for verb in (["list"], ["export"], ["analyze"]):
        code, out, err = hfsa(*verb, "machine/broken.py")
        assert (code, out) == (2, "")
        assert err.startswith("error: machine/broken.py:1: SyntaxError: ")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("def cart(): return None\n", "cart.py:1: cart() returned None, expected a Scene"),
        ("def cart():\n    x = {}['a']\n", "cart.py:2: KeyError: 'a'; expected cart() to return a Scene"),
        ("def cart() -> None\n", "cart.py:1: SyntaxError: "),
        ("def card(): ...\n", "cart.py defines no function cart; a scene is a function named as its file"),
        (
            "from hfsa.cosim import System\ndef cart():\n    System([1])\n",
            "cart.py:3: components[1] is 1, expected a Component",
        ),
        (
            "from hfsa.cosim import Component\n\ndef cart():\n    Component('a b', 'c')\n",
            "cart.py:4: component name 'a b'",
        ),
    ],
)
@pytest.mark.parametrize("verb", ["run", "sweep", "stability"])
def test_a_broken_scene_is_one_line(hfsa, tmp_path, text, message, verb):
    write(tmp_path, cart=text)
    code, out, err = hfsa(verb, "cart.py")
    assert (code, out) == (2, "")
    assert err.startswith(f"error: {message}")
    assert err.count("\n") == 1


def test_a_broken_part_in_a_scene_is_one_line(hfsa, machine):
    write(machine, spring=SPRING.replace("m.output(", "m.outputt("))
    for verb in ("run", "sweep", "stability"):
        code, _, err = hfsa(verb, "machine/springs.toml")
        assert code == 2
        assert err.startswith("error: machine/spring.py:18: AttributeError: 'Model' object has no attribute 'outputt'")
        assert err.count("\n") == 1


def test_traceback_shows_where_it_was_raised(hfsa, machine):
    write(machine, spring=SPRING.replace("m.output(", "m.outputt("))
    code, _, err = hfsa("export", "machine/spring.py", "--traceback")
    assert code == 2
    assert "Traceback (most recent call last)" in err
    assert "\nAttributeError: 'Model' object has no attribute 'outputt'" in err
    assert err.splitlines()[-1].startswith("error: machine/spring.py:18: AttributeError")
    write(machine, pair=PYTHON.replace("System(", "Systm("))
    code, _, err = hfsa("run", "machine/pair.py", "--traceback")
    assert code == 2
    assert "\nNameError: name 'Systm'" in err


def test_numbers_that_json_does_not_know_are_named(hfsa):
    Path("p.py").write_text("def analyze():\n    return {'a': 1.0, 'b': [0, object()]}\n")
    assert hfsa("analyze", "./p.py", "--json") == (
        2, "", "error: p: analyze()['b'][1] is of the type object, expected a number, a text or a list of them\n"
    )  # fmt: skip


def test_rows_of_unequal_lengths_are_printed(hfsa):
    Path("p.py").write_text("def analyze():\n    return {'b': [[1.0], [2.0, 3.0]]}\n")
    assert hfsa("analyze", "./p.py") == (0, "b =\n  1\n  2  3\n", "")


# Installed ------------------------------------------------------------------------------------------------------------


def test_an_installed_package_has_parts_and_scenes_by_name(hfsa, tmp_path, monkeypatch):
    site = tmp_path / "site"
    text = {"spring": SPRING.replace("from magnet", "from own_lab.magnet")}
    text["pair"] = PYTHON.replace("from magnet", "from own_lab.magnet")
    write(site / "own_lab", __init__="", magnet="CONSTANT = 1e3\n", broken="def (\n", **text)
    information = write(site / "own_lab-1.0.dist-info")
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: own_lab\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text("[hfsa.parts]\nlab = own_lab\n[hfsa.scenes]\nlab = own_lab.pair\n")
    monkeypatch.syspath_prepend(site)
    try:
        code, out, _ = hfsa("list")
        assert code == 0
        assert "\nparts\n  broken\n      cannot be used: site/own_lab/broken.py:1: SyntaxError: " in out
        assert "\n  spring (soft, hard)\n" in out
        assert "\n  pair\n      Two springs: a scene.\n" in out
        assert hfsa("analyze", "spring")[:2] == (0, "travel = 0.001\n")
        code, _, err = hfsa("sweep", "pair", "-p", "part=spring", "--points", "2", "-j", "2", "-o", "sweep.h5")
        assert (code, err) == (0, "")
    finally:
        for name in [name for name in sys.modules if name.partition(".")[0] == "own_lab"]:
            del sys.modules[name]
