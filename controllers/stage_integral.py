"""Sampled integral control of the 3-RRR stage by voltage, the usual control of such stages in practice.

    V_i(n) = clip( feed_forward_i + z_i(n) + k_i T (r_i - l_i) ),   z_i(n + 1) = V_i(n) - feed_forward_i

clipped to 0..Vmax. The integral z is updated with the clipped voltage, so it does not wind up at a limit. Constant
errors vanish, those of hysteresis and creep included; the error of a ramp is its rate / the crossover frequency.

The static gain of the stage is alpha / (k + K) on each axis. The crossover frequency is therefore
w = k_i alpha / (k + K), and the loop is stable below 2 zeta w_n of the mode with bonded stacks, 114 rad/s at 1 % and
905 Hz; the default gain has a crossover of 30 rad/s.

Ports of axis i: in `axis[i].reference`, `.measured` [m], `.feed_forward` [V]; out `axis[i].command` [V] and
`axis[i].saturation`, 1 while the voltage is clipped.

Bode plot, measured to command within the limits, from tick to tick: -k_i T / (1 - exp(-i w T)), an integrator, -20 dB
per decade and +90 degrees where w T is small.
"""

from hfsa.components import Model
from hfsa.components._mechanics.pzt import TOKIN, Stack
from hfsa.components._mechanics.rrr_facts import STACK_VOLTAGE
from hfsa.components._modelling.facts import Known
from hfsa.controllers._command import clipped

FACTS = {STACK_VOLTAGE: Known("maximum.voltage")}


def stage_integral(*, stack: Stack = TOKIN) -> Model:
    """Return one controller for the three stacks.

    Args:
        stack: data sheet of the stacks; its full voltage is the default of `maximum.voltage`.

    Raises:
        ModelError: an invalid data sheet.
    """
    m = Model("StageIntegral", "Sampled integral controller of the 3-RRR stage")
    sample_time = m.sample_time(50e-6)
    each = "axis[1..3]"
    gain = m.parameter(f"{each}.integral_gain", 4.3e8, "V/(m.s)", "Integral gain", min=0, nominal=1e8)
    highest = m.parameter("maximum.voltage", stack.full_voltage, "V", "Largest voltage; the smallest is 0", min=1e-9)
    reference = m.input(f"{each}.reference", "m", "Reference elongation", nominal=1e-6)
    measured = m.input(f"{each}.measured", "m", "Measured elongation", nominal=1e-6)
    feed_forward = m.input(f"{each}.feed_forward", "V", "Feed-forward voltage", nominal=100.0)
    integral = m.sampled_state(f"{each}.integral", "V", "Integral part of the voltage", nominal=100.0)
    wanted = feed_forward + integral + gain * sample_time * (reference - measured)
    command, saturation = clipped(wanted, 0, highest)
    m.next[integral] = command - feed_forward
    m.sampled_output(f"{each}.command", command, "V", "Voltage of the stack", nominal=100.0)
    m.sampled_output(f"{each}.saturation", saturation, "1", "1 while the voltage is clipped, otherwise 0")
    return m
