"""Step limits against closed forms, and against simulations on either side of each limit.

A mass of 1 kg, q'' = u, solved exactly, under the memoryless law u = -Kp q - Kv q', with a step of H:

    wiring                                   stable up to
    u held, from q and q' of the same point  min(2 / Kv, 2 Kv / Kp)          3.333 ns: gauss_seidel and jacobi
    u a step late                            0.9222 / Kv for this Kp / Kv^2  1.537 ns: jacobi_plain
    u two steps late                         by its polynomial               0.938 ns: jacobi_plain, relayed
    u on a line through the last points      by its polynomial               1.686 ns: gauss_seidel_linear
    u on a line to where it ends             sqrt(12 / Kp)                   15.49 ns: quasi_newton

As values are exchanged in feedthrough order, a law without memory is never late under `jacobi`: its limit is that of
`gauss_seidel`, in whatever order the two step. Who fetches all outputs before setting any input pays a step for each
part on the way that has no memory, so that a relay between plant and law, both directions delayed, costs one more.
"""

import numpy as np
import pytest
from algorithm_groups import HELD
from mass_and_law import KP, KV, law, plant

from hfsa.components import Model
from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.masters.master import Master
from hfsa.cosim.systems.system import Component, Connection, System

HELD_LIMIT, LATE_LIMIT, TWICE_LATE_LIMIT, LINE_LIMIT = 3.333e-9, 1.537e-9, 0.938e-9, 1.686e-9
IMPLICIT_LIMIT = np.sqrt(12 / KP)
K, C = 1e4, 2.0
LIMITS = {
    "gauss_seidel": HELD_LIMIT,
    "jacobi": HELD_LIMIT,
    "jacobi_plain": LATE_LIMIT,
    "gauss_seidel_linear": LINE_LIMIT,
    "jacobi_linear": LINE_LIMIT,
    "fixed_point": IMPLICIT_LIMIT,
    "quasi_newton": IMPLICIT_LIMIT,
}
each_algorithm = pytest.mark.parametrize("algorithm", LIMITS)


def relay() -> Model:
    """A component whose output equals its input."""
    m = Model("Relay", "Relay")
    m.output("out.position", m.input("position", "m", "Position"), "m", "Position")
    m.output("out.velocity", m.input("velocity", "m/s", "Velocity"), "m/s", "Velocity")
    return m


@pytest.fixture(scope="module")
def limit_files(exported):
    """FMUs by component name."""
    makers = {"plant": plant, "law": law, "relay": relay}
    return {name: exported(make())[2] for name, make in makers.items()}


@pytest.fixture
def wired(limit_files, opened):
    """Return the system and the instances of components in their order; start values by component."""

    def make(*names: str, **starts: dict[str, float]):
        sensed = "relay.out" if "relay" in names else "plant"
        connections = [Connection("law.force", "plant.force")]
        for signal in ("position", "velocity"):
            connections.append(Connection(f"{sensed}.{signal}", f"law.{signal}"))
            if "relay" in names:
                connections.append(Connection(f"plant.{signal}", f"relay.{signal}"))
        system = System([Component(name, "x", start=starts.get(name, {})) for name in names], connections)
        return system, opened({name: limit_files[name] for name in names})

    return make


def assert_simulated(coupled: CoupledStep, system, instances, algorithm: str, limit: float) -> None:
    """At 0.98 and 1.02 of a limit, a mass let go shrinks and grows at the rate of the slowest mode, within 2 %.

    Seen in the position over 40 steps, early and 400 steps later, when the other modes have died away.
    """
    for factor in (0.98, 1.02):
        step_size = factor * limit
        expected = coupled.over(step_size).modes[0].rate * step_size
        assert (expected > 0) == (factor > 1)
        master = make_master(instances, system, algorithm, step_size)
        recording = master.record(["plant.q"], 641)
        master.initialize(starts={"plant.q": 1.0})
        master.advance(640)
        early, late = (np.linalg.norm(recording["plant.q"][k : k + 40]) for k in (200, 600))
        assert np.log(late / early) / 400 == pytest.approx(expected, rel=0.02)


# Commanded acceleration -----------------------------------------------------------------------------------------------


@each_algorithm
@pytest.mark.parametrize("order", [("plant", "law"), ("law", "plant")], ids="-".join)
def test_limit(wired, algorithm, order):
    system, instances = wired(*order)
    (limit,) = CoupledStep(system, instances, algorithm).stability_limits(0.3e-9, 50e-9, points=30)
    assert limit == pytest.approx(LIMITS[algorithm], rel=1e-3)


def test_held_is_the_closed_form():
    assert min(2 / KV, 2 * KV / KP) == pytest.approx(HELD_LIMIT, rel=1e-3)


@pytest.mark.parametrize("algorithm", [name for name in LIMITS if name != "fixed_point"])
def test_limit_in_simulation(wired, algorithm):
    system, instances = wired("plant", "law")
    assert_simulated(CoupledStep(system, instances, algorithm), system, instances, algorithm, LIMITS[algorithm])


def test_a_fixed_point_is_lost_before_stability(wired):
    """It attracts while Kp H^2 / 6 + Kv H / 2 < 1, up to 3.072 ns: below even what holding inputs takes.

    The one-step matrix is that of an iteration that has converged.
    """
    limit = (np.sqrt((KV / 2) ** 2 + 4 * KP / 6) - KV / 2) / (2 * KP / 6)
    assert limit == pytest.approx(3.072e-9, rel=1e-3)
    assert limit < HELD_LIMIT
    system, instances = wired("plant", "law")
    for factor in (0.85, 1.02):
        master = make_master(instances, system, "fixed_point", factor * limit)
        master.initialize(starts={"plant.q": 1.0})
        if factor < 1:
            master.advance(100)
            assert abs(master.read(["plant.q"])[0]) < 1e-6
        else:
            with pytest.raises(StepError, match=r"does not converge.*fixed_point coupling.*or quasi_newton"):
                master.advance(100)


def test_a_line_is_worse_than_holding(wired):
    """Between the two limits, at 2.5 ns, held inputs are stable, lines are unstable, and parabolas more so."""
    system, instances = wired("plant", "law")
    names = ("gauss_seidel", "gauss_seidel_linear", "gauss_seidel_quadratic")
    growth = {name: CoupledStep(system, instances, name).over(2.5e-9).growth() for name in names}
    assert growth["gauss_seidel"] < 0 < growth["gauss_seidel_linear"] < growth["gauss_seidel_quadratic"]


@pytest.mark.parametrize(("algorithm", "expected"), [("gauss_seidel", 2.667e-9), ("quasi_newton", 13.856e-9)])
def test_a_mass_lighter_than_the_law_believes(wired, algorithm, expected):
    """0.8 kg instead of 1 kg: gains 1.25 times as large, 2.67 ns held."""
    system, instances = wired("plant", "law", plant={"mass": 0.8})
    coupled = CoupledStep(system, instances, algorithm)
    (limit,) = coupled.stability_limits(0.3e-9, 50e-9, points=30)
    assert limit == pytest.approx(
        LIMITS[algorithm] / (1.25 if algorithm == "gauss_seidel" else np.sqrt(1.25)), rel=1e-3
    )
    assert limit == pytest.approx(expected, rel=1e-3)
    assert_simulated(coupled, system, instances, algorithm, limit)


@pytest.mark.parametrize(
    ("algorithm", "expected"),
    [("gauss_seidel", HELD_LIMIT), ("jacobi", HELD_LIMIT), ("jacobi_plain", TWICE_LATE_LIMIT)],
)
def test_a_relay_costs_a_step_only_where_all_outputs_are_fetched_first(wired, algorithm, expected):
    system, instances = wired("plant", "relay", "law")
    coupled = CoupledStep(system, instances, algorithm)
    (limit,) = coupled.stability_limits(0.3e-9, 50e-9, points=30)
    assert limit == pytest.approx(expected, rel=1e-3)
    assert_simulated(coupled, system, instances, algorithm, limit)


# Exchanged force ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("algorithm", HELD)
def test_an_exchanged_spring_takes_damping(wired, algorithm):
    """H < 2 c / k where the force is held, a third of it where it is a step late as well.

    That is for c H << m: it takes 400.5 us instead of 400 us, and 133.5 us instead of 133.3 us.
    """
    expected = 2 * C / K / (3 if algorithm == "jacobi_plain" else 1)
    system, instances = wired("plant", "law", plant={"damping": C}, law={"stiffness": K, "damping": 0.0})
    coupled = CoupledStep(system, instances, algorithm)
    (limit,) = coupled.stability_limits(expected / 10, 10 * expected, points=30)
    assert limit == pytest.approx(expected, rel=2e-3)
    for factor in (0.98, 1.02):
        mode = coupled.over(factor * limit).modes[0]
        assert (mode.rate > 0) == (factor > 1)
        rate = ringing(make_master(instances, system, algorithm, factor * limit), mode.frequency)
        assert (rate > 0) == (factor > 1)
        assert rate == pytest.approx(mode.rate, rel=0.1)


def ringing(master: Master, frequency: float) -> float:
    """Growth rate [1/s] of a released mass over some 50 periods.

    Its size is seen at the frequency through a Hann window of ten periods, early and late.
    """
    window = round(10 / (frequency * master.step_size))
    recording = master.record(["plant.q"], 6 * window + 1)
    master.initialize(starts={"plant.q": 1.0})
    master.advance(6 * window)
    turned = np.hanning(window) * np.exp(-2j * np.pi * frequency * master.step_size * np.arange(window))
    early, late = (abs(turned @ recording["plant.q"][k : k + window]) for k in (0, 5 * window))
    return float(np.log(late / early) / (5 * window * master.step_size))


# Weak control ---------------------------------------------------------------------------------------------------------


def test_weak_control_is_control(wired):
    """A mass held by 0.01 N/m and 2e-3 N.s/m settles within hours: it is not free, and too long a step counts.

    A force held over 2 s drives it as a damper of -Kp H / 2 would; it grows as the matrix says.
    """
    system, instances = wired("plant", "law", law={"stiffness": 1e-2, "damping": 2e-3})
    coupled = CoupledStep(system, instances)
    assert coupled.counting == "all"
    assert coupled.is_stable(0.2)
    assert not coupled.is_stable(2.0)
    master = make_master(instances, system, "gauss_seidel", 2.0)
    recording = master.record(["plant.q"], rows=2001)
    master.initialize(starts={"plant.q": 1.0})
    master.advance(2000)
    early, late = (np.abs(recording["plant.q"][k : k + 100]).max() for k in (500, 1500))
    assert np.log(late / early) / 2000 == pytest.approx(coupled.over(2.0).growth(), rel=0.01)


def test_a_mass_without_a_law_is_free(wired):
    system, instances = wired("plant", "law")
    assert CoupledStep(System([system["plant"]]), instances).counting == "oscillatory"
