"""Comparison of runs: numbers, table and figure, and refusals before anything runs."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from hfsa.cosim.experiments.over import parse_over
from hfsa.cosim.figures.comparison import comparison_figure
from hfsa.cosim.measurement.limit_flags import ActiveLimit
from hfsa.cosim.measurement.trial import Outcome, measure, thinned
from hfsa.cosim.results.files import read_run
from hfsa.cosim.signals.prefixes import readable

# Numbers --------------------------------------------------------------------------------------------------------------


def test_outputs_that_differ_in_indices_are_one_group():
    t = np.linspace(0, 1, 100_001)
    values = {
        "loop.axis[1].error": 3 * np.sin(2 * np.pi * t),
        "stage.hinge.stress": np.full_like(t, 7.0),
        "loop.axis[2].error": np.where(t < 0.5, -4.0, 1.0),
        "loop.axis[3].torque": np.zeros_like(t),
    }
    units = {"loop.axis[1].error": "m", "loop.axis[2].error": "m", "stage.hinge.stress": "Pa"}
    error, stress, torque = measure(t, values, units | {"loop.axis[3].torque": "N.m"})
    assert (error.name, error.label, error.unit) == ("loop.axis.error", "loop.axis[1..2].error", "m")
    assert error.members == ("loop.axis[1].error", "loop.axis[2].error")
    assert (error.peak, error.final) == (4.0, 1.0)
    assert error.rms == pytest.approx(np.sqrt(8.5), rel=1e-4)  # of the second, which is larger than 3 / sqrt(2)
    assert (stress.peak, stress.rms, stress.final, stress.label) == (7.0, 7.0, 7.0, "stage.hinge.stress")
    assert (torque.peak, torque.label) == (0.0, "loop.axis[3].torque")


def test_a_thinned_curve_keeps_every_extreme_and_both_ends():
    t = np.linspace(0, 1, 123_457)
    v = np.sin(200 * t)
    v[[777, 100_001]] = 9.0, -9.0
    time, values = thinned(t, v, 500)
    assert len(time) <= 1002
    assert np.all(np.diff(time) > 0)
    assert (time[0], time[-1], values.max(), values.min()) == (0.0, 1.0, 9.0, -9.0)
    assert np.array_equal(values, v[np.searchsorted(t, time)])
    assert np.array_equal(thinned(t[:50], v[:50], 500)[1], v[:50])


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (3.391e-7, "m", "339.1 nm"),
        (0.9999999e-6, "m", "1 um"),
        (-2.5e-4, "m/s", "-250 um/s"),
        (150.0, "V", "150 V"),
        (2.407e8, "Pa", "240.7 MPa"),
        (4e-18, "m", "4e-18 m"),
        (0.0, "N.m", "0 N.m"),
        (1e-4, "m2", "0.0001 m2"),
        (2e-3, "kg", "0.002 kg"),
        (0.05, "1", "0.05"),
    ],
)
def test_numbers_to_read_have_prefixes_where_their_unit_takes_one(value, unit, text):
    assert readable(value, unit) == text


# Runs -----------------------------------------------------------------------------------------------------------------


def test_a_comparison_says_of_each_run_what_its_file_holds(hfsa):
    code, out, err = hfsa("compare", "mass_on_spring", "--over", "damping=0.5,20", "--over", "mass.mass=1,2",
                          "--frequency", "15.9", "--stop", "1", "-j", "1", "-o", "out/it.png", "--json")  # fmt: skip
    assert (code, err) == (0, "")
    answer = json.loads(out)
    assert answer["over"] == {"damping": ["0.5", "20"], "mass.mass": ["1", "2"]}
    assert Path(answer["figure"]).read_bytes().startswith(b"\x89PNG")
    assert [Path(run["file"]).name for run in answer["runs"]] == [
        f"mass_on_spring_damping={d}_mass.mass={m}.h5" for d in ("0.5", "20") for m in ("1", "2")
    ]
    for run in answer["runs"]:
        values, units = read_run(run["file"])
        (group,) = run["groups"]
        position = values["mass.position"]
        assert (group["name"], group["unit"], group["members"]) == ("mass.position", "m", ["mass.position"])
        assert units["mass.position"] == "m"
        assert group["peak"] == np.abs(position).max()
        assert group["final"] == np.abs(position[-1])
        assert group["rms"] == pytest.approx(np.sqrt(np.mean(position**2)), rel=1e-12)
        assert (run["status"], run["steps"], run["stop_time"], run["limits"]) == ("complete", 10_000, 1.0, [])
        assert run["sampling"] is None
    peaks = [run["groups"][0]["peak"] for run in answer["runs"]]
    assert peaks[0] > 3 * peaks[2]  # at the resonance of 1 kg damping decides
    assert peaks[1] < peaks[0]  # 2 kg resonates elsewhere


@pytest.mark.slow
def test_a_comparison_tells_limits_and_the_sampling_limit(hfsa):
    words = ["--input", "command.position[3]", "--frequency", "20", "--stop", "0.3", "-j", "2"]
    code, out, err = hfsa("compare", "sdelta_hfsa", "--over", "torque_limit=7.16,1e-4", *words, "--json")
    assert (code, err) == (0, "")
    free, limited = json.loads(out)["runs"]
    assert free["limits"] == []
    assert {limit["kind"] for limit in limited["limits"]} == {"saturated"}
    times, flags = (read_run(limited["file"])[0][name] for name in ("time", limited["limits"][0]["signal"]))
    assert limited["limits"][0]["first_time"] == times[np.argmax(flags)]
    assert limited["limits"][0]["share"] == np.mean(flags)
    assert free["sampling"]["sample_time"] == 0.25e-3
    assert free["sampling"]["longest"] == pytest.approx(3.366e-3, rel=1e-3)
    assert free["sampling"]["is_stable"]
    names = [group["name"] for group in free["groups"]]
    assert names[:2] == ["robot.platform.rotation", "robot.platform.position"]
    assert {"position_error.axis.error", "controller.axis.command", "robot.rod.deflection"} <= set(names)
    code, out, _ = hfsa("compare", "sdelta_hfsa", "--over", "torque_limit=7.16,1e-4", *words, "--force")
    assert code == 0
    (first, second) = [line for line in out.splitlines() if line.startswith(("7.16", "1e-4"))]
    assert " none " in first
    assert " 3.366 ms " in first
    assert "saturated at " in second
    assert "position: robot.platform.position[1..3]" in out
    assert "results/sdelta_hfsa_torque_limit=1e-4.h5" in out


def test_a_run_that_fails_is_a_row_and_the_others_go_on(hfsa, failing_scene):
    """The output of the FMU is NaN from a given time."""
    code, out, _ = hfsa("compare", failing_scene, "--over", "box.at=1.5,9", "-j", "1", "--json")
    assert code == 1
    failed, fine = json.loads(out)["runs"]
    assert (failed["status"], failed["failure_time"]) == ("failed", pytest.approx(1.5, abs=2e-3))
    assert "not finite at t = 1.5" in failed["message"]
    assert failed["steps"] == pytest.approx(1500, abs=2)
    assert (fine["status"], fine["steps"], fine["message"]) == ("complete", 2000, "")
    code, out, err = hfsa("compare", failing_scene, "--over", "box.at=1.2,1.5", "-j", "1", "--force")
    assert code == 4
    assert "no run was finished of 2; box.at=1.2 failed: box" in err
    assert out.count("FAILED at 1.") == 2
    assert "box.at=1.5 failed: box" in out


def test_an_fmu_that_crashes_takes_only_its_own_run_with_it(hfsa, failing_scene):
    """The other FMU only warns."""
    code, out, err = hfsa("compare", failing_scene, "--over", "box.behaviour=8,1", "-j", "1", "--json")
    assert code == 1
    crashed, fine = json.loads(out)["runs"]
    assert crashed["status"] == "failed"
    assert "box: fmi2DoStep: lost at t = 1.5 s: its process was ended by SIGSEGV" in crashed["message"]
    assert fine["status"] == "complete"
    assert "hfsa: box.behaviour=1: " in err
    assert fine["warnings"]


def test_file_names_are_safe_and_distinct(hfsa):
    code, out, _ = hfsa("compare", "sdelta_shaker", "--over", "posture.position=0,0,0.15;0.01,0,0.15", "--over",
                        "source.amplitude=1e-5", "--stop", "0.01", "-j", "1", "--json")  # fmt: skip
    assert code == 0
    names = [Path(run["file"]).name for run in json.loads(out)["runs"]]
    assert names[0] == "sdelta_shaker_posture.position=0,0,0.15_source.amplitude=1e-5.h5"
    assert len(set(names)) == 2


@pytest.mark.slow
def test_an_interrupted_comparison_keeps_what_is_finished(tmp_path):
    words = ["compare", "mass_on_spring", "--over", "damping=0.5,1,2,3", "--backend", "python", "--stop", "30", "-j1"]
    command = [sys.executable, "-m", "hfsa.cosim.cli", *words]
    child = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=tmp_path, start_new_session=True)
    while not (tmp_path / "results" / "mass_on_spring_damping=1.h5").is_file():
        assert child.poll() is None
        time.sleep(0.05)
    os.killpg(child.pid, signal.SIGINT)
    _, err = child.communicate()
    assert child.returncode == 130
    # one, unless this process was kept from looking while the second ended
    assert re.search("[1-3] of 4 runs are finished: results/mass_on_spring_damping=0.5.h5", err)
    assert "Traceback" not in err
    values, _ = read_run(tmp_path / "results" / "mass_on_spring_damping=0.5.h5")
    assert np.isfinite(values["mass.position"]).all()


# The figure -----------------------------------------------------------------------------------------------------------


def outcome(scale: float, names: tuple[str, ...] = ("a.error", "b.force"), **more) -> Outcome:
    """A run of three members per group, of a size."""
    t = np.linspace(0, 2, 5001)
    values = {f"{name}[{i}]": scale * i * np.sin(7 * t) for name in names for i in (1, 2, 3)}
    groups = measure(t, values, dict.fromkeys(values, "m"))
    return Outcome(Path("x.h5"), groups, steps=5000, stop_time=2.0, **more)


def test_peaks_decades_apart_make_the_axis_logarithmic():
    near = comparison_figure("T", ["p", "q"], [outcome(1e-6), outcome(5e-6)])
    far = comparison_figure("T", ["p", "q"], [outcome(1e-6), outcome(5e-9)])
    assert [axes.get_yscale() for axes in near.axes] == ["linear", "linear"]
    assert [axes.get_yscale() for axes in far.axes] == ["log", "log"]
    assert [axes.get_ylabel() for axes in far.axes] == ["um", "um"]
    assert near.axes[0].get_title(loc="left") == "a.error[1..3]"
    assert far.axes[0].get_title(loc="left") == "|a.error[1..3]|"
    assert not any(np.any(line.get_ydata() < 0) for line in far.axes[0].lines)


def test_there_is_one_colour_per_run_one_line_style_per_member_and_one_legend():
    limits = (ActiveLimit("pd.saturation", 0.5, 0.1, 1.5), ActiveLimit("stage.overload", 0.2, 0.1))
    names = ("a.error", "b.force", "c.voltage", "d.stress")
    figure = comparison_figure("T", ["p", "q"], [outcome(1.0, names, limits=limits), outcome(2.0, names)])
    panels = [axes for axes in figure.axes if axes.axison]
    assert len(panels) == 4
    curves = [line for line in panels[1].lines if len(line.get_xdata()) > 1]
    assert len({line.get_color() for line in curves}) == 2
    assert len({line.get_linestyle() for line in curves}) == 3
    marks = [line for line in panels[0].lines if line.get_marker() == "v"]
    assert [line.get_xdata()[0] for line in marks] == [0.5, 1.5]  # stress spoils nothing
    legends = [*figure.legends, *(axes.get_legend() for axes in figure.axes if axes.get_legend())]
    words = [text.get_text() for legend in legends for text in legend.get_texts()]
    assert words == ["p", "q", "[1]", "[2]", "[3]", "a limit becomes active"]


def test_a_run_that_diverges_does_not_hide_the_others():
    figure = comparison_figure("T", ["p", "q"], [outcome(1.0), outcome(1e250, failure="pd: not finite")])
    assert figure.axes[0].get_yscale() == "linear"
    assert figure.axes[0].get_ylim()[1] < 10
    assert "q, failed" in [text.get_text() for text in figure.legends[0].get_texts()]
    comparison_figure("T", ["p"], [Outcome(Path("x.h5"), failure="no file")])


# Wrong words ----------------------------------------------------------------------------------------------------------


def test_values_of_an_argument():
    assert parse_over(["law=pd, ctc", "at=0,0,1;1,0,1"]) == {"law": ("pd", "ctc"), "at": ("0,0,1", "1,0,1")}


WRONG = {
    "scene": (["sdelta_shakr", "--over", "damping=1,2"], "no scene is called 'sdelta_shakr'; did you mean"),
    "no pair": (["mass_on_spring", "--over", "damping"], "--over 'damping' is not of the form NAME=VALUES"),
    "no values": (["mass_on_spring", "--over", "damping="], "--over 'damping=' has an empty value"),
    "an empty value": (["mass_on_spring", "--over", "damping=1,,2"], "'damping=1,,2' has an empty value"),
    "a value twice": (["mass_on_spring", "--over", "damping=1,2,1.0"], "damping has the value 1.0 twice, as 1"),
    "a name twice": (["mass_on_spring", "--over", "damping=1", "--over", "damping=2"], "damping is given twice"),
    "name": (["mass_on_spring", "--over", "dampin=1,2"], "has no argument 'dampin'; did you mean damping"),
    "both": (
        ["mass_on_spring", "--over", "damping=1,2", "-p", "damping=3"],
        "damping is given with -p and with --over",
    ),
    "value": (["mass_on_spring", "--over", "damping=1,much"], "damping is 'much', expected a number"),
    "level": (["sdelta_hfsa", "--over", "robot.level=cartesian,cartesain"], "did you mean cartesian?"),
    "law": (["sdelta_hfsa", "--over", "stiffness=ch4,ch5"], "expected one of ch3_full, ch3_rods, ch4, ch4_full"),
    "bounds": (["mass_on_spring", "--over", "mass.damping=1,-1"], "damping is -1 N.s/m, expected 0 to inf"),
    "ticks": (["sdelta_hfsa", "--over", "sample_time=2.5e-4,2.7e-4"], "sample_time"),
    "stop": (["mass_on_spring", "--over", "damping=1,2", "--stop", "1e-9"], "less than a step"),
    "nothing": (["mass_on_spring"], "--over"),
}


@pytest.mark.parametrize(("tokens", "message"), WRONG.values(), ids=WRONG)
def test_what_is_wrong_is_refused_before_anything_runs(hfsa, tokens, message):
    code, out, err = hfsa("compare", *tokens)
    assert (code, out) == (2, "")
    assert message in " ".join(err.split())
    assert not list(Path().rglob("*.h5"))
