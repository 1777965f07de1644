"""The 3-RRR piezo stage: three stacks move a platform in its plane, on nine flexure hinges.

    jacobian            (x, y, yaw) = J0 l
    constant_jacobian   M(l) l'' + c + beta K0 l' + dP/dl = Q + J0^T w - G(l) a_b
    exact               the same equations over the pose, every link at its length, l(pose) in closed form
    flexible_hinges     M [l; q]'' + K ([l; q] + beta [l'; q']) = [Q; w] - G a_b, over elongations and pose q: rigid
                        links on necks that give along, across and in bending
    continuum           modes of the plate by finite elements, with their static residual; elongations and pose follow

l are the stacks' elongations, w the wrench on the platform, a_b the acceleration of the base, K0 = d2P/dl2 at rest; T
and P are in `_mechanics/rrr_dynamics.py`. The causality defines Q:

    force    Q = F                                  the stack models its stiffness and outputs its force F
    source   Q = F_b - k l - c l' - m_tip l''       the stage models it; the stack outputs its blocking force F_b

With `force` a stack and the stage exchange the spring force k l, held over each communication step: co-simulation
diverges above the step 2 c / k, c the damping of a mode, and without damping at every step. With `source` the only
signal from the stage to a stack is l', which acts on the charge: co-simulation is stable for every step with `static`
stacks, and for steps below 57 us with `linear` ones.

Ports: in `stack[i].force` or `stack[i].blocking_force` [N], positive along the elongation, `wrench.force` [N] and
`.torque` [N.m] at the platform's centre, `base.acceleration` [m/s2]; out `stack[i].elongation` [m] and
`.elongation_rate`, with `source` also `stack[i].force` on the crank and `.contact_lost`, `platform.position` [m] and
`.rotation` [rad] from rest, `.velocity`, `.angular_velocity`, `.acceleration`, `.angular_acceleration`, and the largest
`hinge.angle` [rad] and `hinge.stress` [Pa] with `hinge.overload`, 1 above 233 MPa. At level `jacobian` the elongations
and their derivatives are inputs, and there are no forces. As the elongations go to zero, `exact` converges to
`constant_jacobian` and both poses to J0 l, with a difference of second order.

A stack can only push. `contact_lost` is 1 while its force + `stack.preload` is a pull of more than a millionth of F0,
larger than rounding and solver errors. The equations remain those of a bonded stack.

In free vibration without damping the FMU loses 4e-11 of its energy per period of 529 Hz, or 2e-12 with
`solver.relative_tolerance` 1e-9 instead of 1e-8.

Bode plot at rest, `source`, from the blocking forces to the pose: equal forces produce a pure rotation, 2.2 urad/N (per
stack) up to one resonance at 2225 Hz, 30 dB high; forces of sum zero produce a pure translation, up to one resonance at
904.7 Hz, 38 dB high. With `force` the resonances are at 1334.7 Hz, 26 dB, and at 529.05 Hz, 34 dB. Above the resonances
-40 dB per decade.

`flexible_hinges` (`_mechanics/rrr_hinged.py`) has no fitted number, and other arguments: the contact of stack and
lever, which decides the motion, the bolts of the platform, and the plate that the stage is cut from. It shows what the
rigid links of the source leave out. Elongations of 0 to 12 um move the source's platform by 77 x 71 um and 2.16 mrad;
with pinned bolts this is 70 x 65 um and 1.97 mrad on ball tips, 67 x 61 um and 1.87 mrad on flat stacks (`stack`), and
33 x 30 um and 0.93 mrad where the levers are held sideways (`locked`); 36 x 42 um and 0.97 mrad were measured, in
between. A stack feels 16 N/um instead of 28 N/um on flat stacks, so that the ramp to 12 um needs 146 V and is reached,
and 66 N/um when locked, where 150 V end at 7.1 um. With `contact=ball` the Jacobian tends to that of rigid links as the
necks become thin, with a difference in proportion to t / r, and with rigid bolts the stiffness does so too. The level
is linear. Its stresses, those of beams of the necks' profile, are a quarter (free sideways) to a half (locked) above
those of finite elements.

`continuum` (`_continuum/`) gives in its bodies too; it needs the extra `fem` at export, and nothing of it afterwards.
Beside the same arguments there is `mesh`: a third of the plate is meshed with curved triangles of six nodes, and turned
twice. The elongations move the platform by 61 x 56 um and 1.73 mrad on flat stacks, by 33 x 31 um and 0.93 mrad where
the levers are held sideways. Six modes, three with rigid bolts, and the residual of all others follow all finite
elements: the pose to 1.2 % to 5 kHz, elongations to 1.5 % to 2 kHz and 7 % to 5 kHz; rates and accelerations are
without the residual, 1 % of the static response. The modes are those of a stage on its stacks (`source`), of the data
sheet `stack`, with the `damping_ratio` 1 % of each. Pinned end blocks swing about their bolts at 3.09 to 3.12 kHz.
`hinge.stress` is the largest von Mises stress at a few points of each neck, within 1 %, and `hinge.angle` is left out.
With `contact=ball` the Jacobian tends to J0 as the necks become thin. Results have a `mesh_error`, the difference from
a mesh of twice the size.

Links, hinges and masses are arguments, by default those of the source. At `constant_jacobian` and `exact`, which are
affine in them, the stiffness of the hinges and all masses are parameters of the FMU too, `hinge.stiffness` and
`masses.platform` to `masses.coupler`: of this part alone, not of the models in controllers. A Jacobian, a stiffness or
an inertia that is measured or computed elsewhere can take the place of theirs, by `_mechanics/rrr_design.py`.

Source: thesis of 2000 on the 3-RRR stage. Assumed: beta, for a damping ratio of 1 % of the translations; damping and
mass of the stacks.
"""

from typing import Any, Literal, get_args

import numpy as np

from hfsa.components import Drawing, Model, ModelError, Moving
from hfsa.components._continuum.design import continuum
from hfsa.components._continuum.drawing import drawing
from hfsa.components._continuum.extra import unavailable
from hfsa.components._continuum.level import elastic
from hfsa.components._continuum.results import elastic_numbers
from hfsa.components._mechanics.pzt import STROKE_IN_USE, TOKIN, Stack
from hfsa.components._mechanics.rrr_calibration import calibration_of
from hfsa.components._mechanics.rrr_design import THESIS_DESIGN, THESIS_DIMENSIONS, Design, Dimensions
from hfsa.components._mechanics.rrr_facts import (
    DAMPING_TIME,
    STACK_COUPLING,
    STACK_STIFFNESS,
    STACK_VOLTAGE,
    STAGE,
)
from hfsa.components._mechanics.rrr_hinged import hinged
from hfsa.components._mechanics.rrr_hinged_numbers import hinged_numbers
from hfsa.components._mechanics.rrr_kinematics import inverse
from hfsa.components._mechanics.rrr_levels import declare_hinges, declare_motion, dynamic, flexible, kinematic
from hfsa.components._mechanics.rrr_numbers import UNITS as UNITS
from hfsa.components._mechanics.rrr_numbers import Triple, dynamic_numbers, elongations_at, kinematic_numbers
from hfsa.components._mechanics.rrr_outline import THESIS_PLATE, Plate
from hfsa.components._mechanics.rrr_picture import links_drawing, links_in_motion
from hfsa.components._mechanics.rrr_study import Goals, Objective, design_study
from hfsa.components._modelling.calibration import Calibration
from hfsa.components._modelling.facts import Known
from hfsa.components._modelling.model import one_of
from hfsa.components._modelling.study import Study

Level = Literal["jacobian", "constant_jacobian", "exact", "flexible_hinges", "continuum"]
Causality = Literal["source", "force"]

LADDER = ("jacobian", "constant_jacobian", "flexible_hinges", "continuum")
"""Levels of growing truth about the structure; `exact` is that of finite motion on rigid links, beside them."""
_SMALL = 0.1
"""Largest elongation of a level of small motion, by the arm of a stack."""
UNAVAILABLE = unavailable("continuum")
"""Levels that this machine cannot build, with the reason."""

FACTS = {
    **STAGE,
    DAMPING_TIME: Known("damping_time", levels=("constant_jacobian", "exact", "flexible_hinges")),
    STACK_STIFFNESS: Known("stack.stiffness", when=("causality", "source")),
    STACK_COUPLING: Known("stack.blocking_force", per="stack.full_voltage", of_analysis=True),
    STACK_VOLTAGE: Known("stack.full_voltage", of_analysis=True),
}


def rrr_stage(
    *,
    level: Level = "constant_jacobian",
    causality: Causality = "source",
    design: Design = THESIS_DESIGN,
    stack: Stack = TOKIN,
    plate: Plate = THESIS_PLATE,
    mesh: float | None = None,
) -> Model:
    """Return the stage about rest.

    Args:
        level: `jacobian` (kinematic), `constant_jacobian`, `exact`, `flexible_hinges` or `continuum` (dynamic).
        causality: whether the stage includes the stacks' stiffness, damping and tip mass (`source`) or not (`force`);
            without effect at level `jacobian`.
        design: links, hinges and masses, the arguments `kinematics`, `links`, `hinge`, `masses`, and matrices in their
            place, `jacobian`, `stiffness`, `mass` (`_mechanics/rrr_design.py`). Level `jacobian` has a Jacobian alone,
            level `exact` takes none; `measured` is a Jacobian without links.
        stack: data sheet of the stacks; the defaults of the parameters `stack.stiffness`, `.damping`, `.tip_mass`.
        plate: the arguments `contact`, `bolts` and `outline` (`_mechanics/rrr_outline.py`), of levels `flexible_hinges`
            and `continuum`.
        mesh: size of the triangles at the necks [m], of level `continuum` (default: an eighth of their thickness).

    Raises:
        ModelError: an unknown level, parameter set or causality; `measured` at a dynamic level; dimensions that cannot
            be built; a singular Jacobian; a stiffness or mass that is not symmetric and positive definite.
    """
    _check(level, causality, mesh)
    _check_plate(level, plate)
    m = Model("RrrStage", "3-RRR piezo stage")
    if level == "jacobian":
        declare_motion(m, kinematic(m, design.jacobian_at_rest))
        return m
    if level == "continuum":
        declare_motion(m, elastic(m, continuum(design, causality, stack, plate, mesh)))
        return m
    if level == "flexible_hinges":
        motion, hinges = flexible(m, hinged(design, plate, stack), causality, stack)
    else:
        motion, hinges = dynamic(m, level, design, causality, stack)
    declare_motion(m, motion)
    declare_hinges(m, hinges)
    return m


def analyze(
    *,
    level: Level = "constant_jacobian",
    causality: Causality = "source",
    design: Design = THESIS_DESIGN,
    stack: Stack = TOKIN,
    plate: Plate = THESIS_PLATE,
    mesh: float | None = None,
    elongation: Triple = (0.0, 0.0, 0.0),
    pose: Triple | None = None,
    voltage: Triple = (0.0, 0.0, 0.0),
    resolution: float = 10e-9,
) -> dict[str, Any]:
    """Return kinematic, static and dynamic properties of the stage, in SI units, in the coordinates of the stacks.

    The arguments are those of `rrr_stage`, with further ones; at level `jacobian` only the first five results are
    returned. `causality` has no effect.

    Further arguments:
        elongation: elongations of the stacks [m].
        pose: x, y [m] and yaw [rad] in their place.
        voltage: voltages of the stacks for the results `..._at_voltage` [V], limited to 0 and the full voltage, 150 V.
        resolution: smallest step of an elongation [m].

    Returns:
        jacobian: Jacobian from elongations to pose, (3, 3) [m/m, m/m, rad/m].
        pose: x, y [m], yaw [rad], (3,).
        elongation: elongations at that pose, (3,) [m].
        range: ranges of x, y, yaw over elongations from 0 to 12 um, (3,).
        step: least steps of x, y [m] and yaw [rad] by a stack that moves them, at its smallest step, (3,).
        hinge_stiffness: stiffness of each hinge [N.m/rad] (eq 2.3); at level `flexible_hinges` of the profile, and
            `hinge_stiffness_along`, `hinge_stiffness_across` its axis [N/m].
        hinge_angle, hinge_stress: angle from rest [rad] and bending stress [Pa] by hinge, A1 to C3 (eqs 2.4, 2.6); at
            level `flexible_hinges` by neck, D1 to D3 those of the stacks, with the stress of forces.
        allowed_angle, allowed_stress: largest angle of a hinge [rad], and its stress [Pa] (eqs 2.6, 3.6).
        hinge_limit: the hinge that bends most, and the elongations from which on it exceeds the allowable angle.
        inertia, stiffness: inertia and stiffness of the stage without stacks, (3, 3) [kg], [N/m].
        platform_stiffness_free, _bonded, _blocked: at levels `flexible_hinges` and `continuum` the stiffness on the
            pose without stacks, with them, and with elongations held, (3, 3) [N/m, N, N.m/rad].
        natural_frequencies_hz, natural_frequencies_bonded_hz: natural frequencies without and with stacks, ascending,
            (3,) [Hz].
        force: forces of the stacks that hold the elongations, (3,) [N].
        voltage: voltages for these forces, (3,) [V]; not feasible outside 0 to the full voltage.
        elongation_at_voltage: elongations in equilibrium at the argument `voltage`, limited, (3,) [m].
        pose_at_voltage: x, y [m], yaw [rad] in that equilibrium, (3,).
        saturated: 1 for a `voltage` outside 0 to the full voltage, (3,).
        peak_stress, peak_stacks: at level `continuum` the largest von Mises stress of the necks A to D over elongations
            from 0 to 12 um [Pa], and which stacks are at 12 um there, for leg 1.
        piece_mass, mode_at_voltage: mass of the plate [kg]; coordinates of the modes at the argument `voltage` [m].
        mesh, mesh_unknowns, mesh_error: size of the triangles at the necks [m], unknowns, and relative errors of the
            results by a mesh of twice the size.
        reduction_error: largest relative errors of the exported modes, from forces of the stacks to the pose.

    Raises:
        ModelError: as `rrr_stage`; an invalid data sheet; elongations without a pose, a pose out of reach, or both
            given; elongations, a pose or voltages that are not finite.
    """
    _check(level, causality, mesh)
    _check_plate(level, plate)
    for name, values, unit in (
        ("elongation", elongation, "m"),
        ("pose", pose or (), "m, rad"),
        ("voltage", voltage, "V"),
    ):
        _check_finite(name, values, unit)
    if level in ("flexible_hinges", "continuum"):
        _check_stroke(design, elongation)
    if not (np.isfinite(resolution) and resolution > 0):
        raise ModelError(f"rrr_stage: resolution is {resolution:g} m, expected a finite length above 0")
    if pose is not None and any(elongation):
        raise ModelError("rrr_stage: elongation and pose are given; each follows from the other, leave one out")
    if level == "continuum":
        whole = continuum(design, "source", stack, plate, mesh)
        return elastic_numbers(whole, elongation if pose is None else whole.elongations(pose), voltage, resolution)
    if pose is not None:
        J = hinged(design, plate, stack).jacobian if level == "flexible_hinges" else None
        elongation = elongations_at(level, design, pose) if J is None else tuple(np.linalg.solve(J, pose).tolist())
    if level == "jacobian":
        return kinematic_numbers(design.jacobian_at_rest, elongation, resolution)
    if level == "flexible_hinges":
        return hinged_numbers(hinged(design, plate, stack), stack, elongation, voltage, resolution)
    return dynamic_numbers(level, design, stack, elongation, voltage, resolution)


def picture(
    *,
    level: Level = "constant_jacobian",
    dimensions: Dimensions = THESIS_DIMENSIONS,
    stack: Stack = TOKIN,
    plate: Plate = THESIS_PLATE,
    mesh: float | None = None,
    elongation: Triple = (STROKE_IN_USE, 0.0, 0.0),
    pose: Triple | None = None,
) -> Drawing:
    """Return the stage at elongations [m] or a pose [m, m, rad]: at `continuum` mesh, deformation and stress.

    At every other level the drawing shows its links as a mechanism, with the bending stress of its hinges. The
    arguments are those of `analyze` at level `continuum`.

    Raises:
        ModelError: as `analyze`; a mesh at another level; a parameter set of links without dimensions.
    """
    _check(level, "source", mesh)
    _check_finite("elongation", elongation, "m")
    _check_finite("pose", pose or (), "m, rad")
    if level == "continuum":
        whole = continuum(dimensions, "source", stack, plate, mesh)
        return drawing(whole, elongation if pose is None else whole.elongations(pose))
    links = dimensions.links_at_rest
    reached = elongation if pose is None else tuple(inverse(links, pose, "rrr_stage").tolist())
    return links_drawing(links, dimensions.hinge, reached, f"3-RRR stage, kinematics {dimensions.kinematics}")


def moving(*, dimensions: Dimensions = THESIS_DIMENSIONS) -> Moving:
    """Return the links of the stage in a run, as its platform moves; arguments and errors as in `rrr_stage`."""
    return links_in_motion(dimensions.links_at_rest)


def study(
    *,
    objective: Objective = "yaw_range",
    dimensions: Dimensions = THESIS_DIMENSIONS,
    stack: Stack = TOKIN,
    stroke: float = STROKE_IN_USE,
    least_yaw: float | None = None,
    least_frequency: float | None = None,
    largest_stress: float | None = None,
) -> Study:
    """Return the design study of ranges, natural frequencies and peak stress at level `constant_jacobian`.

    Args:
        objective: response that an optimisation maximises; `safety` is the yield strength over the peak stress.
        dimensions: links, hinges and masses, the arguments `kinematics`, `links`, `hinge` and `masses`; an inertia
            varies with its mass.
        stack: data sheet of the stacks.
        stroke: elongations go from 0 to it, each of them [m].
        least_yaw: least range of the yaw that an optimisation keeps [rad] (default: none).
        least_frequency: least natural frequency without stacks that it keeps [Hz] (default: none).
        largest_stress: largest peak stress that it keeps [Pa] (default: none).

    Raises:
        ModelError: an unknown objective or parameter set; dimensions that cannot be built; a stroke or goal that
            is not above 0.
    """
    one_of(objective, get_args(Objective), "rrr_stage: objective")
    goals = Goals(stroke, least_yaw, least_frequency, largest_stress)
    return design_study(dimensions, stack, goals, objective, f"rrr_stage, kinematics {dimensions.kinematics}")


def calibration(*, dimensions: Dimensions = THESIS_DIMENSIONS, turn: float = 0.0) -> Calibration:
    """Return the calibration of the links from measured poses, at level `constant_jacobian`.

    A table has the columns elongation_1 to elongation_3 [m] and some of x, y [m], yaw [rad]; a Jacobian has those rows.

    Args:
        dimensions: the links to start from, of the arguments `kinematics` and `links`.
        turn: angle from the axes of the measurement to those of the stage [deg]; 53.961 in the source.

    Raises:
        ModelError: dimensions that cannot be built; a turn that is not finite.
    """
    if not np.isfinite(turn):
        raise ModelError(f"rrr_stage: turn is {turn:g} deg, expected a finite angle")
    return calibration_of(dimensions, turn)


def _check_plate(level: str, plate: Plate) -> None:
    """Raise `ModelError` for contact, bolts or outline at a level of rigid links, which knows none of them."""
    if level in ("flexible_hinges", "continuum") or plate == THESIS_PLATE:
        return
    changed = [name for name in ("contact", "bolts", "outline") if getattr(plate, name) != getattr(THESIS_PLATE, name)]
    raise ModelError(
        f"rrr_stage: {' and '.join(changed)} {'is' if len(changed) == 1 else 'are'} given, but level {level} has rigid "
        "links on hinges, where it has no effect; take flexible_hinges or continuum"
    )


def _check_stroke(design: Design, elongation: Triple) -> None:
    """Raise `ModelError` for elongations that are not small beside the links, at a level of small motion."""
    farthest = max(map(abs, elongation))
    if not farthest < _SMALL * design.links_at_rest.arm:
        raise ModelError(
            f"rrr_stage: elongation is {farthest:g} m, but the level is one of small motion, below "
            f"{_SMALL * design.links_at_rest.arm:g} m; the stacks reach 0 to 12e-6 m"
        )


def _check(level: str, causality: str, mesh: float | None) -> None:
    """Raise `ModelError` for an unknown level or causality, and for a mesh at a level without one."""
    one_of(level, get_args(Level), "rrr_stage: level")
    one_of(causality, get_args(Causality), "rrr_stage: causality")
    if mesh is not None and level != "continuum":
        raise ModelError(f"rrr_stage: mesh is {mesh:g} m, but level {level} has none; expected level continuum")


def _check_finite(name: str, values: tuple[float, ...], unit: str) -> None:
    """Raise `ModelError` unless an argument has finite numbers."""
    if not np.all(np.isfinite(values)):
        raise ModelError(f"rrr_stage: {name} is {values} {unit}, expected three finite numbers")
