"""`hfsa new`: what it makes works as it is, by path and installed, and nothing is overwritten."""

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from hfsa.cosim.cli import main


def run(*command: str, cwd: Path, **environment: str) -> str:
    done = subprocess.run(
        command, cwd=cwd, env={**os.environ, **environment}, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_the_commands_of_its_readme_work_as_they_are(hfsa, tmp_path):
    code, out, err = hfsa("new", "Wafer-Stage")
    assert (code, err) == (0, "")
    assert out.endswith("cd Wafer-Stage\nhfsa run scene.toml\nhfsa sweep scene.toml\npytest\n")
    folder = tmp_path / "Wafer-Stage"
    (block,) = re.findall(r"```console\n(.*?)```", (folder / "README.md").read_text(), re.DOTALL)
    *commands, tests = block.splitlines()
    for line in commands:
        run(sys.executable, "-m", "hfsa.cosim.cli", *line.split()[1:], cwd=folder)
    assert {"scene_run.h5", "scene.h5"} <= {file.name for file in (folder / "results").iterdir()}
    assert re.search(r"\d passed", run(sys.executable, "-m", tests, cwd=folder))
    assert not [
        file for file in folder.rglob("*") if file.is_file() and "my_machine" in file.read_text(errors="ignore")
    ]
    code, out, _ = hfsa("list", "Wafer-Stage/wafer_stage")
    assert code == 0
    for name in ("position_controller", "stage", "voice_coil"):
        assert f"  {name}\n" in out
    assert "cannot be used" not in out


@pytest.mark.slow
def test_its_parts_have_names_once_installed(hfsa, tmp_path):
    hfsa("new", "gantry")
    run(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", ".", "gantry", cwd=tmp_path)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "site")
    where = {"PYTHONPATH": str(tmp_path / "site")}
    out = run(sys.executable, "-m", "hfsa.cosim.cli", "analyze", "stage", cwd=tmp_path, **where)
    assert out.startswith("resonance = 15.91549 Hz\n")
    # the part of the folder and that of the package are two files of one name, but the scene names its own by path
    run(sys.executable, "-m", "hfsa.cosim.cli", "list", "gantry/scene.toml", cwd=tmp_path, **where)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("full", "full exists and is not empty; expected a new folder"),
        ("a_file", "a_file exists and is not empty; expected a new folder"),
        ("3d", "'3d' is no name of a Python package"),
        ("class", "'class' is no name of a Python package"),
        ("numpy", "numpy is a Python package already; name the folder otherwise, such as numpy_machine"),
        ("größe", "'größe' is no name of a Python package; expected the letters a to z"),
        ("stage-", "'stage-' is no name of a Python package"),
        ("hfsa", "hfsa is a Python package already; name the folder otherwise, such as hfsa_machine"),
        ("tests", "tests is a Python package already"),
        ("a_file/inside", "a_file/inside cannot be written: Not a directory"),
    ],
)
def test_what_cannot_be_made_is_refused(hfsa, tmp_path, name, message):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "notes.txt").write_text("mine")
    (tmp_path / "a_file").touch()
    code, out, err = hfsa("new", name)
    assert (code, out) == (2, "")
    assert err.startswith(f"error: {message}")
    assert sorted(file.name for file in tmp_path.rglob("*")) == ["a_file", "full", "notes.txt"]


def test_an_empty_folder_is_taken(tmp_path, monkeypatch, capsys):
    (tmp_path / "press").mkdir()
    monkeypatch.chdir(tmp_path / "press")
    assert main(["new", "."]) == 0
    assert (tmp_path / "press" / "press" / "__init__.py").is_file()
