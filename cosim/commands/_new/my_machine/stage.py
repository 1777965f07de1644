"""Stage on leaf springs, moved by a force.

    mass x'' + damping x' + stiffness x = force

Bode plot, force to position: 1 / stiffness at low frequency, a resonance at sqrt(stiffness / mass) rad/s that stands
sqrt(stiffness mass) / damping above it, and -40 dB per decade beyond.
"""

from math import pi, sqrt

from hfsa.components import Model
from my_machine._sizes import MASS, STIFFNESS

UNITS = {"resonance": "Hz", "travel": "m"}


def stage() -> Model:
    """One mass that is guided along one axis."""
    m = Model("Stage", "Stage on leaf springs")
    k = m.parameter("stiffness", STIFFNESS, "N/m", "Stiffness of the leaf springs", min=0)
    c = m.parameter("damping", 10.0, "N.s/m", "Damper coefficient", min=0)
    mass = m.parameter("mass", MASS, "kg", "Moving mass", min=1e-9)
    force = m.input("force", "N", "Force on the stage", nominal=1.0)
    x = m.state("stage.position", "m", "Position of the stage", nominal=1e-4)
    v = m.state("stage.velocity", "m/s", "Velocity of the stage", nominal=1e-2)
    m.der[x] = v
    m.der[v] = (force - c * v - k * x) / mass
    m.output("position", x, "m", "Measured position", nominal=1e-4)
    m.output("velocity", v, "m/s", "Measured velocity", nominal=1e-2)
    return m


def analyze(*, force: float = 20.0) -> dict[str, float]:
    """Return the resonance of the free stage and its travel under a constant force [N]."""
    return {"resonance": sqrt(STIFFNESS / MASS) / (2 * pi), "travel": force / STIFFNESS}
