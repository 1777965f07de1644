"""Runs with signals of the user's own: requests, what they replace, warnings, the file, and the round trip by CSV."""

import re

import numpy as np
import pytest

from hfsa.cosim import Component, Connection, Scene, System, run
from hfsa.cosim.results.files import read_driven, read_run
from hfsa.cosim.signals.shapes import Sine
from hfsa.cosim.systems.errors import StructureError

INPUT, OUTPUT = "mass.base.position", "mass.position"


@pytest.fixture
def driven(tmp_path, scene_cache):
    """Run a scene with driven inputs; returns the run and the warnings."""

    def do(drive, scene="mass_on_spring", name="run.h5", **options):
        words = []
        found = run(scene, drive=drive, path=tmp_path / name, warn=words.append, **{"stop_time": 0.5, **options})
        return found, words

    return do


def twenty(time):
    """A sine of 20 Hz, which nobody declares to be one."""
    return np.sin(40 * np.pi * time)


def connected():
    """A scene whose mass a sine source moves."""
    source = Component("source", "sine_source", None, {"unit": "m"}, {"amplitude": 1e-3})
    return Scene(
        System([source, Component("mass", "mass_on_spring")], [Connection("source.value", INPUT)]),
        inputs=[],
        outputs=[OUTPUT],
        band=(1.0, 20.0),
        step_size=1e-3,
        stop_time=0.5,
    )


def test_a_signal_a_function_a_table_and_a_text_are_the_same(driven):
    """The mass moves alike, but for the error of the lines between rows."""
    times = np.linspace(0, 0.5, 5001)
    sine = Sine(1e-3, frequency=3.0)
    requests = {
        "signal": sine,
        "function": lambda t: 1e-3 * np.sin(6 * np.pi * t),
        "text": "sine,amplitude=1e-3,frequency=3",
        "table": np.column_stack([times, sine.derivatives(times)[0]]),
    }
    found = {name: driven({"base.position": wanted}, name=f"{name}.h5")[0] for name, wanted in requests.items()}
    size = np.abs(found["signal"][OUTPUT]).max()
    for name, one in found.items():
        assert np.allclose(
            one[OUTPUT], found["signal"][OUTPUT], rtol=0, atol=(1e-5 if name == "table" else 1e-12) * size
        )
        assert np.allclose(one[INPUT], sine.derivatives(one.time)[0], rtol=0, atol=1e-15)


def test_a_drive_replaces_what_feeds_its_input(driven):
    """The source is left out of the system."""
    found, words = driven({INPUT: "step,amplitude=2e-3,start=0.1"}, connected())
    assert found[INPUT].max() == 2e-3
    assert not any("nothing" in word for word in words)
    text, _ = read_run(found.path)
    assert set(text) == {"time", INPUT, OUTPUT}


def test_the_file_says_what_was_driven(driven):
    """By words that repeat the run, and a hash of a table."""
    found, _ = driven({INPUT: "chirp,amplitude=1e-3,to=20,duration=0.3"})
    (one,) = read_driven(found.path)
    assert (one.name, one.sha256) == (INPUT, "")
    again, _ = driven({one.name: one.signal}, name="again.h5")
    assert np.array_equal(found[OUTPUT], again[OUTPUT])
    tabled, _ = driven({INPUT: [[0, 0], [1, 1e-3]]}, name="table.h5")
    assert len(read_driven(tabled.path)[0].sha256) == 64


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss_seidel_linear"])
@pytest.mark.parametrize("ending", [".csv", ".h5"], ids=["csv", "hdf5"])
def test_a_recorded_input_drives_the_same_motion(driven, hfsa, algorithm, ending):
    """All digits pass through the file."""
    first, _ = driven({INPUT: [[0, 0], [0.2, 1e-3], [0.3, -1e-3], [0.5, 0]]}, algorithm=algorithm, step_size=1e-3)
    assert hfsa("convert", first.path, "-o", first.path.with_suffix(".csv"))[0] == 0
    text = f"{first.path.with_suffix(ending)}:{INPUT}"
    again, _ = driven({INPUT: text}, name="again.h5", algorithm=algorithm, step_size=1e-3)
    assert np.array_equal(first[INPUT], again[INPUT])
    assert np.allclose(first[OUTPUT], again[OUTPUT], rtol=0, atol=1e-12 * np.abs(first[OUTPUT]).max())


def test_units_of_a_table_are_converted(driven, tmp_path):
    """And refused where they do not fit."""
    (tmp_path / "mm.csv").write_text("time [ms],u [mm]\n0,0\n500,2\n")
    found, _ = driven({INPUT: f"{tmp_path / 'mm.csv'}"})
    assert found[INPUT][-1] == pytest.approx(2e-3)
    (tmp_path / "volt.csv").write_text("time [s],u [V]\n0,0\n1,2\n")
    with pytest.raises(StructureError, match=r"volt.csv:u is in V, but mass.base.position in m"):
        driven({INPUT: f"{tmp_path / 'volt.csv'}"}, name="volt.h5")


@pytest.mark.parametrize(
    ("drive", "options", "words"),
    [
        ("chirp,to=3000", {"step_size": 1e-3}, "0.333 communication points per period; above 500 Hz .*aliasing"),
        ("sine,frequency=200", {"step_size": 1e-3}, "5 communication points per period"),
        (twenty, {"step_size": 1e-3, "algorithm": "jacobi"}, r"held from .* deviates .* by up to 9\.4"),
        ("sine,frequency=20", {"step_size": 1e-3, "algorithm": "jacobi"}, "the response of mass.position .* errs by"),
        ("step,start=0.10005", {"step_size": 1e-3}, "jumps at 0.10005 s, .* and the input at 0.101 s"),
        ([[0.1, 1.0], [0.2, 2.0]], {}, "held at its ends: 1 before 0.1 s and 2 after 0.2 s"),
        ("noise,period=0.1", {}, "the noise repeats after 0.1 s"),
    ],
    ids=["aliasing", "few-points", "held", "predicted", "late-jump", "short-table", "periodic-noise"],
)
def test_what_steps_leave_of_a_signal_is_told(driven, drive, options, words):
    """With the figure."""
    _, found = driven({INPUT: drive}, **options)
    assert any(re.search(words, word) for word in found), found


def test_nothing_is_told_of_a_signal_that_steps_follow(driven):
    """A slow sine, on parabolas."""
    assert driven({INPUT: "sine,frequency=2,amplitude=1e-3"})[1] == []


@pytest.mark.parametrize(
    ("drive", "words"),
    [
        ({"base.positio": "step"}, "no input is called 'base.positio'; did you mean"),
        ({OUTPUT: "step"}, "no input is called 'mass.position'"),
        ({INPUT: "stepp"}, "no signal is called 'stepp'; did you mean step"),
        ({INPUT: "step,time=1"}, "step has no option 'time'; it has amplitude, offset, start"),
        ({INPUT: "step,start=1,start=2"}, "start is given twice"),
        ({INPUT: "step,start=x"}, "start is 'x', expected a number"),
        ({INPUT: "noise,seed=1.5"}, "seed is '1.5', expected a whole number"),
        ({INPUT: "none.csv"}, "none.csv: cannot be read"),
        ({INPUT: "none.h5"}, "none.h5"),
        ({INPUT: 3}, "expected rows of a time and a value"),
        ({INPUT: [[0, 1, 2]]}, "expected rows of a time and a value"),
        ({INPUT: [[0, 1], [0, 2]]}, "row 2: time is 0 s after 0 s"),
        ({INPUT: lambda t: None}, "returns None at 0 s"),
        ({INPUT: lambda t: 1.0 if t < 0.1 else float("nan")}, "drive of mass.base.position: .* returns nan at 0.1"),
        ({INPUT: "step", "base.position": "step"}, "driven twice"),
    ],
    ids=[
        "name",
        "output",
        "shape",
        "option",
        "twice",
        "number",
        "whole",
        "csv",
        "hdf5",
        "scalar",
        "columns",
        "times",
        "function",
        "function-later",
        "input-twice",
    ],
)
def test_wrong_requests_are_refused(driven, drive, words):
    """Before anything runs."""
    with pytest.raises((StructureError, RuntimeError), match=words):
        driven(drive)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("time,u\n", "has a header, but no rows"),
        ("time,u\n0,1\n", "has 1 rows, expected 2 or more"),
        ("time,u\n0,1\n\n1,x\n", "line 4: u is 'x', expected a finite number"),
        ("time,u\n0,1\n1,nan\n", "line 3: u is 'nan'"),
        ("time,u\n0,1\n1\n", "line 3: 1 values, expected 2"),
        ("time,u\n0,1\n2,1\n\n1,3\n", "line 5: time is 1 s after 2 s"),
        ("t,u\n0,1\n1,2\n", "has the columns t, u, expected time among them"),
        ("time,u,v\n0,1,2\n1,2,3\n", "has the columns u, v; expected .*:COLUMN"),
        ("time,u,u\n0,1,2\n", "the column u is given twice"),
        ("0,1\n1,2\n", "numbers, expected a header"),
        ("time;u\n0;1\n", "separated by semicolons"),
        ("time [kg],u\n0,1\n1,2\n", "time is in kg, expected s"),
    ],
    ids=[
        "empty",
        "no-rows",
        "one-row",
        "text",
        "nan",
        "short",
        "falling",
        "no-time",
        "columns",
        "twice",
        "no-header",
        "semicolons",
        "unit",
    ],
)
def test_bad_files_are_refused_with_the_line(driven, tmp_path, text, words):
    """Lines count from the header's."""
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(StructureError, match=words):
        driven({INPUT: str(tmp_path / "bad.csv")})


def test_a_sine_may_be_beside_a_drive_but_not_on_it(driven):
    """Its input is another one."""
    with pytest.raises(StructureError, match="is driven, and has no sine as well"):
        driven({INPUT: "step"}, frequency=3.0)


def test_verification_drives_the_second_run_too(driven):
    """The estimate is that of the algorithm."""
    found, _ = driven({INPUT: "sine,frequency=3,amplitude=1e-3"}, algorithm="jacobi", step_size=1e-3, verify=True)
    assert 1e-3 < found.errors[OUTPUT].relative < 0.1


def test_a_million_rows_run(driven):
    """Without any compilation."""
    times = np.linspace(0, 0.5, 1_000_001)
    rows = np.column_stack([times, 1e-3 * np.sin(6 * np.pi * times)])
    found, _ = driven({INPUT: rows}, step_size=1e-3)
    exact, _ = driven({INPUT: "sine,frequency=3,amplitude=1e-3"}, name="exact.h5", step_size=1e-3)
    assert np.allclose(found[OUTPUT], exact[OUTPUT], rtol=0, atol=1e-6)


def test_the_command_drives_inputs(hfsa, scene_cache):
    """And says so in its answer."""
    code, out, _ = hfsa("run", "mass_on_spring", "--drive", "base.position=step,amplitude=1e-3", "--stop", "0.2")
    assert code == 0
    assert "mass.base.position is driven by step,amplitude=0.001" in out
    code, _, err = hfsa("run", "mass_on_spring", "--drive", "base.position", "--force")
    assert code == 2
    assert "--drive 'base.position' is not of the form NAME=VALUE" in err


@pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
@pytest.mark.parametrize("algorithm", ["jacobi_plain", "jacobi_linear"])
def test_an_input_of_a_foreign_fmu_is_driven(driven, box, foreign, version, algorithm):
    """It is held at the point's value, or where the algorithm moves inputs at that in the middle of the step."""
    found, words = driven({"box.u": "ramp,duration=0.5"}, box(foreign[version]), algorithm=algorithm, name="box.h5")
    assert np.allclose(found["box.u"], found.time / 0.5)
    late = 0.0 if algorithm == "jacobi_linear" else found.time * 1e-3
    assert np.allclose(found["box.y"], found.time**2 - late, rtol=0, atol=1e-12)
    assert not any("nothing feeds" in word for word in words)
    assert any("no derivatives of its inputs" in word for word in words) == (algorithm == "jacobi_linear")
