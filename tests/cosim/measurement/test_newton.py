"""Newton's method on the map of a window: exact linear maps, periodic states with harmonics, fewer steps."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.integrate
from duffing import CUBIC, DAMPING, W0, duffing_scene

from hfsa.cosim import load_scene, sweep
from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.assembly.build import LOCK_IN, with_ports
from hfsa.cosim.fidelity.step_judge import judge
from hfsa.cosim.measurement.rig import Bench, Rig, Settings, Task
from hfsa.cosim.measurement.start_state import StartState


def rig_and_tasks(library, scene, algorithm, frequency, settings=None):
    """The rig of the last input of a scene, and a task at each frequency."""
    excited = scene.inputs[-1]
    variants = Variants(scene)
    whole = variants.instrumented(excited)
    with judge(scene, variants.plain, {excited: whole}, scene.outputs, scene.band) as known:
        scene = replace(scene, algorithm=algorithm)
        starts = known.steady_starts(scene, np.asarray(frequency))[0][excited]
    bench = Bench(with_ports(whole, algorithm), tuple(scene.outputs), scene.source.name, LOCK_IN, library)
    settings = settings or Settings("stepped", algorithm, scene.step_size)
    amplitude = whole.system[scene.source.name].start["amplitude"]
    tasks = [
        Task(0, k, bench, settings, f, amplitude, start)
        for k, (f, start) in enumerate(zip(frequency, starts, strict=True))
    ]
    return Rig(bench, settings), tasks


MAPS = [
    ("sdelta_hfsa", {}, "gauss_seidel"),
    ("sdelta_hfsa", {"law": "ctc"}, "jacobi_quadratic"),
    ("sdelta_hfsa", {"execution": "continuous"}, "gauss_seidel_quadratic"),
    ("sdelta_hfsa", {"execution": "continuous"}, "jacobi_linear"),
    ("sdelta_shaker", {}, "gauss_seidel_linear"),
]


@pytest.mark.parametrize(
    ("name", "arguments", "algorithm"), MAPS, ids=[f"{n}-{a}-{i}" for i, (n, _, a) in enumerate(MAPS)]
)
def test_a_disturbed_start_moves_by_the_linear_map(library, name, arguments, algorithm):
    """States, sampled states, held outputs and the values before the start: each one's effect after whole patterns."""
    rig, (task,) = rig_and_tasks(library, load_scene(name, arguments), algorithm, [20.0])
    try:
        start = task.start
        state = StartState(rig.master, start.map.values)
        z = state.vector(start)
        patterns = 3
        expected = start.map.weighted(patterns, [1.0])

        def after(vector):
            rig._initialize(replace(task, start=state.start(start, vector)), 0.1)
            rig._advance(patterns * start.map.steps)
            return state.read()

        undisturbed = after(z)
        rng = np.random.default_rng(3)
        for place in rng.choice(len(z), 12, replace=False):
            size = 1e-3 * state.nominal[place]
            moved = (after(z + size * np.eye(len(z))[place]) - undisturbed) / size
            most = np.max(np.abs(expected[:, place]) / state.nominal) * state.nominal
            scale = np.maximum(np.abs(expected[:, place]), 1e-3 * most + 1e-15 * state.nominal)
            rounding = np.finfo(float).eps * (100 * np.abs(z) / size + 10 * np.abs(expected).max(axis=1))
            np.testing.assert_array_less(np.abs(moved - expected[:, place]), 1e-4 * scale + rounding)
    finally:
        rig.close()


def periodic_gain(frequency, amplitude, harmonics):
    """Complex amplitudes of the harmonics of the Duffing oscillator, relative to the sine, by an independent solver."""
    w = 2 * np.pi * frequency

    def rate(t, y):
        return [y[1], amplitude * np.sin(w * t) - DAMPING * y[1] - W0**2 * y[0] - CUBIC * y[0] ** 3]

    period, n = 1 / frequency, 256
    before = round(30 / DAMPING / period)
    t = (before + np.arange(n) / n) * period
    found = scipy.integrate.solve_ivp(rate, (0, t[-1]), [0, 0], "DOP853", t, rtol=1e-10, atol=1e-14)
    turns = np.exp(-2j * np.pi * np.outer(harmonics, np.arange(n)) / n)
    return 2j / n * turns @ found.y[0]


@pytest.mark.parametrize("frequency", [13.3, 14.6, 19.77], ids=lambda f: f"{f} Hz")
def test_the_periodic_state_has_harmonics(library, tmp_path, frequency):
    """Whether or not a window is a whole number of periods; response and third harmonic as of an independent solver."""
    scene = load_scene(str(duffing_scene(tmp_path)), {})
    scene = replace(scene, amplitude={"m/s2": 10.0})
    settings = Settings("stepped", "gauss_seidel_linear", scene.step_size, settling_tolerance=1e-5)
    rig, (task,) = rig_and_tasks(library, scene, "gauss_seidel_linear", [frequency], settings)
    try:
        point = rig.measure(task)
        closing = rig.closing_state(task)
        window = point.steps
        again = rig.measure(replace(task, start=closing))  # on the periodic state: nothing to settle
    finally:
        rig.close()
    assert not point.message
    first, third = periodic_gain(frequency, 10.0, [1, 3])
    np.testing.assert_allclose(point.response[0] * 10.0, first, rtol=3e-4)
    np.testing.assert_allclose(point.harmonic_distortion[0], np.abs(third / first), rtol=2e-2)
    assert np.abs(third / first) > 5e-5
    np.testing.assert_allclose(again.response, point.response, rtol=2e-5)
    assert window < 15 / frequency / scene.step_size


def test_newton_takes_a_fraction_of_the_steps_of_waiting(tmp_path, monkeypatch):
    scene = duffing_scene(tmp_path)
    words = {"low": 13, "high": 24, "points": 6, "grid": "log", "amplitude": 6.0, "jobs": 1, "warn": lambda _: None}
    quick = sweep(scene, path=tmp_path / "quick.h5", **words)
    monkeypatch.setattr("hfsa.cosim.measurement.rig.MOST_CORRECTIONS", 0)
    waited = sweep(scene, path=tmp_path / "waited.h5", **words)
    np.testing.assert_allclose(quick.response, waited.response, rtol=2e-3)
    assert not quick.message.any()
    assert quick.steps.sum() < waited.steps.sum() / 2
    assert np.all(quick.steps <= waited.steps * 1.01)


def test_where_newton_does_not_contract_the_point_waits_and_says_so(tmp_path):
    scene = duffing_scene(tmp_path)
    words = {"low": 14, "high": 17, "points": 2, "grid": "log", "amplitude": 100.0, "jobs": 1, "warn": lambda _: None}
    steady = sweep(scene, path=tmp_path / "steady.h5", **words)
    rest = sweep(scene, path=tmp_path / "rest.h5", start="rest", **words)
    np.testing.assert_allclose(steady.response, rest.response, rtol=2e-3)
    assert all(m.startswith("waited for the transient: Newton's method does not") for m in steady.message.ravel())
    assert not rest.message.any()


@pytest.mark.slow
def test_the_nonlinear_accelerometer_takes_a_tenth_of_the_steps_from_rest(tmp_path):
    words = {"inputs": ["sensor.base.acceleration[2]"], "low": 6000, "points": 1, "warn": lambda _: None}
    level = {"sensor.level": "nonlinear"}
    steady = sweep("accelerometer_shaker", level, path=tmp_path / "steady.h5", **words)
    rest = sweep("accelerometer_shaker", level, path=tmp_path / "rest.h5", start="rest", **words)
    assert np.all(steady.steps * 10 < rest.steps)
    np.testing.assert_allclose(steady.response[..., 1, 0], rest.response[..., 1, 0], rtol=2e-3)
