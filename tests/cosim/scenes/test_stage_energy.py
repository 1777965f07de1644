"""Energy of the stage's FMU: conserved without damping; exact rest without voltage."""

import casadi as ca
import numpy as np
import pytest

from hfsa.components._mechanics import rrr_dynamics as dynamics
from hfsa.components._mechanics.rrr_kinematics import NOMINAL, forward
from hfsa.components._modelling.model import Kind
from hfsa.components.rrr_stage import rrr_stage
from hfsa.cosim.assembly.build import build
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.systems.system import Component, Connection, System

LEVEL = pytest.mark.parametrize("level", ["constant_jacobian", "exact"])
PERIOD = 1 / 529.05
RELEASED = [4e-6, 1e-6, -2e-6]
"""Elongations [m] that move all three modes."""


def energy(level: str) -> ca.Function:
    """Coordinates and rates to T + P [J]."""
    p, v = ca.SX.sym("p", 3), ca.SX.sym("v", 3)
    mechanism = getattr(dynamics, level)(NOMINAL, p, v)
    kinetic = v.T @ dynamics.terms(mechanism).mass @ v / 2
    return ca.Function("energy", [p, v], [kinetic + dynamics.potential(mechanism)])


def drift(level: str, opened, tolerance: float, periods: int) -> float:
    """Largest change of the energy relative to it, seen once per period of the free and undamped stage."""
    stage = Component("stage", "rrr_stage", level, {"causality": "force"})
    instance = opened(build(System([stage], [])).files)["stage"]
    states = [q.name for q in rrr_stage(level=level, causality="force").of(Kind.STATE)]
    at = RELEASED if level == "constant_jacobian" else list(forward(NOMINAL, RELEASED))
    start = dict(zip(states, [*at, 0.0, 0.0, 0.0], strict=True))
    instance.start(values={"damping_time": 0.0, "solver.relative_tolerance": tolerance, **start})
    handle, found, rows = instance.handle(states), energy(level), []
    for k in range(periods):
        instance.step(k * PERIOD, PERIOD)
        rows.append(instance.get(handle).copy())
    left = [float(found(row[:3], row[3:])) for row in rows]
    return np.abs(np.array(left) / float(found(at, [0.0, 0.0, 0.0])) - 1).max()


@LEVEL
@pytest.mark.slow
def test_energy_is_kept_for_1000_periods(level, opened):
    """It takes a tolerance of 1e-9, which loses 1.6e-9; the default of 1e-8 loses 4e-8."""
    assert drift(level, opened, 1e-9, 1000) < 3e-9


@LEVEL
def test_energy_is_lost_as_the_tolerance_allows(level, opened):
    """Each digit of tolerance takes off more than a digit."""
    lost = [drift(level, opened, tolerance, 100) for tolerance in (1e-8, 1e-9, 1e-10)]
    assert lost[0] < 1e-8
    assert lost[1] < lost[0] / 10
    assert lost[2] < lost[1] / 10


@LEVEL
@pytest.mark.parametrize("stacks", ["linear", "hysteretic"])
def test_without_voltage_rest_stays_rest(level, stacks, opened, library):
    """Three stacks and their stage, every state exactly 0.0 after 2000 steps."""
    numbers = (1, 2, 3)
    components = [Component("stage", "rrr_stage", level), *[Component(f"pzt{i}", "pzt_stack", stacks) for i in numbers]]
    force = [Connection(f"pzt{i}.stack.blocking_force", f"stage.stack[{i}].blocking_force") for i in numbers]
    back = [Connection(f"stage.stack[{i}].elongation_rate", f"pzt{i}.stack.elongation_rate") for i in numbers]
    system = System(components, [*force, *back])
    instances = opened(build(system).files)
    master = make_master(instances, system, "gauss_seidel", 10e-6, library)
    master.initialize()
    master.advance(2000)
    for instance in instances.values():
        states = [name for pair in instance.fmu.description.states for name in pair]
        assert states
        assert not instance.get(instance.handle(states)).any()
