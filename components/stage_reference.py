"""Reference motion of the 3-RRR stage: elongations of its three stacks over time, with exact derivatives.

    ramp         r_i = rate t until `duration`, then constant
    three_axis   r_i = amplitude sin^2(pi i frequency t),  i = 1, 2, 3
    step         r_i = 0 before `step.time`, `step.elongation[i]` from then on

The inputs `command.elongation[i]` [m], `.elongation_rate[i]` and `.elongation_acceleration[i]` are added to the motion.
The outputs are `stack[i].elongation`, `.elongation_rate` and `.elongation_acceleration`.

`ramp` is the motion of the source: it starts at full speed and, equal on all stacks, changes the yaw only. `three_axis`
has a different frequency for each stack, so it moves all three axes and shows their coupling. The derivatives of `step`
are 0, also at its jump.

Bode plot, command to reference: 1 at all frequencies, without phase.

Source: thesis of 2000 on the 3-RRR stage, ch. 5, for the ramp of 3 um/s over 4 s; the other motions are not in it.
"""

from typing import Any, Literal, NamedTuple

import casadi as ca
import numpy as np

from hfsa.components import Model, ModelError
from hfsa.components._mechanics.pzt import TOKIN
from hfsa.components._mechanics.rrr_design import Design, Matrix
from hfsa.components._mechanics.rrr_facts import GEOMETRY, STACK_STROKE
from hfsa.components._mechanics.rrr_kinematics import AS_NAMED, KinematicsSet, LinkChanges, inverse
from hfsa.components._modelling.facts import Known
from hfsa.components._modelling.model import one_of

FACTS = {**GEOMETRY, STACK_STROKE: Known("stroke")}  # of the analysis only

_ROUNDING = 1e-9
"""Tolerance at the ends of the stroke [m], for poses given with a few digits."""


class _Motion(NamedTuple):
    """Elongations of the stacks with their derivatives, columns of three [m], [m/s], [m/s2]."""

    elongation: ca.SX
    rate: ca.SX
    acceleration: ca.SX


def stage_reference(*, motion: Literal["ramp", "three_axis", "step"] = "ramp") -> Model:
    """Return one reference motion of all three stacks.

    Args:
        motion: `ramp`, `three_axis` or `step`.

    Raises:
        ModelError: an unknown motion.
    """
    motions = {"ramp": _ramp, "three_axis": _three_axis, "step": _step}
    one_of(motion, motions, "stage_reference: motion")
    m = Model("StageReference", "Reference motion of the 3-RRR stage")
    words = (
        ("elongation", "m", "elongation", 1e-6),
        ("elongation_rate", "m/s", "rate of the elongation", 1e-3),
        ("elongation_acceleration", "m/s2", "acceleration of the elongation", 1.0),
    )
    for (name, unit, text, size), moved in zip(words, motions[motion](m), strict=True):
        added = m.input(f"command.{name}[1..3]", unit, f"Added {text}", nominal=size)
        m.output(f"stack[1..3].{name}", moved + added, unit, f"Reference {text}", nominal=size)
    return m


UNITS = {
    "elongation": "m",
}
"""Units of the results of `analyze`, in the notation of `_modelling/parts.py`."""


def analyze(
    *,
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    kinematics: KinematicsSet = "nominal",
    links: LinkChanges = AS_NAMED,
    jacobian: Matrix | None = None,
    stroke: float = TOKIN.stroke,
) -> dict[str, Any]:
    """Return the elongations of the stacks at a pose of the platform: inverse kinematics.

    Args:
        pose: x, y [m] and yaw [rad] of the platform from rest.
        kinematics: parameter set of the stage's links; `measured` is a Jacobian.
        links: lengths [m] and angles [rad] of the links in place of those of the set.
        jacobian: Jacobian from elongations to pose in place of the links, nine numbers row by row [m/m; m/m; rad/m].
        stroke: free stroke of the stacks [m].

    Returns:
        elongation: elongations of the stacks, (3,) [m].

    Raises:
        ModelError: a pose out of reach of the legs; elongations outside the free stroke; an unknown parameter set;
            as `rrr_stage`.
    """
    design = Design(kinematics, links, jacobian=jacobian)
    if jacobian is None and kinematics != "measured":
        wanted = inverse(design.links_at_rest, pose, "stage_reference")
    else:
        wanted = np.linalg.solve(design.jacobian_at_rest, pose)
    label = "stage_reference: pose {:g} m, {:g} m, {:g} rad".format(*pose)
    if not np.all((wanted >= -_ROUNDING) & (wanted <= stroke + _ROUNDING)):
        found = ", ".join(f"{value * 1e6:.3f}" for value in wanted)
        raise ModelError(f"{label} needs elongations of {found} um, expected 0 to {stroke * 1e6:g} um, the free stroke")
    return {"elongation": wanted}


def _ramp(m: Model) -> _Motion:
    """Return equal elongations that rise at a constant rate and then stay constant."""
    rate = m.parameter("rate", 3e-6, "m/s", "Rate of all elongations", nominal=1e-6)
    duration = m.parameter("duration", 4.0, "s", "Time after which the elongations are constant", min=0)
    moving, ones = m.time < duration, ca.SX.ones(3)
    elongation = rate * ca.if_else(moving, m.time, duration)
    return _Motion(elongation * ones, ca.if_else(moving, rate, 0) * ones, ca.SX.zeros(3))


def _three_axis(m: Model) -> _Motion:
    """Return elongations that oscillate between 0 and the amplitude, each at its own frequency."""
    amplitude = m.parameter("amplitude", 8e-6, "m", "Largest elongation", nominal=1e-6)
    frequency = m.parameter("frequency", 5.0, "Hz", "Frequency of the first stack; the others have 2 and 3 times it")
    omega = 2 * ca.pi * frequency * ca.DM([1, 2, 3])
    turn = omega * m.time
    return _Motion(
        amplitude * ca.sin(turn / 2) ** 2, amplitude / 2 * omega * ca.sin(turn), amplitude / 2 * omega**2 * ca.cos(turn)
    )


def _step(m: Model) -> _Motion:
    """Return elongations that jump to their final values."""
    target = m.parameter("step.elongation[1..3]", 1e-6, "m", "Elongation after the step", nominal=1e-6)
    begin = m.parameter("step.time", 1e-3, "s", "Time of the step", min=0)
    return _Motion(ca.if_else(m.time < begin, 0, 1) * target, ca.SX.zeros(3), ca.SX.zeros(3))
