"""Extreme gains, damping, amplitudes, stiffnesses, steps and values, against closed forms.

Each works to the accuracy that its test states, or stops with a message that says what happened.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from scipy.linalg import expm

from hfsa.components import Model
from hfsa.components._mechanics.sdelta_direct import direct_kinematics
from hfsa.components._mechanics.sdelta_kinematics import Kinematics
from hfsa.components.mass_on_spring import mass_on_spring
from hfsa.components.sdelta import Posture
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.masters.master import Master
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, Connection, System

OMEGA = 100.0
POSITION, VELOCITY = "mass.mass.position", "mass.mass.velocity"
SINGULAR_PITCH = np.radians(-22.61986)
GAINS = (5e16, 6e8)
LOOP = [Connection("law.force", "plant.force")]
LOOP += [Connection(f"plant.{name}", f"law.{name}") for name in ("position", "velocity")]
VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
LOOPS = pytest.mark.parametrize("loop", ["c", "python"])


def law() -> Model:
    """A PD law without memory, with the largest gains."""
    m = Model("StiffLaw", "PD law")
    q, v = m.input("position", "m", "Position"), m.input("velocity", "m/s", "Velocity")
    m.output("force", -GAINS[0] * q - GAINS[1] * v, "N", "Force")
    return m


def two_masses() -> Model:
    """1 kg on a soft spring and 1 kg on a stiff one, and a spring between them."""
    m = Model("TwoMasses", "Two masses and three springs")
    soft = m.parameter("soft", 1.0, "N/m", "Spring of the first mass")
    stiff = m.parameter("stiff", 0.0, "N/m", "Spring of the second mass")
    between = m.parameter("between", 0.0, "N/m", "Spring between the masses")
    damping = m.parameter("damping", 0.0, "N.s/m", "Damper of the second mass")
    x, v = m.state("x", "m", "First position", start=1.0), m.state("v", "m/s", "First velocity")
    y, w = m.state("y", "m", "Second position", start=1.0), m.state("w", "m/s", "Second velocity")
    m.der[x], m.der[y] = v, w
    m.der[v] = -soft * x - between * (x - y)
    m.der[w] = -stiff * y - between * (y - x) - damping * w
    m.output("position", x, "m", "First position")
    return m


def rosenbrock() -> Model:
    """The mass on a spring by the solver that controls its error."""
    m = mass_on_spring()
    m.solver = "rosenbrock"
    return m


@pytest.fixture
def alone(opened, library):
    """Run one FMU; times and values of variables at every so many points, (variables, points)."""

    def run(
        file, step_size: float, steps: int, starts: Mapping[str, float], names: Sequence[str], every: int = 1
    ) -> tuple[np.ndarray, np.ndarray]:
        system = System([Component("mass", "x")])
        master = make_master(opened({"mass": file}), system, "gauss_seidel", step_size, library)
        recording = master.record(names, steps // every + 1, every)
        master.initialize(starts=starts)
        master.advance(steps)
        return np.array(recording.time), np.array([recording[name] for name in names])

    return run


@pytest.fixture
def stiff_loop(files, exported, opened):
    """A master of a mass under the largest gains, 1 nm away; with step and algorithm."""

    def make(algorithm: str, step_size: float) -> Master:
        system = System([Component("plant", "x", start={"x": 1e-9}), Component("law", "x")], LOOP)
        found = {"plant": files["Plant", 2], "law": exported(law())[2]}
        return make_master(opened(found), system, algorithm, step_size)

    return make


# Gains of 5e16 --------------------------------------------------------------------------------------------------------


def recorded(master: Master, steps: int) -> np.ndarray:
    """Position and velocity of the plant, (steps + 1, 2)."""
    recording = master.record(["plant.x", "plant.v"], steps + 1)
    master.initialize()
    master.advance(steps)
    return np.column_stack([recording["plant.x"], recording["plant.v"]])


def test_gains_of_5e16_held(stiff_loop):
    """Each step of 1 ns equals the motion under a held force, to 12 digits of the largest values, from 1 nm on."""
    moved = expm(1e-9 * np.array([[0, 1, 0], [-100, -0.5, 1], [0, 0, 0]]))
    step = moved[:2, :2] - np.outer(moved[:2, 2], GAINS)
    expected = [np.array([1e-9, 0.0])]
    for _ in range(300):
        expected.append(step @ expected[-1])
    found = recorded(stiff_loop("gauss_seidel", 1e-9), 300)
    assert np.all(np.abs(found - expected).max(axis=0) < 1e-12 * np.abs(expected).max(axis=0))
    assert np.abs(found[-1]).max() < 1e-12 * np.abs(found).max()


def test_gains_of_5e16_iterated(stiff_loop):
    """With inputs on lines, at 0.5 and 0.25 ns: an error of second order in the step."""
    exact = expm(10e-9 * np.array([[0, 1], [-100 - GAINS[0], -0.5 - GAINS[1]]]))[0, 0] * 1e-9
    errors = [abs(recorded(stiff_loop("quasi_newton", 10e-9 / n), n)[-1, 0] - exact) for n in (20, 40)]
    assert errors[1] < 1e-3 * exact
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.05)


# Damping and amplitude ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("amplitude", [1e-9, 1.0])
@pytest.mark.parametrize("damping", [0.0, 2 * OMEGA])
@VERSIONS
def test_damping_of_none_and_critical_at_1_nm_and_1_m(alone, mass_on_spring_files, version, damping, amplitude):
    """1e-13 of the amplitude over 16 periods, whatever the amplitude."""
    starts = {POSITION: amplitude, "mass.damping": damping}
    time, (position,) = alone(mass_on_spring_files[version], 1e-3, 1000, starts, [POSITION])
    free = np.cos(OMEGA * time)
    critical = (1 + OMEGA * time) * np.exp(-OMEGA * time)
    assert np.abs(position / amplitude - (critical if damping else free)).max() < 1e-13


def test_an_error_controlled_solver_is_as_accurate_at_1_nm_as_at_1_m(alone, exported):
    """1.0e-9 and 0.8e-9 of the amplitude over 16 periods, where the nominal value is 1 mm."""
    file = exported(rosenbrock())[2]
    errors = []
    for amplitude in (1e-9, 1.0):
        time, (position,) = alone(file, 1e-3, 1000, {POSITION: amplitude, "mass.damping": 0.0}, [POSITION])
        errors.append(np.abs(position / amplitude - np.cos(OMEGA * time)).max())
    assert max(errors) < 2e-9
    assert max(errors) < 1.5 * min(errors)


# Stiffness ratio of 1e12 ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("damping", [0.0, 2e6])
@pytest.mark.parametrize("step_size", [1e-7, 1e-3])
def test_springs_of_1_and_1e12_in_one_model(alone, exported, step_size, damping):
    """The slow mass to 1e-14; the fast one as well when critically damped, else as exact as its phase at 1e6 rad/s."""
    starts = {"mass.stiff": 1e12, "mass.damping": damping}
    time, (slow, fast) = alone(exported(two_masses())[2], step_size, 1000, starts, ["mass.position", "mass.y"])
    assert np.abs(slow - np.cos(time)).max() < 1e-14
    phase = 1e6 * time
    expected = (1 + phase) * np.exp(-phase) if damping else np.cos(phase)
    rounding = np.finfo(float).eps * 1e6 * step_size * 1000
    assert np.abs(fast - expected).max() < 1e-13 + (0 if damping else 2 * rounding)


def test_a_spring_of_1_behind_one_of_1e12(alone, exported):
    """Two masses all but welded together move as one, at 1 / sqrt(2) rad/s.

    1 N/m is found from sums with 1e12 N/m, of which 1e-4 is the last bit; over 1 s in steps of 1 ms 6e-9 is lost.
    """
    soft, stiff = 1.0, 1e12
    square = 2 * soft * stiff / (soft + 2 * stiff + np.hypot(soft, 2 * stiff))
    starts = {"mass.between": stiff, "mass.y": 1 / (1 - square / stiff)}
    time, (position,) = alone(exported(two_masses())[2], 1e-3, 1000, starts, ["mass.position"])
    assert np.abs(position - np.cos(np.sqrt(square) * time)).max() < 1e-7


# Steps ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("steps", "lost"), [(10**6, 1e-10), (10**7, 1e-8)])
def test_energy_is_kept(alone, mass_on_spring_files, steps, lost):
    """Of an undamped mass at steps of 1 ms, seen at 1000 points: it loses 1.5e-12 and 1.5e-11, in rounding."""
    starts = {POSITION: 1.0, "mass.damping": 0.0}
    _, (x, v) = alone(mass_on_spring_files[2], 1e-3, steps, starts, [POSITION, VELOCITY], every=steps // 1000)
    energy = OMEGA**2 * x**2 + v**2
    assert len(energy) == 1001
    assert np.abs(energy / energy[0] - 1).max() < lost


def test_steps_of_1_ns_and_1_ms_end_at_the_same(alone, mass_on_spring_files):
    """A million against one, both at 1 ms exactly: 1e-11 apart, and from the closed form."""
    starts = {POSITION: 1.0, "mass.damping": 0.0}
    ends = []
    for step_size, steps in ((1e-9, 10**6), (1e-3, 1)):
        time, values = alone(
            mass_on_spring_files[2], step_size, steps, starts, [POSITION, VELOCITY], every=max(1, steps)
        )
        assert time[-1] == pytest.approx(1e-3, rel=1e-15)
        ends.append(values[:, -1])
    exact = np.array([np.cos(0.1), -OMEGA * np.sin(0.1)])
    for end in ends:
        np.testing.assert_allclose(end, exact, rtol=1e-11)


# Values ---------------------------------------------------------------------------------------------------------------


@pytest.fixture
def plant_master(files, opened, library):
    """A master of one mass whose force is free, stepping in C or in Python, in either version of FMI."""

    def make(version: int, loop: str) -> Master:
        instances = opened({"plant": files["Plant", version]})
        system = System([Component("plant", "x")])
        return make_master(instances, system, "gauss_seidel", 1e-3, library if loop == "c" else None)

    return make


@LOOPS
@VERSIONS
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_an_input_that_is_not_finite_is_named(plant_master, version, loop, value):
    """At the step that uses it; until then all is well, and after a new start again."""
    master = plant_master(version, loop)
    master.initialize()
    master.advance(5)
    master.set({"plant.force": value})
    with pytest.raises(StepError, match=rf"plant: fmi{version}DoStep: error at t = 0\.005 s: input force is {value}"):
        master.advance(5)
    master.initialize(starts={"plant.x": 1.0, "plant.force": 0.0})
    master.advance(5)
    assert 0.9 < master.read(["plant.x"])[0] < 1.0


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_start_value_that_is_not_finite_is_refused(files, opened, value):
    system = System([Component("plant", "x", start={"force": value})])
    with pytest.raises(StructureError, match=rf"plant\.force starts at {value} N, expected a number"):
        make_master(opened({"plant": files["Plant", 2]}), system)


@LOOPS
@VERSIONS
@pytest.mark.parametrize("value", [5e-324, 1e-310, 1e-300])
def test_denormals(plant_master, version, loop, value):
    """Denormals are numbers: the response is proportional to 9 digits, or to all digits of a denormal."""
    master = plant_master(version, loop)
    ends = []
    for force in (value, 1.0):
        master.initialize(starts={"plant.force": force})
        master.advance(100)
        ends.append(master.read(["plant.x", "plant.v"]))
    assert np.all(np.isfinite(ends[0]))
    np.testing.assert_allclose(ends[0], value * ends[1], rtol=1e-9, atol=200 * 5e-324)


# Postures beside a singularity ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("distance", [0.0, 1e-6, -1e-6])
@pytest.mark.parametrize("command", [("analyze", "sdelta"), ("export", "sdelta"), ("run", "sdelta_hfsa")], ids=" ".join)
def test_a_posture_a_microradian_from_a_singularity_is_refused(hfsa, command, distance):
    """With its condition number, before anything is built."""
    pitch = np.degrees(SINGULAR_PITCH + distance)
    code, _, err = hfsa(*command, "-p", f"posture.rotation=0,{pitch:.9g},0")
    assert code in (2, 3)
    assert "is singular: condition number" in " ".join(err.split())
    assert "expected at most 10000" in " ".join(err.split())


def test_a_posture_a_milliradian_from_a_singularity_works():
    """From its motor angles the pose is found again to 1e-12 rad and m, with a condition number above 1000."""
    pitch = np.degrees(SINGULAR_PITCH + 1e-3)
    wanted = Kinematics.at(Posture(rotation=(0, pitch, 0)))
    assert 1000 < wanted.condition_number < 1e4
    start = Posture(rotation=(0, np.degrees(SINGULAR_PITCH + 1.5e-3), 0))
    Q, position = direct_kinematics(wanted.motor_angles, start)
    np.testing.assert_allclose(Q, wanted.Q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(position, wanted.position, rtol=0, atol=1e-12)
