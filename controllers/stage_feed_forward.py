"""Static feed-forward of the 3-RRR stage: forces that hold it at its reference, and the voltages of the stacks.

    force = H(r),    voltage = (H(r) + k r) / alpha

with the stacks' elongations r, H = dP/dl of the stage's energy P, k and alpha of the stacks' line F = alpha V - k l.
Added to PD control it removes the error H(r) / Kp; the voltage alone is open-loop control of the stage. It is a static
map with direct feedthrough; in a sampled system the controller it feeds does the sampling. Voltages above the stacks'
150 V are not clipped here.

Ports of axis i: in `axis[i].reference` [m]; out `axis[i].force` [N], `axis[i].voltage` [V].

Bode plot about rest, reference to force: the stage's static stiffness K0 at all frequencies, without phase.

Source: thesis of 2000 on the 3-RRR stage, ch. 4 for H, eq (5.9) for the line.
"""

import casadi as ca

from hfsa.components import Model
from hfsa.components._mechanics.pzt import TOKIN, Stack
from hfsa.components._mechanics.rrr_design import THESIS_DESIGN, Design
from hfsa.components._mechanics.rrr_facts import STACK_COUPLING, STACK_STIFFNESS, STAGE
from hfsa.components._modelling.facts import Known
from hfsa.controllers._stage_inverse import StageModel, stack_forces

FACTS = {
    **STAGE,
    STACK_STIFFNESS: Known("stack.stiffness"),
    STACK_COUPLING: Known("stack.coupling"),
}


def stage_feed_forward(
    *,
    model: StageModel = "exact",
    design: Design = THESIS_DESIGN,
    stack: Stack = TOKIN,
) -> Model:
    """Return the feed-forward of the three stacks.

    Args:
        model: model of the stage, `exact` or `constant_jacobian`.
        design: design of the stage, the arguments `kinematics`, `links`, `hinge`, `masses`, `jacobian`, `stiffness` and
            `mass`, as in `rrr_stage`.
        stack: data sheet of the stacks; the defaults of the parameters `stack.stiffness` and `stack.coupling`.

    Raises:
        ModelError: an unknown model or parameter set; as `rrr_stage`.
    """
    m = Model("StageFeedForward", "Stiffness feed-forward of the 3-RRR stage")
    line = m.parameter("stack.stiffness", stack.stiffness, "N/m", "Stiffness k of each stack", min=0)
    coupling = m.parameter("stack.coupling", stack.coupling, "N/V", "Force per volt of each stack", min=1e-9)
    reference = m.input("axis[1..3].reference", "m", "Reference elongation", nominal=1e-6)
    force = stack_forces(model, design)(reference, ca.DM.zeros(3), ca.DM.zeros(3))
    m.output("axis[1..3].force", force, "N", "Force that holds the stage at the reference", nominal=100.0)
    voltage = (force + line * reference) / coupling
    m.output("axis[1..3].voltage", voltage, "V", "Voltage that holds the stage at the reference", nominal=100.0)
    return m
