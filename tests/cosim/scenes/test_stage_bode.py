"""The scene `stage_bode`: the linearised response agrees with a formula, the swept response with the linearised one."""

from functools import cache

import numpy as np
import pytest
from scene_responses import errors

from hfsa.components import pzt_stack, rrr_stage
from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.assembly import build
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.cli import main
from hfsa.cosim.linear.linearize import linearize
from hfsa.cosim.measurement.rig import Rig, Settings, Task
from hfsa.cosim.measurement.sweep import Bench
from hfsa.cosim.results.files import read_run
from hfsa.cosim.results.records import Status
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, System

FREQUENCY = np.unique([*np.geomspace(1, 3000, 12), *np.linspace(850, 970, 7), 2000, *np.linspace(2200, 2500, 5)])
BETA, RESISTANCE = 6.02e-6, 50.0
DECIBELS, DEGREES = 0.1, 1.0


@cache
def scene(**arguments) -> Scene:
    return load_scene("stage_bode", arguments)


def linearized(opened, **arguments):
    at = scene(**arguments)
    return linearize(at.system, opened(build.build(at.system).files), at.inputs, at.outputs)


def response(linear, frequency) -> np.ndarray:
    return linear.response(np.atleast_1d(frequency), [(i, -1, -1) for i in range(3)])


def by_hand(frequency: np.ndarray, level: str = "constant_jacobian", bias: float = 75.0) -> np.ndarray:
    """Return pose per voltage from inertia, stiffness and two-port, (frequencies, 3, 3).

    M l'' + D l' + K l = alpha V,  R C_S V' = V_c - V - R alpha l'
    """
    stack = pzt_stack.analyze()
    rest = rrr_stage.analyze(level=level)
    at = rrr_stage.analyze(level=level, voltage=(bias, bias, bias))
    at = rrr_stage.analyze(level=level, elongation=tuple(at["elongation_at_voltage"].tolist()))
    one, alpha = np.eye(3), stack["coupling"]
    M = at["inertia"] + stack["effective_mass"] * one
    D = BETA * rest["stiffness"] + stack["damping"] * one
    K = at["stiffness"] + stack["stiffness"] * one
    found = []
    for s in 2j * np.pi * frequency:
        corner = 1 + s * RESISTANCE * stack["clamped_capacitance"]
        impedance = M * s**2 + (D + alpha**2 * RESISTANCE / corner * one) * s + K
        found.append(at["jacobian"] @ np.linalg.inv(impedance) * alpha / corner)
    return np.array(found)


def bench(excited: str, outputs: tuple[str, ...] = (), library=None) -> Bench:
    names = outputs or scene().outputs
    system = build.instrument(scene(), excited, names)
    return Bench(build.build(system), tuple(names), library=library)


# Docstring ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("level", ["constant_jacobian", "exact"])
@pytest.mark.parametrize("bias", [75.0, 20.0])
def test_every_entry_is_the_formula_of_the_parts_numbers(opened, level, bias):
    found = response(linearized(opened, stage=level, bias=bias), FREQUENCY)
    expected = by_hand(FREQUENCY, level, bias)
    assert max(errors(found, expected)) < 1e-3


def test_bode_plot_is_as_documented(opened):
    linear = linearized(opened)
    dense = np.arange(700.0, 2800.0, 0.5)
    found, still = np.abs(response(linear, dense)), np.abs(response(linear, 1.0)[0])
    assert still[:2].max() == pytest.approx(0.23e-6, rel=0.02)
    np.testing.assert_allclose(response(linear, 1.0)[0, 2].real, -4.10e-6, rtol=2e-3)
    for rows, frequency, height in ((slice(0, 2), 912, 18), (slice(2, 3), 2332, 11)):
        for curve, start in zip(found[:, rows].reshape(len(dense), -1).T, still[rows].ravel(), strict=True):
            assert dense[curve.argmax()] == pytest.approx(frequency, abs=1.5)
            assert 20 * np.log10(curve.max() / start) == pytest.approx(height, abs=0.5)
    low, high = response(linear, [1e5, 1e6])
    np.testing.assert_allclose(20 * np.log10(np.abs(high / low)), -60, atol=0.5)


@pytest.mark.parametrize(
    ("arguments", "modes"),
    [
        ({}, [(916.1 * 0.9996, 0.06), (2375.6 * 0.9997, 0.12)]),
        ({"bias": 0.0}, [(916.1, 0.06), (2375.6, 0.12)]),
        ({"resistance": 1e-3, "bias": 0.0}, [(904.65, 0.006), (2225.2, 0.016)]),
    ],
)
def test_the_amplifiers_resistance_stiffens_and_damps(opened, arguments, modes):
    poles = linearized(opened, **arguments).poles
    poles = poles[poles.imag > 0]
    for frequency, damping in modes:
        near = poles[np.argmin(np.abs(np.abs(poles) / (2 * np.pi) - frequency))]
        assert abs(near) / (2 * np.pi) == pytest.approx(frequency, rel=1e-4)
        assert -near.real / abs(near) == pytest.approx(damping, rel=0.05)


# Bias -----------------------------------------------------------------------------------------------------------------


def test_it_starts_and_stays_at_rest(opened):
    """Nothing moves by more than the solver's tolerance, no limit acts, and the equilibrium is that of the start."""
    for level, turn in (("constant_jacobian", "stage.leg[1].elongation"), ("exact", "stage.center.rotation")):
        at = scene(stage=level)
        linear = linearized(opened, stage=level)
        start = at.system["stage"].start[turn.removeprefix("stage.")]
        assert linear.operating_point[turn] == pytest.approx(start, rel=1e-6)
        assert linear.operating_point["stack[2].voltage"] == pytest.approx(75.0)


def test_a_run_rides_on_the_bias(tmp_path, capsys):
    path, excited = tmp_path / "run.h5", "stack[2].command.voltage"
    words = ["--input", excited, "--frequency", "100", "--stop", "0.6", "-o", str(path)]
    assert main(["run", "stage_bode", *words]) == 0
    assert capsys.readouterr().err == ""
    found, _ = read_run(path)
    voltage, turned = found[excited], found["stage.platform.rotation"]
    assert voltage[0] == 75.0
    assert (voltage.min(), voltage.max()) == pytest.approx((74.5, 75.5), abs=1e-3)
    assert np.ptp(turned) == pytest.approx(4.10e-6, rel=0.02)
    assert (turned.min() + turned.max()) / 2 == pytest.approx(turned[0], abs=0.05e-6)


def test_the_source_swings_about_what_the_scene_says():
    first, second = scene().inputs[:2]
    assert build.instrument(scene(), first)["source"].start == {"amplitude": 0.5, "offset": 75.0}
    other = load_scene("stage_bode", {second: 20})
    assert build.instrument(other, second)["source"].start["offset"] == 20.0


def test_without_a_start_in_the_scene_the_fmus_own_counts():
    system = System([Component("it", "lock_in")])
    inputs, outputs = ["it.cosine", "it.sine"], ["it.windows"]
    simple = Scene(
        system, inputs=inputs, outputs=outputs, band=(1.0, 2.0), amplitude={"1": 0.1}, step_size=1e-3, stop_time=1.0
    )
    assert build.instrument(simple, "it.cosine")["source"].start == {"amplitude": 0.1, "offset": 1.0}
    assert build.instrument(simple, "it.sine")["source"].start == {"amplitude": 0.1}


def test_a_bias_that_the_stacks_cannot_have():
    for bias in (-1, 151, float("nan")):
        with pytest.raises(StructureError, match=r"bias is .* V, expected 0 to 150 V"):
            load_scene("stage_bode", {"bias": bias})


# Stepped sweep --------------------------------------------------------------------------------------------------------


def coupled_step(opened, algorithm: str, stacks_first: bool) -> CoupledStep:
    made = bench(scene().inputs[0])
    source, stage, *rest = made.assembly.system.components
    components = [source, *rest[:3], stage, *rest[3:]] if stacks_first else made.assembly.system.components
    system = System(components, made.assembly.system.connections)
    return CoupledStep(system, opened(made.assembly.files), algorithm, source="source", lock_in="lock_in")


def test_the_stage_first_makes_the_error_one_of_second_order(opened):
    linear = response(linearized(opened), FREQUENCY)[:, :, 0]
    below = FREQUENCY <= 2000

    def error(algorithm: str, step_size: float, stacks_first: bool = False) -> tuple[float, float]:
        found = coupled_step(opened, algorithm, stacks_first).over(step_size).response(FREQUENCY)
        return errors(found[below], linear[below])

    assert error("gauss_seidel", 10e-6) == pytest.approx((0.006, 0.15), rel=0.1)
    assert error("gauss_seidel", 20e-6) == pytest.approx((0.024, 0.59), rel=0.1)
    for algorithm, stacks_first in (("jacobi", False), ("jacobi_plain", False), ("gauss_seidel", True)):
        assert error(algorithm, 10e-6, stacks_first)[1] == pytest.approx(7.3, abs=0.3)
    found = coupled_step(opened, "gauss_seidel", False).over(10e-6).response(FREQUENCY)
    assert errors(found, linear) == pytest.approx((0.021, 0.22), rel=0.1)


@pytest.mark.parametrize(
    ("algorithm", "limit"), [("jacobi_plain", 64.8e-6), ("jacobi", 64.8e-6), ("gauss_seidel", 188.5e-6)]
)
def test_the_charge_that_is_fed_back_limits_the_step(opened, algorithm, limit):
    made = coupled_step(opened, algorithm, stacks_first=False)
    assert made.over(0.98 * limit).is_stable()
    assert not made.over(1.02 * limit).is_stable()
    assert all(made.over(step_size).growth() < -300 for step_size in (1e-6, 10e-6, 40e-6))


def assert_swept_is_linearized(library, opened, excited: str, frequency) -> None:
    made = bench(excited, library=library)
    column = scene().inputs.index(excited)
    expected = response(linearized(opened), frequency)[:, :, column]
    settings = Settings(step_size=scene().step_size)
    rig = Rig(made, settings)
    for f, line in zip(frequency, expected, strict=True):
        point = rig.measure(Task(0, 0, made, settings, f, 0.5))
        assert (point.status, point.message) == (Status.DONE, "")
        decibels, degrees = errors(point.response, line)
        assert decibels < DECIBELS
        assert degrees < DEGREES
        assert point.harmonic_distortion.max() < 1e-3
    rig.close()


@pytest.mark.slow
def test_a_stepped_sweep_is_the_linearized_response(library, opened):
    """Below, at and above the resonances, up to 2 kHz and at the one above it."""
    assert_swept_is_linearized(library, opened, "stack[1].command.voltage", [20.0, 455.0, 912.5, 2000])


@pytest.mark.slow
@pytest.mark.parametrize("excited", [f"stack[{i}].command.voltage" for i in (1, 2, 3)])
def test_all_stepped_sweeps_are_the_linearized_response(library, opened, excited):
    frequency = np.unique(np.concatenate([np.geomspace(1, 2000, 15), np.linspace(860, 960, 6)]))
    assert_swept_is_linearized(library, opened, excited, frequency)


# Limits ---------------------------------------------------------------------------------------------------------------


def test_a_large_amplitude_meets_the_current_limit(library, opened):
    """At 2 kHz 0.1 A is 9.65 V by the linear current; well above that the point is limited."""
    at, excited = scene(), scene().inputs[0]
    current = linearize(at.system, opened(build.build(at.system).files), [excited], ["stack[1].stack.current"])
    per_volt = abs(current.response(np.array([2000.0]), [(0, -1, -1)])[0, 0, 0])
    assert 0.1 / per_volt == pytest.approx(9.65, abs=0.01)
    made, settings = bench(excited, library=library), Settings(step_size=at.step_size)
    rig = Rig(made, settings)
    points = [rig.measure(Task(0, 0, made, settings, 2000.0, amplitude)) for amplitude in (9.0, 10.5)]
    rig.close()
    assert [point.status for point in points] == [Status.DONE, Status.LIMITED]
    assert "stack[1]: current_limited" in points[1].message


def test_a_swing_beyond_the_range_saturates_and_says_so(library):
    made, settings = bench(scene().inputs[0], library=library), Settings(step_size=scene().step_size)
    rig = Rig(made, settings)
    point = rig.measure(Task(0, 0, made, settings, 50.0, 80.0))
    rig.close()
    assert point.status == Status.LIMITED
    assert "stack[1]: saturated" in point.message
