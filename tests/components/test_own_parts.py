"""Parts that do not come with hfsa: from files, folders and installed packages; a mistake in one breaks no other."""

import os
import sys
import textwrap
from pathlib import Path

import pytest

import hfsa.components
from hfsa.components import ModelError
from hfsa.components._modelling.catalogue import find, part_named
from hfsa.components._modelling.loading import files_of, kind_of
from hfsa.components._modelling.parts import own_part

SPRING = '''
"""A spring."""

from typing import Literal

from hfsa.components import Model
from magnet import CONSTANT


def spring(*, level: Literal["soft", "hard"] = "soft", gain: float = 1.0) -> Model:
    """It."""
    from pole import TURNS  # while it runs, as when it is loaded

    m = Model("Spring", "A spring of the test")
    m.parameter("stiffness", CONSTANT * gain * TURNS, "N/m", "Stiffness")
    m.output("y", m.time, "s", "Time")
    return m
'''


def write(folder: Path, **texts: str) -> Path:
    """Write modules by name into a folder and return it."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (folder / f"{name}.py").write_text(textwrap.dedent(text).lstrip("\n"))
    return folder


@pytest.fixture
def machine(tmp_path) -> Path:
    return write(tmp_path / "machine", spring=SPRING, magnet="CONSTANT = 2.0\n", pole="TURNS = 3.0\n")


def test_a_file_is_a_part_that_imports_modules_beside_it(machine):
    path, modules = list(sys.path), set(sys.modules)
    part = own_part(machine / "spring.py")
    assert part.levels == ("soft", "hard")
    assert part.is_own
    assert part.model(gain="5")["stiffness"].start == 30.0
    assert sys.path == path
    assert not {"spring", "magnet", "pole"} & (set(sys.modules) - modules)
    assert not list(machine.rglob("__pycache__"))


def test_a_path_may_count_from_the_working_folder(machine, monkeypatch):
    monkeypatch.chdir(machine)
    assert part_named("./spring.py", {}) is part_named("spring.py", {}) is own_part(machine / "spring.py")


def test_two_folders_may_have_modules_of_one_name(machine, tmp_path):
    other = write(tmp_path / "other", spring=SPRING, magnet="CONSTANT = 7.0\n", pole="TURNS = 1.0\n")
    parts = [own_part(folder / "spring.py") for folder in (machine, other, machine)]
    assert [part.model()["stiffness"].start for part in parts] == [6.0, 7.0, 6.0]


@pytest.mark.parametrize("name", ["statistics", "pool"])
def test_a_module_that_is_there_already_by_its_name_comes_back(tmp_path, monkeypatch, name):
    """One of the standard library, and one that somebody has imported from elsewhere."""
    text = (
        SPRING.replace("spring", name).replace("from magnet import CONSTANT", "CONSTANT = 1.0").replace("pole", "poles")
    )
    folder = write(tmp_path / "machine", **{name: text}, poles="TURNS = 4.0")
    elsewhere = type(sys)(name)
    monkeypatch.setitem(sys.modules, name, elsewhere)
    assert own_part(folder / f"{name}.py").model()["stiffness"].start == 4.0
    assert sys.modules[name] is elsewhere


def test_modules_of_a_package_import_each_other(tmp_path):
    text = SPRING.replace("from magnet", "from .magnet").replace("from pole", "from machine.pole")
    folder = write(tmp_path / "machine", spring=text, magnet="CONSTANT = 2.0\n", pole="TURNS = 3.0\n", __init__="")
    assert own_part(folder / "spring.py").model()["stiffness"].start == 6.0
    assert "machine" not in sys.modules


def test_a_part_is_loaded_again_when_a_module_beside_it_has_changed(machine):
    assert own_part(machine / "spring.py").model()["stiffness"].start == 6.0
    assert own_part(machine / "spring.py") is own_part(machine / "spring.py")
    write(machine, magnet="CONSTANT = 9.0\n")
    os.utime(machine / "magnet.py", ns=(1, 1))
    assert own_part(machine / "spring.py").model()["stiffness"].start == 27.0


def test_a_folder_is_its_file_of_the_same_name_or_its_only_part(machine):
    assert own_part(machine).name == "spring"
    write(machine, other="def analyze() -> dict: ...\n")
    with pytest.raises(
        ModelError, match=r"machine is a folder; name one of its files that define a part: .*other.py, "
    ):
        own_part(machine)
    write(machine, machine=SPRING.replace("def spring", "def machine"))
    assert own_part(machine).name == "machine"


def test_files_of_a_folder_are_parts_scenes_or_neither(machine):
    write(machine, cart="def cart() -> 'Scene': ...\n", plain="def plain():\n    return Scene(1)\n", broken="def (\n")
    write(machine, _private="def _private(): ...\n", test_spring="def test_spring(): ...\n", conftest="conftest = 1\n")
    assert [file.stem for file in files_of(machine, "part")] == ["broken", "spring"]
    assert [file.stem for file in files_of(machine, "scene")] == ["cart", "plain"]
    assert kind_of(machine / "magnet.py") is None


BROKEN = {
    "syntax": ("def syntax(:\n", r"1: SyntaxError: .*; expected a module that defines syntax\(\) -> Model"),
    "imports": (
        "import sys\nimport helpr\n",
        r"2: ModuleNotFoundError: No module named 'helpr'; expected a module that defines",
    ),
    "exits": ("import sys\nsys.exit(3)\n", "2: SystemExit: 3; expected a module"),
    "missing": ("def mising() -> int: ...\n", "defines neither a function missing nor analyze; a part is a function"),
    "joins": ("JOINS = {}\ndef joins(): ...\n", "JOINS is {}, expected a tuple of Join"),
    "facts": ("FACTS = {'mass': 1}\ndef facts(): ...\n", "FACTS is {'mass': 1}, expected a dict of Known by Fact"),
    "units": ("UNITS = ['m']\ndef units(): ...\n", r"UNITS is \['m'\], expected a dict of texts"),
    "number": ("number = 3\n", "number is an int, expected a function"),
    "annotation": (
        'def annotation(*, level: "Litteral" = 1) -> int: ...\n',
        "1: NameError: name 'Litteral' is not defined; expected annotations that name types",
    ),
    "bare": (
        "def bare(*, gain=1.0): ...\n",
        r"1: the argument gain of bare\(\) has no annotation to read its value by; expected gain: float",
    ),
}
RUNNING = {
    "nothing": ("import sys\n\ndef nothing(): ...\n", r"3: nothing\(\) returned None, expected a Model"),
    "text": ("def text():\n    return 'Model'\n", r"1: text\(\) returned a str, expected a Model"),
    "raises": (
        "def raises():\n    k = 1 / 0\n",
        r"2: ZeroDivisionError: division by zero; expected raises\(\) to return a Model",
    ),
    "unit": (
        "from hfsa.components import Model\n\ndef unit():\n    Model('A', 'a').parameter('k', 1, 'Newton', 'd')\n",
        r"4: A: k: unit 'Newton'",
    ),
    "required": ("def required(*, gain: float): ...\n", r"1: TypeError: required\(\) missing 1 required .* 'gain'"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_file_that_cannot_be_loaded_is_one_line(tmp_path, name):
    text, message = BROKEN[name]
    write(tmp_path, **{name: text})
    with pytest.raises(ModelError, match=rf"{name}\.py:? ?{message}") as error:
        own_part(tmp_path / f"{name}.py")
    assert error.value.exit_code == 2
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", RUNNING)
def test_a_function_that_fails_is_one_line(tmp_path, name):
    text, message = RUNNING[name]
    write(tmp_path, **{name: text})
    with pytest.raises(ModelError, match=rf"{name}\.py:? ?{message}") as error:
        own_part(tmp_path / f"{name}.py").model()
    assert error.value.exit_code == 2


def test_the_line_is_that_of_the_helper_where_it_fails_there(machine):
    write(machine, pole="def turns():\n    return [][0]\n\n\nTURNS = turns()\n")
    with pytest.raises(ModelError, match=r"pole\.py:2: IndexError: list index out of range"):
        own_part(machine / "spring.py").model()


def test_an_analysis_of_another_kind_is_named(tmp_path):
    write(tmp_path, numbers="def analyze():\n    return 3\n")
    with pytest.raises(ModelError, match=r"numbers\.py:1: analyze\(\) returned an int, expected a dict"):
        own_part(tmp_path / "numbers.py").analysis()


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("absent.py", "there is no file absent.py"),
        ("./absent", "there is no file absent"),
        ("./notes.txt", "notes.txt is no part; expected a .py file, or a folder of them"),
        ("empty/", "empty is a folder; name one of its files that define a part: none"),
        ("spring", r"no part is called 'spring'; the path is written \./spring\.py"),
    ],
)
def test_a_path_that_is_no_part_is_named(tmp_path, monkeypatch, path, message):
    monkeypatch.chdir(write(tmp_path, spring=SPRING))
    (tmp_path / "empty").mkdir()
    (tmp_path / "notes.txt").touch()
    with pytest.raises(ModelError, match=message):
        part_named(path, {})


# Installed packages ---------------------------------------------------------------------------------------------------


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Install packages with entry points `hfsa.parts`; their modules go after the test."""
    site, before = tmp_path / "site", set(sys.modules)
    site.mkdir()
    monkeypatch.syspath_prepend(site)

    def make(name: str, points: str, **modules: str) -> Path:
        information = site / f"{name}-1.0.dist-info"
        information.mkdir()
        (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        (information / "entry_points.txt").write_text(f"[hfsa.parts]\n{points}\n")
        return write(site / name, **modules)

    yield make
    for name in set(sys.modules) - before:
        del sys.modules[name]


def parts():
    return find([hfsa.components], "hfsa.parts")


def test_an_entry_point_is_a_package_whose_modules_are_parts(install):
    text = SPRING.replace("from magnet", "from lab_a.magnet").replace("from pole", "from lab_a.pole")
    install(
        "lab_a", "lab = lab_a", __init__="", spring=text, magnet="CONSTANT = 2.0", pole="TURNS = 3.0", bad="def (\n"
    )
    found = parts()
    assert list(found)[-2:] == ["bad", "spring"]
    assert "lab_a" not in sys.modules, "names come from files"
    assert found["spring"].model()["stiffness"].start == 6.0
    assert (found["spring"].is_own, found["mass_on_spring"].is_own) == (True, False)
    assert (found.is_own("spring"), found.is_own("mass_on_spring")) == (True, False)
    with pytest.raises(ModelError, match=r"bad\.py:1: SyntaxError"):
        found["bad"]


def test_an_entry_point_is_a_module(install):
    install("lab_b", "one = lab_b.deep.nothing", __init__="raise RuntimeError('not yet')\n")
    write(Path(sys.path[0]) / "lab_b" / "deep", __init__="", nothing="def nothing(): ...\n")
    assert "nothing" in parts()
    with pytest.raises(ModelError, match=r"RuntimeError: not yet; expected a module that defines nothing\(\) -> Model"):
        parts()["nothing"]
    write(Path(sys.path[0]) / "lab_b", __init__="")
    with pytest.raises(ModelError, match=r"nothing\.py:1: nothing\(\) returned None, expected a Model"):
        parts()["nothing"].model()


def test_an_entry_point_to_nowhere_breaks_nothing_else(install):
    install("lab_c", "lost = lab_c.lost", __init__="")
    assert parts()["mass_on_spring"].model()
    with pytest.raises(ModelError, match=r"the entry point lost of lab_c: there is no module lab_c\.lost"):
        parts()["lost"]


def test_a_name_of_two_parts_is_an_error_that_names_both(install):
    install("lab_d", "lab = lab_d", __init__="", mass_on_spring="def mass_on_spring(): ...\n")
    with pytest.raises(
        ModelError,
        match=r"mass_on_spring is the name of 2 parts, hfsa\.components\.mass_on_spring and lab_d\.mass_on_spring; ",
    ):
        parts()["mass_on_spring"]
    assert parts()["sdelta"]
