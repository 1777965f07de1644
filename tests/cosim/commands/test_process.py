"""The command as a process: import time, closed pipes, interruption."""

import os
import signal
import subprocess
import sys
import time

import numpy as np

from hfsa.cosim.cli import main
from hfsa.cosim.results.files import Status, read_sweep


def test_help_comes_without_the_heavy_libraries():
    heavy = {"casadi", "control", "fmpy", "h5py", "matplotlib", "numpy", "scipy"}
    script = f"import sys; from hfsa.cosim.cli import main; main(['--help']); print({heavy} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("set()\n")
    for verb in ("list", "analyze", "export", "check", "run", "compare", "sweep", "bode"):
        assert f" {verb} " in done.stdout


def test_a_reader_that_goes_away_is_no_error():
    command = [sys.executable, "-m", "hfsa.cosim.cli", "list", "--json"]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    child.stdout.close()
    err = child.stderr.read()
    assert (child.wait(), err) == (0, "")


def test_an_interrupted_sweep_keeps_its_points_and_resumes(tmp_path):
    path = tmp_path / "sweep.h5"
    words = ["sweep", "mass_on_spring", "-p", "damping=0.5", "--points", "12", "--start", "rest", "-o", str(path)]
    command = [sys.executable, "-m", "hfsa.cosim.cli", *words]
    child = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    while not (path.is_file() and measured(path)):
        assert child.poll() is None
        time.sleep(0.05)
    os.killpg(child.pid, signal.SIGINT)  # as the keyboard does, to all processes
    _, err = child.communicate()
    assert child.returncode == 130
    assert "sweep with --resume to continue" in err
    assert "Traceback" not in err
    half = read_sweep(path)
    assert half.attributes["status"] == "interrupted"
    assert 0 < np.sum(half.status == Status.DONE) < 12
    assert main([*words, "--resume"]) == 0
    assert read_sweep(path).attributes["status"] == "complete"


def measured(path):
    """Count the finished points of a file that another process is writing."""
    import h5py

    with h5py.File(path, "r", locking=False) as file:
        return np.sum(file["bode/status"][:] == Status.DONE)
