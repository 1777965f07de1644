"""A PZT stack (Tokin AE0505D16) with its amplifier, from commanded voltage to force.

    k = F0 / s0,  alpha = F0 / Vmax,  C_S = C_T - alpha^2 / k            the line ends at F0 (blocked) and s0 (free)
    V_c = command clipped to 0..Vmax

    static       V = V_c,  u = s0 V / Vmax,  F = k (u - l) = F0 (V / Vmax - l / s0),  i = 0
    linear       i = (V_c - V) / R_a clipped to +-I_max,  C_S V' = i - alpha l',  u = d V,  d = s0 / Vmax
    hysteretic   as linear, but u = d V - h + z_1 + z_2
                 h' = A d V' - beta |V'| h - gamma V' |h|                Bouc-Wen
                 z_j' = (c_j d V - z_j) / tau_j                          creep

with the elongation l and the elongation u without a load. In `hysteretic`, d gives a first rise of s0 to Vmax before
creep, d = s0 / (Vmax - A / (beta + gamma) (1 - exp(-(beta + gamma) Vmax))). With A = 0 and c_j = 0 it equals `linear`,
and `linear` at rest equals `static`.

The causality assigns the stack's stiffness k, damping c and mass to the stack or to its load:

    source   the load models all three; the stack outputs its blocking force F_b = k u, and the load acts back on the
             charge only
    force    the stack models k and c, F = k (u - l) - c l' (no c in `static`); the load models the mass m / 3. Held
             over a communication step H, the spring acts as a negative damper k H / 2

Ports: in `command.voltage` [V], `stack.elongation_rate` [m/s] (in `source` it affects the voltage only and may stay
unconnected) and, in `force`, `stack.elongation` [m]; out `stack.blocking_force` (source) or `stack.force` (force) [N],
positive in compression, `stack.voltage` [V], `stack.current` [A], `stack.free_elongation` u [m], in `force` also
`stack.charge` q = C_S V + alpha l [C]. Flags, 0 or 1: `saturated` (command outside 0..Vmax), `current_limited`, and in
`force` `contact_lost`: a stack can only push, and the flag is 1 while F + preload is a pull of more than a millionth of
F0, larger than rounding and solver errors. The equations remain those of a bonded stack.

Bode plot, `linear` within its limits, from the command to the blocking force: alpha up to the corner
1 / (2 pi R_a C_S), 3.94 kHz, then -20 dB per decade and -90 degrees; `static` has alpha at all frequencies, and
`hysteretic` about rest has k d (1 - A + sum c_j / (1 + s tau_j)) in place of alpha. From the elongation to the force,
`linear`: -(k + c s + alpha^2 R_a s / (1 + R_a C_S s)), which is -(k + c s) well below that corner and
-(k C_T / C_S + c s), the value at constant charge, well above it; `static`: -k.

A stack of another size, `hfsa analyze pzt_stack -p stack.blocking_force=2000`, is by default of the same ceramic, with
the scaling of `_mechanics/pzt.py`.

Source: the thesis of 2000 on the 3-RRR stage, eq (5.9) and App. A, for F0, s0, Vmax (it also prints 834 N). k, alpha,
C_S, c and d are derived; capacitance, density, quality factor, amplifier, hysteresis and creep are typical values, not
measured ones.
"""

from dataclasses import dataclass
from typing import Any, Literal

import casadi as ca
import numpy as np

from hfsa.components import Model
from hfsa.components._mechanics.pzt import BLOCKING_FORCE, FULL_VOLTAGE, PULL_FROM_ROUNDING, TOKIN, Stack
from hfsa.components._mechanics.rrr_facts import STACK_COUPLING, STACK_STIFFNESS, STACK_STROKE, STACK_VOLTAGE
from hfsa.components._modelling.facts import Known
from hfsa.components._modelling.model import one_of

FACTS = {
    STACK_STIFFNESS: Known("maximum.force", per="maximum.elongation"),
    STACK_COUPLING: Known("maximum.force", per="maximum.voltage"),
    STACK_STROKE: Known("maximum.elongation"),
    STACK_VOLTAGE: Known("maximum.voltage"),
}

_STROKE, _RATE = 1e-5, 1e-2


@dataclass(frozen=True)
class _Line:
    """The force-elongation line and the clamped capacitance, as symbols."""

    force: ca.SX
    elongation: ca.SX
    voltage: ca.SX
    clamped_capacitance: ca.SX

    @property
    def stiffness(self) -> ca.SX:
        """k, stiffness [N/m]."""
        return self.force / self.elongation

    @property
    def coupling(self) -> ca.SX:
        """alpha, force per volt [N/V = C/m]."""
        return self.force / self.voltage


@dataclass(frozen=True)
class _ElectricalSide:
    """Results of the electrical side: voltage V, current i, free elongation u, and 1 while i is at its limit."""

    voltage: ca.SX
    current: ca.SX | float
    free_elongation: ca.SX
    current_limited: ca.SX | float


def pzt_stack(
    *,
    level: Literal["static", "linear", "hysteretic"] = "linear",
    causality: Literal["source", "force"] = "source",
    stack: Stack = TOKIN,
) -> Model:
    """Return one stack with its amplifier, at rest at the start, with hysteresis and creep at 0.

    Args:
        level: `static` (force-elongation line), `linear` (adds amplifier and capacitance) or `hysteretic` (adds
            Bouc-Wen hysteresis and creep).
        causality: `source` (outputs the blocking force) or `force` (has the elongation as an input).
        stack: data sheet of the stack; the defaults of the parameters `maximum.`, `clamped_capacitance`, `damping`.

    Raises:
        ModelError: an unknown level or causality; an invalid data sheet, see `_mechanics/pzt.py`.
    """
    levels = {"static": _static, "linear": _linear, "hysteretic": _hysteretic}
    causalities = {"source": _source, "force": _force}
    one_of(level, levels, "pzt_stack: level")
    one_of(causality, causalities, "pzt_stack: causality")
    m = Model("PztStack", "PZT stack with its voltage amplifier")
    full = "at the maximum voltage"
    line = _Line(
        m.parameter("maximum.force", stack.blocking_force, "N", f"Force of the blocked stack {full}", min=1e-9),
        m.parameter("maximum.elongation", stack.stroke, "m", f"Elongation of the free stack {full}", min=1e-12),
        m.parameter("maximum.voltage", stack.full_voltage, "V", "Maximum voltage; the minimum is 0", min=1e-9),
        m.parameter("clamped_capacitance", stack.clamped_capacitance, "F", "Capacitance at held elongation", min=1e-15),
    )
    command = m.input("command.voltage", "V", "Commanded voltage", nominal=FULL_VOLTAGE)
    rate = m.input("stack.elongation_rate", "m/s", "Rate of the elongation", nominal=_RATE)
    above, below = command > line.voltage, command < 0
    electrical = levels[level](m, line, ca.if_else(below, 0, ca.if_else(above, line.voltage, command)), rate)
    causalities[causality](m, line, electrical, None if level == "static" else rate, stack)
    m.output("stack.voltage", electrical.voltage, "V", "Voltage across the stack", nominal=FULL_VOLTAGE)
    m.output("stack.current", electrical.current, "A", "Current into the stack", nominal=0.1)
    m.output("stack.free_elongation", electrical.free_elongation, "m", "Elongation without a load", nominal=_STROKE)
    m.output("saturated", ca.logic_or(below, above), "1", "1 while the command is outside 0..maximum.voltage")
    m.output("current_limited", electrical.current_limited, "1", "1 while the amplifier is at its current limit")
    return m


UNITS = {
    "blocking_force": "N",
    "free_stroke": "m",
    "full_voltage": "V",
    "stiffness": "N/m",
    "elongation_per_volt": "m/V",
    "coupling": "N/V",
    "available_force": "N",
    "required_voltage": "V",
    "capacitance": "F",
    "clamped_capacitance": "F",
    "coupling_factor": "1",
    "mass": "kg",
    "effective_mass": "kg",
    "damping": "N.s/m",
    "resonance_hz": "Hz",
}
"""Units of the results of `analyze`, in the notation of `_modelling/parts.py`."""


def analyze(
    *, stack: Stack = TOKIN, voltage: float | None = None, elongation: float = 0.0, force: float = 0.0
) -> dict[str, Any]:
    """Return the properties of a stack, and force and voltage at a point of its static line, in SI units.

    Args:
        stack: data sheet of the stack; missing values are scaled from the Tokin, for the same ceramic.
        voltage: voltage of `available_force` [V]; default the full voltage.
        elongation: elongation of `available_force` and `required_voltage` [m].
        force: force of `required_voltage` [N].

    Returns:
        blocking_force, free_stroke: F0 [N], s0 [m], at `full_voltage`, Vmax [V].
        stiffness: k [N/m].
        elongation_per_volt: d [m/V].
        coupling: alpha [N/V].
        available_force: static force at `voltage` and `elongation` [N].
        required_voltage: static voltage for `force` at `elongation`, not clipped [V].
        capacitance, clamped_capacitance: C_T and C_S [F].
        coupling_factor: k33, alpha / sqrt(k C_T) [1].
        mass, effective_mass: m and m / 3, lumped at the tip [kg].
        damping: c [N.s/m].
        resonance_hz: first resonances of the stack alone [Hz]: `free_free`, `clamped_free` (a continuous rod) and
            `lumped` (k and m / 3).

    Raises:
        ModelError: an invalid data sheet, see `_mechanics/pzt.py`.
    """
    k, alpha, mass = stack.stiffness, stack.coupling, 3 * stack.tip_mass
    return {
        "blocking_force": stack.blocking_force,
        "free_stroke": stack.stroke,
        "full_voltage": stack.full_voltage,
        "stiffness": k,
        "elongation_per_volt": stack.stroke / stack.full_voltage,
        "coupling": alpha,
        "available_force": alpha * (stack.full_voltage if voltage is None else voltage) - k * elongation,
        "required_voltage": (force + k * elongation) / alpha,
        "capacitance": stack.capacitance,
        "clamped_capacitance": stack.clamped_capacitance,
        "coupling_factor": alpha / np.sqrt(k * stack.capacitance),
        "mass": mass,
        "effective_mass": stack.tip_mass,
        "damping": stack.damping,
        "resonance_hz": {
            "free_free": np.sqrt(k / mass) / 2,
            "clamped_free": np.sqrt(k / mass) / 4,
            "lumped": np.sqrt(3 * k / mass) / (2 * np.pi),
        },
    }


def _static(_m: Model, line: _Line, target: ca.SX, _rate: ca.SX) -> _ElectricalSide:
    """Return the electrical side without dynamics: the voltage is the clipped command."""
    return _ElectricalSide(target, 0.0, line.elongation / line.voltage * target, 0.0)


def _linear(m: Model, line: _Line, target: ca.SX, rate: ca.SX) -> _ElectricalSide:
    """Return the electrical side with amplifier and capacitance; u is proportional to the voltage."""
    voltage, current, limited, _ = _electrical(m, line, target, rate)
    return _ElectricalSide(voltage, current, line.elongation / line.voltage * voltage, limited)


def _hysteretic(m: Model, line: _Line, target: ca.SX, rate: ca.SX) -> _ElectricalSide:
    """Return the electrical side as `_linear`, with Bouc-Wen hysteresis and creep in u."""
    voltage, current, limited, slope = _electrical(m, line, target, rate)
    A = m.parameter("hysteresis.amplitude", 0.30, "1", "Bouc-Wen A, 0 for no hysteresis", min=0, max=0.9)
    beta = m.parameter("hysteresis.beta", 0.015, "1/V", "Bouc-Wen beta", min=1e-9)
    gamma = m.parameter("hysteresis.gamma", 0.005, "1/V", "Bouc-Wen gamma", min=0)
    gain = m.parameter("creep[1..2].gain", 0.01, "1", "Creep as a share of the elongation", min=0)
    tau = m.parameter("creep[1..2].time_constant", [0.1, 10.0], "s", "Time constant of the creep", min=1e-6)
    h = m.state("hysteresis.elongation", "m", "Hysteretic part of the elongation, subtracted", nominal=1e-6)
    z = m.state("creep[1..2].elongation", "m", "Creep part of the elongation, added", nominal=1e-7)
    fading = beta + gamma
    d = line.elongation / (line.voltage - A / fading * (1 - ca.exp(-fading * line.voltage)))
    m.der[h] = A * d * slope - beta * ca.fabs(slope) * h - gamma * slope * ca.fabs(h)
    m.der[z] = (gain * d * voltage - z) / tau
    return _ElectricalSide(voltage, current, d * voltage - h + ca.sum1(z), limited)


def _electrical(m: Model, line: _Line, target: ca.SX, rate: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """Declare amplifier and capacitance; return V, i, 1 while i is limited, and V'."""
    resistance = m.parameter("amplifier.resistance", 50.0, "Ohm", "Output resistance of the amplifier", min=1e-3)
    limit = m.parameter("amplifier.current_limit", 0.1, "A", "Largest current of the amplifier", min=0)
    voltage = m.state("voltage", "V", "Voltage across the stack", nominal=FULL_VOLTAGE)
    wanted = (target - voltage) / resistance
    limited = ca.fabs(wanted) > limit
    current = ca.if_else(limited, limit * ca.sign(wanted), wanted)
    slope = (current - line.coupling * rate) / line.clamped_capacitance
    m.der[voltage] = slope
    return voltage, current, limited, slope


def _source(m: Model, line: _Line, electrical: _ElectricalSide, _rate: ca.SX | None, _stack: Stack) -> None:
    """Declare the output of causality `source`: the load models stiffness, damping and mass."""
    force = line.stiffness * electrical.free_elongation
    m.output("stack.blocking_force", force, "N", "Force of the blocked stack", nominal=BLOCKING_FORCE)


def _force(m: Model, line: _Line, electrical: _ElectricalSide, rate: ca.SX | None, stack: Stack) -> None:
    """Declare input and outputs of causality `force`: the stack models stiffness and, if `rate` is given, damping."""
    elongation = m.input("stack.elongation", "m", "Elongation of the stack", nominal=_STROKE)
    preload = m.parameter("preload", 0.0, "N", "Force that presses the load on the stack", min=0, nominal=100.0)
    force = line.stiffness * (electrical.free_elongation - elongation)
    if rate is not None:
        force -= m.parameter("damping", stack.damping, "N.s/m", "Damping along the stack", min=0) * rate
    charge = line.clamped_capacitance * electrical.voltage + line.coupling * elongation
    m.output("stack.force", force, "N", "Force on the load, positive in compression", nominal=BLOCKING_FORCE)
    m.output("stack.charge", charge, "C", "Charge of the stack", nominal=1e-4)
    pulls = force + preload < -PULL_FROM_ROUNDING
    m.output("contact_lost", pulls, "1", "1 while the stack would have to pull")
