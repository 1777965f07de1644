"""`hfsa sweep --open-loop`: contents of the file, and the answer."""

import json

import numpy as np
import pytest

from hfsa.cosim.cli import main
from hfsa.cosim.results.files import read_sweep

CONNECTION = "controller.axis[1].command -> drive[1].motor[1].torque"


@pytest.fixture
def sweep(capsys, tmp_path):
    """Return exit code, answer and errors of a linear sweep of the controlled robot, and the file."""

    def run(*words: str):
        path = tmp_path / "loop.h5"
        method = [] if "--method" in words else ["--method", "linear"]
        code = main(["sweep", "sdelta_hfsa", *method, *words, "-o", str(path)])
        out, err = capsys.readouterr()
        return code, out, err, path

    return run


def test_loop_gain_and_sensitivity_are_in_the_file_and_the_margins_answered(sweep):
    code, out, _, path = sweep("--open-loop", "controller.axis[1].command", "--points", "50", "--json")
    assert code == 0
    answer = json.loads(out)
    assert answer["connection"] == CONNECTION
    assert answer["is_stable"]
    bode = read_sweep(path)
    L, S = bode.entry("loop_gain", CONNECTION), bode.entry("sensitivity", CONNECTION)
    np.testing.assert_allclose(S, 1 / (1 + L), rtol=1e-12)
    assert bode.settings["open_loop"] == CONNECTION
    (gain,) = answer["gain_margins"]
    assert bode.frequency[-1] == pytest.approx(gain["frequency"])  # half the sampling frequency
    assert L[-1] == pytest.approx(-1 / gain["factor"], rel=1e-9)
    assert np.abs(S).max() <= answer["sensitivity"]["peak"] * (1 + 1e-9)


def test_the_margins_as_text(sweep):
    code, out, _, _ = sweep("--open-loop", "drive[1].motor[1].torque", "--grid", "log", "--points", "20")
    assert code == 0
    assert "the closed loop is stable" in out
    assert "gain margin    30.6144 (29.72 dB) at 2000 Hz" in out
    assert "phase margin   105.5 degrees at 13.3159 Hz" in out


def test_an_unstable_loop_is_named(sweep):
    code, out, _, _ = sweep("--open-loop", "drive[1].motor[1].torque", "-p", "bandwidth=190", "--points", "5")
    assert code == 0
    assert "the closed loop is UNSTABLE" in out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--open-loop", "controller.axis[7].command"], "did you mean controller.axis[6].command"),
        (
            ["--open-loop", "robot.drive[1].slide", "--to", "3000"],
            "3000 Hz is above half the sampling frequency, 2000 Hz",
        ),
        (["--open-loop", "reference.motor[1].angle"], "closes no loop"),
        (["--open-loop", CONNECTION, "--input", "command.position[3]"], "--input would have no effect"),
        (["--open-loop", CONNECTION, "--method", "stepped"], "--open-loop takes --method linear"),
    ],
)
def test_wrong_words(sweep, words, message):
    code, _, err, path = sweep(*words)
    assert code == 2
    assert message in err
    assert not path.exists()
