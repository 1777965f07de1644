"""The PZT stack: the limits between its levels, energy, hysteresis, creep and flags."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hfsa.components import Model, ModelError
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind
from hfsa.components.pzt_stack import analyze, pzt_stack

NUMBERS = analyze()
K, D, ALPHA, C_S = (NUMBERS[n] for n in ("stiffness", "elongation_per_volt", "coupling", "clamped_capacitance"))
NO_CREEP = {"creep[1].gain": 0.0, "creep[2].gain": 0.0}
LEVELS = pytest.mark.parametrize("level", ["static", "linear", "hysteretic"])


class Evaluated:
    """A stack's own functions at named values; what is not named is at its start."""

    def __init__(self, level: str, causality: str = "force", parameters: dict[str, float] | None = None):
        self.model: Model = pzt_stack(level=level, causality=causality)  # type: ignore[arg-type]
        self.functions = functions(self.model)
        self.values = parameters or {}
        self.states = [q.name for q in self.model.of(Kind.STATE)]

    def _column(self, kind: Kind, values: dict[str, float]) -> list[float]:
        return [values.get(q.name, q.start) for q in self.model.of(kind)]

    def _call(self, function, kind: Kind, values: dict[str, float]) -> dict[str, float]:
        values = {**self.values, **values}
        point = [self._column(k, values) for k in (Kind.STATE, Kind.INPUT, Kind.PARAMETER)]
        result = np.array(function(0.0, point[0], [], point[1], point[2])).ravel()
        return dict(zip([q.name for q in self.model.of(kind)], result, strict=True))

    def out(self, **values: float) -> dict[str, float]:
        return self._call(self.functions.out, Kind.OUTPUT, values)

    def der(self, **values: float) -> dict[str, float]:
        return self._call(self.functions.rhs, Kind.STATE, values)

    def run(self, command, times: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
        """States after the command voltage `command(t)`, elongation held at 0, shape (states, times)."""
        parameters = self._column(Kind.PARAMETER, self.values)
        at = [q.name for q in self.model.of(Kind.INPUT)].index("command.voltage")
        unit = np.eye(len(self.model.of(Kind.INPUT)))[at]

        def rhs(t, x):
            return np.array(self.functions.rhs(t, x, [], unit * command(t), parameters)).ravel()

        x = np.zeros(len(self.states)) if start is None else start
        atol = 1e-9 * np.array([q.nominal for q in self.model.of(Kind.STATE)])
        done = solve_ivp(rhs, times[[0, -1]], x, "LSODA", times, rtol=1e-9, atol=atol, max_step=np.ptp(times) / 50)
        assert done.success, done.message
        return done.y


def at(**values: float) -> dict[str, float]:
    """Values by their names in the model: `stack_elongation` for `stack.elongation`."""
    return {name.replace("_", ".", 1): value for name, value in values.items()}


def response(stack: Model, omega: float, output: str, source: str) -> complex:
    system = linearize(stack)
    row, column = system.output_labels.index(output), system.input_labels.index(source)
    return complex(np.atleast_2d(system(1j * omega))[row, column])


# Line -----------------------------------------------------------------------------------------------------------------


def test_required_voltage_gives_the_wanted_force():
    wanted = analyze(force=123.0, elongation=5e-6)["required_voltage"]
    found = Evaluated("static").out(**at(command_voltage=wanted, stack_elongation=5e-6))
    assert found["stack.force"] == pytest.approx(123.0, rel=1e-13)


# Levels ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("voltage", [0.0, 37.0, 75.0, 150.0])
@pytest.mark.parametrize("elongation", [0.0, 7e-6, 16e-6])
def test_static_is_the_line_and_linear_and_hysteretic_at_rest_are_static(voltage, elongation):
    """With hysteresis and creep off the dynamic levels rest on F = F0 (V / Vmax - l / s0)."""
    values = at(command_voltage=voltage, stack_elongation=elongation)
    line = 833.0 * (voltage / 150.0 - elongation / 16e-6)
    off = {"hysteresis.amplitude": 0.0, **NO_CREEP}
    for level, parameters in (("static", None), ("linear", None), ("hysteretic", off)):
        stack = Evaluated(level, parameters=parameters)
        found = stack.out(voltage=voltage, **values)
        assert found["stack.force"] == pytest.approx(line, abs=1e-10)
        assert found["stack.charge"] == pytest.approx(C_S * voltage + ALPHA * elongation, abs=1e-18)
        assert found["stack.current"] == 0
        assert not any(stack.der(voltage=voltage, **values).values())


def test_hysteretic_with_hysteresis_and_creep_off_is_linear_in_motion_too():
    values = {"voltage": 60.0, **at(command_voltage=62.0, stack_elongation=3e-6, stack_elongation_rate=0.02)}
    plain = Evaluated("linear")
    off = Evaluated("hysteretic", parameters={"hysteresis.amplitude": 0.0, **NO_CREEP})
    assert off.out(**values) == pytest.approx(plain.out(**values), rel=1e-14)
    assert off.der(**values) == pytest.approx({**plain.der(**values), **dict.fromkeys(off.states[1:], 0.0)}, rel=1e-14)


@LEVELS
def test_force_is_the_blocked_force_less_what_source_leaves_to_the_load(level):
    moving = at(command_voltage=82.0, stack_elongation_rate=0.03)
    source = Evaluated(level, "source").out(voltage=80.0, **moving)
    force = Evaluated(level, "force").out(voltage=80.0, **moving, **at(stack_elongation=4e-6))
    damping = 0.0 if level == "static" else NUMBERS["damping"]
    assert force["stack.force"] == pytest.approx(source["stack.blocking_force"] - K * 4e-6 - damping * 0.03, rel=1e-13)
    for name in ("stack.voltage", "stack.current", "stack.free_elongation", "saturated", "current_limited"):
        assert force[name] == source[name]


@LEVELS
@pytest.mark.parametrize("causality", ["source", "force"])
def test_without_a_voltage_rest_stays_rest(level, causality):
    stack = Evaluated(level, causality)
    assert not any(stack.der().values())
    assert not any(stack.out().values())


def test_linear_tends_to_static_with_the_square_of_the_frequency():
    """|H / alpha| - 1 -> -(omega R_a C_S)^2 / 2."""
    stack = pzt_stack(level="linear")
    for omega in (10.0, 100.0, 1000.0):
        defect = 1 - abs(response(stack, omega, "stack/blocking_force", "command/voltage")) / ALPHA
        assert defect == pytest.approx((omega * 50 * C_S) ** 2 / 2, rel=2e-3, abs=1e-12)


# Two-port -------------------------------------------------------------------------------------------------------------


def test_power_of_the_ports_is_stored_or_heats_the_damper():
    """V i - F l' = d/dt (C_S V^2 / 2 + k l^2 / 2) + c l'^2 at any state, the current limited or not."""
    rng = np.random.default_rng(4)
    stack = Evaluated("linear")
    for _ in range(50):
        voltage, command, elongation, rate = rng.uniform([0, 0, -5e-6, -0.1], [150, 150, 16e-6, 0.1])
        values = at(command_voltage=command, stack_elongation=elongation, stack_elongation_rate=rate)
        out, slope = stack.out(voltage=voltage, **values), stack.der(voltage=voltage, **values)["voltage"]
        ports = voltage * out["stack.current"] - out["stack.force"] * rate
        stored = C_S * voltage * slope + K * elongation * rate
        assert ports == pytest.approx(stored + NUMBERS["damping"] * rate**2, rel=1e-11, abs=1e-11)


def test_the_charge_is_the_integral_of_the_current():
    """The balance q' = C_S V' + alpha l' = i: no charge is lost whatever the stack does mechanically."""
    stack = Evaluated("linear")
    values = {"voltage": 20.0, **at(command_voltage=23.0, stack_elongation_rate=-0.04)}
    assert C_S * stack.der(**values)["voltage"] - ALPHA * 0.04 == pytest.approx(
        stack.out(**values)["stack.current"], rel=1e-12
    )


@pytest.mark.parametrize("frequency", [10.0, 1000.0, 3941.4, 1e5])
def test_bode_sentence_of_the_command(frequency):
    """Low pass of gain alpha and corner 1 / (2 pi R_a C_S); static is flat, hysteretic loses A and creeps on."""
    omega, corner = 2 * np.pi * frequency, 1 / (2 * np.pi * 50 * C_S)
    assert corner == pytest.approx(3.94e3, abs=5)
    low_pass = 1 / (1 + 1j * frequency / corner)
    d = 16e-6 / (150 - 0.30 / 0.02 * (1 - np.exp(-0.02 * 150)))
    creeping = 1 - 0.30 + sum(0.01 / (1 + 1j * omega * tau) for tau in (0.1, 10.0))
    expected = {"static": ALPHA, "linear": ALPHA * low_pass, "hysteretic": K * d * creeping * low_pass}
    for level, gain in expected.items():
        found = response(pzt_stack(level=level), omega, "stack/blocking_force", "command/voltage")  # type: ignore[arg-type]
        assert found == pytest.approx(gain, rel=1e-12)


@pytest.mark.parametrize("frequency", [1.0, 1000.0, 3941.4, 1e7])
def test_bode_sentence_of_the_elongation(frequency):
    """The stack is k and c at low frequency and, its charge held, stiffer by C_T / C_S at high frequency."""
    s, damping = 2j * np.pi * frequency, NUMBERS["damping"]
    stack = pzt_stack(causality="force")
    by_elongation, by_rate = (
        response(stack, abs(s), "stack/force", f"stack/{name}") for name in ("elongation", "elongation_rate")
    )
    electrical = by_elongation + s * by_rate + K + damping * s
    assert electrical == pytest.approx(
        -(ALPHA**2) * 50 * s / (1 + 50 * C_S * s), rel=1e-9, abs=1e-12 * abs(damping * s)
    )
    if frequency in (1.0, 1e7):
        stiffer = 0 if frequency == 1.0 else K * NUMBERS["capacitance"] / C_S - K
        assert electrical == pytest.approx(-stiffer, abs=1e-3 * K)
    assert response(pzt_stack(level="static", causality="force"), abs(s), "stack/force", "stack/elongation") == -K


def test_the_amplifier_charges_at_its_current_limit_then_settles():
    """From 0 to 150 V: V = I_max t / C_S until R_a I_max is left, then exponentially."""
    stack = Evaluated("linear")
    begin = stack.out(**at(command_voltage=150.0))
    assert (begin["stack.current"], begin["current_limited"]) == (0.1, 1.0)
    until = C_S * 145.0 / 0.1
    times = np.array([0.0, 0.5e-3, 1e-3, until, until + 50 * C_S])
    voltage = stack.run(lambda _: 150.0, times)[0]
    assert voltage[:4] == pytest.approx(0.1 * times[:4] / C_S, rel=1e-6)
    assert voltage[4] == pytest.approx(150 - 5 * np.exp(-1), rel=1e-6)
    assert stack.out(voltage=voltage[4], **at(command_voltage=150.0))["current_limited"] == 0
    back = stack.out(voltage=150.0)
    assert (back["stack.current"], back["current_limited"]) == (-0.1, 1.0)


# Hysteresis and creep -------------------------------------------------------------------------------------------------


def ramps(stack: Evaluated, corners: list[float]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Voltage and free elongation along straight ramps of 1 s between the corners [V]."""
    state, passes = None, []
    times = np.linspace(0, 1, 401)
    for begin, end in pairwise(corners):
        states = stack.run(lambda t, a=begin, b=end: a + (b - a) * t, times, state)
        state = states[:, -1]
        values = [stack.out(**dict(zip(stack.states, column, strict=True))) for column in states.T]
        passes.append(tuple(np.array([v[n] for v in values]) for n in ("stack.voltage", "stack.free_elongation")))
    return passes


def loop_width(rise: tuple[np.ndarray, np.ndarray], fall: tuple[np.ndarray, np.ndarray]) -> float:
    """Width of a loop at 75 V over the stroke of its rise."""
    (up_voltage, up), (down_voltage, down) = rise, fall
    width = np.interp(75.0, down_voltage[::-1], down[::-1]) - np.interp(75.0, up_voltage, up)
    return width / (up[-1] - up[0])


def test_first_rise_and_loop_width_are_the_printed_ones():
    """Bouc-Wen integrated: 16.00 um at 150 V; the first loop from 0 to 150 V and back after that is 12.98 % wide.

    The loop goes on to close by itself, at 12.97 %.
    """
    passes = ramps(Evaluated("hysteretic", parameters=NO_CREEP), [0.0, *[150.0, 0.0] * 4])
    assert passes[0][1][-1] == pytest.approx(16.00e-6, abs=5e-9)
    widths = [loop_width(rise, fall) for rise, fall in zip(passes[::2], passes[1::2], strict=True)]
    assert widths[1] == pytest.approx(0.1298, abs=5e-5)
    assert widths[3] == pytest.approx(0.12969, abs=1e-5)


def test_gain_of_the_hysteretic_stack_is_rescaled_to_the_printed_one():
    found = Evaluated("hysteretic").out(voltage=1.0)["stack.free_elongation"]
    assert found == pytest.approx(0.117866e-6, abs=5e-13)


def test_hysteresis_is_lossy_and_independent_of_the_rate():
    """dh/dV does not depend on the size of V', only on its sign."""
    stack = Evaluated("hysteretic")
    here = {"voltage": 70.0, "hysteresis.elongation": 1e-6}
    slopes = []
    for command in (70.1, 73.0, 69.9, 67.0):
        der = stack.der(**here, **at(command_voltage=command))
        slopes.append(der["hysteresis.elongation"] / der["voltage"])
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-12)
    assert slopes[2] == pytest.approx(slopes[3], rel=1e-12)
    assert slopes[2] > slopes[0] > 0


def test_creep_adds_its_share_at_its_time_constants():
    """At a held voltage each term goes as c_j d V (1 - exp(-t / tau_j)), without hysteresis."""
    stack = Evaluated("hysteretic", parameters={"hysteresis.amplitude": 0.0})
    times = np.array([0.0, 0.1, 1.0, 10.0, 60.0])
    creep = stack.run(lambda _: 100.0, times, np.array([100.0, 0.0, 0.0, 0.0]))[-2:]
    final = 0.01 * D * 100.0
    for z, tau in zip(creep, (0.1, 10.0), strict=True):
        assert z == pytest.approx(final * (1 - np.exp(-times / tau)), rel=1e-5, abs=1e-5 * final)


# Flags and bad input --------------------------------------------------------------------------------------------------


@LEVELS
@pytest.mark.parametrize(
    ("command", "clipped", "flag"), [(-1.0, 0.0, 1), (0.0, 0.0, 0), (150.0, 150.0, 0), (151.0, 150.0, 1)]
)
def test_a_command_outside_the_range_saturates_and_says_so(level, command, clipped, flag):
    stack = Evaluated(level)
    found = stack.out(voltage=clipped, **at(command_voltage=command))
    assert found["saturated"] == flag
    assert found["stack.voltage"] == clipped
    assert found["stack.current"] == 0


@LEVELS
def test_a_stack_that_would_have_to_pull_says_so(level):
    """At 75 V the line crosses zero at 8 um; a preload moves that to where F = -preload."""
    for preload, limit in ((0.0, 8e-6), (K * 1e-6, 9e-6)):
        stack = Evaluated(level, parameters={"preload": preload, "hysteresis.amplitude": 0.0})
        for elongation, lost in ((limit - 1e-9, 0), (limit + 1e-9, 1)):
            values = at(command_voltage=75.0, stack_elongation=elongation)
            assert stack.out(voltage=75.0, **values)["contact_lost"] == lost


def test_unknown_level_and_causality():
    with pytest.raises(ModelError, match="level is 'histeretic'; did you mean hysteretic"):
        pzt_stack(level="histeretic")  # type: ignore[arg-type]
    with pytest.raises(ModelError, match="causality is 'forces'; did you mean force"):
        pzt_stack(causality="forces")  # type: ignore[arg-type]
