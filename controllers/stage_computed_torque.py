"""Computed-torque control (CTC) of the 3-RRR stage: its dynamics cancelled, a linear error left over.

    Q = limit( M(p) a + c(p, l') + D l' + H(p) ),   a_i = r_i'' + Kv_i (r_i' - l_i') + Kp_i (r_i - l_i),   p = l + h l'

with l measured and r the reference of the stacks' elongations, M, c, H those of the model that the controller is built
on, D = beta K0 its damping and K0 = dH/dl(0). Where the model is the stage, e'' + Kv e' + Kp e = 0 is left of the error
e = r - l: with Kp = w^2 and Kv = 2 w a critically damped one, in which the start of a ramp of speed v makes an error of
v / (exp(1) w) at most.

    continuous    at every instant, a map without memory; h = 0
    sampled       evaluated at each tick and held until the next, a sample time T later; h = T / 2, with `delay` 3 T / 2

Held, the force acts h late on average, so the model is taken where the stage will be by then; taken at l, a ramp would
leave an error of K v h / (M Kp). `sampled` tends to `continuous` with T, at first order.

Ports of axis i: in `axis[i].reference` [m], `.reference_rate`, `.reference_acceleration`, `.measured`,
`.measured_rate`; out `axis[i].command` [N] and `axis[i].saturation`, 1 while the limit acts. Default gains: those of
w = 2 pi 300 rad/s.

Bode plot about rest, below the limit: measured to command K0 - Kp M0, its rate to command D + h K0 - Kv M0. So it is at
level `sampled` from tick to tick; between ticks the hold adds sin(pi f T) / (pi f T) and a delay of T / 2.

Source: thesis of 2000 on the 3-RRR stage, eq (5.8), which prints the states in place of their errors.
"""

from collections.abc import Callable

import casadi as ca
import numpy as np

from hfsa.components import Model
from hfsa.components._mechanics.rrr_facts import DAMPING_TIME, KINEMATICS
from hfsa.components._mechanics.rrr_kinematics import LinkSet
from hfsa.components._modelling.facts import Known
from hfsa.controllers._command import Level, execution
from hfsa.controllers._stage_inverse import StageModel, stack_forces

FACTS = {KINEMATICS: Known("kinematics"), DAMPING_TIME: Known("damping_time")}

_BANDWIDTH = 2 * np.pi * 300


def stage_computed_torque(
    *,
    level: Level = "sampled",
    model: StageModel = "exact",
    kinematics: LinkSet = "nominal",
    delay: bool = False,
) -> Model:
    """One controller for the three stacks.

    Args:
        level: `continuous` or `sampled`.
        model: what the controller takes the stage for.
        kinematics: parameter set of the stage's links, `nominal` or `calibrated`.
        delay: whether the command is put out one sample time late; at level `sampled` only.

    Raises:
        ModelError: an unknown model, parameter set or level, a delay at level `continuous`.
    """
    return controller(stack_forces(model, kinematics), level, delay)


def controller(forces: Callable[[ca.SX, ca.SX, ca.SX], ca.SX], level: Level = "sampled", delay: bool = False) -> Model:
    """Return the controller on any inverse dynamics: elongations, their rates and accelerations to forces, (3, 1)."""
    m = Model("StageComputedTorque", "Computed-torque controller of the 3-RRR stage")
    executed = execution(m, "stage_computed_torque", level, 50e-6, delay)
    each = "axis[1..3]"
    kp = m.parameter(f"{each}.proportional_gain", _BANDWIDTH**2, "1/s2", "Gain Kp", min=0, nominal=1e6)
    kv = m.parameter(f"{each}.derivative_gain", 2 * _BANDWIDTH, "1/s", "Gain Kv", min=0, nominal=1e3)
    limit = m.parameter(f"{each}.limit", 1e9, "N", "Largest command either way", min=0, nominal=1.0)
    beta = m.parameter("damping_time", 6.02e-6, "s", "Damping of the stage by its stiffness, beta", min=0, nominal=1e-6)
    reference = m.input(f"{each}.reference", "m", "Reference elongation", nominal=1e-6)
    reference_rate = m.input(f"{each}.reference_rate", "m/s", "Rate of the reference", nominal=1e-3)
    reference_acceleration = m.input(f"{each}.reference_acceleration", "m/s2", "Acceleration of the reference")
    measured = m.input(f"{each}.measured", "m", "Measured elongation", nominal=1e-6)
    measured_rate = m.input(f"{each}.measured_rate", "m/s", "Rate of the measured elongation", nominal=1e-3)

    demanded = reference_acceleration + kv * (reference_rate - measured_rate) + kp * (reference - measured)
    ahead = measured + executed.lateness * measured_rate
    damping = beta * _rest_stiffness(forces) @ measured_rate
    executed.put_out(each, forces(ahead, measured_rate, demanded) + damping, limit, "N", "Force of the stack")
    return m


def _rest_stiffness(forces: Callable[[ca.SX, ca.SX, ca.SX], ca.SX]) -> ca.DM:
    """K0 = dH/dl at rest, shape (3, 3) [N/m]."""
    elongation, still = ca.SX.sym("l", 3), ca.SX.zeros(3)
    return ca.Function("K0", [elongation], [ca.jacobian(forces(elongation, still, still), elongation)])(0)
