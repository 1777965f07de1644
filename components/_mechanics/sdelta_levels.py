"""Levels of the SDelta: equations of its platform over the motion of the tubes, declared in a model.

Each level adds its states and returns the motion of a reference point and the loads, by the equations of `sdelta.py`.
"""

from typing import NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._mechanics.modes import DampingOf, damping_matrix, damping_rates
from hfsa.components._mechanics.rodrigues import parameter_rate, rotation_vector, turn
from hfsa.components._mechanics.sdelta_generalized import generalized_modes, mass_matrix
from hfsa.components._mechanics.sdelta_kinematics import by_drive
from hfsa.components._mechanics.sdelta_nonlinear import MovedPlatform, deflections, sparse
from hfsa.components._mechanics.sdelta_robot import Robot
from hfsa.components._mechanics.sdelta_stiffness import paths
from hfsa.components._modelling.model import Model, ModelError

TURN = (1e-5, 1e-3, 1e-1)
"""Nominal rotations at tens of hertz [rad], and their first and second derivatives."""
MOVE = (1e-6, 1e-4, 1e-2)
"""Nominal translations [m], and their first and second derivatives."""


class Tubes(NamedTuple):
    """Deviation of the tubes from the posture and its derivatives, columns [slide, angle] by drive, shape (6, 1)."""

    deviation: ca.SX
    rate: ca.SX
    acceleration: ca.SX


class Motion(NamedTuple):
    """Result of a level.

    Attributes:
        displacement, twist, acceleration: motion of the reference point, columns of six.
        on_tubes: forces and torques on the tubes, along +slide and +angle by drive, shape (6, 1).
        deflections: twists of the shafts and deflections of the rod tips, shape (12, 1).
        by_limbs: wrench of the limbs on the platform about the reference point, shape (6, 1).
    """

    displacement: ca.SX
    twist: ca.SX
    acceleration: ca.SX
    on_tubes: ca.SX
    deflections: ca.SX
    by_limbs: ca.SX

    def referred(self, to_reference: ca.DM) -> "Motion":
        """Return small motion and wrench at another point, by the matrix (6, 6) of displacements from this one."""
        return self._replace(
            displacement=to_reference @ self.displacement,
            twist=to_reference @ self.twist,
            acceleration=to_reference @ self.acceleration,
            by_limbs=ca.inv(to_reference).T @ self.by_limbs,
        )


class Wrench(NamedTuple):
    """Moment and force on the platform at the reference point, columns of three, and its weight."""

    torque: ca.SX
    force: ca.SX
    weight: ca.SX


def rigid(_m: Model, robot: Robot, tubes: Tubes, wrench: ca.SX, _damping: DampingOf) -> Motion:
    """Return the motion of a platform that follows the tubes exactly, with the static forces of the limbs."""
    follow = ca.DM(robot.kinematics.tubes_to_pose(robot.offset))
    yielding = ca.DM(_yielding(robot) @ np.linalg.inv(robot.rows).T)
    x, v, a = (follow @ column for column in tubes)
    return Motion(x, v, a, follow.T @ wrench, yielding @ wrench, _by_limbs(robot, a, wrench))


def cartesian(m: Model, robot: Robot, tubes: Tubes, wrench: ca.SX, damping: DampingOf) -> Motion:
    """Add the equations of a rigid platform on the springs at its joints, six degrees of freedom; return its motion."""
    rotation = m.state("center.rotation[1..3]", "rad", "Rotation of the platform from the posture", nominal=TURN[0])
    position = m.state("center.position[1..3]", "m", "Displacement of C from the posture", nominal=MOVE[0])
    angular_velocity = m.state(
        "center.angular_velocity[1..3]", "rad/s", "Angular velocity of the platform", nominal=TURN[1]
    )
    velocity = m.state("center.velocity[1..3]", "m/s", "Velocity of C", nominal=MOVE[1])
    x, v = ca.vertcat(rotation, position), ca.vertcat(angular_velocity, velocity)

    inverse = np.linalg.inv(robot.rows)
    B = damping.ratio * sparse(inverse.T @ damping_matrix(robot.mass, robot.stiffness, damping.model) @ inverse)
    N, L = sparse(robot.rows), ca.DM(robot.kinematics.lever)
    elastic = ca.DM(robot.limb_stiffness) * (N @ x - L * tubes.deviation)
    forces = elastic + B @ (N @ v - L * tubes.rate)
    acceleration = ca.DM(np.linalg.inv(robot.mass)) @ (wrench - N.T @ forces)
    m.der[x] = v
    m.der[v] = acceleration
    deflections = ca.DM(_yielding(robot)) @ elastic
    return Motion(x, v, acceleration, L * forces, deflections, _by_limbs(robot, acceleration, wrench))


def _yielding(robot: Robot) -> np.ndarray:
    """Return the twists of the shafts and deflections of the rod tips per force at the joints, shape (12, 6)."""
    return robot.springs.compliance[:, None] * paths(robot.kinematics).T


def _by_limbs(robot: Robot, acceleration: ca.SX, wrench: ca.SX) -> ca.SX:
    """Return the wrench of the limbs on the platform about C, from its acceleration and the other wrench, (6, 1)."""
    return ca.DM(robot.mass) @ acceleration - wrench


def generalized(m: Model, robot: Robot, tubes: Tubes, wrench: ca.SX, damping: DampingOf) -> Motion:
    """Add the equations of the modes of shafts and rods with the inertia of the limbs; return the platform's motion."""
    if robot.extra_inertia == 0:
        return cartesian(m, robot, tubes, wrench, damping)
    M_E = mass_matrix(robot)
    omega, shapes = generalized_modes(robot, M_E)
    if not np.all(np.isfinite(omega)):
        raise ModelError(
            f"sdelta: {np.sum(np.isinf(omega))} of 12 modes have no inertia beyond rounding at extra_inertia "
            f"{robot.extra_inertia:g}; expected 0, or screws, tubes and rods with more inertia"
        )
    eta = m.state("mode[1..12].displacement", "m", "Displacement of the mode, as of a mass of 1 kg", nominal=MOVE[0])
    rate = m.state("mode[1..12].velocity", "m/s", "Velocity of the mode, as of a mass of 1 kg", nominal=MOVE[1])
    from_tubes = shapes.T @ M_E[:, :6] @ np.linalg.inv(robot.machine.mechanism.drives_matrix)
    G, W = ca.DM(from_tubes), ca.DM(robot.of_limbs @ shapes)
    elastic = ca.DM(omega**2) * (eta - G @ tubes.deviation)
    forces = elastic + damping.ratio * ca.DM(damping_rates(omega, damping.model)) * (rate - G @ tubes.rate)
    acceleration = W.T @ wrench - forces
    m.der[eta] = rate
    m.der[rate] = acceleration
    yielding = ca.DM(robot.springs.compliance[:, None] * (M_E @ shapes))
    a = W @ acceleration
    return Motion(W @ eta, W @ rate, a, G.T @ forces, yielding @ elastic, _by_limbs(robot, a, wrench))


def nonlinear(m: Model, robot: Robot, tubes: Tubes, wrench: Wrench, damping: DampingOf, reference_point: str) -> Motion:
    """Add the equations of a rigid platform in finite motion on the springs of its limbs; return its motion."""
    s = m.state("center.attitude[1..3]", "rad", "4 tan(angle / 4) along the axis of rotation", nominal=TURN[0])
    position = m.state("center.position[1..3]", "m", "Displacement of C from the posture", nominal=MOVE[0])
    omega = m.state("center.angular_velocity[1..3]", "rad/s", "Angular velocity of the platform", nominal=TURN[1])
    velocity = m.state("center.velocity[1..3]", "m/s", "Velocity of C", nominal=MOVE[1])
    platform = MovedPlatform(robot, turn(s), position)
    slide, angle = tubes.deviation[0::2], tubes.deviation[1::2]
    loads = platform.loads(slide, angle)

    D = sparse(damping_matrix(robot.mass, robot.stiffness, damping.model))
    follow = sparse(robot.kinematics.tubes_to_pose(robot.offset))
    damped = damping.ratio * (D @ (ca.vertcat(omega, velocity) - follow @ tubes.rate))
    arm = platform.center if reference_point == "S" else ca.SX.zeros(3)
    moment, force = loads.moment - damped[:3], loads.force - damped[3:]
    alpha = platform.angular_acceleration(moment + wrench.torque - ca.cross(arm, wrench.force), omega)
    acceleration = (force + wrench.force + wrench.weight) / robot.body.mass
    m.der[s] = parameter_rate(s, omega)
    m.der[position] = velocity
    m.der[omega] = alpha
    m.der[velocity] = acceleration

    left = platform.has_left_workspace(slide, angle, loads.lever)
    m.output("platform.workspace_left", left, "1", "1 beyond the reach of limbs or tubes, or beyond a singular pose")
    seen = platform.centroid if reference_point == "S" else position
    return Motion(
        ca.vertcat(rotation_vector(s), seen),
        ca.vertcat(omega, velocity - ca.cross(omega, arm)),
        ca.vertcat(alpha, acceleration - ca.cross(alpha, arm) - ca.cross(omega, ca.cross(omega, arm))),
        by_drive(loads.slide, loads.angle) + follow.T @ damped,
        deflections(robot, loads),
        ca.vertcat(moment + ca.cross(arm, force), force),
    )
