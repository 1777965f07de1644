"""Design studies on the command line: answers, file and picture of a map, conflicting options."""

import json
from itertools import combinations
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

from hfsa import components
from hfsa.components._mechanics.tba_design import DESIGNS
from hfsa.components._modelling.catalogue import find
from hfsa.components._modelling.study import optimum, response_map
from hfsa.cosim.commands._studies import as_record
from hfsa.cosim.figures.response_map import response_map_figure

PART = ["analyze", "tba_accelerometer"]


def test_sensitivities_are_sorted(hfsa):
    code, out, _ = hfsa(*PART, "-p", "design=optimum", "--sensitivity", "--json")
    found = json.loads(out)
    ratio = found["sensitivity"]["frequency_ratio"]
    assert code == 0
    assert sorted(map(abs, ratio.values()), reverse=True) == [abs(value) for value in ratio.values()]
    assert all(list(of) == list(ratio) == list(found["dimensions"]) for of in found["sensitivity"].values())
    numbers = json.loads(hfsa(*PART, "-p", "design=optimum", "--json")[1])
    assert ratio == numbers["sensitivity"]
    assert found["responses"]["frequency_ratio"] == numbers["formula_frequency_ratio"]
    code, out, _ = hfsa(*PART, "--sensitivity")
    assert code == 0
    rows = [line.split()[0] for line in out.splitlines()[3:12]]
    assert rows == ["w", "tm", "c", "e", "l", "a", "b", "d", "s"]
    assert "20 um" in out


def test_sensitivities_say_what_does_not_follow_of_the_sentences_on_figure_4(hfsa):
    """L in words a third of tm, all others below 15 %, and a bar d that lowers f3/f1."""
    code, out, _ = hfsa(*PART, "--sensitivity")
    assert code == 0
    text = " ".join(out.split())
    found = [json.loads(hfsa(*PART, "-p", f"design={d}", "--json")[1])["sensitivity"] for d in DESIGNS]
    foot, leg = ([abs(of[name] / of["tm"]) for of in found] for name in ("l", "c"))
    assert (
        f"of l is {foot[0]:.2f} (mems), {foot[1]:.2f} (optimum) and {foot[2]:.2f} (rapid_prototype) of that of tm"
        in text
    )
    assert f"that of c is {leg[0]:.2f}, {leg[1]:.2f} and {leg[2]:.2f} of it, in words below 15 %" in text
    assert all(of["d"] > 0 for of in found)
    assert "d raises f3/f1, in words it lowers it" in text
    assert all(max(of, key=lambda name: abs(of[name])) == "w" for of in found)
    for words in (["limbs=4"], ["k_out_rule=plus"]):
        assert "figure 4" not in hfsa(*PART, "-p", *words, "--sensitivity")[1]


def test_a_map_opens_in_xarray_with_named_axes(hfsa):
    code, out, _ = hfsa(*PART, "--map", "tm=10e-6:300e-6,l", "-o", "maps/feet.h5", "--json")
    found = json.loads(out)
    assert (code, found["file"], found["picture"]) == (0, "maps/feet.h5", "maps/feet.png")
    assert Path("maps/feet.png").stat().st_size > 10_000
    with xarray.open_dataset("maps/feet.h5", group="map", engine="h5netcdf") as read:
        assert read.frequency_ratio.dims == ("tm", "l")
        assert (read.tm.attrs["units"], read.frequency_ratio.attrs["units"], read.f_in.attrs["units"]) == (
            "m",
            "1",
            "Hz",
        )
        assert read.tm.attrs["long_name"] == "Thickness of a foot"
        assert [float(read.l[0]), float(read.l[-1])] == pytest.approx([105e-6, 420e-6])
        ratio = read.frequency_ratio.load()
        at = read.sel(tm=20e-6, l=210e-6, method="nearest")
        assert [float(at[name]) for name in ("frequency_ratio", "f_in", "f_out")] == pytest.approx(
            [2.245085, 5818.906, 13063.94], rel=1e-6
        )
    assert float(ratio.isnull().mean()) == found["impossible"] > 0.2
    best = found["responses"]["frequency_ratio"]["highest"]
    assert best["value"] == float(ratio.max()) == float(ratio.sel(best["at"]))
    with xarray.open_dataset("maps/feet.h5", group="design", engine="h5netcdf") as design:
        assert float(design.value.sel(dimension="tm")) == pytest.approx(20e-6)
        assert set(design.unit.values) == {"m"}
    with h5py.File("maps/feet.h5") as file:
        assert file.attrs["status"].rstrip(b"\0") == b"complete"
        assert file["system"].attrs["scene"] == "tba_accelerometer"


def test_a_map_has_a_usual_place_and_says_what_it_found(hfsa):
    code, out, _ = hfsa(*PART, "-p", "k_out_rule=plus", "--map", "w,c")
    assert code == 0
    title = "tba_accelerometer, design mems, springs in series"
    assert out.startswith(f"{title}: w 150 um to 600 um, c 100 um to 400 um\n  frequency_ratio: lowest")
    assert out.splitlines()[-2:] == [f"results/tba_accelerometer_map.{ending}" for ending in ("h5", "png")]
    with h5py.File("results/tba_accelerometer_map.h5") as file:
        assert file["system"].attrs["scene"] == "tba_accelerometer k_out_rule=plus"
        assert np.isfinite(file["map/f_out"][:]).all()


@pytest.mark.parametrize(
    ("low", "high", "entries"),
    [
        (1e-5, 4e-5, ["the design"]),
        (1e-5, 3e-4, ["the design", "blank: cannot be built"]),
        (3e-5, 4e-5, []),
    ],
)
def test_a_picture_marks_the_design_and_what_is_blank(low, high, entries):
    study = find([components])["tba_accelerometer"].design_study()
    figure = response_map_figure(as_record(response_map(study, {"tm": (low, high), "l": None}, points=11)))
    panels = [axes for axes in figure.axes if axes.get_xlabel()]
    assert [axes.get_xlabel() for axes in panels] == ["Thickness of a foot, tm (um)"] * 3
    assert panels[0].get_legend_handles_labels()[1] == entries
    assert [text.get_text() for legend in figure.legends for text in legend.get_texts()] == entries
    assert panels[0].get_title(loc="left").endswith("\nthe design: 2.245")
    for axes in panels:
        boxes = [text.get_window_extent() for text in axes.texts]
        assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
    left, right = panels[0].get_xlim()
    assert (left, right) == pytest.approx((1e6 * low, 1e6 * high))


def test_an_optimum_says_what_stops_it_and_what_to_think_of_the_printed_one(hfsa):
    words = [*PART, "-p", "design=optimum", "--optimize", "--bounds", "10,tm=2e-5:3e-5,w=3e-4"]
    code, out, _ = hfsa(*words, "--json")
    found = json.loads(out)
    assert (code, found["is_converged"], found["maximised"]) == (0, True, "frequency_ratio")
    dimensions = found["dimensions"]
    assert (dimensions["tm"]["at_bound"], dimensions["tm"]["value"]) == ("lower", pytest.approx(2e-5))
    assert (dimensions["w"]["at_bound"], dimensions["w"]["bounds"]) == ("held", [3e-4, 3e-4])
    assert dimensions["a"]["bounds"] == pytest.approx([10.8e-3, 13.2e-3])
    assert dimensions["s"]["at_bound"] is None
    assert found["active_requirements"] == ["a leg and its two feet no longer than a link (e + 2 l <= h)"]
    assert found["responses"]["frequency_ratio"] > found["present"]["frequency_ratio"] == pytest.approx(1.506, abs=5e-4)
    code, out, _ = hfsa(*words)
    assert code == 0
    for text in ("active: a leg and its two feet", "Solve_Succeeded", "1.506", "2.884", "15.2 um", "59.5 um"):
        assert text in out
    assert "The printed optimum does not follow from the printed formulas" in out
    assert "The source's bounds and requirements on its dimensions are not known" in out


def test_an_optimum_that_did_not_converge_is_a_problem(hfsa, monkeypatch):
    monkeypatch.setattr(
        "hfsa.cosim.commands._studies.optimum", lambda study, limits: optimum(study, limits, iterations=1)
    )
    code, out, _ = hfsa(*PART, "--optimize")
    assert code == 1
    assert "NOT an optimum; IPOPT did not converge: Maximum_Iterations_Exceeded" in out


WRONG = {
    "part": (["analyze", "mass_on_spring", "--sensitivity"], "mass_on_spring offers no design study; these do: "),
    "argument": ([*PART, "--sensitivity", "-p", "mass=1,1,1"], "a design study has no argument 'mass'"),
    "level": (
        [*PART, "--sensitivity", "--level", "planar"],
        "a design study is of one level of the part and takes none",
    ),
    "design": ([*PART, "--optimize", "-p", "design=memes"], "design is 'memes', expected one of mems"),
    "impossible": ([*PART, "--optimize", "-p", "dimensions.s=1e-3"], "the frame must be larger than the proof mass"),
    "two": ([*PART, "--map", "tm,l", "--optimize"], "--map and --optimize are different studies"),
    "output": (
        [*PART, "--sensitivity", "-o", "x.h5"],
        "cannot write x.h5: its ending is no picture format",
    ),
    "bounds": ([*PART, "--bounds", "10"], "--bounds are bounds of an optimum, which takes --optimize"),
    "one dimension": ([*PART, "--map", "tm"], "a map has two dimensions, not 1: tm"),
    "same dimension": ([*PART, "--map", "tm,tm"], "--map names tm twice"),
    "dimension": ([*PART, "--map", "tn,l"], "no dimension 'tn'; did you mean tm"),
    "no range": ([*PART, "--map", "tm=,l"], "--map 'tm=,l' is not of the form NAME or NAME=LOW:HIGH"),
    "number": ([*PART, "--map", "tm=1e-6:much,l"], "--map tm has 'much', expected a number"),
    "reversed": ([*PART, "--map", "tm=4e-5:1e-5,l"], "the range of tm is 4e-05 to 1e-05, expected the lower end first"),
    "empty": ([*PART, "--map", "tm=4e-5,l"], "the range of tm is 4e-05 to 4e-05"),
    "nowhere": ([*PART, "--map", "s=1e-4:3e-3,l"], ": never a frame larger than the proof mass (s > a)"),
    "percent": (
        [*PART, "--optimize", "--bounds", "120"],
        "bounds are 120 % to either side, expected between 0 and 100",
    ),
    "bound": ([*PART, "--optimize", "--bounds", "tm=4e-5:1e-5"], "bounds of tm are 4e-05 to 1e-05"),
    "bound of": ([*PART, "--optimize", "--bounds", "tn=4e-5"], "no dimension 'tn'; did you mean tm"),
    "share": ([*PART, "--optimize", "--bounds", "wide"], "--bounds has 'wide', expected PERCENT or"),
    "shares": (
        [*PART, "--optimize", "--bounds", "10,20"],
        "has more than one PERCENT; bounds of one dimension are NAME=",
    ),
    "picture": ([*PART, "--map", "tm,l", "-o", "x.png"], "-o x.png is the map's HDF5 file; its picture is written"),
    "place": ([*PART, "--map", "tm,l", "-o", "/dev/null/x.h5"], "cannot write /dev/null/x.h5"),
}


@pytest.mark.parametrize(("tokens", "message"), WRONG.values(), ids=WRONG)
def test_a_wrong_word_is_named_with_the_right_one(hfsa, tokens, message):
    code, out, err = hfsa(*tokens)
    assert (code, out) == (2, "")
    assert message in " ".join(err.split())
    assert not list(Path().rglob("*.h5"))


def test_help_shows_the_study_apart(hfsa):
    _, out, _ = hfsa("analyze", "--help")
    assert "Design study" in out
    for option in ("--sensitivity", "--map", "--optimize", "--bounds", "-o"):
        assert option in out


def test_sensitivities_are_drawn_as_bars(hfsa, tmp_path, monkeypatch):
    made = []
    monkeypatch.setattr("hfsa.cosim.commands._studies.save", lambda figure, _: made.append(figure))
    code, out, _ = hfsa(*PART, "--sensitivity", "-o", str(tmp_path / "bars.png"), "--json")
    found = json.loads(out)
    assert code == 0
    (axes,) = made[0].axes
    for bars, of in zip(axes.containers, found["sensitivity"].values(), strict=True):
        assert [bar.get_height() for bar in bars] == pytest.approx(list(of.values()))
    assert [text.get_text() for text in axes.get_xticklabels()] == list(found["dimensions"])
