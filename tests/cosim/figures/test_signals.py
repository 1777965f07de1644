"""Figures of recorded signals: what is drawn is what the file has, over time, over each other, and as clouds."""

from pathlib import Path

import numpy as np
import pytest

import hfsa.cosim
from hfsa.cosim import plot
from hfsa.cosim.results.recorded import read_recorded
from hfsa.cosim.results.records import ResultsError

VOLTS, LENGTHS = "stack[1..3].stack.voltage", "stage.stack[1..3].elongation"


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Two runs of the stage on a circle, a path of postures of the robot, and a sweep."""
    from hfsa.cosim.cli import main

    place = tmp_path_factory.mktemp("plot")
    for law in ("ctc", "pd"):
        arguments = {"motion": "circle", "law": law}
        hfsa.cosim.run("stage_tracking", arguments, every=25, path=place / f"{law}.h5", warn=lambda _: None)
    (place / "path.csv").write_text("x,y\n0,0\n0.01,0\n0,0.01\n")
    assert main(["analyze", "sdelta", "--path", str(place / "path.csv"), "-o", str(place / "path.h5")]) == 0
    hfsa.cosim.sweep("mass_on_spring", method="linear", points=3, path=place / "sweep.h5")
    return place


def lines(axes):
    """Drawn curves, (points, 2) each."""
    return [line.get_xydata() for line in axes.lines]


def test_numbers_of_a_table_are_drawn_over_the_argument_that_varies(tmp_path):
    from hfsa.components.rrr_stage import analyze
    from hfsa.cosim.cli import main

    for level in ("exact", "constant_jacobian"):
        over = ["--over", "elongation[2]=0:12e-6:5", "-o", str(tmp_path / f"{level}.h5")]
        assert main(["analyze", "rrr_stage", "--level", level, *over]) == 0
    files = [tmp_path / "exact.h5", tmp_path / "constant_jacobian.h5"]
    lengths, angles = plot(files, ["pose[1..3]"], x="elongation[2]", points=False).axes
    # the elements of a pose have two units, and so two panels
    assert [lengths.get_ylabel(), angles.get_ylabel()] == ["pose[1..2] (um)", "pose[3] (urad)"]
    poses = [analyze(level="exact", elongation=(0.0, s, 0.0))["pose"] for s in np.linspace(0, 12e-6, 5)]
    np.testing.assert_allclose(lines(angles)[0][:, 1], 1e6 * np.array(poses)[:, 2], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(lines(angles)[0][:, 0], np.linspace(0, 12, 5), atol=1e-9)
    assert read_recorded(files[0]).units["jacobian[3,1]"] == "rad/m"


def test_signals_over_time_are_those_of_the_file(folder):
    found = read_recorded(folder / "ctc.h5")
    (axes,) = plot(folder / "ctc.h5", [LENGTHS]).axes
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_title(loc="left")) == ("Time (ms)", "um", LENGTHS)
    for i, drawn in enumerate(lines(axes), 1):
        assert drawn[:, 0] == pytest.approx(1e3 * found.at, rel=1e-12)
        assert drawn[:, 1] == pytest.approx(1e6 * found.values[f"stage.stack[{i}].elongation"], rel=1e-12)


def test_without_names_all_but_limit_flags_are_drawn(folder):
    panels = {axes.get_title(loc="left") for axes in plot(folder / "ctc.h5").axes}
    assert panels == {
        "stage.platform.position[1..2]", "stage.platform.rotation", "stage.hinge.stress", LENGTHS, VOLTS,
        "stage.stack[1..3].force", "tracking.axis[1..3].error",
    }  # fmt: skip


def test_each_signal_over_its_own(folder):
    """Force over stroke of three stacks: by ranges, the first over the first."""
    found = read_recorded(folder / "pd.h5")
    (axes,) = plot(folder / "pd.h5", ["stage.stack[1..3].force"], x=LENGTHS).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == (f"{LENGTHS} (um)", "stage.stack[1..3].force (N)")
    for i, drawn in enumerate(lines(axes), 1):
        assert drawn[:, 0] == pytest.approx(1e6 * found.values[f"stage.stack[{i}].elongation"], rel=1e-12)
        assert drawn[:, 1] == pytest.approx(found.values[f"stage.stack[{i}].force"], rel=1e-12)


def test_a_path_in_one_unit_has_equal_scales(folder):
    """The circle of the platform is drawn as a circle, from the second turn on 2 um in radius."""
    figure = plot(folder / "ctc.h5", ["platform.position[2]"], x="platform.position[1]", low=0.2)
    (axes,), (drawn,) = figure.axes, lines(figure.axes[0])
    assert axes.get_aspect() == 1
    assert np.hypot(*drawn.T) == pytest.approx(2.0, rel=1e-3)
    assert (
        plot(folder / "ctc.h5", ["stack[1].stack.voltage"], x="stage.stack[1].elongation").axes[0].get_aspect()
        == "auto"
    )


def test_several_files_have_a_colour_each(folder):
    figure = plot([folder / "ctc.h5", folder / "pd.h5"], ["tracking.axis[1..2].error"])
    colours = [line.get_color() for line in figure.axes[0].lines]
    assert colours[0] == colours[1] != colours[2] == colours[3]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["ctc", "pd"]


def test_a_cloud_is_coloured_by_a_third_signal(folder):
    figure = plot(folder / "ctc.h5", ["platform.position[2]"], x="platform.position[1]", colour="platform.rotation")
    cloud, bar = figure.axes
    found = read_recorded(folder / "ctc.h5").values
    assert np.asarray(cloud.collections[0].get_offsets()) == pytest.approx(
        1e6 * np.transpose([found[f"stage.platform.position[{i}]"] for i in (1, 2)]), rel=1e-12
    )
    assert np.asarray(cloud.collections[0].get_array()) == pytest.approx(
        1e6 * found["stage.platform.rotation"], rel=1e-12
    )
    assert bar.get_ylabel() == "stage.platform.rotation (urad)"


def test_rows_without_time_are_points(folder):
    found = read_recorded(folder / "path.h5")
    figure = plot(folder / "path.h5", ["f1"], x="x")
    (line,) = figure.axes[0].lines
    assert (line.get_marker(), line.get_linestyle()) == (".", "None")
    assert line.get_xydata()[:, 1] == pytest.approx(found.values["f1"], rel=1e-12)
    assert plot(folder / "path.h5", ["f1"], points=False).axes[0].lines[0].get_linestyle() == "-"
    assert plot(folder / "path.h5", ["f1"], low=2).axes[0].lines[0].get_xdata().tolist() == [2, 3]


WRONG = {
    "sweep": (["sweep.h5"], {}, "holds no signals over time or rows, but frequency responses, which `hfsa bode` draws"),
    "name": (["ctc.h5"], {"signals": ["stage.stack[1].elongtion"]}, "no signal is called 'stage.stack[1].elongtion'"),
    "several": (["ctc.h5"], {"signals": ["stack.voltage"]}, "stack.voltage fits several signals"),
    "number": (["ctc.h5"], {"signals": [VOLTS], "x": "stage.stack[1..2].elongation"}, "3 signals cannot be drawn over"),
    "colours": (["ctc.h5", "pd.h5"], {"colour": "platform.rotation"}, "the colour stage.platform.rotation is for the"),
    "window": (["ctc.h5"], {"low": 7.0}, "has no time from 7; it has 0 to 0.6"),
    "file": (["none.h5"], {}, "there is no file"),
}


@pytest.mark.parametrize(("files", "options", "message"), WRONG.values(), ids=WRONG.keys())
def test_what_cannot_be_drawn_is_a_sentence(folder, files, options, message):
    with pytest.raises(ResultsError) as caught:
        plot([folder / file for file in files], options.pop("signals", ()), **options)
    assert message in str(caught.value)


def test_the_verb_writes_a_picture_beside_the_file(folder, hfsa):
    words = ["--x", VOLTS, "--signal", LENGTHS, "--from", "0.2"]
    code, out, err = hfsa("plot", folder / "ctc.h5", *words)
    assert (code, out, err) == (0, f"{folder / 'ctc.png'}\n", "")
    assert (folder / "ctc.png").read_bytes().startswith(b"\x89PNG")
    assert hfsa("plot", folder / "ctc.h5", folder / "pd.h5", "-o", folder / "two.pdf", "--json")[0] == 0
    assert (folder / "two.pdf").read_bytes().startswith(b"%PDF")
    code, _, err = hfsa("plot", folder / "ctc.h5", folder / "ctc.h5")
    assert code == 2
    assert "is given twice" in err
    code, _, err = hfsa("plot", folder / "ctc.h5", "-o", "stage.platform.rotation")
    assert code == 2
    assert "is a signal, which --signal takes" in err
