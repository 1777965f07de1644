"""Monolithic integration: against closed forms, as the limit of co-simulation, and its errors."""

import sys
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from algorithm_groups import MONOLITHIC, MONOLITHIC_DAE
from scipy.linalg import expm
from spring_loop import KD, KP, LOOP, MATRIX

from hfsa.components import Model
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.co_simulation import Fmu, StepError, open_instances
from hfsa.cosim.fmi.model_exchange import ModelExchangeInstance
from hfsa.cosim.masters.algorithms import make_master, open_master
from hfsa.cosim.masters.monolithic import integrator
from hfsa.cosim.masters.monolithic.master import Monolithic
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, Connection, System

ALGORITHMS = pytest.mark.parametrize(
    ("algorithm", "error"), [(MONOLITHIC, 1e-10), (MONOLITHIC_DAE, 5e-8)], ids=[MONOLITHIC, MONOLITHIC_DAE]
)
VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])


@pytest.fixture
def master():
    """Make masters from component -> file, start values by component, and connections; closed after the test."""
    made = []

    def make(files, connections=(), step_size=1e-3, starts=None, algorithm=MONOLITHIC) -> Monolithic:
        system = System([Component(n, "x", start=(starts or {}).get(n, {})) for n in files], connections)
        made.append(make_master(open_instances(files, ModelExchangeInstance), system, algorithm, step_size))
        return made[-1]

    yield make
    for one in made:
        one.close()


def recorded(master, names, steps, start_time=0.0) -> np.ndarray:
    """Values at all points of a run, (steps + 1, names)."""
    recording = master.record(names, rows=steps + 1)
    master.initialize(start_time)
    master.advance(steps)
    return np.array([recording[name] for name in names]).T


def free(A, x: list[float], step: float, steps: int) -> np.ndarray:
    """Values of x' = A x at the points of a run, (steps + 1, n)."""
    over, found = expm(np.array(A) * step), [np.array(x)]
    for _ in range(steps):
        found.append(over @ found[-1])
    return np.array(found)


def assert_accurate(found: np.ndarray, exact: np.ndarray, tolerance: float = 1e-10) -> None:
    """Compare columns, each relative to its largest value."""
    assert np.all(np.abs(found - exact).max(axis=0) <= tolerance * np.abs(exact).max(axis=0))


# Closed forms ---------------------------------------------------------------------------------------------------------


@VERSIONS
@ALGORITHMS
@pytest.mark.parametrize("amplitude", [1e-9, 1.0])
def test_eighty_periods_of_a_vibration(master, mass_on_spring_files, version, amplitude, algorithm, error):
    one = master({"mass": mass_on_spring_files[version]}, (), 5e-3, {"mass": {"mass.position": amplitude}}, algorithm)
    found = recorded(one, ["mass.mass.position", "mass.mass.velocity"], 1000)
    assert_accurate(found, free([[0, 1], [-1e4, -0.5]], [amplitude, 0], 5e-3, 1000), error)


@VERSIONS
@ALGORITHMS
def test_a_loop_of_two(master, files, version, algorithm, error):
    fmus = {"plant": files["Plant", version], "pd": files["Pd", version]}
    one = master(fmus, LOOP, 0.01, {"plant": {"x": 1.0}}, algorithm)
    found = recorded(one, ["plant.x", "plant.v", "pd.filtered"], 100)
    assert_accurate(found, free(MATRIX, [1, 0, 0], 0.01, 100), error)
    np.testing.assert_allclose(one._ode.jacobian(), MATRIX, rtol=1e-14)


@VERSIONS
@ALGORITHMS
@pytest.mark.parametrize("start_time", [0.0, 1000.1])
def test_a_sampled_loop(master, files, version, start_time, algorithm, error):
    """The integrator stops at each tick; the values recorded there are those before it."""
    found = {"plant": files["Plant", version], "pd": files["SampledPd", version]}
    one = master(found, LOOP, 2.5e-3, {"plant": {"x": 1.0}}, algorithm)
    E = expm(np.block([[np.array([[0, 1, 0], [-100, -0.5, 1.0]])], [np.zeros((1, 3))]]) * 2.5e-3)
    x, v, force, last, exact = 1.0, 0.0, 0.0, 0.0, []
    for k in range(401):
        exact.append([x, v, force])
        if k % 4 == 0:
            force, last = -KP * x - KD * (x - last) / 0.01, x
        x, v, _ = E @ [x, v, force]
    assert_accurate(recorded(one, ["plant.x", "plant.v", "pd.force"], 400, start_time), np.array(exact), error)


def controller() -> Model:
    """A PD law whose rate is filtered with 5 ms, on the error from a reference."""
    m = Model("FilteredPd", "PD law with filtered rate")
    wanted = m.parameter("reference", 1.0, "m", "Reference")
    position = m.input("position", "m", "Measured position")
    w = m.state("filtered", "m", "Filtered error", start=1.0)
    error = wanted - position
    m.der[w] = (error - w) / 0.005
    m.output("force", 400 * error + 10 * (error - w) / 0.005, "N", "Force")
    return m


@VERSIONS
def test_the_loop_that_error_control_stalls_on(master, files, exported, version):
    pd = exported(controller())[version]
    one = master({"plant": files["Plant", version], "pd": pd}, LOOP, 0.05)
    assert recorded(one, ["plant.x"], 20)[-1, 0] == pytest.approx(0.8034755886, abs=1e-10)


@VERSIONS
def test_values_set_on_the_way(master, files, version):
    one = master({"plant": files["Plant", version]}, (), 0.05)
    one.initialize()
    one.advance(1)
    one.set({"plant.force": 3.0})
    assert one.read(["plant.acceleration"])[0] == 3.0
    one.advance(10)
    exact = free([[0, 1, 0], [-100, -0.5, 1], [0, 0, 0]], [0, 0, 3.0], 0.05, 10)[-1]
    assert one.read(["plant.x"])[0] == pytest.approx(exact[0], rel=1e-10)
    assert one.time == pytest.approx(0.55, abs=1e-15)


def stiff() -> Model:
    """A slow vibration, followed by a filter of 1 us."""
    m = Model("Stiff", "A slow vibration and a fast filter")
    x = m.state("x", "m", "Position", start=1.0)
    v = m.state("v", "m/s", "Velocity")
    w = m.state("w", "m", "Filtered")
    m.der[x], m.der[v], m.der[w] = v, -100.0 * x, (x - w) / 1e-6
    m.output("y", w, "m", "Filtered")
    return m


def test_a_fast_filter_does_not_shorten_the_steps(master, exported):
    one = master({"it": exported(stiff())[2]}, (), 0.01)
    found = recorded(one, ["it.x", "it.w"], 100)
    A = [[0, 1, 0], [-100, 0, 0], [1e6, 0, -1e6]]
    assert_accurate(found[1:], free(A, [1, 0, 0], 0.01, 100)[1:, [0, 2]], 1e-8)
    assert one._integrator.method == "BDF"


OMEGA, AMPLITUDE, STIFF_KP, STIFF_KV = 100 * np.pi, 1e-9, 5e16, 6e8


def oscillation() -> Model:
    """Moves by 1 nm at 50 Hz."""
    m = Model("Oscillation", "A cosine and its rate")
    a = m.state("a", "m", "Position", start=AMPLITUDE, nominal=1e-6)
    b = m.state("b", "m", "A quarter of a period late", nominal=1e-6)
    m.der[a], m.der[b] = -OMEGA * b, OMEGA * a
    m.output("position", a, "m", "Position")
    m.output("velocity", -OMEGA * b, "m/s", "Velocity")
    return m


def follower() -> Model:
    """PD law at every instant, with the stage's published gains on 1 kg: poles at -1e8 and -5e8 rad/s."""
    m = Model("Follower", "PD law")
    r, rd = m.input("reference", "m", "Reference"), m.input("reference_rate", "m/s", "Its rate")
    x, v = m.input("position", "m", "Measured"), m.input("velocity", "m/s", "Measured")
    m.output("force", STIFF_KP * (r - x) + STIFF_KV * (rd - v), "N", "Force")
    return m


@ALGORITHMS
def test_gains_of_5e16_at_1_nm(master, files, exported, algorithm, error):
    """The force has the error of the last digits of 1 nm times 5e16; all other values are exact as before."""
    gain = (STIFF_KP + 1j * OMEGA * STIFF_KV) / (STIFF_KP + 100 - OMEGA**2 + 1j * OMEGA * (STIFF_KV + 0.5))
    phasor = AMPLITUDE * gain
    found = {"source": exported(oscillation())[2], "pd": exported(follower())[2]}
    wires = [
        ("source.position", "pd.reference"),
        ("source.velocity", "pd.reference_rate"),
        ("plant.position", "pd.position"),
        ("plant.velocity", "pd.velocity"),
        ("pd.force", "plant.force"),
    ]
    starts = {"plant": {"x": phasor.real, "v": (1j * OMEGA * phasor).real}}
    found["plant"] = files["Plant", 2]
    one = master(found, [Connection(*wire) for wire in wires], 1e-3, starts, algorithm)
    motion = np.exp(1j * OMEGA * np.arange(101) * 1e-3)
    values = recorded(one, ["plant.x", "plant.v", "pd.force"], 100)
    force = (100 - OMEGA**2 + 0.5j * OMEGA) * phasor
    assert_accurate(values[:, :2], np.outer(motion, [phasor, 1j * OMEGA * phasor]).real, max(5 * error, 1e-9))
    if algorithm == MONOLITHIC:
        assert_accurate(values[1:, 2:], np.outer(motion, [force]).real[1:], 1e-3)
        assert one._integrator.method == "BDF"


def added_mass() -> Model:
    """Half a kilogram that moves with another mass: its force follows the acceleration directly."""
    m = Model("AddedMass", "A mass carried along")
    m.output("force", -0.5 * m.input("acceleration", "m/s2", "Acceleration"), "N", "Force")
    return m


@VERSIONS
@ALGORITHMS
def test_an_algebraic_loop(master, files, exported, version, algorithm, error):
    found = {"plant": files["Plant", version], "more": exported(added_mass())[version]}
    loop = [Connection("plant.acceleration", "more.acceleration"), Connection("more.force", "plant.force")]
    one = master(found, loop, 0.01, {"plant": {"x": 1.0}}, algorithm)
    A = [[0, 1], [-100 / 1.5, -0.5 / 1.5]]
    assert_accurate(recorded(one, ["plant.x", "plant.v"], 200), free(A, [1, 0], 0.01, 200), error)
    np.testing.assert_allclose(one._ode.jacobian(), A, rtol=1e-14)


def test_without_a_state_there_is_nothing_to_integrate(master, exported):
    one = master({"more": exported(added_mass())[2]}, (), 0.5, {"more": {"acceleration": 4.0}})
    assert recorded(one, ["more.force", "more.time"], 3).tolist() == [[-2.0, 0.5 * k] for k in range(4)]


@pytest.mark.parametrize(
    ("poles", "horizon", "method"),
    [
        ([-0.1 + 50j, -0.1 - 50j, -20], np.inf, "Adams"),
        ([-0.1 + 50j, -0.1 - 50j, -1e5], np.inf, "BDF"),
        ([-0.1 + 50j, -0.1 - 50j, -1e5], 1e-4, "Adams"),  # the next tick comes first
        ([-1e8, -5e8], np.inf, "BDF"),  # nothing to see of either
        ([-50.0, -60.0], np.inf, "Adams"),
        ([0.0, 0.0], np.inf, "Adams"),
    ],
)
def test_the_method_suits_the_poles(master, mass_on_spring_files, poles, horizon, method):
    one = master({"mass": mass_on_spring_files[2]})
    one._integrator._choose(np.array(poles), 1e-3, horizon)
    assert one._integrator.method == method


@ALGORITHMS
def test_without_derivatives_of_the_fmus(files, algorithm, error):
    fmus = {name: Fmu(files[kind, 2], "model_exchange") for name, kind in (("plant", "Plant"), ("pd", "Pd"))}
    for fmu in fmus.values():
        fmu.description = replace(fmu.description, has_derivatives=False, needs_completed_steps=True)
    instances = {name: ModelExchangeInstance(fmu, name) for name, fmu in fmus.items()}
    system = System([Component("plant", "x", start={"x": 1e-6}), Component("pd", "x")], LOOP)
    one = make_master(instances, system, algorithm, 0.01)
    found = recorded(one, ["plant.x", "plant.v", "pd.filtered"], 100)
    assert_accurate(found, free(MATRIX, [1e-6, 0, 0], 0.01, 100), error)
    np.testing.assert_allclose(one._ode.jacobian(), MATRIX, rtol=1e-7, atol=1e-6)
    one.close()
    for fmu in fmus.values():
        fmu.close()


def pendulum() -> Model:
    """A nonlinear FMU, which has a solver with a tolerance in Co-Simulation."""
    m = Model("Pendulum", "A pendulum")
    angle, rate = m.state("angle", "rad", "Angle", start=1.0), m.state("rate", "rad/s", "Its rate")
    m.der[angle], m.der[rate] = rate, -9.81 * ca.sin(angle)
    m.output("y", angle, "rad", "Angle")
    return m


@pytest.mark.parametrize("algorithm", [MONOLITHIC, MONOLITHIC_DAE])
def test_an_fmus_own_solver_has_no_part(master, exported, algorithm):
    """The FMU's own tolerance does not limit the accuracy."""
    files = {"it": exported(pendulum())[2]}
    fine = recorded(master(files, (), 0.1, algorithm=algorithm), ["it.angle"], 5)
    coarse = master(files, (), 0.1, {"it": {"solver.relative_tolerance": 0.1}}, algorithm)
    np.testing.assert_array_equal(recorded(coarse, ["it.angle"], 5), fine)


# Where it cannot go on ------------------------------------------------------------------------------------------------


@VERSIONS
def test_an_fmu_without_model_exchange(foreign, version):
    files, system = {"it": foreign[version]}, System([Component("it", "x")])
    with pytest.raises(StructureError, match=r"Foreign\.fmu offers no Model Exchange interface, which .* monolithic"):
        open_master(Assembly.read(system, files), "monolithic", 1e-3, None)


@pytest.mark.parametrize(("algorithm", "module"), [(MONOLITHIC, "cvode"), (MONOLITHIC_DAE, "ida")])
def test_without_sundials(monkeypatch, files, algorithm, module):
    monkeypatch.setitem(sys.modules, f"sksundae.{module}", None)
    with pytest.raises(StructureError, match="its package scikit-sundae cannot be loaded"):
        open_master(Assembly.read(System([Component("it", "x")]), {"it": files["Plant", 2]}), algorithm, 1e-3, None)


def runaway() -> Model:
    """From 1 by x' = x^2, infinite at 1 s."""
    m = Model("Runaway", "Infinite at 1 s")
    x = m.state("x", "1", "Runs away", start=1.0)
    m.der[x] = x**2
    m.output("y", x, "1", "Output")
    return m


def rooted() -> Model:
    """From 1 by x' = -1 - sqrt(x): no number where x is below 0, after 2 - 2 ln 2 s."""
    m = Model("Rooted", "A root of a state that falls")
    x = m.state("x", "1", "Falls", start=1.0)
    m.der[x] = -1 - ca.sqrt(x)
    m.output("y", x, "1", "Output")
    return m


def test_a_solution_that_ends(master, exported):
    one = master({"it": exported(runaway())[2]}, (), 0.1)
    one.initialize()
    one.advance(9)
    assert one.read(["it.x"])[0] == pytest.approx(10.0, rel=1e-9)
    with pytest.raises(StepError) as caught:
        one.advance(2)
    assert caught.value.instance == "it"
    assert caught.value.time == pytest.approx(1.0, abs=1e-6)


@ALGORITHMS
def test_more_steps_than_anybody_waits_for(monkeypatch, master, mass_on_spring_files, algorithm, error):
    monkeypatch.setattr(integrator, "MOST_STEPS", 50)
    one = master({"mass": mass_on_spring_files[2]}, (), 5.0, {"mass": {"mass.position": 1.0}}, algorithm)
    one.initialize()
    with pytest.raises(StepError, match=r"mass: (CVODE|IDA): cannot go on at t = 0\.\d* s: 50 steps do not lead"):
        one.advance(1)


@VERSIONS
@ALGORITHMS
def test_an_fmu_that_refuses_a_state(master, exported, version, algorithm, error):
    """A shorter step follows a refusal of an FMU; where none helps, the run ends with the FMU's message."""
    one = master({"it": exported(rooted())[version]}, (), 0.1, algorithm=algorithm)
    one.initialize()
    one.advance(6)
    with pytest.raises(StepError, match=r"it: .*Derivatives: discard at t = 0\.61.*der\(x\) is") as caught:
        one.advance(1)
    assert caught.value.time == pytest.approx(2 - 2 * np.log(2), abs=1e-3)


def test_the_command(hfsa):
    code, _, error = hfsa("run", "mass_on_spring", "--algorithm", "monolithic", "--stop", "0.1", "-o", "run.h5")
    assert (code, error.count("Traceback")) == (0, 0)
