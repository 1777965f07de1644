"""Massless compliant beams (`beam_module`) between a base and a platform, from two poses to two wrenches; linear.

    delta = D(p) q_platform - D(b) q_base          displacement across the beams at the stage's reference point
    w = -K delta - D delta'                        wrench of the beams on the platform there
    w_platform = D(p)^T w,  w_base = -D(b)^T w     wrenches at the two origins

q = (x, y, z, thx, thy, thz) is the displacement of an origin and the small rotation from rest, along the module's
axes: X from base to stage. p and b are the positions of the reference point from the origins of platform and base, 0 by
default; D(p) = [[1, -skew(p)], [0, 1]]. K is the stiffness of the module. D is `damping_ratio` times the damping of
ratio 1 in every mode of the body `platform` on these beams; connected to a `rigid_body` with the same values the
suspension is equivalent to a `beam_stage`. The two wrenches are in equilibrium, and a common rigid motion of both ends
produces none.

Ports: in `base.position` [m], `.rotation` [rad], `.velocity`, `.angular_velocity`, `platform.position` and so on; out
`base.force` [N], `.torque` [N.m], `platform.force`, `.torque`, with direct feedthrough from all inputs, and
`displacement` and `displacement_warning` of delta as in `beam_stage`. There are no states.

Bode plot of three aluminium beams 50 mm long and 2 mm thick on a circle of 30 mm: from `platform.position[1]` to
`platform.force[1]` 1.30e7 N/m in opposite phase, from `platform.rotation[1]` to `platform.torque[1]` 16.5 N.m/rad, and
no resonance. The velocity is a separate input; its gain is 22.8 N.s/m along X for the default platform at 1 %.

A force held over a communication step H acts H / 2 late, as a negative damper k H / 2 in parallel with the damping c of
each mode. Co-simulation with separately stepped bodies diverges above H = 2 c / k = 4 damping_ratio / omega of the
fastest mode, 2.48 us for the default platform at 1 %, and without damping at every step; `beam_stage` has no such
limit.

Source: the paper of 2013 on beam modules. Not in it: the damping, 1 % (assumed), and the step limit.
"""

import math
from typing import Any

import casadi as ca
import numpy as np

from hfsa.components import Model, ModelError
from hfsa.components._mechanics.beam_assembly import at_point
from hfsa.components._mechanics.beam_module import without_rounding
from hfsa.components._mechanics.beam_spring import DAMPING_RATIO, USUAL, SpringDesign, displacement_outputs
from hfsa.components._mechanics.body_facts import BODY_CENTER, BODY_INERTIA, BODY_MASS
from hfsa.components._mechanics.modes import damping_matrix, modes
from hfsa.components._mechanics.rigid_body import (
    DISC,
    POSE,
    TWIST,
    WRENCH,
    Body,
    Triple,
    declare_vector,
    mass_matrix,
    output_vector,
)
from hfsa.components._modelling.facts import Known

FACTS = {
    BODY_MASS: Known("platform.mass"),
    BODY_INERTIA: Known("platform.inertia"),
    BODY_CENTER: Known("platform.center", plus="from_platform"),
}

_HERE = (0.0, 0.0, 0.0)


def beam_suspension(
    *,
    module: SpringDesign = USUAL,
    platform: Body = DISC,
    from_base: Triple = _HERE,
    from_platform: Triple = _HERE,
) -> Model:
    """Return the beams between two bodies, which are parts of their own.

    Args:
        module: kind, dimensions, material or list of the beams.
        platform: body whose modes have the damping ratio; the suspension does not include its mass. Its mass centre is
            given from the stage's reference point.
        from_base: b, the stage's reference point from the base's origin at rest [m].
        from_platform: p, the stage's reference point from the platform's origin [m].

    Raises:
        ModelError: as `beam_module`; a platform without mass or inertia; a point that is not finite.
    """
    beams = module.module("beam_suspension")
    K, M = beams.dimensional_stiffness(), mass_matrix(platform, "beam_suspension: platform")
    m = Model("BeamSuspension", "Compliant beams without mass between two bodies")
    ratio = m.parameter("damping_ratio", DAMPING_RATIO, "1", "Damping ratio of every mode of the platform", min=0)
    arms = {"base": _arm("from_base", from_base), "platform": _arm("from_platform", from_platform)}
    motions = {end: [declare_vector(m.input, end, six, f"of the {end}") for six in (POSE, TWIST)] for end in arms}
    delta, rate = (
        arms["platform"] @ on_platform - arms["base"] @ on_base
        for on_platform, on_base in zip(motions["platform"], motions["base"], strict=True)
    )
    stiffness, damping = (ca.sparsify(ca.DM(without_rounding(A))) for A in (K, damping_matrix(M, K)))
    wrench = -(stiffness @ delta) - ratio * (damping @ rate)
    for end, sign in (("base", -1), ("platform", 1)):
        output_vector(m, end, WRENCH, sign * (arms[end].T @ wrench), f"of the beams on the {end} at its origin")
    displacement_outputs(m, beams, delta)
    return m


UNITS = {
    "stiffness": "N/m, N; N, N.m/rad",
    "damping": "N.s/m, N.s; N.s, N.m.s/rad",
    "natural_frequencies_hz": "Hz",
    "step_limits": "s",
}
"""Units of the results of `analyze`, in the notation of `_modelling/parts.py`."""


def analyze(
    *,
    module: SpringDesign = USUAL,
    platform: Body = DISC,
    damping_ratio: float = DAMPING_RATIO,
) -> dict[str, Any]:
    """Return stiffness, damping and step limits at the stage's reference point; arguments as `beam_suspension`.

    Returns:
        stiffness: stiffness, translations before rotations, (6, 6) [N/m], [N], [N.m].
        damping: damping, translations before rotations, (6, 6) [N.s/m], [N.s], [N.m.s].
        natural_frequencies_hz: natural frequencies of the platform on the beams, ascending, (6,) [Hz].
        step_limits: 2 c / k of each of these modes, (6,) [s]; above the smallest, co-simulation with a separately
            stepped rigid body diverges.

    Raises:
        ModelError: as `beam_suspension`; a damping ratio below 0.
    """
    if not 0 <= damping_ratio < math.inf:
        raise ModelError(f"beam_suspension: damping_ratio is {damping_ratio:g}, expected 0 or more")
    K = module.module("beam_suspension").dimensional_stiffness()
    M = mass_matrix(platform, "beam_suspension: platform")
    omega = modes(M, K).omega
    return {
        "stiffness": K,
        "damping": damping_ratio * without_rounding(damping_matrix(M, K)),
        "natural_frequencies_hz": omega / (2 * np.pi),
        "step_limits": 4 * damping_ratio / omega,
    }


def _arm(name: str, point: Triple) -> ca.DM:
    """Return D(point), shape (6, 6); `ModelError` with `name` unless the point is finite."""
    if not np.all(np.isfinite(point)):
        raise ModelError(f"beam_suspension: {name} is {point} m, expected three finite numbers")
    return ca.sparsify(ca.DM(at_point(point)))
