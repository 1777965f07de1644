"""Pages of drawings: what their data say, what a page needs, and what is refused."""

import json
import re

import numpy as np
import pytest

from hfsa.components import Drawing, Layer, ModelError, Panel
from hfsa.cosim.pages import page as page_module
from hfsa.cosim.pages.drawing_page import drawing_page
from hfsa.cosim.pages.page import text, write_page
from hfsa.cosim.results.records import ResultsError

LINE = Layer(
    np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.002]]),
    np.array([[0, 1]]),
    "moved",
    "a <b> & c",
    notes=["2 mm"],
    rest=np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.001]]),
)
DRAWING = Drawing("One </script> line", [Panel([LINE], title="only")])


def data_of(content: str) -> dict:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', content, re.DOTALL)
    assert found
    return json.loads(found[1])


def test_a_page_holds_points_and_rest_in_the_unit_that_it_names():
    layer = data_of(text(drawing_page(DRAWING)))["panels"][0]["layers"][0]
    assert data_of(text(drawing_page(DRAWING)))["panels"][0]["unit"] == "mm"
    np.testing.assert_allclose(layer["points"], [[0, 0], [0, 0], [0, 2]])
    np.testing.assert_allclose(layer["rest"], [[0, 0], [0, 0], [0, 1]])
    assert layer["notes"] == ["2 mm"]


def test_no_text_of_a_drawing_becomes_markup():
    content = text(drawing_page(DRAWING))
    assert "One &lt;/script&gt; line" in content
    assert "One </script>" not in content
    assert data_of(content)["panels"][0]["layers"][0]["name"] == "a &lt;b&gt; &amp; c"


def test_a_page_asks_for_nothing_from_elsewhere():
    own = text(drawing_page(DRAWING)).replace(page_module._plotly(), "")
    assert not re.search(r"(src|href)\s*=|@import|url\(", own)
    assert own.count("<script") == 4


def test_panels_of_a_plane_have_a_third_coordinate_of_zero():
    flat = Drawing("Flat", [Panel([Layer(np.array([[1.0, 2.0]]), np.array([[0]]))], axes=("X", "Y"))])
    panel = data_of(text(drawing_page(flat)))["panels"][0]
    assert panel["is_flat"]
    assert panel["title"] == "panel 1"
    assert panel["layers"][0]["points"] == [[1.0], [2.0], [0.0]]


def test_only_a_page_of_hfsa_is_replaced(tmp_path):
    file = tmp_path / "part.html"
    write_page(file, drawing_page(DRAWING))
    write_page(file, drawing_page(DRAWING))
    file.write_text("<!doctype html><p>mine</p>")
    with pytest.raises(ResultsError, match="a text file, which is not replaced"):
        write_page(file, drawing_page(DRAWING))
    assert file.read_text() == "<!doctype html><p>mine</p>"


def test_a_page_that_no_browser_would_open_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(page_module, "LARGEST", page_module.LARGEST._replace(size=1e6))
    with pytest.raises(ResultsError, match=r"4\.8 MB, expected at most 1 MB; a coarser mesh"):
        write_page(tmp_path / "part.html", drawing_page(DRAWING))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"rest": [[0.0, 0.0, 0.0]]}, "at rest are of shape"),
        ({"rest": [[0.0, 0.0, np.nan], [0.0, 0.0, 1.0]]}, "points at rest have NaN"),
        ({"notes": ["one", "two"]}, "has 2 notes, expected 1, one per cell"),
    ],
    ids=["shape", "nan", "notes"],
)
def test_a_layer_that_cannot_move_is_refused(fields, words):
    with pytest.raises(ModelError, match=words):
        Layer(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.array([[0, 1]]), **fields)


def test_the_command_writes_a_page_by_default_and_a_picture_by_its_ending(hfsa, tmp_path):
    code, out, _ = hfsa("view", "tba_accelerometer", "--json")
    assert code == 0
    assert json.loads(out)["page"] == "tba_accelerometer.html"
    assert (tmp_path / "tba_accelerometer.html").stat().st_size < 6e6
    assert hfsa("view", "tba_accelerometer", "-o", "sensor.svg")[0] == 0
    assert (tmp_path / "sensor.svg").read_text().startswith("<?xml")


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (["pd"], "pd offers no picture"),
        (["mass_on_spring", "-o", "x.txt"], "mass_on_spring offers no picture"),
        (["sdelta", "-o", "x.txt"], "its ending is no picture format"),
        (["sdelta", "-p", "posture.position=9,9,9"], "posture"),
        (["rrr_stage", "-p", "kinematics=measured"], "measured"),
    ],
    ids=["controller", "undrawn", "ending", "posture", "measured"],
)
def test_what_cannot_be_drawn_is_refused(hfsa, tmp_path, words, answer):
    code, _, err = hfsa("view", *words)
    assert code == 2
    assert answer in err
    assert not list(tmp_path.iterdir())
