"""The Reference FMUs of the Modelica Association in our scenes: Co-Simulation as fmpy runs them, bit for bit.

They are not a part of this repository. `HFSA_REFERENCE_FMUS` names a folder with `2.0/NAME.fmu` and `3.0/NAME.fmu`, as
in the archive of a release, or built from source. Without it only the stored solutions are judged, each by its closed
form or by an integration of its own. The numbers are in `data/reference_fmus.toml`.
"""

import os
import tomllib
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu
from scipy.integrate import solve_ivp

from hfsa.cosim import run

DATA = tomllib.loads((Path(__file__).parents[1] / "data" / "reference_fmus.toml").read_text())
MODELS = DATA["models"]
VARIANTS = [(version, name) for name, model in MODELS.items() for version in model["versions"]]
FOLDER = os.environ.get("HFSA_REFERENCE_FMUS")

each_variant = pytest.mark.parametrize(
    ("version", "name"), VARIANTS, ids=[f"{name}-{version}" for version, name in VARIANTS]
)


def reference(version: str, name: str) -> Path:
    """Return a Reference FMU; the test is skipped where there are none, or none of this version."""
    if FOLDER is None:
        pytest.skip("HFSA_REFERENCE_FMUS names no folder with Reference FMUs")
    file = Path(FOLDER, version, f"{name}.fmu")
    if not file.exists():
        pytest.skip(f"there is no {file}")
    return file


def ours(file: Path, name: str, algorithm: str) -> np.ndarray:
    """Return the outputs at the communication points by a scene, (rows, outputs)."""
    model = MODELS[name]
    outputs = [f"part.{output}" for output in model["outputs"]]
    Path("scene.toml").write_text(
        f"inputs = []\noutputs = {outputs}\nquiet_inputs = true\n"
        f'step_size = {model["step"]}\nstop_time = {model["stop"]}\nalgorithm = "{algorithm}"\n'
        f"[[components]]\nname = 'part'\npart = '{file}'\n"
    )
    found = run("scene.toml", path="run.h5", warn=lambda _: None)
    return np.array([found[output] for output in outputs]).T


def theirs(file: Path, name: str) -> np.ndarray:
    """Return the outputs at the communication points by fmpy, (rows, outputs); arrays are one column per element."""
    model = MODELS[name]
    found = simulate_fmu(
        file,
        fmi_type="CoSimulation",
        output=list(dict.fromkeys(output.partition("[")[0] for output in model["outputs"])),
        stop_time=model["stop"],
        output_interval=model["step"],
        step_size=model["step"],
    )
    columns = [np.asarray(found[column], dtype=float).reshape(len(found), -1) for column in found.dtype.names[1:]]
    values = np.column_stack(columns)
    # an event is a second row of the same time, of which the later one is kept
    rows = np.arange(round(model["stop"] / model["step"]) + 1) * model["step"]
    return values[np.searchsorted(found["time"], rows + 1e-6 * model["step"]) - 1]


@each_variant
@pytest.mark.parametrize("algorithm", ["gauss_seidel", "jacobi_plain"])
def test_co_simulation_is_that_of_fmpy_bit_for_bit(version, name, algorithm, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = reference(version, name)
    np.testing.assert_array_equal(ours(file, name, algorithm), theirs(file, name))


@each_variant
def test_co_simulation_ends_at_the_stored_numbers(version, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = ours(reference(version, name), name, "gauss_seidel")
    np.testing.assert_allclose(found[-1], MODELS[name]["co_simulation"], rtol=1e-12)


@each_variant
def test_model_exchange_is_the_solution(version, name, tmp_path, monkeypatch):
    """Monolithic: within the tolerance of its integrator, far from the steps of Co-Simulation."""
    monkeypatch.chdir(tmp_path)
    found = ours(reference(version, name), name, "monolithic")
    np.testing.assert_allclose(found[-1], MODELS[name]["solution"], rtol=MODELS[name]["tolerance"])


def van_der_pol(stop: float) -> list[float]:
    """The oscillator with mu = 1 from (2, 0)."""
    found = solve_ivp(
        lambda _, x: [x[1], (1 - x[0] ** 2) * x[1] - x[0]], (0, stop), [2.0, 0.0], "DOP853", rtol=1e-13, atol=1e-14
    )
    return found.y[:, -1].tolist()


def bouncing_ball(stop: float) -> list[float]:
    """A fall from 1 m with 70 % of the speed kept at each bounce, which rests below 0.1 m/s."""
    g, keeps, slowest = 9.81, 0.7, 0.1
    t, speed = np.sqrt(2 / g), np.sqrt(2 * g)
    while True:
        speed *= keeps
        if speed < slowest:
            return [0.0, 0.0]
        flight = 2 * speed / g
        if t + flight > stop:
            since = stop - t
            return [speed * since - g * since**2 / 2, speed - g * since]
        t += flight


SOLUTIONS = {
    "Dahlquist": lambda stop: [np.exp(-stop)],
    "VanDerPol": van_der_pol,
    "BouncingBall": bouncing_ball,
    "StateSpace": lambda stop: [u * np.exp(stop) for u in (1.0, 2.0, 3.0)],
    "Stair": lambda stop: [1.0 + np.floor(stop)],
    "Feedthrough": lambda _: [0.0, 0.0, 0.0, 0.0],
    "Resource": lambda _: [float(ord("a"))],
}


@pytest.mark.parametrize("name", sorted(SOLUTIONS))
def test_stored_solutions_are_solutions(name):
    np.testing.assert_allclose(MODELS[name]["solution"], SOLUTIONS[name](MODELS[name]["stop"]), rtol=1e-9, atol=1e-12)
