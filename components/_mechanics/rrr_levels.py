"""Levels of the 3-RRR stage: equations of its platform over the stacks, declared in a model."""

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._mechanics import rrr_dynamics as dynamics
from hfsa.components._mechanics.pzt import PULL_FROM_ROUNDING, Stack
from hfsa.components._mechanics.rrr_design import Design, Tuned
from hfsa.components._mechanics.rrr_hinge import stress_per_angle
from hfsa.components._mechanics.rrr_hinged import Hinged
from hfsa.components._mechanics.rrr_symbols import MASSES, MassSymbols
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


class Hinges(NamedTuple):
    """Largest angle [rad] and largest stress [Pa] of a hinge, and the allowable stress [Pa]."""

    angle: ca.SX
    stress: ca.SX
    allowed: float


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


def dynamic(m: Model, level: str, design: Design, causality: str, stack: Stack) -> tuple[Motion, Hinges]:
    """Add the equations of rigid links and the outputs of the stacks; return the motion of the platform."""
    coordinates, tuned = _elongations(m) if level == "constant_jacobian" else _poses(m), _tuned(m, design)
    mechanism = design.mechanism(level, *coordinates, tuned)
    rest_stiffness, hinge = design.tuned_stiffness(tuned.hinge_stiffness), design.hinge
    beta, loads = _damping_time(m), declare_loads(m, causality)
    p, v, terms = mechanism.coordinates, mechanism.rates, dynamics.terms(mechanism)
    (to_pose, to_stacks), (pose_bias, stack_bias) = ca.vertsplit(terms.slope, 3), ca.vertsplit(terms.bias, 3)
    rate = to_stacks @ v
    k, c, tip = _stack_parameters(m, causality, stack)
    on_cranks = loads.drive - k * mechanism.elongation - c * rate - tip * stack_bias
    force = to_stacks.T @ (on_cranks - beta * rest_stiffness @ rate) + to_pose.T @ loads.wrench
    force -= terms.velocity + terms.elastic + terms.base @ loads.base
    m.der[p] = v
    acceleration = m.motion(v, mass=terms.mass + tip * to_stacks.T @ to_stacks, force=force)
    declare_stacks(m, causality, mechanism.elongation, rate, on_cranks - tip * to_stacks @ acceleration)
    angle = ca.mmax(ca.fabs(mechanism.hinges))
    stress = stress_per_angle(tuned.hinge_stiffness, hinge.width, hinge.thickness) * angle
    hinges = Hinges(angle, stress, hinge.allowed_stress)
    return Motion(mechanism.pose, to_pose @ v, to_pose @ acceleration + pose_bias), hinges


def flexible(m: Model, stage: Hinged, causality: str, stack: Stack) -> tuple[Motion, Hinges]:
    """Add the equations of elongations and pose on necks that give; return the motion of the platform."""
    elongation, rate = _elongations(m)
    pose, twist = _poses(m)
    beta, loads = _damping_time(m), declare_loads(m, causality)
    k, c, tip = _stack_parameters(m, causality, stack)
    p, v = ca.vertcat(elongation, pose), ca.vertcat(rate, twist)
    K, drive = ca.DM(stage.stiffness), loads.drive - k * elongation - c * rate
    force = ca.vertcat(drive, loads.wrench) - K @ (p + beta * v) - ca.DM(stage.base) @ loads.base
    m.der[p] = v
    on_tips = ca.diag(ca.vertcat(ca.SX.ones(3), ca.SX.zeros(3)))
    acceleration = m.motion(v, mass=ca.DM(stage.mass) + tip * on_tips, force=force)
    declare_stacks(m, causality, elongation, rate, drive - tip * acceleration[:3])
    deformed = [ca.DM(neck) @ p for neck in stage.deformations]
    loaded = [ca.vertsplit(ca.DM(stage.neck.stiffness) * neck) for neck in deformed]
    stresses = [stress for load in loaded for stress in stage.neck.stresses(*load, size=ca.fabs)]
    angle = ca.mmax(ca.fabs(ca.vertcat(*[neck[2] for neck in deformed])))
    hinges = Hinges(angle, ca.mmax(ca.vertcat(*stresses)), stage.neck.hinge.allowed_stress)
    return Motion(pose, twist, acceleration[3:]), hinges


def _tuned(m: Model, design: Design) -> Tuned:
    """Declare hinges and masses as parameters, which start as those of the design."""
    stiffness = m.parameter("hinge.stiffness", design.hinge.stiffness, "N.m/rad", "Stiffness of each hinge", min=0)
    symbols = {
        name: m.parameter(f"masses.{name}", getattr(design.masses, name), unit, text, min=0)
        for name, (unit, text) in MASSES.items()
    }
    return Tuned(stiffness, MassSymbols(**symbols))


class Loads(NamedTuple):
    """Inputs of a dynamic level: forces of the stacks, (3, 1) [N], wrench (3, 1) [N, N.m], and base (2, 1) [m/s2]."""

    drive: ca.SX
    wrench: ca.SX
    base: ca.SX


def declare_loads(m: Model, causality: str) -> Loads:
    """Declare the inputs of a dynamic level."""
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
    return Loads(drive, wrench, m.input("base.acceleration[1..2]", "m/s2", "Acceleration of the base", nominal=MOVE[2]))


def declare_stacks(m: Model, causality: str, elongation: ca.SX, rate: ca.SX, felt: ca.SX) -> None:
    """Declare the elongations of the stacks as outputs, and with `source` the forces that their cranks feel."""
    m.output("stack[1..3].elongation", elongation, "m", "Elongation of the stack", nominal=MOVE[0])
    m.output("stack[1..3].elongation_rate", rate, "m/s", "Rate of the elongation", nominal=MOVE[1])
    if causality == "source":
        preload = m.parameter(
            "stack.preload", 0.0, "N", "Force that presses each crank on its stack", min=0, nominal=FORCE
        )
        m.output("stack[1..3].force", felt, "N", "Force of the stack on its crank", nominal=FORCE)
        pulls = felt + preload < -PULL_FROM_ROUNDING
        m.output("stack[1..3].contact_lost", pulls, "1", "1 while the stack would have to pull")


def _elongations(m: Model) -> tuple[ca.SX, ca.SX]:
    """Declare the elongations and their rates as states."""
    return (
        m.state("leg[1..3].elongation", "m", "Elongation of the stack", nominal=MOVE[0]),
        m.state("leg[1..3].elongation_rate", "m/s", "Rate of the elongation", nominal=MOVE[1]),
    )


def _poses(m: Model) -> tuple[ca.SX, ca.SX]:
    """Declare the pose of the platform and its twist as states."""
    position = m.state("center.position[1..2]", "m", "Position of the platform's centre from rest", nominal=MOVE[0])
    rotation = m.state("center.rotation", "rad", "Rotation of the platform from rest", nominal=TURN[0])
    velocity = m.state("center.velocity[1..2]", "m/s", "Velocity of the platform's centre", nominal=MOVE[1])
    turning = m.state("center.angular_velocity", "rad/s", "Angular velocity of the platform", nominal=TURN[1])
    return ca.vertcat(position, rotation), ca.vertcat(velocity, turning)


def _damping_time(m: Model) -> ca.SX:
    """Declare the damping time beta."""
    return m.parameter("damping_time", 6.02e-6, "s", "Damping / stiffness of the hinges, beta", min=0)


def _stack_parameters(m: Model, causality: str, stack: Stack) -> tuple[Any, Any, Any]:
    """Declare stiffness, damping and tip mass of the stacks and return their symbols; zeros without stacks."""
    if causality != "source":
        return 0, 0, 0
    return (
        m.parameter("stack.stiffness", stack.stiffness, "N/m", "Stiffness of each stack", min=0),
        declare_stack_damping(m, stack),
        m.parameter("stack.tip_mass", stack.tip_mass, "kg", "Mass of each stack that moves with its tip", min=0),
    )


def declare_stack_damping(m: Model, stack: Stack) -> ca.SX:
    """Declare the damping of the stacks [N.s/m] and return its symbol."""
    return m.parameter("stack.damping", stack.damping, "N.s/m", "Damping of each stack", min=0)


def declare_motion(m: Model, motion: Motion) -> None:
    """Declare the motion of the platform as outputs."""
    (x, v, a) = motion
    m.output("platform.position[1..2]", x[:2], "m", "Position of the centre from rest", nominal=MOVE[0])
    m.output("platform.rotation", x[2], "rad", "Rotation from rest, counter-clockwise", nominal=TURN[0])
    m.output("platform.velocity[1..2]", v[:2], "m/s", "Velocity of the centre", nominal=MOVE[1])
    m.output("platform.angular_velocity", v[2], "rad/s", "Angular velocity", nominal=TURN[1])
    m.output("platform.acceleration[1..2]", a[:2], "m/s2", "Acceleration of the centre", nominal=MOVE[2])
    m.output("platform.angular_acceleration", a[2], "rad/s2", "Angular acceleration", nominal=TURN[2])


def declare_hinges(m: Model, hinges: Hinges) -> None:
    """Declare the largest angle and stress of a hinge as outputs."""
    m.output("hinge.angle", hinges.angle, "rad", "Largest angle of a hinge from rest", nominal=1e-3)
    declare_stress(m, hinges.stress, hinges.allowed)


def declare_stress(m: Model, stress: ca.SX, allowed: float) -> None:
    """Declare the largest stress of a hinge as an output, and whether it exceeds the allowable one [Pa]."""
    m.output("hinge.stress", stress, "Pa", "Largest stress of a hinge", nominal=1e8)
    overload = ca.if_else(stress > allowed, 1, 0)
    m.output("hinge.overload", overload, "1", f"1 while the stress exceeds {allowed / 1e6:.0f} MPa")
