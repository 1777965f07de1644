"""`analyze --over`: one table of cases, with reasons where a case cannot be."""

import json

import h5py
import numpy as np
import pytest

from hfsa.components.rrr_stage import analyze
from hfsa.cosim.cli import main
from hfsa.cosim.experiments.over import parse_over
from hfsa.cosim.systems.errors import StructureError


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_cases_are_those_of_single_analyses(capsys):
    words = ["analyze", "rrr_stage", "--over", "voltage=150,0,0;0,75,0", "--over", "resolution=1e-8:3e-8:2"]
    assert main([*words, "--json", "-o", "cases.h5"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["over"] == {
        "voltage": ["150,0,0", "150,0,0", "0,75,0", "0,75,0"],
        "resolution": ["1e-08", "3e-08", "1e-08", "3e-08"],
    }
    expected = [analyze(voltage=v, resolution=r) for v in ((150.0, 0, 0), (0, 75.0, 0)) for r in (1e-8, 3e-8)]
    with h5py.File("cases.h5") as file:
        for name in ("pose_at_voltage", "step", "natural_frequencies_hz"):
            rows = np.array([numbers[name] for numbers in expected])
            np.testing.assert_allclose(found["numbers"][name], rows, rtol=1e-12, atol=1e-20)
            np.testing.assert_allclose(file["analyses"][name], rows, rtol=1e-12, atol=1e-20)
        assert file["analyses/natural_frequencies_hz"].attrs["units"] == "Hz"
        np.testing.assert_allclose(file["over/resolution"], [1e-8, 3e-8, 1e-8, 3e-8])


def test_the_text_is_one_table_with_units_and_sentences_beside(capsys):
    assert main(["analyze", "rrr_stage", "--over", "elongation=0,0,0;12e-6,12e-6,0"]) == 0
    out = capsys.readouterr().out
    lines = {line.split()[0]: line.split() for line in out.splitlines() if line}
    assert lines["pose[3]"][1] == "rad"
    stress = analyze(elongation=(12e-6, 12e-6, 0.0))["hinge_stress"]["B1"]
    assert float(lines["hinge_stress.B1"][3]) == pytest.approx(stress, rel=1e-5)
    assert "case 2: hinge_limit: hinge B1 bends most" in out


def test_a_case_that_cannot_be_has_a_reason(capsys):
    assert main(["analyze", "rrr_stage", "--over", "links.crank=7e-3,17e-3", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["numbers"]["range"][0] == [None, None, None]
    assert found["refusals"][0]["case"] == 1
    assert "the links do not close" in found["refusals"][0]["reason"]


def test_every_part_with_numbers(capsys):
    assert main(["analyze", "beam_module", "--over", "tilt=30:60:3", "-p", "kind=tilted"]) == 0
    assert main(["analyze", "stage_closed_loop", "--over", "law=pd,ctc"]) == 0
    assert "verdict" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--over", "links.arm=3e-3", "-p", "links.arm=4e-3"], "links.arm is given with -p and with --over"),
        (["--over", "links.arms=3e-3"], "no argument 'links.arms'"),
        (["--over", "links.arm"], "is not of the form NAME=VALUES"),
        (["--over", "links.arm=3e-3", "--sensitivity"], "--sensitivity and --over are different studies"),
        (["--over", "links.arm=0,-1"], "links.arm is 0 m"),
    ],
    ids=["twice", "unknown", "no values", "study", "none possible"],
)
def test_mistakes_are_named(capsys, words, message):
    assert main(["analyze", "rrr_stage", *words]) == 2
    assert message in capsys.readouterr().err


def test_values_in_words():
    assert parse_over(["a=0:1:3", "b=x:y", "c=1,2;3,4"]) == {
        "a": ("0.0", "0.5", "1.0"),
        "b": ("x:y",),
        "c": ("1,2", "3,4"),
    }
    assert parse_over(["n=3:6:4", "m=3:6:3"]) == {"n": ("3", "4", "5", "6"), "m": ("3.0", "4.5", "6.0")}
    with pytest.raises(StructureError, match="'0:1:0', expected FIRST:LAST:COUNT"):
        parse_over(["a=0:1:0"])
