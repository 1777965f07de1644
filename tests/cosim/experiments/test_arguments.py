"""Arguments of the public functions: each wrong one is named, with what was found, before anything happens."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hfsa.cosim import compare, open_loop, run, stability, sweep
from hfsa.cosim.experiments.arguments import checked
from hfsa.cosim.systems.errors import StructureError

WRONG = [
    (sweep, {"points": 0}, "points is 0, expected a positive whole number"),
    (sweep, {"points": "2"}, "points is '2'"),
    (sweep, {"points": 2.5}, "points is 2.5"),
    (sweep, {"method": "nix"}, "method is 'nix', expected one of stepped, multisine, linear"),
    (sweep, {"grid": "nix"}, "grid is 'nix'"),
    (sweep, {"start": "nix"}, "start is 'nix', expected one of steady, rest"),
    (sweep, {"backend": "nix"}, "backend is 'nix', expected one of c, python"),
    (sweep, {"algebraic_loops": "nix"}, "algebraic_loops is 'nix'"),
    (sweep, {"jobs": -2}, "jobs is -2"),
    (sweep, {"jobs": True}, "jobs is True"),
    (sweep, {"amplitude": -1.0}, "amplitude is -1.0, expected a positive number or zero"),
    (sweep, {"amplitude": 0}, "--amplitude 0 excites nothing that --method stepped could measure"),
    (sweep, {"amplitude": 0, "method": "multisine"}, "--amplitude 0 excites nothing that --method multisine could"),
    (run, {"every": 0}, "every is 0, expected a positive whole number"),
    (run, {"every": 2, "interval": 1e-3}, "--every 2 and --interval 0.001 both thin the file; expected one of them"),
    (run, {"interval": 2.5e-4}, "--interval 0.00025 s is no multiple of the communication step of 0.0001 s; expected"),
    (sweep, {"low": float("nan")}, "low is nan"),
    (sweep, {"settling_time": -1}, "settling_time is -1"),
    (sweep, {"measurement_periods": 0}, "measurement_periods is 0"),
    (sweep, {"inputs": "mass.base.position"}, "inputs is 'mass.base.position', expected a list of texts"),
    (sweep, {"outputs": [5]}, "outputs is [5]"),
    (sweep, {"order": ["mass"]}, "order is ['mass'], expected a text"),
    (sweep, {"force": "yes"}, "force is 'yes', expected True or False"),
    (run, {"stop_time": -1.0}, "stop_time is -1.0"),
    (run, {"amplitude": -1.0}, "amplitude is -1.0, expected a positive number or zero"),
    (run, {"parameters": 5}, "parameters is 5, expected names with values"),
    (stability, {"step_size": np.inf}, "step_size is inf"),
]


@pytest.fixture(autouse=True)
def empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(("function", "arguments", "sentence"), WRONG, ids=[sentence for *_, sentence in WRONG])
def test_a_wrong_argument_is_named(function, arguments, sentence):
    with pytest.raises(StructureError) as caught:
        function("mass_on_spring", **arguments)
    assert str(caught.value).startswith(sentence)
    assert not list(Path.cwd().iterdir())


@pytest.mark.parametrize("function", [sweep, run, stability])
def test_so_is_a_wrong_scene(function):
    with pytest.raises(StructureError, match="scene is 5, expected a text or Path or Scene"):
        function(5)


@pytest.mark.parametrize(
    ("over", "sentence"),
    [
        ({}, "there is nothing to compare"),
        ({"damping": []}, "damping has no values to compare"),
        ({"damping": [1, 1.0]}, "damping has the value 1.0 twice, as 1"),
        ({"damping": 5}, "over is {'damping': 5}"),
    ],
)
def test_so_are_wrong_values_to_compare(over, sentence):
    with pytest.raises(StructureError) as caught:
        compare("mass_on_spring", over)
    assert str(caught.value).startswith(sentence)


def test_a_missing_argument_is_an_error_of_python():
    with pytest.raises(TypeError, match="connection"):
        open_loop("sdelta_hfsa")


def test_what_fits_is_passed_on():
    @checked(zero=("offset",))
    def function(size: float, count: int | None = None, offset: float = 1.0, names: list | None = None):
        return size, count, offset

    assert function(np.float32(2), np.int64(3), 0) == (2, 3, 0)
    assert function.__name__ == "function"
    with pytest.raises(StructureError, match="size is 0"):
        function(0)


def test_a_script_runs_once_however_many_processes_measure(tmp_path):
    """Its workers do not import it: it needs no guard."""
    text = """
from hfsa.cosim import compare, sweep
print("begins")
compared = compare("mass_on_spring", {"damping": [5, 10]}, jobs=2, stop_time=0.1)
swept = sweep("mass_on_spring", {"damping": 50}, points=2, low=10, backend="python", jobs=2)
print([run.outcome.failure for run in compared.runs], swept.status.ravel())
"""
    script = tmp_path / "script.py"
    script.write_text(text)
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert done.stdout == "begins\n['', ''] [1 1]\n"
    assert done.stderr == ""
