"""Mass on a damped spring, driven at its base: the template for a new part.

    mass x'' + damping x' + stiffness (x - u) = 0        u: base.position, x: position

Bode plot, base.position to position: 0 dB at low frequency, a resonance of height sqrt(stiffness mass) / damping at
sqrt(stiffness / mass) rad/s (46 dB at 15.9 Hz with the defaults), and -40 dB per decade above it.
"""

from hfsa.components import Model


def mass_on_spring() -> Model:
    """Return one mass with a damper to the ground and a spring to the base."""
    m = Model("MassOnSpring", "Mass on a damped spring, driven at its base")
    k = m.parameter("stiffness", 1e4, "N/m", "Spring stiffness", min=0)
    c = m.parameter("damping", 0.5, "N.s/m", "Damper coefficient", min=0)
    mass = m.parameter("mass", 1.0, "kg", "Moving mass", min=1e-9)
    u = m.input("base.position", "m", "Base displacement", nominal=1e-3)
    x = m.state("mass.position", "m", "Displacement of the mass", nominal=1e-3)
    v = m.state("mass.velocity", "m/s", "Velocity of the mass", nominal=0.1)
    m.der[x] = v
    m.der[v] = (k * (u - x) - c * v) / mass
    m.output("position", x, "m", "Measured displacement", nominal=1e-3)
    return m
