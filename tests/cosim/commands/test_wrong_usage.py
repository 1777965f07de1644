"""Wrong usage and failures: messages with the nearest right name, and exit codes."""

import json
import resource
from pathlib import Path

import numpy as np
import pytest
from command_line import LINEAR, OWN_MOTION, strict_json

from hfsa.cosim.commands._shell import plain
from hfsa.fmus.errors import ExportError

WRONG = {
    "scene": (["sweep", "sdelta_shakr"], "no scene is called 'sdelta_shakr'; did you mean sdelta_shaker"),
    "part for scene": (["run", "sdelta"], "sdelta is a part, expected a scene; `export` and `analyze` take it"),
    "scene file": (["run", "mine.toml"], "there is no file mine.toml"),
    "scene argument": (["run", "mass_on_spring", "-p", "dampin=1"], "has no argument 'dampin'; did you mean damping"),
    "scene value": (["run", "mass_on_spring", "-p", "damping=much"], "damping is 'much', expected a number"),
    "component": (["sweep", "sdelta_shaker", "-p", "robt.level=rigid"], "'robt.level'; did you mean robot.level"),
    "level": (["sweep", "sdelta_shaker", "-p", "robot.level=cartesain"], "did you mean cartesian?"),
    "out of bounds": (["run", "mass_on_spring", "-p", "mass.damping=-1"], "damping is -1 N.s/m, expected 0 to inf"),
    "start": (["run", "mass_on_spring", "-p", "mass.dampin=1"], "mass has no argument 'dampin'; did you mean damping?"),
    "input": (
        ["sweep", "mass_on_spring", "--input", "base.positon"],
        "no input is called 'base.positon'; did you mean",
    ),
    "output": (["sweep", "mass_on_spring", "--signal", "mass.positon"], "did you mean mass.position"),
    "band": (["sweep", "mass_on_spring", "--from", "9", "--to", "2"], "frequencies from 9 to 2 Hz, expected"),
    "step": (["sweep", "mass_on_spring", "--to", "9000"], "9000 Hz has 1.11 steps of 0.0001 s in a period"),
    "stop": (["run", "mass_on_spring", "--stop", "1e-9"], "less than a step"),
    "pair": (["analyze", "sdelta", "-p", "stiffness"], "-p 'stiffness' is not of the form NAME=VALUE"),
    "pair twice": (["analyze", "sdelta", "-p", "a=1", "-p", "a=2"], "-p a is given twice: 1 and 2"),
    "part": (["export", "sdlta"], "no part is called 'sdlta'; did you mean sdelta"),
    "part level": (["export", "sdelta", "--level", "rigit"], "level is 'rigit', expected one of rigid, cartesian"),
    "argument": (
        ["export", "sdelta", "-p", "stifness=ch4"],
        "sdelta has no argument 'stifness'; did you mean stiffness",
    ),
    "choice": (["analyze", "sdelta", "-p", "stiffness=ch5"], "expected one of ch3_full, ch3_rods, ch4, ch4_full"),
    "bounds": (["export", "mass_on_spring", "-p", "stiffness=-1"], "stiffness is -1 N/m, expected 0 to inf N/m"),
    "analysis": (["analyze", "mass_on_spring"], "mass_on_spring has no analysis"),
    "listed": (["list", "sdlta"], "nothing is called 'sdlta'; did you mean sdelta"),
    "results": (["bode", "none.h5"], "there is no file none.h5"),
    "fmu": (["check", "none.fmu"], "there is no file none.fmu"),
    "results folder": (["bode", "."], ". is a folder, expected a results file"),
    "fmu folder": (["check", "."], ".: a folder, expected the files of FMUs"),
    "a scene's part": (["analyze", "sdelta_hfsa"], "sdelta_hfsa is a scene, expected a part; `run`, `sweep` and"),
    "a scene's fmu": (["export", "sdelta_hfsa"], "sdelta_hfsa is a scene, expected a part; `--fuse NAME,NAME` exports"),
    "proc": (["export", "mass_on_spring", "-o", "/proc/x"], "cannot write /proc/x/MassOnSpring.fmi2.fmu: /proc takes"),
    "verb": (["sweeep"], 'Did you mean "sweep"'),
    "option": (["sweep", "mass_on_spring", "--metod", "linear"], "--method"),
    "method": (["sweep", "mass_on_spring", "--method", "step"], "stepped"),
    "points": (["sweep", "mass_on_spring", "--points", "0"], "1"),
    "nothing": (["sweep"], "SCENE"),
}


OWN_MOTION_WRONG = {
    "frequency": (["run", "--frequency", "3"], "motion of its own; a sine takes --input beside --frequency and"),
    "amplitude": (["run", "--input", "other.base.position"], "no amplitude for other.base.position in m; it has none"),
    "fed": (["run", "--input", "mass.base.position", "--amplitude", "1"], "input mass.base.position is fed twice"),
    "sweep": (["sweep"], "no input to excite; name one with --input; there are other.base.position"),
}


@pytest.mark.parametrize(("tokens", "message"), OWN_MOTION_WRONG.values(), ids=OWN_MOTION_WRONG)
def test_what_a_scene_with_a_motion_of_its_own_does_not_take(hfsa, tokens, message):
    Path("own.toml").write_text(OWN_MOTION)
    code, out, err = hfsa(tokens[0], "own.toml", *tokens[1:])
    assert (code, out) == (2, "")
    assert message in " ".join(err.split())
    assert not list(Path().rglob("*.h5"))


@pytest.mark.parametrize(("tokens", "message"), WRONG.values(), ids=WRONG)
def test_a_wrong_word_is_named_with_the_nearest_right_one(hfsa, tokens, message):
    code, out, err = hfsa(*tokens)
    assert (code, out) == (2, "")
    assert message in " ".join(err.split())
    assert not list(Path().rglob("*.h5"))


def test_a_build_that_fails_is_exit_code_3(hfsa, monkeypatch):
    def fail(*_):
        raise ExportError("no C compiler: tried cc, gcc, clang")

    monkeypatch.setattr("hfsa.fmus.export.export", fail)
    assert hfsa("export", "mass_on_spring") == (3, "", "error: no C compiler: tried cc, gcc, clang\n")


@pytest.mark.parametrize("code", [2, 3, 4])
def test_a_traceback_keeps_the_exit_code(hfsa, monkeypatch, code):
    def fail(*_):
        error = ExportError("it failed")
        error.exit_code = code
        raise error

    monkeypatch.setattr("hfsa.fmus.export.export", fail)
    found, _, err = hfsa("export", "mass_on_spring", "--traceback")
    assert found == code
    assert err.startswith("Traceback (most recent call last)")
    assert err.endswith("\nerror: it failed\n")


@pytest.mark.parametrize("variable", ["HFSA_CACHE", "XDG_CACHE_HOME"])
def test_a_cache_that_cannot_be_written_is_named(hfsa, monkeypatch, variable):
    monkeypatch.delenv("HFSA_CACHE", raising=False)
    Path("a_file").touch()
    monkeypatch.setenv(variable, "a_file")
    code, out, err = hfsa("run", "mass_on_spring")
    assert (code, out) == (2, "")
    assert err.startswith(f"error: ${variable} is a_file, but its folder a_file/")
    assert "cannot be written (" in err


def test_a_compiler_that_does_not_exist_is_named(hfsa, monkeypatch):
    for command in ("nonexistent -O3", "'open"):
        monkeypatch.setenv("CC", command)
        code, out, err = hfsa("export", "mass_on_spring", "-o", "built")
        assert (code, out) == (3, "")
        assert err.startswith(f"error: $CC is {command!r}, ")
    assert not list(Path().rglob("*.fmu"))


def test_a_file_given_twice_is_named(hfsa):
    hfsa(*LINEAR, "--points", "3", "-o", "l.h5")
    for again in ("l.h5", "./l.h5"):
        code, _, err = hfsa("bode", "l.h5", again, "-o", "x.png")
        assert (code, err) == (2, "error: l.h5 is given twice; expected each results file once\n")


@pytest.mark.parametrize("verb", ["run", "sweep", "stability", "compare --over mass.damping=1,2"])
def test_a_folder_is_no_scene(hfsa, verb):
    Path("dir.toml").mkdir()
    code, _, err = hfsa(*verb.split(), "./dir.toml")
    assert (code, err) == (2, "error: ./dir.toml is a folder, expected the file of a scene\n")


@pytest.mark.parametrize("verb", ["export", "analyze"])
def test_the_file_of_a_scene_is_no_part(hfsa, verb):
    Path("own.toml").write_text(OWN_MOTION)
    Path("own.py").write_text("def own() -> 'Scene':\n    return None\n")
    for file in ("./own.toml", "./own.py"):
        code, _, err = hfsa(verb, file)
        assert code == 2
        assert err.startswith(f"error: {file} is a scene, expected a part; ")


def test_the_output_of_an_export_is_a_folder(hfsa):
    Path("a_file").write_text("mine")
    code, _, err = hfsa("export", "mass_on_spring", "-o", "a_file")
    assert (code, err) == (2, "error: -o a_file is a file, expected a folder\n")
    Path("MassOnSpring.fmi2.fmu").write_text("mine")
    code, _, err = hfsa("export", "mass_on_spring", "-o", ".")
    assert code == 2
    assert err.endswith("it is a text file, which is not replaced; -o names another folder\n")


def test_a_full_disk_is_exit_code_4(hfsa):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, hard))
    try:
        code, out, err = hfsa("sweep", "mass_on_spring", "--method", "linear", "--points", "9000", "-o", "big.h5")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert (code, out, err) == (4, "", "error: cannot write big.h5: File too large\n")
    assert list(Path().iterdir()) == []


def test_a_file_that_cannot_be_is_wrong_usage(hfsa):
    code, _, err = hfsa(*LINEAR, "--points", "2", "-o", "/dev/full/a.h5")
    assert code == 2
    assert "error: cannot write /dev/full/a.h5: " in err


def test_json_has_neither_nan_nor_numpy():
    value = {"a": np.array([[1.0, np.nan]]), "b": 1 + 2j, "c": np.int64(3), "d": Path("x"), "e": (np.inf, None, True)}
    assert strict_json(json.dumps(plain(value), allow_nan=False)) == {
        "a": [[1.0, None]],
        "b": {"real": 1.0, "imaginary": 2.0},
        "c": 3,
        "d": "x",
        "e": [None, None, True],
    }
