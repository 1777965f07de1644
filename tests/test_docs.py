"""The pages of `docs/`: their examples compute what they print, and their commands are commands."""

import doctest
import re
import shlex
from pathlib import Path

import pytest

from hfsa.cosim.cli import app
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
    _, _, ignored = app.parse_args(shlex.split(line)[1:], print_error=False, exit_on_error=False)
    assert not ignored


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "toml", "python")], ids=lambda page: page.name)
def test_scenes_are_scenes_and_python_is_python(page):
    for text in blocks(page, "toml"):
        assert read_scene_text(text).outputs
    for text in blocks(page, "python"):
        compile(text, page.name, "exec")


def test_the_readme_is_read_in_two_minutes():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 90
