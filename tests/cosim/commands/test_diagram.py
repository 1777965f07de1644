"""Diagrams on the command line: scenes of one's own with foreign FMUs, endings, and files that stay."""

import json
import shutil

import pytest
from pygraphviz import AGraph

SCENE = """
inputs = ["box.u"]
outputs = ["mass.position"]
amplitude = {{ "1" = 1.0 }}
step_size = 1e-3
stop_time = 1.0

[[components]]
name = "box"
part = "{part}"

[[components]]
name = "mass"
part = "mass_on_spring"

[[connections]]
start = "box.y"
end = "mass.base.position"
factor = 0.001
"""


def test_a_scene_of_ones_own_with_a_foreign_fmu(hfsa, foreign, tmp_path):
    shutil.copy(foreign[3], tmp_path / "Box.fmu")
    (tmp_path / "mine.toml").write_text(SCENE.format(part="Box.fmu"))
    code, out, _ = hfsa("view", "mine.toml", "--diagram", "-o", "mine.dot", "--json")
    assert code == 0
    answer = json.loads(out)
    assert (answer["blocks"], answer["foreign"], answer["sampled"]) == (["box", "mass"], ["box"], [])
    graph = AGraph(string=(tmp_path / "mine.dot").read_text())
    assert graph.get_node("box").attr["label"] == "box\\nBox.fmu\\nFMI 3"
    assert graph.get_edge("box", "mass").attr["label"] == "y\\nx 0.001"
    assert str(tmp_path) not in (tmp_path / "mine.dot").read_text()


def test_a_level_to_be_chosen_is_drawn_as_one(hfsa, tmp_path):
    assert hfsa("view", "stage_tracking", "--diagram", "-p", "stack[1].level=auto", "-o", "a.dot")[0] == 0
    text = (tmp_path / "a.dot").read_text()
    assert "pzt_stack, auto, up to " in text
    assert "sampled every 0.01 ms" in text


@pytest.mark.parametrize("ending", ["svg", "png", "pdf"])
def test_a_picture_by_its_ending(hfsa, tmp_path, ending):
    file = tmp_path / f"mass.{ending}"
    for _ in range(2):
        code, out, err = hfsa("view", "mass_on_spring", "--diagram", "-o", file)
        assert (code, err) == (0, "")
    assert out.endswith(f": 1 component, 0 connections\n{file}\n")
    assert file.stat().st_size > 1000


WRONG = {
    "part": (["sdelta"], "sdelta is a part, expected a scene"),
    "name": (["sdelta_hfs"], "no scene is called 'sdelta_hfs'; did you mean sdelta_hfsa"),
    "file": (["mine.toml"], "there is no file mine.toml"),
    "ending": (["mass_on_spring", "-o", "mass.dox"], ".webp, or .dot for text"),
    "text": (["mass_on_spring", "-o", "notes.dot"], "it is a text file, which is not replaced"),
    "picture": (["mass_on_spring", "-o", "notes.svg"], "it is a text file, which is not replaced"),
    "results": (["run.h5"], "run.h5 is a results file, expected a scene"),
    "level": (["mass_on_spring", "--level", "auto"], "--level, --from and --to do not apply to a diagram"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_usage_leaves_every_file(hfsa, tmp_path, case):
    tokens, words = WRONG[case]
    for name in ("notes.dot", "notes.svg"):
        (tmp_path / name).write_text("my own notes")
    code, _, err = hfsa("view", *tokens, "--diagram")
    assert code == 2
    assert words in err
    assert {file.name for file in tmp_path.iterdir()} == {"notes.dot", "notes.svg"}
    assert (tmp_path / "notes.dot").read_text() == "my own notes"


def test_a_scene_without_the_option_says_how(hfsa):
    code, _, err = hfsa("view", "sdelta_hfsa")
    assert (code, "--diagram draws the blocks of a scene" in err) == (2, True)
