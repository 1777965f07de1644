"""A platform on compliant beams (`beam_module`), from loads and base acceleration to platform motion; linear.

    M q'' + D q' + K q = w - M b        D = damping_ratio D_1, D_1 the damping of ratio 1 in every mode

q = (x, y, z, thx, thy, thz) is the displacement of the stage's reference point and the rotation from rest, relative to
the base, along the module's axes: X from base to stage. w = (force, torque) is the wrench at that point, b = (a, alpha)
the acceleration of the coincident point of the base. K is the stiffness of the module, M the mass matrix of the
platform at the reference point. The beams have no mass.

Ports: in `wrench.force` [N], `wrench.torque` [N.m], `base.acceleration` [m/s2], `base.angular_acceleration` [rad/s2];
out `platform.position` [m], `.rotation` [rad], `.velocity`, `.angular_velocity`, `.acceleration` and
`.angular_acceleration`, all relative to the base. The two accelerations have direct feedthrough from all inputs.
`displacement` is the largest entry of q with translations divided by the length of a beam; `displacement_warning` is 1
while it is above 0.1, beyond the linear range of the beams.

Bode plot of three aluminium beams 50 mm long and 2 mm thick on a circle of 30 mm that carry a disc of 0.1 kg and 30 mm:
from `wrench.force[1]` to `platform.position[1]` 7.69e-8 m/N up to one resonance, 34 dB high, at 1815.1 Hz; from
`wrench.torque[1]` to `platform.rotation[1]` 6.06e-2 rad/(N.m) up to one, 34 dB high, at 96.36 Hz; -40 dB per decade
above. From `wrench.force[2]` to `platform.position[2]` 6.42e-5 m/N up to a resonance, 34 dB high, at 62.82 Hz, and -40
dB per decade above; the force also turns the platform about Z, 4.27e-6 rad/N at low frequency with a second resonance
at 2569.8 Hz, and moves it in no other direction. The response to `base.acceleration[2]` is that to 0.1 N per m/s2.

Source: the paper of 2013 on beam modules. Not in it: the platform, and damping, of which 1 % is assumed.
"""

from typing import Any

import casadi as ca
import numpy as np

from hfsa.components import Model
from hfsa.components._mechanics.beam_module import without_rounding
from hfsa.components._mechanics.beam_spring import DAMPING_RATIO, USUAL, SpringDesign, displacement_outputs
from hfsa.components._mechanics.beam_stage_picture import stage_drawing, stage_in_motion
from hfsa.components._mechanics.modes import damping_matrix, modes
from hfsa.components._mechanics.rigid_body import (
    ACCELERATION,
    DISC,
    POSE,
    TWIST,
    WRENCH,
    Body,
    declare_vector,
    mass_matrix,
    output_vector,
)
from hfsa.components._modelling.drawing import Drawing, Moving


def beam_stage(
    *,
    module: SpringDesign = USUAL,
    platform: Body = DISC,
) -> Model:
    """Return the platform on its module.

    Args:
        module: kind, dimensions, material or list of the beams.
        platform: mass, inertia and mass centre of the platform.

    Raises:
        ModelError: as `beam_module`; a platform without mass or inertia.
    """
    beams = module.module("beam_stage")
    M, K = mass_matrix(platform, "beam_stage: platform"), beams.dimensional_stiffness()
    m = Model("BeamStage", "Platform on compliant beams")
    ratio = m.parameter("damping_ratio", DAMPING_RATIO, "1", "Damping ratio of every mode", min=0)
    load = declare_vector(m.input, "wrench", WRENCH, "on the platform at the reference point")
    base = declare_vector(m.input, "base", ACCELERATION, "of the base at the reference point")
    q = declare_vector(m.state, "center", POSE, "of the reference point, relative to the base")
    rate = declare_vector(m.state, "center", TWIST, "of the reference point, relative to the base")
    inverse, damping, stiffness = (
        ca.sparsify(ca.DM(without_rounding(A))) for A in (np.linalg.inv(M), damping_matrix(M, K), K)
    )
    acceleration = inverse @ (load - ratio * (damping @ rate) - stiffness @ q) - base
    m.der[q], m.der[rate] = rate, acceleration
    for six, column in ((POSE, q), (TWIST, rate), (ACCELERATION, acceleration)):
        output_vector(m, "platform", six, column, "of the platform, relative to the base")
    displacement_outputs(m, beams, q)
    return m


UNITS = {
    "stiffness": "N/m, N; N, N.m/rad",
    "mass": "kg, kg.m; kg.m, kg.m2",
    "natural_frequencies_hz": "Hz",
    "shapes": "m; rad",
}
"""Units of the results of `analyze`, in the notation of `_modelling/parts.py`."""


def analyze(
    *,
    module: SpringDesign = USUAL,
    platform: Body = DISC,
) -> dict[str, Any]:
    """Return stiffness, mass matrix and modes of the stage; arguments and errors as `beam_stage`.

    Returns:
        stiffness: stiffness at the reference point, translations before rotations, (6, 6) [N/m], [N], [N.m].
        mass: mass matrix at the reference point, (6, 6) [kg], [kg.m], [kg.m2].
        natural_frequencies_hz: natural frequencies, ascending, (6,) [Hz].
        shapes: mode shapes as columns, their largest entry 1, metres and radians, (6, 6).
    """
    K = module.module("beam_stage").dimensional_stiffness()
    M = mass_matrix(platform, "beam_stage: platform")
    found = modes(M, K)
    largest = found.shapes[np.argmax(np.abs(found.shapes), axis=0), range(6)]
    return {
        "stiffness": K,
        "mass": M,
        "natural_frequencies_hz": found.omega / (2 * np.pi),
        "shapes": np.round(found.shapes / largest, 12) + 0.0,
    }


def picture(
    *,
    module: SpringDesign = USUAL,
    platform: Body = DISC,
) -> Drawing:
    """Return the stage at rest, and in each of its modes; arguments and errors as `beam_stage`."""
    M = mass_matrix(platform, "beam_stage: platform")
    return stage_drawing(
        module.module("beam_stage"), M, np.array(platform.center), f"Stage on a beam module {module.kind}"
    )


def moving(*, module: SpringDesign = USUAL) -> Moving:
    """Return the stage in a run, as its platform moves; arguments and errors as `beam_stage`."""
    return stage_in_motion(module.module("beam_stage"))
