"""Inverse dynamics of the SDelta as a rigid body: motor torques for a motion, at two levels of fidelity.

    tau = M_th theta'' + T^T ( M a + [omega x I omega; 0] - w_g ),    theta' = T^-1 t,   theta'' = T^-1 a + (T^-1)' t

with the twist t = [omega; v] and acceleration a of the centre of mass C, M = blkdiag(I, m 1), I in world axes, w_g the
weight, and M_th the inertia of the drives. (T^-1)' t = -T^-1 T' theta' is the acceleration of the motors at a = 0.

    linear    T and M of the posture, displacements are added, no terms quadratic in a velocity
    exact     T and M of the pose

T^-1 of `exact` is the derivative of the inverse kinematics; Newton's method finds the pose at given motor angles. Motor
angles and poses count from the posture, attitudes as R - 1, R the rotation from there: small motions are computed from
small numbers only and keep all their digits.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Literal, NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._mechanics.screws import expm1, log1p, shift
from hfsa.components._mechanics.sdelta_geometry import Posture, tube_motion
from hfsa.components._mechanics.sdelta_inertia import Inertia, Payload
from hfsa.components._mechanics.sdelta_kinematics import Kinematics, by_drive
from hfsa.components._mechanics.sdelta_robot import Machine
from hfsa.components._modelling.model import one_of

RobotModel = Literal["linear", "exact"]

_NEWTON_STEPS = 6
"""Newton steps from the posture; the convergence is quadratic: at 50 mm, five steps reach rounding error."""


class Motion(NamedTuple):
    """Pose and twist of the platform.

    Attributes:
        pose: pose of C in the representation of the model.
        twist: twist of C, [omega; v], shape (6, 1).
    """

    pose: tuple[ca.SX, ...]
    twist: ca.SX


class Robot(ABC):
    """The rigid robot about a posture; screws are columns of six about C, rotation first.

    Attributes:
        body: inertia of platform and payload.
        kinematics: kinematics at the posture.
        drives: M_th, inertia of the drives on the motors, shape (6, 6) [kg.m2].
        offset: C - S at the posture, shape (3,) [m].
    """

    def __init__(self, posture: Posture, payload: Payload, machine: Machine):
        self.body: Inertia = machine.body(payload)
        self.kinematics = Kinematics.at(posture, machine.mechanism)
        self.drives = machine.drive_inertia
        self.offset = posture.matrix @ self.body.center

    @abstractmethod
    def at_motors(self, angle: ca.SX, rate: ca.SX) -> Motion:
        """Return the motion of C from columns of six: motor angles from the posture [rad] and rates [rad/s]."""

    @abstractmethod
    def at_platform(self, displacement: ca.SX, twist: ca.SX) -> Motion:
        """Return the motion of C from that of S: the displacement from the posture and the twist, (6, 1) each."""

    @abstractmethod
    def acceleration(self, motion: Motion, of_S: ca.SX) -> ca.SX:
        """Return the acceleration of C from that of S, (6, 1)."""

    @abstractmethod
    def error(self, wanted: Motion, motion: Motion) -> ca.SX:
        """Return the displacement from one pose to a wanted one, (6, 1)."""

    @abstractmethod
    def motors_of(self, motion: Motion, acceleration: ca.SX) -> ca.SX:
        """Return the accelerations of the motors from that of C, (6, 1) each."""

    @abstractmethod
    def platform_of(self, motion: Motion, motors: ca.SX) -> ca.SX:
        """Return the acceleration of C from those of the motors, (6, 1) each."""

    @abstractmethod
    def reaction(self, motion: Motion, acceleration: ca.SX, weight: ca.SX) -> ca.SX:
        """Return the motor torques for an acceleration of the platform under its weight, shape (6, 1) [N.m]."""

    def torques(self, motion: Motion, motors: ca.SX, acceleration: ca.SX, gravity: ca.SX) -> ca.SX:
        """Return tau, (6, 1) [N.m], for consistent accelerations of the motors and of C."""
        weight = ca.vertcat(0, 0, 0, 0, 0, -self.body.mass * gravity)
        return ca.DM(self.drives) @ motors + self.reaction(motion, acceleration, weight)


class _Linear(Robot):
    """The linear model about the posture; a pose is the displacement of C."""

    def __init__(self, posture: Posture, payload: Payload, machine: Machine):
        super().__init__(posture, payload, machine)
        T = self.kinematics.jacobian(self.offset)
        self._T, self._to_motors = ca.DM(T), ca.DM(np.linalg.inv(T))
        self._mass = ca.DM(self.body.matrix(posture.matrix))
        self._from_S = ca.DM(shift(-self.offset))

    def at_motors(self, angle: ca.SX, rate: ca.SX) -> Motion:
        return Motion((self._T @ angle,), self._T @ rate)

    def at_platform(self, displacement: ca.SX, twist: ca.SX) -> Motion:
        return Motion((self._from_S @ displacement,), self._from_S @ twist)

    def acceleration(self, motion: Motion, of_S: ca.SX) -> ca.SX:  # noqa: ARG002
        return self._from_S @ of_S

    def error(self, wanted: Motion, motion: Motion) -> ca.SX:
        return wanted.pose[0] - motion.pose[0]

    def motors_of(self, motion: Motion, acceleration: ca.SX) -> ca.SX:  # noqa: ARG002
        return self._to_motors @ acceleration

    def platform_of(self, motion: Motion, motors: ca.SX) -> ca.SX:  # noqa: ARG002
        return self._T @ motors

    def reaction(self, motion: Motion, acceleration: ca.SX, weight: ca.SX) -> ca.SX:  # noqa: ARG002
        return self._T.T @ (self._mass @ acceleration - weight)


class _Exact(Robot):
    """The exact model; a pose is the rotation from the posture minus 1, (3, 3), and the displacement of C, (3, 1)."""

    def __init__(self, posture: Posture, payload: Payload, machine: Machine):
        super().__init__(posture, payload, machine)
        self._arm = ca.DM(self.offset)
        self._motors, self._slope, self._bias = self._inverse_kinematics()

    def at_motors(self, angle: ca.SX, rate: ca.SX) -> Motion:
        turn, move = ca.SX.zeros(3, 3), ca.SX.zeros(3)
        for _ in range(_NEWTON_STEPS):
            step = ca.solve(self._slope(turn, move), angle - self._motors(turn, move))
            change = expm1(step[:3])
            turn, move = turn + change + change @ turn, move + step[3:]
        return Motion((turn, move), ca.solve(self._slope(turn, move), rate))

    def at_platform(self, displacement: ca.SX, twist: ca.SX) -> Motion:
        turn = expm1(displacement[:3])
        arm_moved, omega = turn @ self._arm, twist[:3]
        velocity = twist[3:] + ca.cross(omega, self._arm + arm_moved)
        return Motion((turn, displacement[3:] + arm_moved), ca.vertcat(omega, velocity))

    def acceleration(self, motion: Motion, of_S: ca.SX) -> ca.SX:
        arm, omega, alpha = self._arm + motion.pose[0] @ self._arm, motion.twist[:3], of_S[:3]
        return ca.vertcat(alpha, of_S[3:] + ca.cross(alpha, arm) + ca.cross(omega, ca.cross(omega, arm)))

    def error(self, wanted: Motion, motion: Motion) -> ca.SX:
        missing = wanted.pose[0] - motion.pose[0]
        return ca.vertcat(log1p(missing + missing @ motion.pose[0].T), wanted.pose[1] - motion.pose[1])

    def motors_of(self, motion: Motion, acceleration: ca.SX) -> ca.SX:
        return self._slope(*motion.pose) @ acceleration + self._bias(*motion)

    def platform_of(self, motion: Motion, motors: ca.SX) -> ca.SX:
        return ca.solve(self._slope(*motion.pose), motors - self._bias(*motion))

    def reaction(self, motion: Motion, acceleration: ca.SX, weight: ca.SX) -> ca.SX:
        Q, omega = (ca.SX.eye(3) + motion.pose[0]) @ ca.DM(self.kinematics.Q), motion.twist[:3]
        tensor = Q @ ca.SX(self.body.tensor) @ Q.T
        moment = tensor @ acceleration[:3] + ca.cross(omega, tensor @ omega)
        wrench = ca.vertcat(moment, self.body.mass * acceleration[3:])
        return ca.solve(self._slope(*motion.pose).T, wrench - weight)

    def _inverse_kinematics(self) -> tuple[Callable[..., ca.SX], Callable[..., ca.SX], Callable[..., ca.SX]]:
        """Return pose -> motor angles (6, 1), pose -> T^-1 (6, 6) and (pose, twist) -> (T^-1)' t (6, 1)."""
        turn, move, step, twist = ca.SX.sym("R", 3, 3), ca.SX.sym("c", 3), ca.SX.sym("step", 6), ca.SX.sym("t", 6)
        change = ca.skew(step[:3])  # first order suffices for a derivative at 0
        moved = (turn + change + change @ turn, move + step[3:])
        at = self.kinematics
        tubes = by_drive(*tube_motion(at.mechanism.geometry, at.Q, at.position, turn, move - turn @ self._arm))
        to_motors = ca.DM(np.linalg.inv(at.mechanism.drives_matrix))
        motors = ca.Function("motors", [turn, move], [to_motors @ tubes])

        def at_rest(expression: ca.SX) -> ca.SX:
            """Return an expression at a step of 0."""
            return ca.substitute(expression, step, ca.SX.zeros(6))

        slope = ca.Function("slope", [turn, move], [at_rest(ca.jacobian(motors(*moved), step))])
        bias = ca.Function("bias", [turn, move, twist], [at_rest(ca.jtimes(slope(*moved) @ twist, step, twist))])
        return motors, slope, lambda pose, t: bias(*pose, t)


def robot(model: str, posture: Posture, payload: Payload, machine: Machine, part: str) -> Robot:
    """Return the robot with a model; `ModelError`, beginning with `part`, for an unknown one or a singular posture."""
    models = {"linear": _Linear, "exact": _Exact}
    return models[one_of(model, models, f"{part}: model")](posture, payload, machine)
