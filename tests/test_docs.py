"""The pages of `docs/`: their examples compute what they print, and their commands are commands."""

import doctest
import json
import re
import shlex
from pathlib import Path

import h5py
import numpy as np
import pytest

from hfsa.cosim.cli import main, parser
from hfsa.cosim.commands._shell import plain
from hfsa.cosim.masters.algorithms import ALGORITHMS
from hfsa.cosim.systems.scene import AUTO
from hfsa.cosim.systems.scene_file import read_scene_text

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "fmus/README.md", *sorted((ROOT / "docs").glob("*.md"))]
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(page: Path, *languages: str) -> list[str]:
    return [text for language, text in FENCE.findall(page.read_text()) if language in languages]


def commands() -> list[tuple[str, str]]:
    """Commands of all pages without their comments, lines that go on joined, with the page's name."""
    found = []
    for page in PAGES:
        for text in blocks(page, "console", "sh"):
            lines = text.replace("\\\n", " ").splitlines()
            found += [(page.name, line.split(" #")[0].strip().removeprefix("$ ")) for line in lines]
    return [(page, line) for page, line in found if re.match(r"(\.venv/bin/)?hfsa ", line)]


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "pycon")], ids=lambda page: page.name)
def test_examples_compute_what_they_print(page):
    text = "\n".join(blocks(page, "pycon"))
    test = doctest.DocTestParser().get_doctest(text, {}, page.name, str(page), 0)
    assert test.examples
    failed, _ = doctest.DocTestRunner(optionflags=doctest.REPORT_NDIFF).run(test)
    assert not failed


@pytest.mark.parametrize(("page", "line"), commands())
def test_commands_have_the_options_that_there_are(page, line):
    _, _, ignored = parser().parse_args(shlex.split(line)[1:], print_error=False, exit_on_error=False)
    assert not ignored


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "toml", "python")], ids=lambda page: page.name)
def test_scenes_are_scenes_and_python_is_python(page):
    for text in blocks(page, "toml"):
        assert read_scene_text(text).outputs
    for text in blocks(page, "python"):
        compile(text, page.name, "exec")


PAIR = re.compile(r"^```console\n(hfsa [^\n]*)\n```\n\n```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PAIRS = PAIR.findall((ROOT / "docs/python.md").read_text())


def test_each_command_of_the_readme_has_its_python():
    lines = {line.removeprefix(".venv/bin/") for page, line in commands() if page == "README.md"}
    assert lines
    assert lines <= {command for command, _ in PAIRS}


LONG = ("hfsa stability sdelta_hfsa", "hfsa compare", "hfsa sweep sdelta_shaker --method multisine")
"""Beginnings of commands that take too long for every run of the tests."""


@pytest.mark.parametrize(
    ("command", "python"),
    [pytest.param(*pair, id=pair[0], marks=pytest.mark.slow if pair[0].startswith(LONG) else ()) for pair in PAIRS],
)
def test_a_command_and_its_python_do_the_same(command, python, tmp_path, monkeypatch, capsys):
    """They write the same files with the same numbers, and answer the same."""
    one, other = tmp_path / "command", tmp_path / "python"
    one.mkdir()
    other.mkdir()
    monkeypatch.chdir(one)
    assert main([*shlex.split(command)[1:], "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    monkeypatch.chdir(other)
    found: dict = {}
    exec(python, found)
    if "--vary" in command:
        same_map(one / answer["file"], found)
        return
    assert written(one) == written(other)
    for file in written(one):
        same_file(one / file, other / file)
    match shlex.split(command)[1]:
        case "list":
            assert {entry["name"] for group in answer.values() for entry in group} == set(found["names"])
        case "analyze":
            assert plain(found["numbers"]) == {name: value for name, value in answer.items() if name != "units"}
        case "stability":
            limits = {a["algorithm"]: a["longest_step"] for a in answer["algorithms"] if "longest_step" in a}
            assert {name: value for name, value in plain(found["longest"]).items() if name in limits} == limits


def written(folder: Path) -> set[Path]:
    return {file.relative_to(folder) for file in folder.rglob("*") if file.suffix in (".h5", ".fmu")}


def same_map(file: Path, found: dict) -> None:
    """A map in a file and the same one returned, with the values of its axis that are stable."""
    mapped = found["found"]
    with h5py.File(file) as written_map:
        growth, stable, verified, values = (
            written_map["map"][name][...] for name in ("growth", "stable", "verified", mapped.axes[0].name)
        )
    np.testing.assert_array_equal(mapped.growth, growth)
    np.testing.assert_array_equal(mapped.stable, stable)
    np.testing.assert_array_equal(mapped.verified, verified)
    np.testing.assert_array_equal(mapped.axes[0].values, values)
    np.testing.assert_array_equal(found["stable"], values[stable.astype(bool)])
    assert 0 < found["stable"].size < values.size


def same_file(one: Path, other: Path) -> None:
    """Two results files with the same numbers, or two FMUs with the same bytes."""
    if one.suffix == ".fmu":
        assert one.read_bytes() == other.read_bytes()
        return
    with h5py.File(one) as a, h5py.File(other) as b:
        names: list[str] = []
        a.visititems(lambda name, node: names.append(name) if isinstance(node, h5py.Dataset) else None)
        assert names
        for name in names:
            if not name.endswith("wall_time") and a[name].dtype.kind in "fci":
                np.testing.assert_array_equal(a[name][...], b[name][...], name)


def test_the_advice_names_every_algorithm_once_and_no_other():
    text = (ROOT / "docs/algorithms.md").read_text()
    table = text[text.index("| algorithm | needs") :].split("\n\n")[0]
    named = [name for row in table.splitlines()[2:] for name in re.findall(r"`(\w+)`", row.split("|")[1])]
    assert sorted(named) == sorted([AUTO, *ALGORITHMS])


def test_the_readme_is_read_in_two_minutes():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 90
