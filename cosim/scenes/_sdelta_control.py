"""Control laws of the SDelta in a scene: reference, controller, and their connections to drives and robot.

    law             compares                        feedback encoder      feedback pose
    pd              motor angles                    of the motors         of the measured pose, by a second reference
    ctc             motor angles                    of the motors         of the measured pose, by a second reference
    ctc_cartesian   poses                           of the motors         measured

The component `reference` converts a command to motor angles and, with feed-forward, to torques. A component `estimate`
converts a measured pose to motor angles by the same map, T^-1.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from hfsa.cosim.scenes._machine import Machine, reference_level
from hfsa.cosim.scenes._posture import Posture
from hfsa.cosim.scenes._specimen import Payload
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Analysis, Component, Connection

Law = Literal["pd", "ctc", "ctc_cartesian"]
Feedback = Literal["encoder", "pose"]
Execution = Literal["sampled", "continuous"]
FeedForward = Literal["none", "rigid", "elastic"]

_AXES, _MOTORS = "axis[1..6]", "motor[1..6]"
_DRIVES = ((1, "axis[1..2]"), (2, "axis[3..4]"), (3, "axis[5..6]"))
_POSE = ("rotation", "position", "angular_velocity", "velocity")
_AS_COMMAND = {
    "rotation": "rotation",
    "position": "position",
    "angular_velocity": "rotation_rate",
    "velocity": "position_rate",
}


@dataclass(frozen=True)
class Control:
    """Control law with its options; the fields are arguments of the scene."""

    law: Law
    feedback: Feedback
    execution: Execution
    feed_forward: FeedForward
    posture: Posture
    payload: Payload
    damping: float
    bandwidth: float
    control_damping: float
    sample_time: float
    delay: bool
    torque_limit: float
    gravity: float
    machine: Machine
    robot: str

    def __post_init__(self):
        if (self.feedback, self.feed_forward) == ("pose", "elastic") and self.law != "ctc_cartesian":
            raise StructureError(
                f"law {self.law} with feedback pose takes the platform's pose for that of its motors, but elastic "
                "feed-forward makes them differ; take law ctc_cartesian, or feedback encoder"
            )

    @property
    def components(self) -> list[Component]:
        """Reference and controller, and an estimate of motor angles from a pose that is fed back."""
        return [self._reference(), self._controller(), *([self._converter("estimate")] if self._estimates else [])]

    @property
    def connections(self) -> list[Connection]:
        """Connections from reference, drives and robot to the controller, and from it to the motors."""
        connections = [*self._to_reference(), *self._to_measured()]
        connections += [
            Connection(f"controller.{axes}.command", f"drive[{j}].motor[1..2].torque") for j, axes in _DRIVES
        ]
        return connections

    def tuned(self, key: str) -> Analysis:
        """Return a number of the rigid design at the posture."""
        design = {"bandwidth": self.bandwidth, "damping": self.control_damping, "gravity": self.gravity}
        return Analysis("sdelta_tuning", key, {**self._robot, **design})

    @property
    def _robot(self) -> dict[str, Any]:
        """Model of the controlled robot, as arguments of a component."""
        return {**self.posture.arguments, **self.payload.arguments, **self.machine.rigid}

    @property
    def _estimates(self) -> bool:
        return self.feedback == "pose" and self.law != "ctc_cartesian"

    @property
    def _is_cartesian(self) -> bool:
        return self.law == "ctc_cartesian"

    def _converter(self, name: str) -> Component:
        """Return a component that converts poses to motor angles."""
        arguments = {**self.posture.arguments, **self.machine.kinematic}
        return Component(name, "sdelta_reference", reference_level(self.robot), arguments)

    def _reference(self) -> Component:
        """Return the reference: motor motions of a commanded pose, with the feed-forward of the law."""
        if self.feed_forward == "none" and not self._is_cartesian:
            return self._converter("reference")
        level = "elastic" if self.feed_forward == "elastic" else "rigid"
        arguments = {**self._robot, **self.machine.elastic}
        start = {"gravity": self.gravity, **({"damping_ratio": self.damping} if level == "elastic" else {})}
        return Component("reference", "sdelta_feed_forward", level, arguments, start)

    def _controller(self) -> Component:
        """Return the controller of the law."""
        sampling = {"sample_time": self.sample_time} if self.execution == "sampled" else {}
        start: Mapping[str, Any] = {**sampling, f"{_AXES}.limit": self.torque_limit}
        if self.law == "pd":
            gains = {f"{_AXES}.{gain}": self.tuned(gain) for gain in ("proportional_gain", "derivative_gain")}
            holding = {f"{_AXES}.feed_forward": self.tuned("holding_torque")} if self.feed_forward == "none" else {}
            arguments = {"axes": 6, "delay": self.delay}
            return Component("controller", "pd", self.execution, arguments, {**start, **gains, **holding})
        omega = 2 * math.pi * self.bandwidth
        gains = {"proportional_gain": omega**2, "derivative_gain": 2 * self.control_damping * omega}
        # the feed-forward torque contains the weight
        gains["gravity"] = self.gravity if self.feed_forward == "none" else 0.0
        pose = {"encoder": "encoder_pose", "pose": "measured_pose"}[self.feedback]
        arguments = {
            "feedback": pose if self._is_cartesian else "motor",
            **self._robot,
            "delay": self.delay,
        }
        return Component("controller", "sdelta_computed_torque", self.execution, arguments, {**start, **gains})

    def _to_reference(self) -> list[Connection]:
        """Connections from the reference: motions with the derivatives that the law uses, and torques."""
        own_acceleration = self.law != "pd" and self.feed_forward == "none"
        if self._is_cartesian:
            shown = "platform" if self.feedback == "pose" else "nominal"
            names = [*_POSE, *(("angular_acceleration", "acceleration") if own_acceleration else ())]
            pairs = [(f"{shown}.{name}[1..3]", f"reference.{name}[1..3]") for name in names]
        else:
            orders = ["", "_rate", *(["_acceleration"] if own_acceleration else [])]
            pairs = [(f"{_MOTORS}.angle{order}", f"{_AXES}.reference{order}") for order in orders]
        if self.feed_forward != "none":
            pairs.append((f"{_MOTORS}.torque", f"{_AXES}.feed_forward"))
        return [Connection(f"reference.{start}", f"controller.{end}") for start, end in pairs]

    def _to_measured(self) -> list[Connection]:
        """Connections of the feedback."""
        shown = [f"robot.platform.{name}[1..3]" for name in _POSE]
        if self._estimates:
            ends = [f"estimate.command.{_AS_COMMAND[name]}[1..3]" for name in _POSE]
            measured = [(f"{_MOTORS}.angle", f"{_AXES}.measured"), (f"{_MOTORS}.angle_rate", f"{_AXES}.measured_rate")]
            return [
                *(Connection(start, end) for start, end in zip(shown, ends, strict=True)),
                *(Connection(f"estimate.{start}", f"controller.{end}") for start, end in measured),
            ]
        if self.feedback == "pose":
            ends = [f"controller.measured.{name}[1..3]" for name in _POSE]
            return [Connection(start, end) for start, end in zip(shown, ends, strict=True)]
        return [
            Connection(f"drive[{j}].motor[1..2].{start}", f"controller.{axes}.{end}")
            for j, axes in _DRIVES
            for start, end in (("angle", "measured"), ("speed", "measured_rate"))
        ]
