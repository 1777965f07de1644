"""The command with FMUs of bad manners: one sentence, the documented exit code, all rows, and nothing left behind."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from command_line import strict_json
from hostile_fmu import hostile_fmu, hostile_scene

from hfsa.cosim.results.files import read_run, read_status, read_sweep
from hfsa.cosim.results.records import Status

MASS = """
[[components]]
name = "mass"
part = "mass_on_spring"

[[connections]]
start = "box.y"
end = "mass.base.position"

[[connections]]
start = "mass.position"
end = "box.u"
"""
"""A part of ours, joined to the FMU in a loop."""

ENDINGS = {
    "crash": "its process was ended by SIGSEGV",
    "leave": "its process ended itself with exit code 0",
    "abort": "its process was ended by SIGABRT",
    "divide": "its process was ended by SIGFPE",
    "kill": "its process was ended by SIGKILL",
    "last_words": "its process was ended by SIGABRT (it printed: the spring is gone)",
}


@pytest.fixture(scope="module")
def fmu(tmp_path_factory) -> Path:
    """The FMU of bad manners."""
    return hostile_fmu(tmp_path_factory.mktemp("hostile"))


@pytest.fixture
def scene(tmp_path, fmu):
    """Write a scene of it."""
    return lambda manner, **times: hostile_scene(tmp_path / f"{manner}.toml", fmu, manner, **times)


@pytest.fixture
def looped(scene):
    """Write a scene of it in a loop with a part of ours."""

    def write(manner, **times):
        path = scene(manner, **times)
        text = path.read_text().replace('inputs = ["box.u"]', "inputs = []")
        path.write_text(text + MASS)
        return path

    return write


@pytest.mark.parametrize("manner", [pytest.param(name, id=name) for name in ENDINGS])
def test_a_run_ends_with_a_sentence_and_keeps_every_row(hfsa, scene, manner):
    code, out, err = hfsa("run", scene(manner), "--amplitude", 0, "-o", "it.h5")
    assert (code, out) == (4, "")
    assert f"box: fmi2DoStep: lost at t = 0.05 s: {ENDINGS[manner]}" in err
    values, _ = read_run("it.h5")
    known = np.isfinite(values["box.y"])
    assert np.array_equal(values["time"][known], np.arange(51) * 1e-3)
    assert np.allclose(values["box.y"][known][1:], values["time"][1:51], rtol=1e-12)
    assert read_status("it.h5")[0] == "failed"
    assert ENDINGS[manner] in read_status("it.h5")[1]


@pytest.mark.parametrize("manner", [pytest.param(name, id=name) for name in ("flood", "move", "disturb")])
def test_what_an_fmu_does_to_its_process_stays_there(hfsa, scene, manner):
    path = scene(manner)
    handlers = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    folder, mask = os.getcwd(), os.umask(0o22)
    code, out, _ = hfsa("run", path, "--amplitude", 0, "-o", "it.h5", "--json")
    assert code == 0
    assert strict_json(out)["file"].endswith("it.h5")
    assert os.getcwd() == folder
    assert os.umask(mask) == 0o22
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == handlers
    assert np.isfinite(read_run("it.h5")[0]["box.y"]).all()


def test_the_traps_of_an_fmu_are_not_ours(hfsa, scene):
    hfsa("run", scene("trap"), "--amplitude", 0, "-o", "it.h5")
    with np.errstate(divide="ignore"):
        assert np.isinf(np.array([1.0]) / np.array([0.0])).all()


def test_a_call_that_hangs_ends_at_the_time_limit(hfsa, scene):
    code, _, err = hfsa("run", scene("hang"), "--amplitude", 0, "-o", "it.h5", "--time-limit", 1)
    assert code == 4
    assert "box: fmi2DoStep: overdue at t = 0.05 s: its call did not return within the time limit" in err
    assert np.isfinite(read_run("it.h5")[0]["box.y"]).sum() == 51


@pytest.mark.slow
def test_a_run_that_is_slow_ends_at_the_time_limit(hfsa, scene):
    code, _, err = hfsa("run", scene("sleep", stop=1e3), "-o", "it.h5", "--every", 10, "--time-limit", 2)
    assert code == 4
    assert "it did not end within the time limit" in err or "its call did not return" in err
    assert np.isfinite(read_run("it.h5")[0]["box.y"]).sum() > 5


def test_points_of_a_sweep_fail_with_the_same_sentence(hfsa, scene):
    code, out, _ = hfsa("sweep", scene("crash"), "--points", 2, "--jobs", 1, "-o", "it.h5")
    assert code == 1
    assert "box: fmi2DoStep: lost at t = 0.05 s: its process was ended by SIGSEGV" in out
    assert (read_sweep("it.h5").status == Status.FAILED).all()


@pytest.mark.slow
def test_points_of_a_sweep_have_a_time_limit(hfsa, scene):
    code, out, _ = hfsa("sweep", scene("hang"), "--points", 1, "--jobs", 1, "-o", "it.h5", "--time-limit", 1)
    assert code == 1
    assert "overdue at t = " in out  # in a call of the FMU or, on a busy machine, before it


def test_linear_maps_of_a_crashing_fmu_are_an_error(hfsa, scene):
    code, _, err = hfsa("sweep", scene("crash", at=-1.0), "--method", "linear", "-o", "it.h5")
    assert code == 4
    assert "box: fmi2GetDirectionalDerivative: lost at t = 0 s: its process was ended by SIGSEGV" in err


def test_stability_of_a_crashing_fmu_is_an_error(hfsa, looped):
    code, _, err = hfsa("stability", looped("crash", at=-1.0))
    assert code == 4
    assert "fmi2GetDirectionalDerivative: lost at t = 0 s: its process was ended by SIGSEGV" in err


@pytest.mark.slow
def test_a_comparison_has_a_failed_run_and_goes_on(hfsa, scene):
    words = ("--over", "box.at=0.05,1e9", "-o", "it.png", "--time-limit", 60, "--json")
    code, out, _ = hfsa("compare", scene("crash"), *words)
    runs = json.loads(out)["runs"]
    assert code == 1
    assert [run["status"] for run in runs] == ["failed", "complete"]
    assert ENDINGS["crash"] in runs[0]["message"]


@pytest.mark.parametrize(
    "jobs", [pytest.param(1, id="one job"), pytest.param(2, id="two jobs", marks=pytest.mark.slow)]
)
def test_an_fmu_of_which_a_process_has_one_instance_runs_twice(hfsa, tmp_path, fmu, jobs):
    text = hostile_scene(tmp_path / "one.toml", fmu, "sleep", at=1e9).read_text()
    component = text[text.index("[[components]]") :]
    both = text + component.replace('"box"', '"other"') + '\n[[connections]]\nstart = "box.y"\nend = "other.u"\n'
    path = tmp_path / "two.toml"
    path.write_text(both.replace('outputs = ["box.y"]', 'outputs = ["box.y", "other.y"]'))
    signals = ("--signal", "box.process", "--signal", "other.process")
    assert hfsa("run", path, "--amplitude", 0, "-o", "it.h5", *signals)[0] == 0
    values, _ = read_run("it.h5")
    assert len({values["box.process"][0], values["other.process"][0], os.getpid()}) == 3
    assert hfsa("sweep", path, "--from", 20, "--points", 2, "--jobs", jobs, "-o", "s.h5")[0] == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("manner", "ending"),
    [
        pytest.param("eat", "ended the process with exit code 9", id="memory"),
        pytest.param("talk", "crashed with SIGXFSZ", id="output", marks=pytest.mark.slow),
    ],
)
def test_the_trial_of_a_check_has_limits(hfsa, tmp_path, manner, ending):
    code, out, _ = hfsa("check", hostile_fmu(tmp_path, manner))
    assert code == 1
    assert ending in out


@pytest.fixture
def hanging(scene, tmp_path):
    """Start a run whose FMU hangs; return its process, the number of that of the FMU, and the file."""
    path, told = tmp_path / "it.h5", tmp_path / "hangs"
    words = ["run", str(scene("hang")), "--amplitude", "0", "-o", str(path)]
    command = [sys.executable, "-m", "hfsa.cosim.cli", *words]
    child = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env={**os.environ, "HFSA_HANGS": str(told)})
    while not (told.is_file() and told.read_text()):
        assert child.poll() is None
        time.sleep(0.05)
    yield child, int(told.read_text()), path
    child.kill()
    child.communicate()


@pytest.mark.parametrize(
    ("number", "expected"),
    [
        pytest.param(signal.SIGINT, 130, id="INT"),
        pytest.param(signal.SIGTERM, 143, id="TERM", marks=pytest.mark.slow),
    ],
)
def test_a_signal_ends_a_run_whose_fmu_hangs(hanging, number, expected):
    child, host, path = hanging
    child.send_signal(number)
    _, err = child.communicate(timeout=30)
    assert child.returncode == expected
    assert "Traceback" not in err
    assert np.isfinite(read_run(path)[0]["box.y"]).sum() == 51
    assert read_status(path)[0] == "interrupted"
    assert not _runs(host)


def test_a_process_that_is_killed_takes_that_of_its_fmu_with_it(hanging):
    child, host, _ = hanging
    child.kill()
    child.wait()
    while _runs(host):  # the timeout of the test ends this
        time.sleep(0.05)


def _runs(process: int) -> bool:
    """Whether a process runs, that is, has not ended and is no zombie."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False
