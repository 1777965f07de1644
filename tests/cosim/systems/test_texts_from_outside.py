"""Scene files of any encoding, and with programs elsewhere: read, or refused in one sentence, and told."""

from pathlib import Path

import pytest

from hfsa.cosim.assembly.outside import outside
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene_file import read_scene, read_scene_text

TEXT = """inputs = ["mass.base.position"]
outputs = ["mass.position"]
band = [1.0, 100.0]
amplitude = { m = 1e-3 }
step_size = 1e-3
stop_time = 0.05

[[components]]
name = "mass"
part = "mass_on_spring"
"""


@pytest.mark.parametrize("code", ["utf-8", "utf-8-sig"])
def test_a_mark_of_the_byte_order_is_no_text(code, tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text(TEXT, encoding=code)
    assert read_scene(file) == read_scene_text(TEXT)


@pytest.mark.parametrize(("code", "byte"), [("utf-16", "byte 0 is 0xff"), ("latin-1", r"byte \d+ is 0xdf")])
def test_another_encoding_is_a_sentence(code, byte, tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text(TEXT.replace('name = "mass"', 'name = "maß"'), encoding=code)
    with pytest.raises(StructureError, match=f"scene.toml: not a TOML document: {byte}, expected text in UTF-8"):
        read_scene(file)


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("step_size", "1e-320", "make more than 9.0072e.15 steps, expected fewer"),
        ("stop_time", "1.7e308", "make more than 9.0072e.15 steps, expected fewer"),
        ("step_size", "1" + "0" * 400, "step_size is 1000.*, expected a number"),
        ("outputs", '["{0.__class__}.position"]', "no component is called '{0'"),
        ("outputs", '["mass.position[1..99999999999]"]', "more members than 1000000"),
    ],
    ids=["denormal_step", "endless", "digits", "format", "range"],
)
def test_extreme_values_are_sentences(key, value, sentence):
    lines = [line for line in TEXT.splitlines() if not line.startswith(f"{key} ")]
    with pytest.raises(StructureError, match=sentence):
        read_scene_text("\n".join([f"{key} = {value}", *lines]))


def test_numbers_are_of_64_bits():
    """A whole number is written as any other, also one that no file could hold as such."""
    text = TEXT.replace("stop_time = 0.05", "stop_time = 2") + "\n"
    scene = read_scene_text("tolerance = 99999999999999999999999999\n" + text)
    assert isinstance(scene.tolerance, float)
    assert (scene.stop_time, scene.tolerance) == (2.0, 1e26)


def test_programs_elsewhere_are_told(tmp_path):
    """An FMU beside the scene is not, one above it, or behind a link to elsewhere, is."""
    folder, other = tmp_path / "scenes", tmp_path / "other"
    folder.mkdir()
    other.mkdir()
    (folder / "link.fmu").symlink_to(other / "Box.fmu")
    for part, place in {
        "Box.fmu": None,
        "../other/Box.fmu": other,
        "link.fmu": other,
        "/tmp/x.py": Path("/tmp"),
    }.items():
        file = folder / "scene.toml"
        file.write_text(TEXT.replace("mass_on_spring", part))
        told = outside(file, read_scene(file))
        assert len(told) == (place is not None)
        assert all(f"mass: {place}" in sentence for sentence in told)
