"""The loop that tests of masters share: a mass on a spring under PD control, as models, wired, and in closed form."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scipy.linalg import expm

from hfsa.components import Model
from hfsa.cosim.systems.system import Component, Connection, System

DAMPING, STIFFNESS = 0.5, 100.0
"""Of a mass of 1 kg [N.s/m], [N/m]."""
KP, KD, TF = 40.0, 2.0, 0.02
"""Gains [N/m], [N.s/m] and the time constant of the derivative's filter [s]."""

LOOP = [Connection("plant.position", "pd.position"), Connection("pd.force", "plant.force")]

MATRIX = np.array([[0, 1, 0], [-STIFFNESS - KP - KD / TF, -DAMPING, KD / TF], [1 / TF, 0, -1 / TF]])
"""Of the continuous loop's [x, v, filtered position]."""


def plant() -> Model:
    """A mass on a spring, pushed; its acceleration follows the force directly."""
    m = Model("Plant", "Mass on a spring, driven by a force")
    force = m.input("force", "N", "Force on the mass")
    x = m.state("x", "m", "Position")
    v = m.state("v", "m/s", "Velocity")
    m.der[x] = v
    m.der[v] = force - DAMPING * v - STIFFNESS * x
    m.output("position", x, "m", "Position")
    m.output("velocity", v, "m/s", "Velocity")
    m.output("acceleration", force - DAMPING * v - STIFFNESS * x, "m/s2", "Acceleration")
    return m


def controller() -> Model:
    """A PD controller whose derivative is filtered; the force follows the position directly."""
    m = Model("Pd", "PD controller with a filtered derivative")
    u = m.input("position", "m", "Measured position")
    w = m.state("filtered", "m", "Filtered position")
    m.der[w] = (u - w) / TF
    m.output("force", -KP * u - KD * (u - w) / TF, "N", "Force")
    return m


def sampled_controller() -> Model:
    """The same, sampled: the derivative is a difference of samples."""
    m = Model("SampledPd", "Sampled PD controller")
    sample_time = m.sample_time(0.01)
    u = m.input("position", "m", "Measured position")
    last = m.sampled_state("last", "m", "Last sample")
    m.next[last] = u
    m.sampled_output("force", -KP * u - KD * (u - last) / sample_time, "N", "Force")
    return m


def loop(
    files: Mapping[tuple[str, int], Path], version: int = 2, controller: str = "Pd"
) -> tuple[System, dict[str, Path]]:
    """Return the loop, which begins at x = 1 m at rest, and its files, from those of the three models."""
    system = System([Component("plant", "x", start={"x": 1.0}), Component("pd", "x")], LOOP)
    return system, {"plant": files["Plant", version], "pd": files[controller, version]}


def closed_loop(time: float) -> float:
    """Return the position of the continuous loop at a time [s]."""
    return float((expm(MATRIX * time) @ [1.0, 0.0, 0.0])[0])
