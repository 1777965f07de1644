"""Amplitudes from a picometre to where a limit acts: responses do not depend on them, and the limit is reported."""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from extreme_rows.bench import PointError, left_wing, point, relative, scratch, sentences, spring_response, transfer
from extreme_rows.row import Accuracy, Found, Message, Row
from hfsa.components import beam_stage
from hfsa.components._mechanics.beam_spring import SpringDesign
from hfsa.components._mechanics.rigid_body import Body
from hfsa.components._modelling.linearize import linearize
from hfsa.cosim import load_scene, sweep

AHEAD = Body(center=(0.03, 0.0, 0.0))
"""Payload of the default module, whose mass centre a shake along it does not turn."""
LENGTH, RATIO, SHAKEN = 0.05, 0.01, 100.0
"""Length of its beams [m], their damping ratio, and the frequency of the shake [Hz]."""
HEIGHT = "robot.platform.position[3]"
POSE = ["stage.platform.position[2]", "stage.platform.rotation"]
VOLTAGE, SMALL, FAST, CURRENT_LIMIT = "stack[1].command.voltage", 1e-6, 2000.0, 0.1
"""Excited input of the stage, a small amplitude [V], frequency [Hz], and current limit of its amplifiers [A]."""
RESPONSE = 1e-3
"""Tolerance of a response, that of scenes."""


def rows() -> Iterator[Row]:
    """Yield the rows."""
    for amplitude in (1e-12, 1e-3):
        yield Row(
            "amplitude",
            f"`mass_on_spring`, base shaken by {amplitude:g} m at 17 Hz",
            Accuracy("response", "k / (k - m omega^2 + j c omega)", RESPONSE),
            partial(spring, amplitude),
            is_cheap=True,
        )
    for amplitude in (1e-12, 1e-3, 1e-2):
        yield Row(
            "amplitude",
            f"`sdelta_shaker`, vertical command of {amplitude:g} m at 17 Hz",
            Accuracy("response", "the equations of both parts", RESPONSE),
            partial(robot, amplitude),
        )
    for scene, component, excited, observed, frequency, amplitudes, unit in (
        (
            "accelerometer_shaker",
            "sensor",
            "base.acceleration[1]",
            "acceleration_estimate[1]",
            4e3,
            (1e-9, 1e2),
            "m/s2",
        ),
        ("beam_bode", "stage", "wrench.force[1]", "platform.position[1]", 1000.0, (1e-9, 1e2), "N"),
    ):
        for amplitude in amplitudes:
            yield Row(
                "amplitude",
                f"`{scene}`, `{excited}` of {amplitude:g} {unit} at {frequency:g} Hz",
                Accuracy("response", "the equations of the part", RESPONSE),
                partial(alone, scene, component, excited, observed, frequency, amplitude),
            )
    for scene, arguments, excited, observed, frequency, amplitudes, unit in (
        ("stage_bode", {}, VOLTAGE, POSE, FAST, (1e-6, 0.5), "V"),
        ("stage_bode", {"damping_time": 0.0}, VOLTAGE, POSE, FAST, (1e-6,), "V"),
        ("stage_bode", {"stage": "exact"}, VOLTAGE, POSE, FAST, (1e-6, 0.5), "V"),
        ("stage_accelerometer", {}, VOLTAGE, None, 100.0, (1e-6, 0.5), "V"),
        ("sdelta_accelerometer", {}, "reference.command.position[3]", None, 17.0, (1e-12, 1e-3), "m"),
        ("sdelta_hfsa", {}, "reference.command.position[3]", [HEIGHT], 17.0, (1e-12, 1e-5), "m"),
        ("sdelta_hfsa", {"law": "ctc"}, "reference.command.position[3]", [HEIGHT], 17.0, (1e-12, 1e-5), "m"),
    ):
        given = "".join(f", {name} {value}" for name, value in arguments.items())
        for amplitude in amplitudes:
            yield Row(
                "amplitude",
                f"`{scene}`{given}, `{excited}` of {amplitude:g} {unit} at {frequency:g} Hz",
                Accuracy("response", "the linearised FMUs", RESPONSE),
                partial(linearized, scene, arguments, excited, observed, frequency, amplitude),
            )
    for bias in (0.0, 150.0):
        yield Row(
            "amplitude",
            f"`stage_bode`, {SMALL:g} V at {FAST:g} Hz about {bias:g} V, an end of the range of the stacks",
            Message("saturated.*not the small-signal response", "a warning"),
            partial(spoilt, {"bias": bias}, SMALL),
        )
    for share, pattern in ((0.98, "^$"), (1.08, "at its current limit.*not the small-signal response")):
        yield Row(
            "amplitude",
            f"`stage_bode`, {share:g} of the voltage at {FAST:g} Hz that takes the current limit of an amplifier",
            Message(pattern, "a warning"),
            partial(current, share),
        )
    for share, pattern in ((0.98, "^$"), (1.02, "displaced too far")):
        yield Row(
            "amplitude",
            f"`beam_payload`, shaken along the module to {share:g} of a tenth of the beam length",
            Message(pattern, "a warning"),
            partial(payload, share),
        )


def spring(amplitude: float) -> Found:
    """Return the error of the response of the mass."""
    found = point("mass_on_spring", {}, "mass.base.position", ["mass.position"], 17.0, amplitude)[0]
    return Found(abs(found / spring_response(17.0, 1e4, 0.5, 1.0) - 1))


def robot(amplitude: float) -> Found:
    """Return the error of the vertical response of the robot."""
    omega = 2j * math.pi * 17.0
    reference, carrier = (linearize(*left_wing("sdelta_shaker", {}, name)) for name in ("reference", "robot"))
    orders = {"": 1.0, "_rate": omega, "_acceleration": omega**2}
    command = {f"command.position{order}[3]": value for order, value in orders.items()}
    shared = [name.replace("/", ".") for name in reference.output_labels if name in carrier.input_labels]
    tubes = dict(zip(shared, transfer(reference, omega.imag, command, shared), strict=True))
    exact = transfer(carrier, omega.imag, tubes, ["platform.position[3]"])
    excited, observed = "reference.command.position[3]", ["robot.platform.position[3]"]
    found = point("sdelta_shaker", {}, excited, observed, 17.0, amplitude)
    return Found(relative(found, exact), f"{abs(found[0]):.5g} times the command")


def alone(scene: str, component: str, excited: str, observed: str, frequency: float, amplitude: float) -> Found:
    """Return the error of the response of a scene of one part."""
    exact = transfer(linearize(*left_wing(scene, {}, component)), 2 * math.pi * frequency, {excited: 1.0}, [observed])
    found = point(scene, {}, f"{component}.{excited}", [f"{component}.{observed}"], frequency, amplitude)
    return Found(relative(found, exact))


def linearized(
    scene: str,
    arguments: dict[str, Any],
    excited: str,
    observed: Sequence[str] | None,
    frequency: float,
    amplitude: float,
) -> Found:
    """Return the error of the responses of a scene, relative to each that is above a thousandth of the largest."""
    observed = observed or load_scene(scene, arguments).outputs
    exact = response(scene, arguments, excited, observed, frequency)
    found = point(scene, arguments, excited, observed, frequency, amplitude)
    moving = np.abs(exact) > 1e-3 * np.abs(exact).max()
    return Found(
        float(np.abs(found[moving] / exact[moving] - 1).max()), f"{moving.sum()} of {moving.size} outputs move"
    )


def current(share: float) -> str:
    """Return the message of a point in which the current has a share of its limit."""
    per_volt = abs(response("stage_bode", {}, VOLTAGE, ["stack[1].stack.current"], FAST)[0])
    return spoilt({}, share * CURRENT_LIMIT / per_volt)


def spoilt(arguments: dict[str, Any], amplitude: float) -> str:
    """Return the message of a point of the stage, empty where it is as it should be."""
    try:
        point("stage_bode", arguments, VOLTAGE, POSE, FAST, amplitude)
    except PointError as error:
        return str(error)
    return ""


def response(
    scene: str, arguments: dict[str, Any], excited: str, observed: Sequence[str], frequency: float
) -> np.ndarray:
    """Return the linear response of outputs, (outputs,), at a frequency [Hz]."""
    with scratch() as folder:
        found = sweep(
            scene,
            arguments,
            method="linear",
            inputs=[excited],
            outputs=observed,
            low=frequency,
            high=frequency,
            points=1,
            path=folder / "linear.h5",
            warn=lambda _: None,
        )
        return found.response[0, :, 0]


def payload(share: float) -> str:
    """Return the warnings of a run in which the displacement is a share of a tenth of the length of a beam."""
    found = beam_stage.analyze(module=SpringDesign("double_tilted"), platform=AHEAD)
    omega, shaken = 2 * math.pi * max(found["natural_frequencies_hz"]), 2 * math.pi * SHAKEN
    displaced = abs(1 / (omega**2 - shaken**2 + 2j * RATIO * omega * shaken))
    excited, amplitude = "payload.base.acceleration[1]", share * 0.1 * LENGTH / displaced
    return sentences(
        "beam_payload", {}, input=excited, amplitude=amplitude, frequency=SHAKEN, stop_time=0.55, step_size=1e-5
    )
