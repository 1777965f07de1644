"""Measurements that start on the predicted steady state: settled at once on linear scenes, equal numbers on all."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hfsa.cosim import load_scene, read
from hfsa.cosim.analysis.steady_start import SteadyStart
from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.assembly.build import LOCK_IN, with_ports
from hfsa.cosim.assembly.load_scene import available_scenes
from hfsa.cosim.fidelity.step_judge import judge
from hfsa.cosim.masters.algorithms import ALGORITHMS
from hfsa.cosim.measurement.rig import Bench, Rig, Settings, Task
from hfsa.cosim.signals.excitation import FEWEST_SAMPLES, window_steps
from hfsa.cosim.signals.frequency_response import FEWEST_WINDOWS, Settling

LINEAR = [
    ("mass_on_spring", {}),
    ("sdelta_shaker", {}),
    ("sdelta_hfsa", {}),
    ("sdelta_hfsa", {"law": "ctc"}),
    ("sdelta_hfsa", {"delay": "true"}),
    ("sdelta_hfsa", {"execution": "continuous"}),
    ("accelerometer_shaker", {"sensor.level": "planar"}),
    ("beam_payload", {}),
    ("beam_bode", {}),
    pytest.param("sdelta_accelerometer", {}, marks=pytest.mark.slow),
]
"""The stage is nonlinear at every level with stacks."""

OTHERS = ("linearized_feedback", "jacobi_plain")
"""One takes FMUs with ports; of the other inputs lag behind outputs, which no start value gives."""

STEPPING = [name for name, row in ALGORITHMS.items() if row.is_limited]


def windows(library, name, arguments, algorithm=None, points=4, count=2):
    """Gains of the first windows over the predicted ones, relative to the largest, (points, count)."""
    scene = load_scene(name, arguments)
    excited = scene.inputs[-1]
    variants = Variants(scene)
    whole = variants.instrumented(excited)
    high = min(scene.band[1], 1 / (FEWEST_SAMPLES * scene.step_size))
    frequency = np.geomspace(scene.band[0], high, points)
    with judge(scene, variants.plain, {excited: whole}, scene.outputs, scene.band) as known:
        scene = known.with_algorithm(scene)[0] if algorithm is None else replace(scene, algorithm=algorithm)
        starts = known.steady_starts(scene, frequency)[0][excited]
    bench = Bench(with_ports(whole, scene.algorithm), tuple(scene.outputs), scene.source.name, LOCK_IN, library)
    settings = Settings("stepped", scene.algorithm, scene.step_size)
    amplitude = whole.system[scene.source.name].start["amplitude"]
    rig = Rig(bench, settings)
    try:
        return [off(rig, Task(0, k, bench, settings, f, amplitude, starts[k]), count) for k, f in enumerate(frequency)]
    finally:
        rig.close()


def off(rig: Rig, task: Task, count: int) -> list[float]:
    steps = window_steps(task.frequency, task.settings.step_size)
    rig._initialize(task, steps)
    found = []
    for window in range(1, count + 1):
        rig.master.advance(steps)
        rig._readings.take(window)
        found.append(np.abs(rig._readings.gains[-1] - task.start.gain).max() / np.abs(task.start.gain).max())
    return found


@pytest.mark.parametrize(
    ("name", "arguments"), LINEAR, ids=lambda value: value if isinstance(value, str) else "-".join(value)
)
def test_a_linear_scene_is_settled_from_the_first_window_on(library, name, arguments):
    """Sampled control, delays and extrapolated inputs included."""
    assert np.max(windows(library, name, arguments)) < 1e-9


@pytest.mark.parametrize("algorithm", [name for name in STEPPING if name not in OTHERS])
def test_whatever_the_algorithm(library, algorithm):
    accuracy = 1e-6 if ALGORITHMS[algorithm].inputs == "iterated" else 1e-9  # their passes end at 1e-10 of a value
    assert np.max(windows(library, "sdelta_hfsa", {"execution": "continuous"}, algorithm, points=2)) < accuracy


SCENES = [
    ("mass_on_spring", [], 3),
    ("sdelta_shaker", ["--input", "command.position[3]"], 4),
    ("sdelta_hfsa", ["--input", "command.position[1]"], 3),
    ("sdelta_hfsa", ["-p", "law=ctc", "--input", "command.rotation[2]"], 3),
    pytest.param("sdelta_accelerometer", ["--input", "command.position[3]"], 2, marks=pytest.mark.slow),
    pytest.param(
        "accelerometer_shaker",
        ["--input", "sensor.base.acceleration[2]", "-p", "sensor.level=nonlinear", "--to", "500"],
        2,
        marks=pytest.mark.slow,
    ),
    ("stage_bode", ["--input", "stack[1].command.voltage", "--from", "100", "--to", "300"], 2),
    pytest.param(
        "stage_accelerometer", ["--input", "stack[1].command.voltage", "--to", "300"], 2, marks=pytest.mark.slow
    ),
    *(
        pytest.param(name, [*more, "--input", source, "--from", "200", "--to", "300"], 1, marks=pytest.mark.slow)
        for name, more, source in (
            ("stage_bode", ["-p", "stage=exact"], "stack[1].command.voltage"),
            ("stage_bode", ["-p", "stack[1].level=hysteretic"], "stack[1].command.voltage"),
            ("stage_accelerometer", ["-p", "stage=exact"], "stack[1].command.voltage"),
        )
    ),
    pytest.param(
        "sdelta_accelerometer",
        ["-p", "sensor.level=nonlinear", "--input", "reference.command.position[3]"],
        1,
        marks=pytest.mark.slow,
    ),
    ("beam_payload", ["--input", "payload.base.acceleration[3]"], 3),
    ("beam_bode", ["--input", "stage.wrench.force[3]"], 3),
]


def test_every_scene_with_inputs_is_compared():
    compared = {getattr(scene, "values", scene)[0] for scene in SCENES}
    assert compared == {name for name in available_scenes() if load_scene(name).inputs}
    nonlinear = {word for scene in SCENES for word in getattr(scene, "values", scene)[1] if "=" in word}
    assert {"sensor.level=nonlinear", "stage=exact", "stack[1].level=hysteretic"} <= nonlinear


@pytest.mark.parametrize(("name", "more", "points"), SCENES, ids=lambda value: value if isinstance(value, str) else "")
def test_both_starts_have_the_same_numbers(hfsa, name, more, points):
    """Within the settling tolerance, on every scene that can be swept."""
    words = ["sweep", name, *more, "--points", points, "-j", "1"]
    for start in ("rest", "steady"):
        assert hfsa(*words, "--start", start, "-o", f"{start}.h5")[0] == 0
    rest, steady = read("rest.h5"), read("steady.h5")
    assert (rest.settings["start"], steady.settings["start"]) == ("rest", "steady")
    scale = np.maximum(np.abs(rest.response), 1e-6 * np.abs(rest.response).max(axis=1, keepdims=True))
    difference = np.abs(steady.response - rest.response) / scale
    assert np.nanmax(difference[scale > 1e-3 * scale.max()]) < 2e-3


def test_what_does_not_let_its_states_be_set_starts_at_rest(library, monkeypatch):
    """A wrong start costs time, never accuracy."""
    scene = load_scene("mass_on_spring", {"damping": 50})
    whole = Variants(scene).instrumented("mass.base.position")
    bench = Bench(whole, tuple(scene.outputs), scene.source.name, LOCK_IN, library)
    settings = Settings("stepped", "gauss_seidel", scene.step_size)
    wrong = SteadyStart({"mass.mass.position": 0.5}, np.zeros((2, 0)), np.array([1e-3 + 0j]), -1.0)
    rig = Rig(bench, settings)
    try:
        plain = rig.measure(Task(0, 0, bench, settings, 20.0, 1e-3))
        misled = rig.measure(Task(0, 0, bench, settings, 20.0, 1e-3, wrong))
        unsettable = replace(wrong, values={"mass.position": 1.0})  # an output
        refused = rig.measure(Task(0, 0, bench, settings, 20.0, 1e-3, unsettable))
    finally:
        rig.close()
    assert not misled.message
    assert refused.message.startswith("started at rest: ")
    assert "mass.position" in refused.message
    for other in (misled, refused):
        np.testing.assert_allclose(other.response, plain.response, rtol=2e-3)


def test_settling_believes_a_prediction_only_while_the_gains_are_there():
    expected = np.array([1.0 + 1j])
    there = Settling(1e-3, expected=expected, keeps=0.9)
    there.add(expected * (1 + 1e-6))
    assert there.settled
    assert there.remaining[0] == pytest.approx(2e-6 * np.abs(expected[0]) / 0.1)
    nearby = Settling(1e-3, expected=expected, keeps=0.9)
    nearby.add(expected * (1 + 5e-4))
    assert not nearby.settled  # on its way to 1.005, perhaps
    nearby.add(expected * (1 + 5.1e-4))
    assert nearby.settled
    elsewhere = Settling(1e-3, expected=1.01 * expected, keeps=0.9)
    for _ in range(FEWEST_WINDOWS - 1):
        elsewhere.add(expected)
        assert not elsewhere.settled
    elsewhere.add(expected)
    assert elsewhere.settled
    slow = Settling(1e-3, expected=expected, keeps=1 - 1e-6)
    slow.add(expected * (1 + 1e-8))
    assert not slow.settled  # so slow a transient may hide below such a change


@given(st.floats(0.01, 0.9999), st.floats(1e-8, 1e-2), st.floats(0, 6.28))
def test_the_remaining_transient_is_not_underestimated(keeps, departure, angle):
    """Of a run that leaves the prediction for a steady state nearby, at the predicted rate."""
    end = 1 + departure * np.exp(1j * angle)
    settling = Settling(1e-3, expected=[1.0], keeps=keeps)
    rate = -np.log(keeps)
    for window in range(1, FEWEST_WINDOWS):
        left = keeps ** (window - 1) * (1 - keeps) / rate  # mean over the window
        settling.add([end + (1 - end) * left])
        if settling.settled:
            assert np.abs(end - settling.gain[0]) <= settling.remaining[0] * (1 + 1e-6) + 1e-15
            assert np.abs(end - settling.gain[0]) <= 1e-3 * np.abs(settling.gain[0])
            break
