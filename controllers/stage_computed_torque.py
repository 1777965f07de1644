"""Computed-torque control (CTC) of the 3-RRR stage: cancellation of its dynamics, with linear error dynamics.

    Q = limit( M(p) a + c(p, l') + D l' + H(p) ),   a_i = r_i'' + Kv_i (r_i' - l_i') + Kp_i (r_i - l_i),   p = l + h l'

with the measured elongations l, their reference r, the terms M, c, H of the model in the controller, its damping
D = beta K0 and K0 = dH/dl(0). If the model is exact, the error e = r - l obeys e'' + Kv e' + Kp e = 0. With Kp = w^2
and Kv = 2 w it is critically damped, and the largest error at the start of a ramp of rate v is v / (exp(1) w).

    continuous    static map with direct feedthrough; h = 0
    sampled       evaluated at each tick and held until the next, a sample time T later; h = T / 2, with `delay` 3 T / 2

A held force acts h late on average, so the model is evaluated at the elongation predicted for that time; evaluated at
l, a ramp would leave an error of K v h / (M Kp). `sampled` converges to `continuous` as T goes to 0, at first order.

Ports of axis i: in `axis[i].reference` [m], `.reference_rate`, `.reference_acceleration`, `.measured`,
`.measured_rate`; out `axis[i].command` [N] and `axis[i].saturation`, 1 while the limit acts. Default gains: those of
w = 2 pi 300 rad/s.

Bode plot about rest, below the limit: measured to command K0 - Kp M0, its rate to command D + h K0 - Kv M0. The same
holds for level `sampled` from tick to tick; between ticks the hold adds sin(pi f T) / (pi f T) and a delay of T / 2.

Source: thesis of 2000 on the 3-RRR stage, eq (5.8), which prints the states in place of their errors.
"""

from collections.abc import Callable

import casadi as ca
import numpy as np

from hfsa.components import Model
from hfsa.components._mechanics.rrr_design import THESIS_DESIGN, Design
from hfsa.components._mechanics.rrr_facts import DAMPING_TIME, STAGE
from hfsa.components._modelling.facts import Known
from hfsa.controllers._command import Level, execution
from hfsa.controllers._stage_inverse import StageModel, stack_forces

FACTS = {**STAGE, DAMPING_TIME: Known("damping_time")}

_BANDWIDTH = 2 * np.pi * 300


def stage_computed_torque(
    *,
    level: Level = "sampled",
    model: StageModel = "exact",
    delay: bool = False,
    design: Design = THESIS_DESIGN,
) -> Model:
    """Return one controller for the three stacks.

    Args:
        level: `continuous` or `sampled`.
        model: model of the stage, `exact` or `constant_jacobian`.
        delay: whether the command is delayed by one sample time; at level `sampled` only.
        design: design of the stage, the arguments `kinematics`, `links`, `hinge`, `masses`, `jacobian`, `stiffness` and
            `mass`, as in `rrr_stage`.

    Raises:
        ModelError: an unknown model, parameter set or level; a delay at level `continuous`; as `rrr_stage`.
    """
    return controller(stack_forces(model, design), level, delay)


def controller(forces: Callable[[ca.SX, ca.SX, ca.SX], ca.SX], level: Level = "sampled", delay: bool = False) -> Model:
    """Return the controller with any inverse dynamics, from elongations, rates and accelerations to forces, (3, 1)."""
    m = Model("StageComputedTorque", "Computed-torque controller of the 3-RRR stage")
    executed = execution(m, "stage_computed_torque", level, 50e-6, delay)
    each = "axis[1..3]"
    kp = m.parameter(f"{each}.proportional_gain", _BANDWIDTH**2, "1/s2", "Gain Kp", min=0, nominal=1e6)
    kv = m.parameter(f"{each}.derivative_gain", 2 * _BANDWIDTH, "1/s", "Gain Kv", min=0, nominal=1e3)
    limit = m.parameter(f"{each}.limit", 1e9, "N", "Largest command either way", min=0, nominal=1.0)
    beta = m.parameter("damping_time", 6.02e-6, "s", "Damping / stiffness of the stage, beta", min=0, nominal=1e-6)
    reference = m.input(f"{each}.reference", "m", "Reference elongation", nominal=1e-6)
    reference_rate = m.input(f"{each}.reference_rate", "m/s", "Rate of the reference", nominal=1e-3)
    reference_acceleration = m.input(f"{each}.reference_acceleration", "m/s2", "Acceleration of the reference")
    measured = m.input(f"{each}.measured", "m", "Measured elongation", nominal=1e-6)
    measured_rate = m.input(f"{each}.measured_rate", "m/s", "Rate of the measured elongation", nominal=1e-3)

    demanded = reference_acceleration + kv * (reference_rate - measured_rate) + kp * (reference - measured)
    ahead = measured + executed.mean_delay * measured_rate
    damping = beta * _rest_stiffness(forces) @ measured_rate
    executed.output_command(each, forces(ahead, measured_rate, demanded) + damping, limit, "N", "Force of the stack")
    return m


def _rest_stiffness(forces: Callable[[ca.SX, ca.SX, ca.SX], ca.SX]) -> ca.DM:
    """Return K0 = dH/dl at rest, shape (3, 3) [N/m]."""
    elongation, still = ca.SX.sym("l", 3), ca.SX.zeros(3)
    return ca.Function("K0", [elongation], [ca.jacobian(forces(elongation, still, still), elongation)])(0)
