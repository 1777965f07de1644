"""Machines in a report: each is drawn at the time of its largest displacement, magnified as its caption says."""

import h5py
import numpy as np
import pytest

from hfsa.components._modelling.drawing import Layer, Panel
from hfsa.cosim.pages.blocks import Machine
from hfsa.cosim.pages.bodies import Body
from hfsa.cosim.pages.machine_section import machine_section
from hfsa.cosim.results.recorded import read_recorded

TIME = np.linspace(0.0, 1.0, 11)
PANEL = Panel([Layer([[0.0, 0, 0], [1.0, 0, 0]], [[0, 1]], "mark"), Layer([[0.0, 0, 1], [1.0, 0, 1]], [[0, 1]])])


def body(shift: np.ndarray) -> Body:
    """A bar above a base that stands still."""
    return Body("bar", PANEL, [None, np.stack([shift, shift], axis=1)], [shift[:, 0]])


@pytest.fixture
def recorded(hfsa):
    assert hfsa("run", "mass_on_spring", "--stop", "1", "--every", "1000", "-o", "r.h5")[0] == 0
    return read_recorded("r.h5")


def test_a_body_is_drawn_where_it_is_farthest_from_rest(recorded):
    shift = np.outer(np.sin(2 * np.pi * TIME), [0.0, 3e-6, -1e-6])
    (block,) = machine_section(recorded, [body(shift)], []).blocks
    assert isinstance(block, Machine)
    row = int(np.argmax(np.abs(shift).max(axis=1)))
    still, base, bar = block.panel["layers"]
    assert still["points"] == bar["rest"]
    assert base["rest"] is None
    drawn = np.array(bar["points"]).T - np.array(bar["rest"]).T
    np.testing.assert_allclose(drawn, 2e4 * np.tile(shift[row], (2, 1)), rtol=1e-5)
    where = f"bar at {recorded.at[row]:.5g} s, where it is farthest from rest"
    assert block.words == f"{where}; its displacements are drawn 20000 times as large"


def test_a_body_that_stands_still_is_drawn_once(recorded):
    (block,) = machine_section(recorded, [body(np.zeros((11, 3)))], []).blocks
    assert isinstance(block, Machine)
    assert [layer["rest"] for layer in block.panel["layers"]] == [None, None]
    assert block.words == "bar, which stands still"


def test_a_run_that_failed_at_once_has_no_machine_to_draw(recorded):
    empty = recorded.__class__(recorded.path, recorded.title, recorded.axis, np.empty(0), {}, {})
    blocks = machine_section(empty, [body(np.empty((0, 3)))], []).blocks
    assert blocks == ["<p>bar is not drawn: no row of the file has a number for every signal.</p>"]


@pytest.mark.parametrize("value", [np.nan, np.inf], ids=str)
def test_a_motion_that_is_no_number_is_told(recorded, value):
    shift = np.zeros((11, 3))
    shift[4, 1] = value
    blocks = machine_section(recorded, [body(shift)], ["robot is not drawn: <x> not recorded"]).blocks
    assert blocks == [
        "<p>bar is not drawn: its motion has values that are no numbers.</p>",
        "<p>Robot is not drawn: &lt;x&gt; not recorded.</p>",
    ]


def test_a_run_whose_scene_cannot_be_read_is_reported_without_machines(hfsa, tmp_path, recorded):
    with h5py.File("r.h5", "r+") as file:
        file["system"].attrs["scene"] = "no scene"
    assert hfsa("report", "r.h5")[0] == 0
    content = (tmp_path / "r.html").read_text()
    assert "No machine is drawn: " in content
    assert "<h3>Run</h3>" in content


@pytest.mark.slow
def test_a_run_of_the_robot_is_reported_with_the_robot(hfsa, tmp_path):
    assert hfsa("run", "sdelta_shaker", "--stop", "0.05", "-o", "r.h5")[0] == 0
    assert hfsa("report", "r.h5")[0] == 0
    content = (tmp_path / "r.html").read_text()
    assert "<h3>Machines</h3>" in content
    assert 'id="machine0"' in content
