"""Figures of the sources: every command of the table draws, and a figure that has commands is named once."""

import re
import shlex
from pathlib import Path

import pytest

from hfsa.cosim.cli import main

PAGE = (Path(__file__).parents[1] / "docs/figures.md").read_text(encoding="utf-8")
SECTIONS = [section.partition("\n") for section in re.split(r"^## ", PAGE, flags=re.MULTILINE)[1:]]


def rows() -> list[tuple[str, str, list[str]]]:
    """Source, figure and commands of each row of the tables."""
    found = []
    for heading, _, text in SECTIONS:
        for line in text.splitlines():
            cells = [cell.strip() for cell in line.strip("|").split(" | ")]
            if line.startswith("| ") and len(cells) == 3 and cells[0] != "figure":
                found.append((heading.partition(":")[0], cells[0], re.findall(r"`(hfsa [^`]*)`", cells[2])))
    return found


ROWS = rows()


def test_each_figure_of_a_source_is_in_one_row():
    named = [(source, figure) for source, figure, _ in ROWS]
    assert len(named) == len(set(named)) > 30
    assert all(commands for _, _, commands in ROWS)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("source", "figure", "commands"), ROWS, ids=[f"{source}-{figure}".replace(" ", "") for source, figure, _ in ROWS]
)
def test_the_commands_of_a_figure_draw_it(source, figure, commands, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for command in commands:
        assert main(shlex.split(command)[1:]) == 0, command
    picture = Path(shlex.split(commands[-1])[-1]).with_suffix(".png")
    assert picture.read_bytes().startswith(b"\x89PNG")
