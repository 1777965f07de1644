"""The 3-RRR stage under the source's extreme gains: a ramp of 3 um/s for 10 us, with ideal forces.

    ctc   Kp = 5e16 1/s2, Kv = 6e8 1/s         poles at 16 and 80 MHz, on a stage of 0.5 kHz
    pd    Kp = 1e17 N/m,  Kv = 1e7 N.s/m       the most damped of table 5.1, at 32 and 78 MHz

The ramp begins at full speed: the initial force on each stack is 745 N (`ctc`), 30 N (`pd`), and its tracking error is
of the order of femtometres. A command held between ticks is stable below

    ctc   T < min(2 / Kv, 2 Kv / Kp)           3.33 ns
    pd    T < min(2 m / Kv, 2 Kv / Kp)         0.2 ns, m = 0.414 kg of the yaw, which the ramp moves

and the default sample time is 0.3 of that. The other gains of table 5.1 have limits from 2 Kv / Kp = 2e-16 s, or none
with Kv = 0: one second takes more than 1e12 steps, so that they are refused. `hfsa analyze stage_closed_loop` computes
their closed loop in continuous time: with Kv > 0, it settles.

The communication step equals the sample time and alone determines the accuracy: the error is 4e-15 m, and the tolerance
of the stage's solver 1e-14 m. The solver takes each step at once; as the force is constant, its error is of sixth order
in the motion of the stage within a nanosecond, (1e-5)^6, far below rounding. The error r - l has nine digits: it is the
difference of numbers up to 3e-11 m, which double precision resolves to 4e-27 m. The level `exact` computes l from
positions on links of a centimetre, resolved to 1e-18 m: its error has four digits, and Kp amplifies the rest as noise.

With `execution` `continuous` the controller acts at every instant, and the stage integrates its linearised response
(`linearized_feedback`): any gains are possible with steps of 1 us, and the impact has decayed after the first step.
"""

import math
from typing import Literal

from hfsa.cosim.scenes._motion import MotionFile, end_of, is_file
from hfsa.cosim.scenes._scale import ELONGATION, FORCE
from hfsa.cosim.scenes._stage import THESIS, Stage
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import AUTO, Scene
from hfsa.cosim.systems.system import Component, Connection, System

_AXES, _STACKS = "axis[1..3]", "stack[1..3]"
_YAW_MASS = {"nominal": 0.41401, "calibrated": 0.23113}
"""Modal mass of the yaw [kg], the smallest of the stage, by parameter set of its links."""
_SHARE = 0.3
"""Default sample time relative to the stable limit."""
_SHORTEST = 1e-12
"""Shortest sample time of a part [s]."""
_STEP = 1e-6
"""Communication step under a continuous controller [s]."""
_LONG = 10e-6
"""Stop time [s], rounded to steps."""
_GAINS = {"ctc": (5e16, 6e8), "pd": (1e17, 1e7)}
_ORDERS = {"ctc": ("", "_rate", "_acceleration"), "pd": ("", "_rate")}


def stage_extremes(
    *,
    law: Literal["ctc", "pd"] = "ctc",
    proportional_gain: float | None = None,
    derivative_gain: float | None = None,
    sample_time: float | None = None,
    execution: Literal["sampled", "continuous"] = "sampled",
    rate: float = 3e-6,
    stage: Literal["constant_jacobian", "exact"] = "constant_jacobian",
    damping_time: float = 0.0,
    machine: Stage = THESIS,
    motion: Literal["ramp"] | MotionFile = "ramp",
) -> Scene:
    """Return the scene: tracking errors and forces of the stage on a ramp.

    Args:
        law: control law; the model of `ctc` is the stage itself.
        proportional_gain: Kp [1/s2] (ctc), [N/m] (pd) (default: that of the law).
        derivative_gain: Kv [1/s] (ctc), [N.s/m] (pd) (default: that of the law).
        sample_time: sample time of the controller, and communication step [s] (default: 0.3 of the stable limit).
        execution: execution of the controller, `sampled` or `continuous`.
        rate: rate of the ramp [m/s].
        stage: level of the stage, and of the model of computed torque.
        damping_time: damping of the stage per stiffness [s], also in the model; the published stage has none.
        machine: design of the stage, also in models of it: the arguments `kinematics`, `links`, `hinge`, `masses`,
            `jacobian`, `stiffness` and `mass` (`_stage.py`).
        motion: `ramp`, or the path of a CSV file as in `stage_tracking`.

    Raises:
        StructureError: for negative gains; without a sample time, for gains that need a shorter one than any part
            supports, and for pd on another stage than the published ones; for a sample time of a continuous controller.
    """
    from_file = is_file(motion, "stage_extremes", ("ramp",))
    kp, kv = (
        own if given is None else given
        for own, given in zip(_GAINS[law], (proportional_gain, derivative_gain), strict=True)
    )
    for name, gain in (("proportional_gain", kp), ("derivative_gain", kv)):
        if not 0 <= gain < math.inf:
            raise StructureError(f"stage_extremes: {name} is {gain:g}, expected 0 or more")
    if execution == "continuous":
        if sample_time is not None:
            raise StructureError("stage_extremes: a continuous controller has no sample_time; the step is --step")
        step, ticking = _STEP, {}
    else:
        step = _sample_time(law, kp, kv, machine) if sample_time is None else sample_time
        ticking = {"sample_time": step}
    damping = {"damping_time": damping_time}
    part, arguments, known = {
        "ctc": ("stage_computed_torque", {"model": stage, **machine.dynamic}, damping),
        "pd": ("pd", {"axes": 3, "unit": "m", "effort": "N"}, {}),
    }[law]
    impact = kv * abs(rate) * (_yaw_mass(machine) if law == "ctc" else 1.0)
    gains = {f"{_AXES}.proportional_gain": kp, f"{_AXES}.derivative_gain": kv}
    components = [
        Component("reference", "stage_path", None, {"motion": motion, **machine.kinematic})
        if from_file
        else Component("reference", "stage_reference", None, {"motion": "ramp"}, {"rate": rate}),
        Component("tracking", "tracking_error", None, {"axes": 3, "unit": "m"}),
        Component("controller", part, execution, arguments, {**ticking, **gains, **known}),
        Component("stage", "rrr_stage", stage, {"causality": "force", **machine.dynamic}, damping),
    ]
    return Scene(
        System(components, _connections(law)),
        inputs=[],
        outputs=[f"tracking.{_AXES}.error", f"controller.{_AXES}.command", f"stage.{_STACKS}.elongation"],
        band=(1.0, 1000.0),
        amplitude={"m": 1e-15},
        step_size=step,
        stop_time=max(round((end_of(motion) if from_file else _LONG) / step), 1) * step,
        algorithm=AUTO if execution == "sampled" else "linearized_feedback",
        scale={
            f"tracking.{_AXES}.error": ELONGATION,
            f"controller.{_AXES}.command": max(FORCE, impact),
            f"stage.{_STACKS}.elongation": ELONGATION,
        },
    )


def _yaw_mass(machine: Stage) -> float:
    """Return the modal mass of the yaw by the parameter set of the links, of a set of one's own the nominal one."""
    return _YAW_MASS[machine.kinematics if isinstance(machine.kinematics, str) else "nominal"]


def _sample_time(law: str, kp: float, kv: float, machine: Stage) -> float:
    """Return a round sample time well below the limit; `StructureError` where it is too short or not known."""
    if law == "pd" and not machine.has_published_inertia:
        raise StructureError(
            "stage_extremes: the stable sample time of pd is known for the published links and masses only; give a "
            "sample_time below 2 m / Kv, m the least eigenvalue of inertia in `hfsa analyze rrr_stage`"
        )
    mass = 1.0 if law == "ctc" else _yaw_mass(machine)
    limit = min(2 * kv / kp if kp else math.inf, 2 * mass / kv if kv else math.inf)
    if kv == 0 or _SHARE * limit < _SHORTEST:
        reason = f"is stable below {limit:g} s only" if kv else "is undamped, and unstable at any sample time"
        raise StructureError(
            f"stage_extremes: {law} with gains of {kp:g} and {kv:g} {reason}, and no part has a sample time below "
            f"{_SHORTEST:g} s. `hfsa analyze stage_closed_loop` computes their closed loop; to simulate them, give a "
            "sample_time"
        )
    return float(f"{_SHARE * limit:.0e}")


def _connections(law: str) -> list[Connection]:
    """Return the connections: elongations to controller and tracking error, forces to the stage."""
    return [
        *(Connection(f"reference.{_STACKS}.elongation{o}", f"controller.{_AXES}.reference{o}") for o in _ORDERS[law]),
        *(Connection(f"stage.{_STACKS}.elongation{o}", f"controller.{_AXES}.measured{o}") for o in ("", "_rate")),
        Connection(f"controller.{_AXES}.command", f"stage.{_STACKS}.force"),
        Connection(f"reference.{_STACKS}.elongation", f"tracking.{_AXES}.reference"),
        Connection(f"stage.{_STACKS}.elongation", f"tracking.{_AXES}.measured"),
    ]
