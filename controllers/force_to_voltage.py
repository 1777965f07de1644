"""Conversion of commanded forces to voltages of piezo stacks, with compensation of the stacks' stiffness.

    V_i = (Q_i + k (l_i + l_i' T / 2)) / alpha,  clipped to 0..Vmax

evaluated at each tick and held until the next. The term k l cancels the stiffness of the stack, which then acts as an
ideal force actuator. A voltage held for a sample time T acts T / 2 late on average: with l' unconnected, k l acts as a
negative damper k T / 2 along each stack; the term in l' cancels it for motion slower than 1 / T.

Ports of axis i: in `axis[i].force` Q [N], `axis[i].elongation` l [m], `axis[i].elongation_rate` [m/s]; out
`axis[i].command` [V] and `axis[i].saturation`, 1 while the voltage is clipped.

Bode plot to the command, within the limits, from tick to tick: from the force 1 / alpha, from the elongation k / alpha,
from its rate k T / (2 alpha). Between ticks the hold adds sin(pi f T) / (pi f T) and a delay of T / 2.

Source: thesis of 2000 on the 3-RRR stage, eq (5.9).
"""

from hfsa.components import Model, ModelError
from hfsa.components._mechanics.pzt import TOKIN, Stack
from hfsa.components._mechanics.rrr_facts import STACK_COUPLING, STACK_STIFFNESS, STACK_VOLTAGE
from hfsa.components._modelling.facts import Known
from hfsa.controllers._command import clipped

FACTS = {
    STACK_STIFFNESS: Known("stack.stiffness"),
    STACK_COUPLING: Known("stack.coupling"),
    STACK_VOLTAGE: Known("maximum.voltage"),
}


def force_to_voltage(*, axes: int = 3, stack: Stack = TOKIN) -> Model:
    """Return the conversion for a number of stacks.

    Args:
        axes: number of stacks.
        stack: data sheet of the stacks; the defaults of `stack.stiffness`, `stack.coupling` and `maximum.voltage`.

    Raises:
        ModelError: fewer than one stack; an invalid data sheet.
    """
    if axes < 1:
        raise ModelError(f"force_to_voltage: axes is {axes}, expected 1 or more")
    m = Model("ForceToVoltage", "Voltages for commanded forces of piezo stacks")
    sample_time = m.sample_time(50e-6)
    each = f"axis[1..{axes}]"
    stiffness = m.parameter("stack.stiffness", stack.stiffness, "N/m", "Stiffness k of each stack", min=0)
    coupling = m.parameter("stack.coupling", stack.coupling, "N/V", "Force per volt of each stack", min=1e-9)
    highest = m.parameter("maximum.voltage", stack.full_voltage, "V", "Largest voltage; the smallest is 0", min=1e-9)
    force = m.input(f"{each}.force", "N", "Commanded force of the stack", nominal=100.0)
    elongation = m.input(f"{each}.elongation", "m", "Elongation of the stack", nominal=1e-6)
    rate = m.input(f"{each}.elongation_rate", "m/s", "Rate of the elongation", nominal=1e-3)
    ahead = elongation + sample_time / 2 * rate
    command, saturation = clipped((force + stiffness * ahead) / coupling, 0, highest)
    m.sampled_output(f"{each}.command", command, "V", "Voltage of the stack", nominal=100.0)
    m.sampled_output(f"{each}.saturation", saturation, "1", "1 while the voltage is clipped, otherwise 0")
    return m
