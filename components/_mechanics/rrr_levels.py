"""Levels of the 3-RRR stage: equations of its platform over the stacks, declared in a model."""

from typing import NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._mechanics import rrr_dynamics as dynamics
from hfsa.components._mechanics.pzt import PULL_FROM_ROUNDING, Stack
from hfsa.components._mechanics.rrr_design import Design
from hfsa.components._mechanics.rrr_dynamics import Mechanism
from hfsa.components._mechanics.rrr_hinge import Hinge
from hfsa.components._modelling.model import Model

MOVE = (1e-6, 1e-3, 1.0)
"""Nominal translations at hundreds of hertz [m], and their first and second derivatives."""
TURN = (1e-4, 1e-1, 1e2)
"""Nominal rotations [rad], and their first and second derivatives."""
FORCE, TORQUE = 100.0, 1.0
"""Nominal force [N] and torque [N.m]."""


class Motion(NamedTuple):
    """Pose, twist and acceleration of the platform, columns of three."""

    pose: ca.SX
    twist: ca.SX
    acceleration: ca.SX


def over_states(m: Model, level: str, design: Design) -> Mechanism:
    """Declare the states of a level, the elongations or the pose and their rates; return the mechanism."""
    if level == "constant_jacobian":
        coordinates = m.state("leg[1..3].elongation", "m", "Elongation of the stack", nominal=MOVE[0])
        rates = m.state("leg[1..3].elongation_rate", "m/s", "Rate of the elongation", nominal=MOVE[1])
        return design.mechanism(level, coordinates, rates)
    position = m.state("center.position[1..2]", "m", "Position of the platform's centre from rest", nominal=MOVE[0])
    rotation = m.state("center.rotation", "rad", "Rotation of the platform from rest", nominal=TURN[0])
    velocity = m.state("center.velocity[1..2]", "m/s", "Velocity of the platform's centre", nominal=MOVE[1])
    turning = m.state("center.angular_velocity", "rad/s", "Angular velocity of the platform", nominal=TURN[1])
    return design.mechanism(level, ca.vertcat(position, rotation), ca.vertcat(velocity, turning))


def kinematic(m: Model, J: np.ndarray) -> Motion:
    """Declare the elongations and their derivatives as inputs; return the motion of the platform."""
    words = (
        ("", "", "Elongation"),
        ("_rate", "/s", "Rate of the elongation"),
        ("_acceleration", "/s2", "Acceleration of the elongation"),
    )
    return Motion(
        *[
            ca.DM(J) @ m.input(f"stack[1..3].elongation{word}", f"m{per}", f"{text} of the stack", nominal=size)
            for (word, per, text), size in zip(words, MOVE, strict=True)
        ]
    )


def dynamic(m: Model, mechanism: Mechanism, rest_stiffness: ca.DM, causality: str, stack: Stack) -> Motion:
    """Add the equations of motion and the outputs of the stacks; return the motion of the platform."""
    beta = m.parameter("damping_time", 6.02e-6, "s", "Damping / stiffness of the hinges, beta", min=0)
    source = causality == "source"
    drive, wrench, base = declare_loads(m, causality)
    p, v, terms = mechanism.coordinates, mechanism.rates, dynamics.terms(mechanism)
    (to_pose, to_stacks), (pose_bias, stack_bias) = ca.vertsplit(terms.slope, 3), ca.vertsplit(terms.bias, 3)
    rate = to_stacks @ v
    k, c, tip = _stack_parameters(m, stack) if source else (0, 0, 0)
    on_cranks = drive - k * mechanism.elongation - c * rate - tip * stack_bias
    force = to_stacks.T @ (on_cranks - beta * rest_stiffness @ rate) + to_pose.T @ wrench
    force -= terms.velocity + terms.elastic + terms.base @ base
    m.der[p] = v
    acceleration = m.motion(v, mass=terms.mass + tip * to_stacks.T @ to_stacks, force=force)

    declare_stacks(m, mechanism.elongation, rate)
    if source:
        declare_contact(m, on_cranks - tip * to_stacks @ acceleration)
    return Motion(mechanism.pose, to_pose @ v, to_pose @ acceleration + pose_bias)


def declare_loads(m: Model, causality: str) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Declare forces of the stacks (3, 1), wrench (3, 1) and acceleration of the base (2, 1); return their symbols."""
    source = causality == "source"
    drive = m.input(
        "stack[1..3].blocking_force" if source else "stack[1..3].force",
        "N",
        "Blocking force of the stack" if source else "Force of the stack on its crank",
        nominal=FORCE,
    )
    wrench = ca.vertcat(
        m.input("wrench.force[1..2]", "N", "Force on the platform at its centre", nominal=FORCE),
        m.input("wrench.torque", "N.m", "Moment on the platform", nominal=TORQUE),
    )
    base = m.input("base.acceleration[1..2]", "m/s2", "Acceleration of the base", nominal=MOVE[2])
    return drive, wrench, base


def declare_stacks(m: Model, elongation: ca.SX, rate: ca.SX) -> None:
    """Declare the motion of the stacks (3, 1) as outputs."""
    m.output("stack[1..3].elongation", elongation, "m", "Elongation of the stack", nominal=MOVE[0])
    m.output("stack[1..3].elongation_rate", rate, "m/s", "Rate of the elongation", nominal=MOVE[1])


def declare_contact(m: Model, felt: ca.SX) -> None:
    """Declare the forces of the stacks on their cranks (3, 1), and whether they would have to pull, as outputs."""
    preload = m.parameter("stack.preload", 0.0, "N", "Force that presses each crank on its stack", min=0, nominal=FORCE)
    m.output("stack[1..3].force", felt, "N", "Force of the stack on its crank", nominal=FORCE)
    pulls = felt + preload < -PULL_FROM_ROUNDING
    m.output("stack[1..3].contact_lost", pulls, "1", "1 while the stack would have to pull")


def declare_stress(m: Model, hinge: Hinge, stress: ca.SX, description: str) -> None:
    """Declare the largest stress of the hinges, and whether it exceeds the allowable one, as outputs."""
    allowed = hinge.allowed_stress
    m.output("hinge.stress", stress, "Pa", description, nominal=1e8)
    words = f"1 while the stress exceeds {allowed / 1e6:.0f} MPa"
    m.output("hinge.overload", ca.if_else(stress > allowed, 1, 0), "1", words)


def declare_stack_damping(m: Model, stack: Stack) -> ca.SX:
    """Declare the damping of the stacks [N.s/m] and return its symbol."""
    return m.parameter("stack.damping", stack.damping, "N.s/m", "Damping of each stack", min=0)


def _stack_parameters(m: Model, stack: Stack) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Declare stiffness, damping and tip mass of the stacks and return their symbols."""
    return (
        m.parameter("stack.stiffness", stack.stiffness, "N/m", "Stiffness of each stack", min=0),
        declare_stack_damping(m, stack),
        m.parameter("stack.tip_mass", stack.tip_mass, "kg", "Mass of each stack that moves with its tip", min=0),
    )


def declare_motion(m: Model, motion: Motion) -> None:
    """Declare the motion of the platform as outputs."""
    (x, v, a) = motion
    m.output("platform.position[1..2]", x[:2], "m", "Position of the centre from rest", nominal=MOVE[0])
    m.output("platform.rotation", x[2], "rad", "Rotation from rest, counter-clockwise", nominal=TURN[0])
    m.output("platform.velocity[1..2]", v[:2], "m/s", "Velocity of the centre", nominal=MOVE[1])
    m.output("platform.angular_velocity", v[2], "rad/s", "Angular velocity", nominal=TURN[1])
    m.output("platform.acceleration[1..2]", a[:2], "m/s2", "Acceleration of the centre", nominal=MOVE[2])
    m.output("platform.angular_acceleration", a[2], "rad/s2", "Angular acceleration", nominal=TURN[2])
