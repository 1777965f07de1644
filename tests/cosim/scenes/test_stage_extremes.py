"""Extreme gains on the stage, co-simulated: errors of the published gains, and their dependence on the sample time."""

import numpy as np
import pytest

from hfsa.controllers.stage_closed_loop import analyze
from hfsa.cosim.assembly.build import build
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.fidelity.step_judge import with_algorithm
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.systems.errors import StructureError

ERROR, FORCE = "tracking.axis[1].error", "controller.axis[1].command"
RATE = 3e-6
CTC, PD = (5e16, 6e8), (1e17, 1e7)


@pytest.fixture
def course(opened, library):
    """Run a scene for some time [s]; times, errors of stack 1 [m] and its forces [N], (n,)."""

    def run(seconds: float, scene: str = "stage_extremes", **arguments) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        loaded = load_scene(scene, arguments)
        master = make_master(
            opened(build(loaded.system).files),
            loaded.system,
            with_algorithm(loaded)[0].algorithm,
            loaded.step_size,
            library,
        )
        steps = round(seconds / loaded.step_size)
        recording = master.record([ERROR, FORCE], rows=steps + 1)
        master.initialize()
        master.advance(steps)
        return np.array(recording.time), np.array(recording[ERROR]), np.array(recording[FORCE])

    return run


def test_ten_microseconds_at_the_sources_gains(course):
    """745 N at once, 3.1e-15 m where 4.0e-15 m would be without sampling, and then nothing is left."""
    scene = load_scene("stage_extremes")
    assert (scene.step_size, scene.stop_time) == (1e-9, 10e-6)
    time, error, force = course(scene.stop_time)
    assert np.array_equal(time, np.arange(10_001) * 1e-9)
    assert force[1] == pytest.approx(745, abs=0.5)
    assert force[1] == pytest.approx(
        analyze(law="ctc", proportional_gain=CTC[0], derivative_gain=CTC[1])["start_force"][0], rel=1e-6
    )
    assert error.max() == pytest.approx(3.08e-15, abs=0.005e-15)
    assert np.abs(error[-1000:]).max() < 1e-24
    assert force[-1] == pytest.approx(29.1175e6 * RATE * 10e-6, rel=1e-3)


def test_nothing_but_the_hold_is_lost(course):
    """At the ticks, the error is that of a double integrator under a held command, to nine digits of its peak."""
    _, found, _ = course(0.1e-6)
    error, rate = 0.0, RATE
    for tick in range(101):
        assert found[tick] == pytest.approx(error, abs=1e-9 * 4e-15)
        braking = CTC[1] * rate + CTC[0] * error
        error, rate = error + rate * 1e-9 - braking * 1e-18 / 2, rate - braking * 1e-9


def test_the_error_tends_to_that_without_sampling(course):
    """4.0124e-15 m at 4.02 ns, with an error of first order in the sample time: 2.3 % at 0.1 ns."""
    exact = analyze(law="ctc", proportional_gain=CTC[0], derivative_gain=CTC[1])
    assert exact["peak_error"] == pytest.approx(4.0124e-15, abs=0.00005e-15)
    lost = {}
    for T in (0.025e-9, 0.05e-9, 0.1e-9):
        time, error, _ = course(10e-9, sample_time=T)
        lost[T] = 1 - error.max() / exact["peak_error"]
        assert time[error.argmax()] == pytest.approx(exact["peak_time"], abs=2 * T)
    assert lost[0.05e-9] / lost[0.025e-9] == pytest.approx(2, rel=0.01)
    assert lost[0.1e-9] / lost[0.05e-9] == pytest.approx(2, rel=0.01)
    assert lost[0.1e-9] == pytest.approx(0.023, abs=0.0005)
    assert 2 * lost[0.025e-9] == pytest.approx(lost[0.05e-9], abs=1e-4)


@pytest.mark.parametrize(("sample_time", "stable"), [(3.30e-9, True), (3.32e-9, True), (3.34e-9, False)])
def test_computed_torque_is_unstable_above_3_33_ns(course, sample_time, stable):
    _, error, _ = course(2e-6, sample_time=sample_time)
    early, late = np.abs(error[100:120]).max(), np.abs(error[-20:]).max()
    assert (late < early) == stable
    assert (
        sample_time < analyze(law="ctc", proportional_gain=CTC[0], derivative_gain=CTC[1])["sample_time_limit"]["held"]
    ) == stable


@pytest.mark.parametrize("share", [0.97, 1.03])
@pytest.mark.parametrize("delay", [False, True])
@pytest.mark.parametrize("damping_time", [0.0, 6.02e-6])
def test_a_sensible_computed_torque_is_unstable_above_its_limit(course, share, delay, damping_time):
    """300 Hz on the analysis' limits with hinges, which are well below the 0.53 and 0.226 ms of masses alone."""
    omega = 2 * np.pi * 300
    limits = analyze(
        law="ctc",
        proportional_gain=omega**2,
        derivative_gain=2 * omega,
        elongation=(0.0, 0.0, 0.0),
        damping_time=damping_time,
    )["sample_time_limit"]
    sample_time = share * limits["held_delayed" if delay else "held"]
    assert sample_time < 0.8 * limits["rigid_delayed" if delay else "rigid"]
    arguments = {"law": "ctc", "actuator": "force", "delay": delay, "damping_time": damping_time}
    _, error, _ = course(600 * sample_time, "stage_tracking", sample_time=sample_time, **arguments)
    swing = np.ptp(error[300:])
    assert swing < 1e-11 if share < 1 else swing > 1e-8


def test_pd_of_table_5_1_sampled(course):
    """1e17 / 1e7 every 60 ps: 5.94e-15 m (5.88e-15 without sampling), then the bias that grows with the ramp."""
    time, error, force = course(0.6e-6, law="pd")
    exact = analyze(proportional_gain=PD[0], derivative_gain=PD[1])
    assert time[1] == 6e-11
    assert exact["sample_time_limit"]["held"] == pytest.approx(0.2e-9, rel=1e-3)
    assert force[1] == pytest.approx(30.0, rel=1e-9)
    assert error.max() == pytest.approx(exact["peak_error"], rel=0.02)
    assert time[error.argmax()] == pytest.approx(exact["peak_time"], abs=6e-11)
    # The yaw dies away at Kv / 2m, less Kp T / 4m for the hold
    decay = -np.polyfit(time, np.log(np.abs(error - 29.1175e6 * RATE * time / PD[0]) + 1e-30), 1)[0]
    assert decay > 0
    early, late = np.abs(error[:200]).max(), np.abs(error[4800:5000]).max()
    assert np.log(early / late) / 0.288e-6 == pytest.approx((PD[1] / 2 - PD[0] * 6e-11 / 4) / 0.41401, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("gains", [(8.6e17, 1e7), (1e17, 1e6)])
def test_more_pairs_of_table_5_1_sampled(course, gains):
    """What a part can tick fast enough for: 7 and 6 ps."""
    time, error, _ = course(10e-6, law="pd", proportional_gain=gains[0], derivative_gain=gains[1])
    exact = analyze(proportional_gain=gains[0], derivative_gain=gains[1])
    assert error.max() == pytest.approx(exact["peak_error"], rel=0.005)
    assert error[-1] == pytest.approx(29.1175e6 * RATE * time[-1] / gains[0], rel=0.05)


@pytest.mark.slow
def test_the_exact_stage_under_its_own_model(course):
    """Ten times as long, on the exact level: the same course, down to what rounding leaves of links of a centimetre."""
    _, error, force = course(100e-6, stage="exact")
    assert force[1] == pytest.approx(745, abs=0.5)
    assert error.max() == pytest.approx(3.08e-15, abs=0.005e-15)
    assert np.abs(error[-1000:]).max() < 1e-18


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"proportional_gain": -1.0}, "proportional_gain is -1, expected 0 or more"),
        ({"derivative_gain": -1.0}, "derivative_gain is -1, expected 0 or more"),
        (
            {"law": "pd", "derivative_gain": 10.0},
            "stable below 2e-16 s only, and no part has a sample time below 1e-12 s",
        ),
        ({"law": "pd", "derivative_gain": 0.0}, "is undamped, and unstable at any sample time"),
    ],
)
def test_what_cannot_be_run_is_refused(arguments, message):
    with pytest.raises(StructureError, match=message):
        load_scene("stage_extremes", arguments)


def test_what_is_refused_can_be_seen_to_fail(course):
    """Without Kv the held command pushes the stage on: PD at 1e17 N/m, every 0.1 ns, grows by Kp T / 4m."""
    _, error, _ = course(0.1e-6, law="pd", derivative_gain=0.0, sample_time=1e-10)
    early, late = np.abs(error[:200]).max(), np.abs(error[-200:]).max()
    assert np.log(late / early) / 80e-9 == pytest.approx(1e17 * 1e-10 / 4 / 0.41401, rel=0.1)
