"""A sum of sinusoids with its exact derivatives: the excitation of many lines of a spectrum at once, as a part.

    value = offset + w(t) sum_i amplitude[i] sin(2 pi order[i] t / T + phase[i]),   T = points * step
    w(t) = sin^2(pi t / (2 ramp)) for t < ramp, then 1;  with ramp = 0 w = 1

Line i makes `order[i]` whole periods in a window of `points` steps, so that the sum repeats after every window. The
phase at t = n step + d is the fraction of order[i] n / points, in whole numbers, and order[i] d / T: it loses no digits
however late t is, and at multiples of the step the sum repeats bit by bit. `rate`, `acceleration` and `jerk` are the
exact derivatives of `value`, ramp included. A line of amplitude 0 is unused. The part has no input and so no Bode plot;
its spectrum has the lines order[i] / T.
"""

import casadi as ca

from hfsa.components import Model, ModelError
from hfsa.components._modelling.units import carried, rate_unit


def multisine_source(*, lines: int = 1, unit: str = "1") -> Model:
    """Return a sum of sinusoids.

    Args:
        lines: number of sinusoids, 1 or more.
        unit: unit of `value`, equal to that of the connected input, any text.

    Raises:
        ModelError: fewer than one line.
    """
    if lines < 1:
        raise ModelError(f"multisine_source: lines is {lines}, expected 1 or more")
    unit = carried(unit)
    m = Model("MultisineSource", "Sum of sinusoids on lines of a uniform grid, with its derivatives")
    each = f"[1..{lines}]"
    amplitude = m.parameter(f"amplitude{each}", [1.0, *[0.0] * (lines - 1)], unit, "Amplitude of the line", min=0)
    order = m.parameter(f"order{each}", 1.0, "1", "Whole number of periods of the line in a window", min=0)
    phase = m.parameter(f"phase{each}", 0.0, "rad", "Phase of the line at time 0, of a sine")
    step = m.parameter("step", 1e-3, "s", "Time between two points of the window", min=1e-15)
    points = m.parameter("points", 1000.0, "1", "Whole number of points in a window", min=1)
    offset = m.parameter("offset", 0.0, unit, "Mean of value, about which the sum swings")
    ramp = m.parameter("ramp", 0.0, "s", "Time in which the amplitude rises, 0: full amplitude from the start", min=0)

    nearest = ca.floor(m.time / step + 0.5)
    beside = m.time - nearest * step
    # a distance within the rounding of the time is none
    beside = ca.if_else(ca.fabs(beside) <= 1e-15 * ca.fabs(m.time), 0, beside)
    place = nearest - points * ca.floor(nearest / points)
    window = points * step
    sums = [ca.SX(0)] * 4
    for i in range(lines):
        turned = order[i] * place
        turned -= points * ca.floor(turned / points)
        angle = 2 * ca.pi * (turned / points + order[i] * beside / window) + phase[i]
        omega, sine, cosine = 2 * ca.pi * order[i] / window, amplitude[i] * ca.sin(angle), amplitude[i] * ca.cos(angle)
        own = sine, omega * cosine, -(omega**2) * sine, -(omega**3) * cosine
        sums = [total + one for total, one in zip(sums, own, strict=True)]
    w = _ramp(m.time, ramp)
    value = w[0] * sums[0]
    rate = w[1] * sums[0] + w[0] * sums[1]
    acceleration = w[2] * sums[0] + 2 * w[1] * sums[1] + w[0] * sums[2]
    jerk = w[3] * sums[0] + 3 * w[2] * sums[1] + 3 * w[1] * sums[2] + w[0] * sums[3]
    units = [unit]
    for _ in range(3):
        units.append(rate_unit(units[-1]))
    m.output("value", offset + value, units[0], "Sum of the sinusoids")
    m.output("rate", rate, units[1], "Derivative of value")
    m.output("acceleration", acceleration, units[2], "Second derivative of value")
    m.output("jerk", jerk, units[3], "Third derivative of value")
    return m


def _ramp(time: ca.SX, ramp: ca.SX) -> list[ca.SX]:
    """Return w and its first three derivatives."""
    is_rising = time < ramp
    turn = ca.pi / ca.if_else(is_rising, ramp, 1)
    return [
        ca.if_else(is_rising, ca.sin(turn * time / 2) ** 2, 1),
        ca.if_else(is_rising, turn * ca.sin(turn * time) / 2, 0),
        ca.if_else(is_rising, turn**2 * ca.cos(turn * time) / 2, 0),
        ca.if_else(is_rising, -(turn**3) * ca.sin(turn * time) / 2, 0),
    ]
