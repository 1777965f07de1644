"""Compliant beams (`beam_module`) without mass between a base and a platform: two poses in, two wrenches out; linear.

    delta = D(p) q_platform - D(b) q_base          displacement across the beams at the stage's reference point
    w = -K delta - D delta'                        of the beams on the platform there
    w_platform = D(p)^T w,  w_base = -D(b)^T w     moved to the two origins

q = (x, y, z, thx, thy, thz) is the displacement of an origin and the small rotation from rest, along the module's
axes: X from base to stage. p and b are where the reference point is from the origin of the platform and of the base,
both 0 unless said otherwise, D(p) = [[1, -skew(p)], [0, 1]]. K is the module's stiffness (`_beam_module`). D is
`damping_ratio` times the damping of ratio 1 in every mode of the argument `platform` on these beams: with a
`rigid_body` like it the whole is `beam_stage`. The two wrenches balance, and a motion of both ends as one body costs
nothing.

Ports: in `base.position` [m], `.rotation` [rad], `.velocity`, `.angular_velocity`, `platform.position` and so on; out
`base.force` [N], `.torque` [N.m], `platform.force`, `.torque`, which follow all of them without a step between, and
`displacement` and `displacement_warning` of delta as in `beam_stage`. There are no states.

Bode plot of three aluminium beams 50 mm long and 2 mm thick on a circle of 30 mm: from `platform.position[1]` to
`platform.force[1]` 1.30e7 N/m in opposite phase, from `platform.rotation[1]` to `platform.torque[1]` 16.5 N.m/rad, and
no resonance: the velocity is an input of its own, with 22.8 N.s/m along X of the default platform at 1 %.

A force that is held over a step H lags by H / 2, a negative damper k H / 2 beside the damping c of each mode. Between
bodies that are stepped on their own it diverges above H = 2 c / k = 4 damping_ratio / omega of the fastest mode, 2.48
us of the default platform at 1 %, and without damping at every step; `beam_stage` has no such limit.

Source: the paper of 2013 on beam modules. Not in it: damping, of which 1 % is assumed, and what a step makes of it.
"""

import math
from typing import Any

import casadi as ca
import numpy as np

from hfsa.components import Model, ModelError
from hfsa.components._mechanics.beam_assembly import at_point
from hfsa.components._mechanics.beam_kinds import KindName
from hfsa.components._mechanics.beam_module import ALUMINIUM, NORMALISED, Dimensions, Material, without_rounding
from hfsa.components._mechanics.beam_spring import DAMPING_RATIO, displacement_outputs, spring
from hfsa.components._mechanics.body_facts import BODY_CENTER, BODY_INERTIA, BODY_MASS
from hfsa.components._mechanics.modes import modal_damping, modes
from hfsa.components._mechanics.rigid_body import (
    DISC,
    POSE,
    TWIST,
    WRENCH,
    Body,
    Triple,
    declared,
    mass_matrix,
    put_out,
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
    kind: KindName = "three_beam",
    tilt: float | None = None,
    count: int | None = None,
    length_error: tuple[float, ...] | None = None,
    material: Material = ALUMINIUM,
    dimensions: Dimensions = NORMALISED,
    platform: Body = DISC,
    from_base: Triple = _HERE,
    from_platform: Triple = _HERE,
) -> Model:
    """The beams between two bodies that are elsewhere.

    Args:
        kind: of module, see `_beam_kinds`.
        tilt: of the beams [deg]; 45.
        count: beams between two bodies.
        length_error: of each beam, as in `beam_module`.
        material: aluminium.
        dimensions: [m]; as in `beam_stage`.
        platform: whose modes have the damping ratio; its mass is not in the suspension. Its centre is from the stage's
            reference point.
        from_base: b, the stage's reference point from the base's origin at rest [m].
        from_platform: p, the stage's reference point from the platform's origin [m].

    Raises:
        ModelError: as `beam_module`; a platform without mass or inertia; a point that is not finite.
    """
    module = spring("beam_suspension", kind, tilt, count, length_error, material, dimensions)
    K, M = module.dimensional_stiffness(), mass_matrix(platform, "beam_suspension: platform")
    m = Model("BeamSuspension", "Compliant beams without mass between two bodies")
    ratio = m.parameter("damping_ratio", DAMPING_RATIO, "1", "Damping ratio of every mode of the platform", min=0)
    arms = {"base": _arm("from_base", from_base), "platform": _arm("from_platform", from_platform)}
    motions = {end: [declared(m.input, end, six, f"of the {end}") for six in (POSE, TWIST)] for end in arms}
    delta, rate = (
        arms["platform"] @ on_platform - arms["base"] @ on_base
        for on_platform, on_base in zip(motions["platform"], motions["base"], strict=True)
    )
    stiffness, damping = (ca.sparsify(ca.DM(without_rounding(A))) for A in (K, modal_damping(M, K)))
    wrench = -(stiffness @ delta) - ratio * (damping @ rate)
    for end, sign in (("base", -1), ("platform", 1)):
        put_out(m, end, WRENCH, sign * (arms[end].T @ wrench), f"of the beams on the {end} at its origin")
    displacement_outputs(m, module, delta)
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
    kind: KindName = "three_beam",
    tilt: float | None = None,
    count: int | None = None,
    length_error: tuple[float, ...] | None = None,
    material: Material = ALUMINIUM,
    dimensions: Dimensions = NORMALISED,
    platform: Body = DISC,
    damping_ratio: float = DAMPING_RATIO,
) -> dict[str, Any]:
    """Return the suspension's numbers at the stage's reference point; arguments and errors as `beam_suspension`.

    Returns:
        stiffness: translations before rotations, (6, 6) [N/m], [N], [N.m].
        damping: likewise, (6, 6) [N.s/m], [N.s], [N.m.s].
        natural_frequencies_hz: of the platform on it, ascending, (6,) [Hz].
        step_limits: 2 c / k of each of these modes, (6,) [s]; above the least, co-simulation with a rigid body that is
            stepped on its own diverges.
    """
    if not 0 <= damping_ratio < math.inf:
        raise ModelError(f"beam_suspension: damping_ratio is {damping_ratio:g}, expected 0 or more")
    K = spring("beam_suspension", kind, tilt, count, length_error, material, dimensions).dimensional_stiffness()
    M = mass_matrix(platform, "beam_suspension: platform")
    omega = modes(M, K).omega
    return {
        "stiffness": K,
        "damping": damping_ratio * without_rounding(modal_damping(M, K)),
        "natural_frequencies_hz": omega / (2 * np.pi),
        "step_limits": 4 * damping_ratio / omega,
    }


def _arm(name: str, point: Triple) -> ca.DM:
    """Return D(point), shape (6, 6)."""
    if not np.all(np.isfinite(point)):
        raise ModelError(f"beam_suspension: {name} is {point} m, expected three finite numbers")
    return ca.sparsify(ca.DM(at_point(point)))
