"""A mass under a law without memory, which tests of stability share: closed forms of their limits are known."""

from hfsa.components import Model

KP, KV = 5e16, 6e8
"""Gains of the source's stage, per mass [1/s2], [1/s]."""


def plant() -> Model:
    """A mass under a force, with a damper of its own."""
    m = Model("Plant", "Mass under a force")
    mass = m.parameter("mass", 1.0, "kg", "Mass", min=0.1)
    damping = m.parameter("damping", 0.0, "N.s/m", "Damping to the ground")
    force = m.input("force", "N", "Force")
    q, v = m.state("q", "m", "Position"), m.state("v", "m/s", "Velocity")
    m.der[q], m.der[v] = v, (force - damping * v) / mass
    m.output("position", q, "m", "Position")
    m.output("velocity", v, "m/s", "Velocity")
    return m


def law() -> Model:
    """A PD law without memory, or a spring whose force is exchanged."""
    m = Model("Law", "PD law")
    kp = m.parameter("stiffness", KP, "N/m", "Proportional gain")
    kv = m.parameter("damping", KV, "N.s/m", "Derivative gain")
    q, v = m.input("position", "m", "Position"), m.input("velocity", "m/s", "Velocity")
    m.output("force", -kp * q - kv * v, "N", "Force")
    return m
