"""Rounding noise of FMUs, ours or foreign: a port near 1 rad is integrated to its last digit, in few steps."""

import casadi as ca
import numpy as np
import pytest
from algorithm_groups import MONOLITHIC, MONOLITHIC_DAE
from hypothesis import given, settings
from hypothesis import strategies as st

from hfsa.components import Model
from hfsa.cosim.fmi.co_simulation import StepError, open_instances
from hfsa.cosim.fmi.model_exchange import ModelExchangeInstance
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.masters.monolithic import integrator
from hfsa.cosim.systems.system import Component, Connection, System

pytestmark = pytest.mark.slow

OMEGA, FREQUENCY, RAMP = 2 * np.pi * 100, 17.0, 0.5
ALGORITHMS = pytest.mark.parametrize("algorithm", [MONOLITHIC, MONOLITHIC_DAE])


def source(ramp: str = "sin") -> Model:
    """A sine that sets in from rest, about an offset; 1 - cos makes steps of 1e-16 of a ramp that begins with zero."""
    m = Model("Source", "A sine about an offset")
    offset, amplitude = m.parameter("offset", 0.0, "rad", "Mean"), m.parameter("amplitude", 1e-3, "rad", "Amplitude")
    turn = ca.pi * m.time / RAMP
    ramped = ca.sin(turn / 2) ** 2 if ramp == "sin" else (1 - ca.cos(turn)) / 2
    m.output("angle", offset + amplitude * ramped * ca.sin(2 * ca.pi * FREQUENCY * m.time), "rad", "Angle")
    return m


def plant() -> Model:
    """A vibration that follows an angle, less an offset taken off at once or only inside."""
    m = Model("Plant", "A vibration that follows an angle")
    offset, inner = m.parameter("offset", 0.0, "rad", "Mean"), m.parameter("inner", 0.0, "rad", "Added and taken off")
    angle = m.input("angle", "rad", "Angle")
    x = m.state("x", "rad", "Position", nominal=1e-5)
    v = m.state("v", "rad/s", "Velocity", nominal=1e-3)
    m.der[x] = v
    m.der[v] = OMEGA**2 * ((((angle - offset) + inner) - x) - inner) - 0.02 * OMEGA * v
    m.output("position", x, "rad", "Position")
    return m


def rubbing() -> Model:
    """The same with sticking dry friction, for which no step is short enough."""
    m = Model("Rubbing", "A vibration under dry friction")
    angle = m.input("angle", "rad", "Angle")
    x = m.state("x", "rad", "Position", nominal=1e-5)
    v = m.state("v", "rad/s", "Velocity", start=1.0, nominal=1e-3)
    m.der[x] = v
    m.der[v] = OMEGA**2 * (angle - x) - 1e6 * ca.sign(v)
    m.output("position", x, "rad", "Position")
    return m


@pytest.fixture
def simulated(exported, monkeypatch):
    """Positions at the points of 0.1 s, by the amplitude, and how many steps of the integrator it took."""

    def run(first: Model, second: Model, algorithm: str, amplitude: float, **starts: float) -> tuple[np.ndarray, int]:
        steps, step = [], integrator.Integrator._step
        monkeypatch.setattr(integrator.Integrator, "_step", lambda self, *to: (steps.append(to), step(self, *to))[1])
        files = {"source": exported(first)[2], "plant": exported(second)[2]}
        offset = {"offset": starts["offset"]} if "offset" in starts else {}
        components = [
            Component("source", "x", start={"amplitude": amplitude, **offset}),
            Component("plant", "x", start={**starts, **({"angle": offset["offset"]} if offset else {})}),
        ]
        system = System(components, [Connection("source.angle", "plant.angle")])
        one = make_master(open_instances(files, ModelExchangeInstance), system, algorithm, 1e-3)
        try:
            recording = one.record(["plant.position"], rows=101)
            one.initialize()
            one.advance(100)
            return np.array(recording["plant.position"]) / amplitude, len(steps)
        finally:
            one.close()
            monkeypatch.undo()

    return run


def closed_form() -> np.ndarray:
    """Solution for the amplitude 1, by the sinusoids that make up a sine under a ramp of sin^2."""
    fractions = {2 * np.pi * FREQUENCY + k * np.pi / RAMP: share for k, share in ((0, 0.5), (1, -0.25), (-1, -0.25))}
    decay = 0.01 * OMEGA
    s = -decay + 1j * np.sqrt(OMEGA**2 - decay**2)
    t = np.arange(101) * 1e-3
    found, position, velocity = np.zeros(101), 0.0, 0.0
    for w, share in fractions.items():
        H = share * OMEGA**2 / (OMEGA**2 - w**2 + 2j * decay * w)
        found = found + (H * np.exp(1j * w * t)).imag
        position, velocity = position + H.imag, velocity + (1j * w * H).imag
    free = (-velocity + np.conj(s) * position) / (2j * s.imag)  # takes place and speed of that off at 0 s
    return found + 2 * (free * np.exp(s * t)).real


DIGITS = {MONOLITHIC: 50, MONOLITHIC_DAE: 500}
"""Tolerance in units of the last digit of 1 rad; IDA needs noise far below its tolerance."""


def resolution(algorithm: str, amplitude: float) -> float:
    """Error of a motion of that amplitude through a port near 1 rad, relative to the largest position."""
    return 1e-8 + DIGITS[algorithm] * np.spacing(1.0) / (amplitude * np.abs(closed_form()).max())


def relative(found: np.ndarray, exact: np.ndarray) -> float:
    return float(np.abs(found - exact).max() / np.abs(exact).max())


@ALGORITHMS
@pytest.mark.parametrize("amplitude", [1e-12, 1e-3])
def test_from_zero_every_digit_is_there(simulated, algorithm, amplitude):
    found, steps = simulated(source(), plant(), algorithm, amplitude)
    assert relative(found, closed_form()) < {MONOLITHIC: 1e-10, MONOLITHIC_DAE: 1e-8}[algorithm]
    assert steps < 10_000


@ALGORITHMS
@pytest.mark.parametrize("amplitude", [1e-3, 1e-9, 1e-12])
def test_about_1_rad_it_runs_to_the_last_digit(simulated, algorithm, amplitude):
    """The error is some tens or hundreds of the port's last digit, 2.2e-16 rad, and the steps stay long."""
    found, steps = simulated(source(), plant(), algorithm, amplitude, offset=1.0)
    assert relative(found, closed_form()) < resolution(algorithm, amplitude)
    assert steps < 10_000


@ALGORITHMS
@pytest.mark.parametrize("amplitude", [1e-3, 1e-9])
def test_an_offset_inside_an_fmu_too(simulated, algorithm, amplitude):
    """No port reveals the noise; it is measured along time, and again where it appears later."""
    found, steps = simulated(source(), plant(), algorithm, amplitude, inner=1.0)
    assert relative(found, closed_form()) < resolution(algorithm, amplitude)
    assert steps < 30_000


@ALGORITHMS
def test_a_ramp_that_begins_in_steps(simulated, algorithm):
    found, steps = simulated(source("cos"), plant(), algorithm, 1e-3)
    assert relative(found, closed_form()) < 1e-8
    assert steps < 50_000


@ALGORITHMS
def test_where_it_cannot_go_on_the_coarsest_port_is_named(monkeypatch, simulated, algorithm):
    monkeypatch.setattr(integrator, "MOST_SHORT_STEPS", 2000)
    sentence = (
        r"steps do not lead to .* the fastest mode of the FMUs has .*source\.angle is the coarsest: .* in steps of"
    )
    with pytest.raises(StepError, match=sentence):
        simulated(source(), rubbing(), algorithm, 1e-3)


@given(st.floats(1, 1e5), st.floats(1e-12, 1.0))
@settings(max_examples=10, deadline=None)
def test_a_sine_much_faster_than_the_plant_is_no_noise(ratio, size):
    """A function that is smooth on the shortest line is smooth, however fast compared with the plant."""
    from hfsa.cosim.masters.monolithic.noise import _along_time

    class Swinging:
        """der(x) = w = a sine, `ratio` times as fast as the plant."""

        x, places = np.zeros(1), np.zeros(1, dtype=int)

        def evaluate(self, time: float, _x: np.ndarray) -> np.ndarray:
            self.values = np.array([size * np.sin(ratio * time + 0.3)])
            return self.values.copy()

    noise = _along_time(Swinging(), 0.1, np.zeros(1), 1e-3)  # type: ignore[arg-type]
    assert (noise < 1e-14 * size * max(1.0, ratio)).all()
