"""Rounding to the steps of a sensor, with the mean slope as its derivative.

    rounded(v) = r floor(v / r + 1/2),  v for r = 0;    d rounded / dv = 1

A staircase has the derivative 0 almost everywhere, by which a loop through a sensor would look open. Its mean slope is
1, and for motions of many steps that is its gain: a linearised loop is that of the sensor without steps.
"""

from functools import cache

import casadi as ca


def rounded(value: ca.SX, resolution: ca.SX) -> ca.SX:
    """Return a column rounded to multiples of `resolution`, which does not round where it is 0."""
    return ca.vertcat(*[_staircase()(value[i], resolution) for i in range(value.shape[0])])


@cache
def _staircase() -> ca.Function:
    """Return the function of a value and the resolution to the rounded value."""
    value, resolution, result = ca.MX.sym("value"), ca.MX.sym("resolution"), ca.MX.sym("result")
    step = ca.if_else(resolution > 0, resolution, 1)
    found = ca.if_else(resolution > 0, step * ca.floor(value / step + 0.5), value)
    slope = ca.Function("jac_rounded", [value, resolution, result], [ca.MX(1.0), ca.MX(1, 1)])
    given = {"custom_jacobian": slope, "jac_penalty": 0, "enable_forward": False, "enable_reverse": False}
    return ca.Function("rounded", [value, resolution], [found], {"never_inline": True, **given})
