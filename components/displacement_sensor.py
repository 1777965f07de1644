"""Displacement sensors with steps and noise, one per axis.

    reading_i = rounded(value_i + noise_i),    noise_i white and normal, a new value in each `interval`

`resolution` is the step of a digit, 0 for none, and `noise` the standard deviation. The noise is a function of time,
axis and `seed`: equal seeds give equal runs, whatever the steps and the algorithm. In the first interval the reading is
the value, so that a loop has an equilibrium to be linearised about. The sensor has no state, and its reading is that of
the instant; no rate is derived from it.

Bode plot, value to reading: 1 at all frequencies, without phase. Steps act as noise of resolution / sqrt(12) where the
value moves over many of them; the derivatives of the FMU are those of their mean slope, 1.
"""

import casadi as ca

from hfsa.components import Model, ModelError
from hfsa.components._modelling.noise import white_noise
from hfsa.components._modelling.rounding import rounded


def displacement_sensor(*, axes: int = 1, unit: str = "m") -> Model:
    """Return the sensors of all axes.

    Args:
        axes: number of axes.
        unit: unit of value and reading.

    Raises:
        ModelError: fewer than one axis; an unknown unit.
    """
    if axes < 1:
        raise ModelError(f"displacement_sensor: axes is {axes}, expected 1 or more")
    m = Model("DisplacementSensor", "Displacement sensors with steps and noise")
    resolution = m.parameter("resolution", 0.0, unit, "Step of the readings, 0 for none", min=0, nominal=1e-9)
    deviation = m.parameter("noise", 0.0, unit, "Standard deviation of the noise", min=0, nominal=1e-9)
    interval = m.parameter("interval", 1e-4, "s", "Time between two values of the noise", min=1e-9)
    seed = m.parameter("seed", 1.0, "1", "Seed of the noise, a whole number", min=0, max=2**20)
    value = m.input(f"axis[1..{axes}].value", unit, "Displacement", nominal=1e-6)
    noise = ca.vertcat(*[white_noise(m.time, interval, axes * seed + i) for i in range(axes)])
    reading = ca.if_else(m.time < (1 - 1e-6) * interval, value, rounded(value + deviation * noise, resolution))
    m.output(f"axis[1..{axes}].reading", reading, unit, "Reading of the displacement", nominal=1e-6)
    return m
