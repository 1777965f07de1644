"""Gains of up to 5e16: the stage on a ramp, under computed torque and PD, against a mass under the same law."""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from extreme_rows.bench import moved, relative, sentences
from extreme_rows.row import Accuracy, Found, Message, Row
from hfsa.components.rrr_stage import analyze as analyze_stage
from hfsa.controllers.stage_closed_loop import analyze as analyze_loop
from hfsa.cosim import load_scene

CTC, PD = (5e16, 6e8), (1e17, 1e7)
SHORT, WEAK, BANDWIDTH = 2.5e-11, 10.0, 1e4
"""A short sample time [s], a weak derivative gain [N.s/m], and a bandwidth above half the sampling rate [Hz]."""
RATE = 3e-6
ERROR, FORCE = "tracking.axis[1].error", "controller.axis[1].command"


def rows() -> Iterator[Row]:
    """Yield the rows."""
    ctc = f"`stage_extremes`, computed torque of {CTC[0]:g} 1/s2 and {CTC[1]:g} 1/s"
    for sample_time, ticks in ((1e-9, 1000), (1e-10, 1000)):
        yield Row(
            "gain",
            f"{ctc} every {sample_time:g} s, on a ramp of {RATE:g} m/s for {sample_time * ticks:g} s",
            Accuracy("tracking error", "a double integrator under the held command", 1e-9),
            partial(held, sample_time, ticks),
        )
    yield Row(
        "gain",
        f"{ctc} every {SHORT:g} s",
        Accuracy("peak of the tracking error", "the loop without sampling", 0.01),
        partial(peak, {"sample_time": SHORT}, "ctc", CTC, 400),
    )
    own = load_scene("stage_extremes", {"execution": "continuous"})
    yield Row(
        "gain",
        f"{ctc}, at every instant, in steps of {own.step_size:g} s",
        Accuracy(f"force after {own.stop_time:g} s", "stiffness of the hinges times the ramp", 1e-3),
        continuous,
    )
    own = load_scene("stage_extremes", {"law": "pd"})
    yield Row(
        "gain",
        f"`stage_extremes`, PD of {PD[0]:g} N/m and {PD[1]:g} N.s/m every {own.step_size:g} s",
        Accuracy("peak of the tracking error", "the loop without sampling", 0.02),
        partial(peak, {"law": "pd"}, "pd", PD, 10_000),
    )
    stiff = {"law": "pd", "actuator": "force", "proportional_gain": CTC[0]}
    for scene, arguments, words, then in (
        ("stage_tracking", stiff, f"PD of {CTC[0]:g} N/m with an ideal force", "diverged at"),
        ("sdelta_hfsa", {"bandwidth": BANDWIDTH}, f"bandwidth of {BANDWIDTH:g} Hz", "saturated"),
    ):
        sample_time = load_scene(scene, arguments).system["controller"].start["sample_time"]
        yield Row(
            "gain",
            f"`{scene}`, {words}, every {sample_time:g} s",
            Message(f"the system itself is unstable.*{then}", "a warning"),
            partial(sentences, scene, arguments, stop_time=0.01),
        )
    yield Row(
        "gain",
        f"`stage_extremes`, PD of {PD[0]:g} N/m and {WEAK:g} N.s/m",
        Message(f"stable below {2 * WEAK / PD[0]:g} s only"),
        partial(load_scene, "stage_extremes", {"law": "pd", "derivative_gain": WEAK}),
        is_cheap=True,
    )


def tracked(arguments: dict[str, Any], steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return tracking error [m] and force [N] of the first stack at every tick."""
    scene = load_scene("stage_extremes", arguments)
    algorithm = "gauss_seidel" if scene.algorithm == "auto" else scene.algorithm
    _, found = moved(scene.system, scene.step_size, steps, [ERROR, FORCE], algorithm=algorithm)
    return found[:, 0], found[:, 1]


def held(sample_time: float, ticks: int) -> Found:
    """Return the error at the ticks, relative to the peak."""
    kp, kv = CTC
    error, rate, exact = 0.0, RATE, []
    for _ in range(ticks + 1):
        exact.append(error)
        braking = kv * rate + kp * error
        error, rate = error + rate * sample_time - braking * sample_time**2 / 2, rate - braking * sample_time
    found, force = tracked({"sample_time": sample_time}, ticks)
    return Found(relative(found, np.array(exact)), f"peak {found.max():.4g} m, first force {force[1]:.4g} N")


def peak(arguments: dict[str, Any], law: Any, gains: tuple[float, float], steps: int) -> Found:
    """Return the error of the peak."""
    exact = analyze_loop(law=law, proportional_gain=gains[0], derivative_gain=gains[1])["peak_error"]
    found = tracked(arguments, steps)[0].max()
    return Found(abs(found / exact - 1), f"{found:.4g} m, without sampling {exact:.4g} m")


def continuous() -> Found:
    """Return the error of the force at the end."""
    own = load_scene("stage_extremes", {"execution": "continuous"})
    _, force = tracked({"execution": "continuous"}, round(own.stop_time / own.step_size))
    exact = analyze_stage(level="constant_jacobian")["stiffness"].sum(axis=1)[0] * RATE * own.stop_time
    return Found(abs(force[-1] / exact - 1), f"{force[-1]:.5g} N")
