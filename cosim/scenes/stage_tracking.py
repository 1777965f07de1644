"""The 3-RRR stage on a motion of its own under five control laws: a comparison of PD and computed torque.

    pd            Kp e + Kv e'                              error H(r) / Kp due to the hinges' force H
    pd_ff         the same and H(r)                         error due to the model of H
    ctc           computed torque on a model of the stage   the same; errors decay as e'' + Kv e' + Kp e = 0
    integral      voltage by the integral of e              lag on a ramp: its rate over the crossover
    integral_ff   the same and the static voltage           lag due to the model

With the actuator `pzt` the force of a law is converted to a voltage, 0 to 150 V, of three stacks; `force` is an ideal
force. The ramp of 3 um/s ends at 12 um, but the stacks reach 10.265 um at 150 V, from 3.42 s on: with them every law
ends 1.735 um short (1.745 um on the exact stage; with linear hinges it would be 1.739 um). A circle of the platform and
poses from a file are converted by the exact inverse kinematics. Sensors with steps or noise stand between the
elongations and all that is fed with them; `sensor.seed` is their seed.

PD is stable, in contrast to the claim of the source: where it is unstable, the sample time is too long for its gains,
as it would be for computed torque. Its drawback is the bias H(r) / Kp, which feed-forward or an integral removes. On a
stage with the calibrated links, whose yaw has 0.231 kg instead of 0.414 kg, its default gains need a sample time below
9.2 us. On this stage `three_axis` requires a pulling force of a stack at times, 12 N when the first one alone is at
8 um: its voltage saturates at 0, and the error of computed torque is up to 0.3 um.

A communication step is a sample time, or a fifth of one for stacks with dynamics, as their force has a kink at every
tick. With such stacks PD at its default gains is unstable at the default sample time of 10 us: its limit is 3.92 us,
and a run warns of it. The first three outputs are the errors of the elongations.
"""

import math
from typing import Any, Literal, NamedTuple

from hfsa.cosim.scenes._motion import MotionFile, end_of, is_file
from hfsa.cosim.scenes._pzt import TOKIN, Pzt
from hfsa.cosim.scenes._scale import ELONGATION, FORCE, STRESS, VOLTAGE, stage_pose
from hfsa.cosim.scenes._stage import THESIS, Stage
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Analysis, Component, Connection, System

_AXES, _STACKS = "axis[1..3]", "stack[1..3]"
_DRIVEN = {
    "pzt": {f"stage.{_STACKS}.force": FORCE, f"{_STACKS}.stack.voltage": VOLTAGE},
    "force": {f"controller.{_AXES}.command": FORCE},
}
"""Driving variables by actuator, with their scales."""
_CONTROLLERS = {"pd": "pd", "ctc": "stage_computed_torque", "integral": "stage_integral"}
_ORDERS = {"pd": ("", "_rate"), "ctc": ("", "_rate", "_acceleration"), "integral": ("",)}
_FINER = 5
"""Communication steps per sample time for stacks with dynamics, whose force has a kink at every tick."""
_STOP_TIMES = {"ramp": 4.0, "three_axis": 0.4, "step": 0.02, "circle": 0.6}
_TARGET = (2.5e-6, 1e-6, -1e-4)
"""Final pose of the step, x, y [m] and yaw [rad]."""
_CENTRE = (0.0, 0.0, -5e-4)
"""Centre of the circle."""


class _Piece(NamedTuple):
    """Components with their connections."""

    components: list[Component]
    connections: list[Connection]


def stage_tracking(
    *,
    law: Literal["pd", "pd_ff", "ctc", "integral", "integral_ff"] = "ctc",
    actuator: Literal["pzt", "force"] = "pzt",
    motion: Literal["ramp", "three_axis", "step", "circle"] | MotionFile = "ramp",
    rate: float = 3e-6,
    pose: tuple[float, float, float] | None = None,
    radius: float = 2e-6,
    frequency: float = 5.0,
    sensor_resolution: float = 0.0,
    sensor_noise: float = 0.0,
    stage: Literal["constant_jacobian", "exact", "flexible_hinges", "continuum"] = "constant_jacobian",
    model: Literal["constant_jacobian", "exact"] = "constant_jacobian",
    pzt: Pzt = TOKIN,
    stack: Literal["static", "linear", "hysteretic"] = "static",
    proportional_gain: float = 1e9,
    derivative_gain: float = 5e4,
    bandwidth: float = 300.0,
    integral_gain: float = 4.3e8,
    sample_time: float = 10e-6,
    delay: bool = False,
    damping_time: float = 6.02e-6,
    machine: Stage = THESIS,
) -> Scene:
    """Return the scene: tracking errors, forces, voltages and stress on a motion of its own, or one from a file.

    Args:
        law: control law; `integral` and `integral_ff` command voltages and need `pzt`.
        actuator: `pzt` stacks, or an ideal `force`.
        motion: `ramp` turns the platform, `three_axis` moves all its axes, `step` jumps to `pose`, `circle` goes round
            it; or the path of a CSV file with columns time [s] and x, y [m], yaw [rad], or elongation_1, _2, _3 [m].
        rate: rate of the ramp [m/s]; 2.5e-6 stays within 150 V.
        pose: final pose of the step, or centre of the circle, x, y [m] and yaw [rad] from rest (default: within reach).
        radius: radius of the circle [m].
        frequency: turns per second of the circle [Hz].
        sensor_resolution: step of the sensors of the elongations [m], 0 for none; their rates are ideal.
        sensor_noise: standard deviation of the noise of these sensors [m], a new value at each tick.
        stage: level of the stage.
        model: level of the model in feed-forward and computed torque.
        pzt: data sheet of the stacks, also in models of the stacks.
        stack: level of the stacks.
        proportional_gain: proportional gain of PD [N/m].
        derivative_gain: derivative gain of PD [N.s/m].
        bandwidth: bandwidth of computed torque, critically damped [Hz].
        integral_gain: gain of the integral laws [V/(m.s)].
        sample_time: sample time of the controller [s].
        delay: whether the command of PD and computed torque is delayed by one sample time.
        damping_time: damping of the stage per stiffness [s], for the stage and computed torque.
        machine: design of the stage, also in models of it: the arguments `kinematics`, `links`, `hinge`, `masses`,
            `jacobian`, `stiffness` and `mass`, for level `flexible_hinges` `contact`, `bolts`, `outline` (`_stage.py`).
    """
    from_file = is_file(motion, "stage_tracking", tuple(_STOP_TIMES))
    base = law.removesuffix("_ff")
    if base == "integral" and actuator == "force":
        raise StructureError(f"law {law} commands a voltage, not a force: take actuator pzt, or one of pd, pd_ff, ctc")
    omega = 2 * math.pi * bandwidth
    gains = {
        "pd": {"proportional_gain": proportional_gain, "derivative_gain": derivative_gain},
        "ctc": {"proportional_gain": omega**2, "derivative_gain": 2 * omega},
        "integral": {"integral_gain": integral_gain},
    }[base]
    arguments = {
        "pd": {"axes": 3, "unit": "m", "effort": "N", "delay": delay},
        "ctc": {"model": model, **machine.dynamic, "delay": delay},
        "integral": {},
    }[base]
    known = {"pd": {}, "ctc": {"damping_time": damping_time}, "integral": pzt.highest}[base]
    ticking = {"sample_time": sample_time}
    sensors = {"resolution": sensor_resolution, "noise": sensor_noise, "interval": sample_time}
    sensed = sensors if sensor_resolution or sensor_noise else None
    pieces = [
        _path(motion, pose or _CENTRE, radius, frequency, machine, pzt)
        if from_file or motion == "circle"
        else _reference(motion, rate, pose or _TARGET, machine, pzt),
        _tracking(),
        *([_feed_forward(base, model, machine, pzt)] if law.endswith("_ff") else []),
        _controller(base, arguments, ticking | known | {f"{_AXES}.{name}": gain for name, gain in gains.items()}),
        _measured(base, sensed),
        _stacks(base, stack, pzt, ticking, sensed) if actuator == "pzt" else _forces(),
        _stage(stage, machine, damping_time, pzt if actuator == "pzt" else None),
    ]
    return Scene(
        System([c for piece in pieces for c in piece.components], [c for piece in pieces for c in piece.connections]),
        inputs=[],
        outputs=[
            f"tracking.{_AXES}.error",
            f"stage.{_STACKS}.elongation",
            *_DRIVEN[actuator],
            "stage.hinge.stress",
            "stage.platform.position[1..2]",
            "stage.platform.rotation",
        ],
        band=(1.0, 1000.0),
        amplitude={"m": 1e-8},
        step_size=sample_time / (_FINER if actuator == "pzt" and stack != "static" else 1),
        stop_time=end_of(motion) if from_file else _STOP_TIMES[motion],
        scale={
            f"tracking.{_AXES}.error": ELONGATION,
            f"stage.{_STACKS}.elongation": ELONGATION,
            **_DRIVEN[actuator],
            "stage.hinge.stress": STRESS,
            **stage_pose(),
        },
    )


def _reference(motion: str, rate: float, pose: tuple[float, float, float], machine: Stage, pzt: Pzt) -> _Piece:
    """Return the reference motion of the stacks."""
    start: dict[str, Any] = {}
    if motion == "ramp":
        start["rate"] = rate
    if motion == "step":
        reached = {"pose": pose, **machine.kinematic, **({} if pzt.stroke is None else {"stroke": pzt.stroke})}
        start["step.elongation[1..3]"] = Analysis("stage_reference", "elongation", reached)
    return _Piece([Component("reference", "stage_reference", None, {"motion": motion}, start)], [])


def _path(
    motion: str, centre: tuple[float, float, float], radius: float, frequency: float, machine: Stage, pzt: Pzt
) -> _Piece:
    """Return the reference motion along a path of the platform: a circle, or that of a file."""
    known = {**machine.kinematic, **({} if pzt.stroke is None else {"stroke": pzt.stroke})}
    if motion == "circle":
        arguments = {"motion": motion, "centre": centre, "radius": radius, **known}
        return _Piece([Component("reference", "stage_path", None, arguments, {"frequency": frequency})], [])
    return _Piece([Component("reference", "stage_path", None, {"motion": motion, **known})], [])


def _tracking() -> _Piece:
    """Return the tracking errors."""
    return _Piece(
        [Component("tracking", "tracking_error", None, {"axes": 3, "unit": "m"})],
        [
            Connection(f"reference.{_STACKS}.elongation", f"tracking.{_AXES}.reference"),
            Connection(f"stage.{_STACKS}.elongation", f"tracking.{_AXES}.measured"),
        ],
    )


def _feed_forward(base: str, model: str, machine: Stage, pzt: Pzt) -> _Piece:
    """Return the feed-forward: force or voltage that holds the stage at the reference."""
    return _Piece(
        [Component("feed_forward", "stage_feed_forward", None, {"model": model, **machine.dynamic}, pzt.line)],
        [
            Connection(f"reference.{_STACKS}.elongation", f"feed_forward.{_AXES}.reference"),
            Connection(
                f"feed_forward.{_AXES}.{'voltage' if base == 'integral' else 'force'}",
                f"controller.{_AXES}.feed_forward",
            ),
        ],
    )


def _controller(base: str, arguments: dict[str, Any], start: dict[str, Any]) -> _Piece:
    """Return the controller with its reference elongations and their derivatives."""
    connections = [
        Connection(f"reference.{_STACKS}.elongation{order}", f"controller.{_AXES}.reference{order}")
        for order in _ORDERS[base]
    ]
    return _Piece([Component("controller", _CONTROLLERS[base], None, arguments, start)], connections)


def _elongations(sensed: dict[str, float] | None) -> str:
    """Return the elongations that a controller is fed: those of the stage, or the readings of its sensors."""
    return f"stage.{_STACKS}.elongation" if sensed is None else f"sensor.{_AXES}.reading"


def _measured(base: str, sensed: dict[str, float] | None) -> _Piece:
    """Return the feedback of elongations and ideal rates, through sensors with `sensed` as start values."""
    fed = [Connection(_elongations(sensed), f"controller.{_AXES}.measured")]
    if "_rate" in _ORDERS[base]:
        fed.append(Connection(f"stage.{_STACKS}.elongation_rate", f"controller.{_AXES}.measured_rate"))
    if sensed is None:
        return _Piece([], fed)
    sensor = Component("sensor", "displacement_sensor", None, {"axes": 3, "unit": "m"}, sensed)
    return _Piece([sensor], [Connection(f"stage.{_STACKS}.elongation", f"sensor.{_AXES}.value"), *fed])


def _forces() -> _Piece:
    """Return the direct connection of the controller's forces to the stage."""
    return _Piece([], [Connection(f"controller.{_AXES}.command", f"stage.{_STACKS}.force")])


def _stacks(base: str, level: str, pzt: Pzt, ticking: dict[str, float], sensed: dict[str, float] | None) -> _Piece:
    """Return three stacks on the stage, driven by voltages, or by forces converted to voltages."""
    stacks = pzt.stacks(level)
    coupled = [
        Connection(f"{_STACKS}.stack.blocking_force", f"stage.{_STACKS}.blocking_force"),
        Connection(f"stage.{_STACKS}.elongation_rate", f"{_STACKS}.stack.elongation_rate"),
    ]
    if base == "integral":
        return _Piece(stacks, [Connection(f"controller.{_AXES}.command", f"{_STACKS}.command.voltage"), *coupled])
    return _Piece(
        [Component("voltage", "force_to_voltage", start={**ticking, **pzt.line, **pzt.highest}), *stacks],
        [
            Connection(f"controller.{_AXES}.command", f"voltage.{_AXES}.force"),
            Connection(_elongations(sensed), f"voltage.{_AXES}.elongation"),
            Connection(f"stage.{_STACKS}.elongation_rate", f"voltage.{_AXES}.elongation_rate"),
            Connection(f"voltage.{_AXES}.command", f"{_STACKS}.command.voltage"),
            *coupled,
        ],
    )


def _stage(level: str, machine: Stage, damping_time: float, pzt: Pzt | None) -> _Piece:
    """Return the stage, with the stiffness of the stacks if there are any."""
    stacks = {"causality": "force"} if pzt is None else {"causality": "source", **pzt.arguments}
    start = machine.damping(level, damping_time)
    return _Piece([Component("stage", "rrr_stage", level, {**machine.itself, **stacks}, start)], [])
