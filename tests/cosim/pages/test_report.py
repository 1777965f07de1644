"""Reports: every number on the page is that of its file, for every kind of results file."""

import base64
import json
import re
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from hfsa.cosim.pages.blocks import Section, paragraph, table
from hfsa.cosim.pages.provenance import provenance
from hfsa.cosim.pages.report_page import Part, report_page
from hfsa.cosim.results.files import read_run, read_sweep
from hfsa.cosim.results.stability_map import read_stability_map
from hfsa.cosim.results.trade import Trade

VARY = ["--vary", "bandwidth=2:60:4", "--vary", "sample_time=0.25e-3:2e-3:8", "-p", "delay=true", "--step", "0.25e-3"]


def page_of(file) -> tuple[str, list[dict]]:
    """Text of a page without its scripts, and its figures."""
    content = file.read_text()
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', content, re.DOTALL)
    assert found
    return re.sub(r"<script.*?</script>", "", content, flags=re.DOTALL), json.loads(found[1])["plots"]


def test_a_sweep_is_reported_with_its_points_and_their_errors(hfsa, tmp_path):
    assert hfsa("sweep", "mass_on_spring", "--points", "5", "-o", "s.h5")[0] == 0
    assert hfsa("report", "s.h5")[0] == 0
    text, plots = page_of(tmp_path / "s.html")
    bode = read_sweep(tmp_path / "s.h5")
    measured = [trace for trace in plots[0]["traces"] if trace["mode"] == "markers"]
    response = bode.entry("mass.position", "mass.base.position")
    np.testing.assert_allclose(measured[0]["x"], bode.frequency, rtol=1e-6)
    np.testing.assert_allclose(measured[0]["y"], 20 * np.log10(np.abs(response)), atol=1e-5)
    assert f"steps within {100 * bode.step_error[0, 0, 0]:.3g} %" in measured[0]["text"][0]
    assert f"{100 * np.nanmax(bode.step_error):.3g} %" in text
    for words in ("5 done", "tool version", "sha256", "MassOnSpring", "gauss_seidel", "The scene as a file"):
        assert words in text
    assert ": mass: mass_on_spring. Inputs: mass.base.position." in text
    hash_of_file = re.search(r"[0-9a-f]{16}", text[text.index("sha256") :])
    assert hash_of_file


def test_an_old_file_has_its_diagram_where_there_is_graphviz(monkeypatch):
    file = Path(__file__).parents[2] / "data" / "sweep_0.1.h5"
    drawn = "".join(map(str, provenance(file).blocks))
    assert drawn.count("<img") == 1
    monkeypatch.setattr("hfsa.cosim.pages.provenance.is_available", lambda: False)
    assert "".join(map(str, provenance(file).blocks)).count("<img") == 0


@pytest.mark.slow
def test_a_report_has_the_block_diagram_with_what_is_sampled(hfsa, tmp_path):
    tokens = ["--method", "linear", "--input", "command.position[3]", "--signal", "platform.position[3]"]
    assert hfsa("sweep", "sdelta_hfsa", *tokens, "--points", "3", "-o", "s.h5")[0] == 0
    assert hfsa("report", "s.h5")[0] == 0
    (content,) = re.findall(r'src="data:image/svg\+xml;base64,([^"]+)"', (tmp_path / "s.html").read_text())
    words = etree.fromstring(base64.b64decode(content)).find("{*}desc").text
    assert "controller: pd" in words
    assert words.count("sampled every 0.25 ms") == 1
    assert "From robot to drive[3]: drive[3].force, drive[3].torque to tube.force, tube.torque" in words


def test_a_verified_run_is_reported_with_its_errors(hfsa, tmp_path):
    assert hfsa("run", "mass_on_spring", "--frequency", "16", "--stop", "0.2", "--verify", "-o", "r.h5")[0] == 0
    assert hfsa("report", "r.h5", "-o", "page.html")[0] == 0
    text, plots = page_of(tmp_path / "page.html")
    values, _ = read_run(tmp_path / "r.h5")
    curves = {trace["name"]: trace for plot in plots for trace in plot["traces"]}
    found = np.array(curves["mass.position"]["y"])
    assert np.ptp(found) / np.ptp(values["mass.position"]) == pytest.approx(1e3, rel=1e-3)  # mm
    assert "Ended complete" in text
    assert "error of the communication steps is not known" not in text


@pytest.mark.slow
def test_a_map_and_a_trade_are_reported(hfsa, tmp_path):
    assert hfsa("stability", "sdelta_hfsa", *VARY, "-o", "m.h5")[0] == 0
    assert hfsa("trade", "mass_on_spring", "--tolerance", "1e-3", "-o", "t.h5")[0] == 0
    assert hfsa("report", "m.h5", "t.h5", "--title", "Both", "-o", "both.html")[0] == 0
    text, (growth, front) = page_of(tmp_path / "both.html")
    found = read_stability_map(tmp_path / "m.h5")
    assert f"{int(found.stable.sum())} of {int(found.built.sum())} points are stable" in text
    drawn = np.array(growth["traces"][0]["z"], dtype=float)
    np.testing.assert_allclose(drawn, found.growth.T, rtol=1e-6)
    trade = Trade.read(tmp_path / "t.h5")
    assert trade.best is not None
    assert trade.sentences[0].split()[0] in text
    star = next(trace for trace in front["traces"] if trace["name"] == "answer")
    assert star["x"] == [trade.best.cost]
    assert "<h1>Both</h1>" in text
    assert text.count('class="file"') == 2


def test_numbers_over_arguments_are_reported_as_a_table(hfsa, tmp_path):
    assert hfsa("analyze", "sdelta", "--over", "payload.mass=1,2,3", "-o", "a.h5")[0] == 0
    assert hfsa("report", "a.h5")[0] == 0
    text, plots = page_of(tmp_path / "a.html")
    assert not plots
    assert "payload.mass" in text
    assert "hfsa convert writes all of them" in text


def test_no_text_of_a_file_becomes_markup():
    section = Section("a < b", [paragraph("<script>alert(1)</script>"), table(["<b>"], [("<i>",)], "<u>")])
    from hfsa.cosim.pages.page import text

    content = text(report_page("<title>", [Part("<h>", [section])]))
    body = content[content.index("<body>") :]
    for words in ("<script>alert", "<b>", "<i>", "<u>", "<h>"):
        assert words not in body


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (["missing.h5"], "there is no file missing.h5"),
        (["notes.h5"], "notes.h5"),
        (["notes.h5", "-o", "report.pdf"], "expected the ending .html"),
    ],
    ids=["missing", "text", "ending"],
)
def test_what_is_no_results_file_is_refused(hfsa, tmp_path, words, answer):
    (tmp_path / "notes.h5").write_text("no HDF5")
    code, _, err = hfsa("report", *words)
    assert code == 2
    assert answer in err
    assert not list(tmp_path.glob("*.html"))
