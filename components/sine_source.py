"""A sinusoid with its exact derivatives: the excitation of a frequency sweep, as a part.

    value = offset + amplitude w(t) sin(omega t),  omega = 2 pi frequency
    w(t) = sin^2(pi t / (2 T)) for t < T, then 1,  T = max(2 / frequency, 0.5 s); with ramp = 0 w = 1

`rate`, `acceleration` and `jerk` are the exact derivatives of `value`, ramp included; all four are accurate to all
digits from the start, while the ramp is small. `sine` and `cosine` are the phase reference for a lock-in amplifier,
without ramp and amplitude. The part has no input and so no Bode plot; its spectrum is one line.
"""

import casadi as ca

from hfsa.components import Model
from hfsa.components._modelling.units import carried, rate_unit


def sine_source(*, unit: str = "1") -> Model:
    """Return one sinusoid.

    Args:
        unit: unit of `value`, equal to that of the connected input, any text.
    """
    unit = carried(unit)
    m = Model("SineSource", "Sinusoid with its derivatives, ramped up smoothly")
    amplitude = m.parameter("amplitude", 1.0, unit, "Amplitude of value", min=0)
    frequency = m.parameter("frequency", 1.0, "Hz", "Frequency", min=1e-9)
    offset = m.parameter("offset", 0.0, unit, "Mean of value, about which the sinusoid swings")
    ramp = m.parameter("ramp", 1.0, "1", "1: amplitude ramped up, 0: full amplitude from the start", min=0, max=1)
    omega = 2 * ca.pi * frequency
    ramp_time = ca.fmax(2 / frequency, 0.5)
    phase, turn = omega * m.time, ca.pi / ramp_time
    ramping = ca.logic_and(m.time < ramp_time, ramp > 0.5)
    w = ca.if_else(ramping, ca.sin(turn * m.time / 2) ** 2, 1)
    w1 = ca.if_else(ramping, turn * ca.sin(turn * m.time) / 2, 0)
    w2 = ca.if_else(ramping, turn**2 * ca.cos(turn * m.time) / 2, 0)
    w3 = ca.if_else(ramping, -(turn**3) * ca.sin(turn * m.time) / 2, 0)
    sine, cosine = ca.sin(phase), ca.cos(phase)
    m.output("value", offset + amplitude * w * sine, unit, "Sinusoid")
    m.output("rate", amplitude * (w1 * sine + w * omega * cosine), rate_unit(unit), "Derivative of value")
    m.output(
        "acceleration",
        amplitude * (w2 * sine + 2 * w1 * omega * cosine - w * omega**2 * sine),
        rate_unit(rate_unit(unit)),
        "Second derivative of value",
    )
    m.output(
        "jerk",
        amplitude * ((w3 - 3 * w1 * omega**2) * sine + (3 * w2 * omega - w * omega**3) * cosine),
        rate_unit(rate_unit(rate_unit(unit))),
        "Third derivative of value",
    )
    m.output("sine", sine, "1", "Phase reference, sine")
    m.output("cosine", cosine, "1", "Phase reference, cosine")
    return m
