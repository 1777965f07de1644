"""Model Exchange with moving inputs: an importer that restarts its integrator at each input is right to 1e-7.

The importer is `model_exchange_loop.py`, SciPy on the calls of fmpy; the other side is Co-Simulation, whose solvers and
steps it does not share. Outputs at ticks are left out, where either side may show the value before or after.
"""

import numpy as np
import pytest
from co_simulation_loop import trajectory
from fmpy import simulate_fmu
from model_exchange_loop import simulated

from hfsa.components._modelling.model import Kind

STEP, STEPS = 1e-3, 60
CASES = ["mass_on_spring", "pendulum", "two_link", "hybrid"]


def moving(model) -> tuple[list[str], list[str], np.ndarray]:
    """Return names of inputs and outputs, and a sine of its own for each input, (STEPS + 1, inputs)."""
    inputs = model.of(Kind.INPUT)
    times = STEP * np.arange(STEPS + 1)[:, None]
    values = [q.nominal for q in inputs] * np.sin(2 * np.pi * (20 + 7 * np.arange(len(inputs))) * times)
    return [q.name for q in inputs], [q.name for q in model.of(Kind.OUTPUT, Kind.SAMPLED_OUTPUT)], values


def error(found: np.ndarray, expected: np.ndarray, rows: slice) -> float:
    """Return the largest error of an output relative to its largest value."""
    return float((np.abs(found - expected)[rows].max(axis=0) / np.abs(expected).max(axis=0)).max())


@pytest.mark.parametrize("linear", [False, True], ids=["held", "linear"])
@pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
@pytest.mark.parametrize("name", CASES)
def test_a_loop_of_our_own_agrees_with_co_simulation(models, exported, name, version, linear):
    model = models[name]()
    file = exported(model)[version]
    inputs, outputs, values = moving(model)
    found = simulated(file, inputs, outputs, values, STEP, linear=linear)
    expected = trajectory(file, inputs, outputs, values, STEP, linear=linear)
    assert error(found, expected, slice(0, None, 2)) <= 1e-7  # the ticks of hybrid are at every other point


def in_fmpy(file, outputs: list[str], inputs: list[str], values: np.ndarray, tolerance: float) -> np.ndarray:
    """Return the outputs after each step by the integrator of fmpy, whose inputs come from a table."""
    times = STEP * np.arange(STEPS + 1)
    table = np.array(list(zip(times, values[:, 0], strict=True)), dtype=[("time", float), (inputs[0], float)])
    found = simulate_fmu(
        file,
        fmi_type="ModelExchange",
        input=table,
        output=outputs,
        output_interval=STEP,
        stop_time=STEPS * STEP,
        relative_tolerance=tolerance,
    )
    return np.array([found[name][1:] for name in outputs]).T


def test_an_importer_that_does_not_restart_errs(exported, models):
    """What `docs/your-tool.md` says of fmpy: its inputs move at output points, where its CVODE is not restarted."""
    model = models["mass_on_spring"]()
    file = exported(model)[2]
    inputs, outputs, values = moving(model)
    expected = trajectory(file, inputs, outputs, values, STEP, linear=True)
    assert error(in_fmpy(file, outputs, inputs, values, 1e-5), expected, slice(None)) > 1e-2
    with pytest.raises(RuntimeError, match="error test failed"):
        in_fmpy(file, outputs, inputs, values, 1e-9)
