"""Driven inputs: every algorithm gives the motion that the equations have, in both loops with the same bits."""

from itertools import pairwise

import numpy as np
import pytest
from algorithm_groups import ALGORITHMS, ERROR_CONTROLLED, HELD, MONOLITHIC, MONOLITHIC_DAE
from driven_loop import PUSH, REFERENCE, SYSTEM, follower, pushed, solution
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from hfsa.components._modelling.feedback_ports import with_linear_feedback
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.masters.algorithms import open_master
from hfsa.cosim.signals.drive import Function
from hfsa.cosim.signals.shapes import Chirp, Sine, Step
from hfsa.cosim.signals.table import Table
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, System

FEEDBACK = "linearized_feedback"
ROUND = Sine(amplitude=1e-3, frequency=4.0, phase=-np.pi / 2, offset=1e-3)
PULSE = Sine(amplitude=0.03, frequency=3.0, phase=-np.pi / 2, offset=0.03)
"""Signals that begin at rest."""
STOP = 0.5
ERRORS = {ERROR_CONTROLLED: 1e-3, MONOLITHIC: 1e-9, MONOLITHIC_DAE: 1e-7}
"""Largest relative errors of algorithms that choose their steps."""


@pytest.fixture(scope="module")
def made(exported):
    """The FMUs of the loop by FMI version, the mass with feedback ports."""
    plant = with_linear_feedback(pushed(), [("force", "position")])
    return {version: {"pd": exported(follower())[version], "plant": exported(plant)[version]} for version in (2, 3)}


@pytest.fixture
def position(made, library):
    """Return the recorded position of a run of the loop with driven inputs, (points,)."""

    def run(signals, algorithm, step_size, stop=STOP, version=2, in_c=True, record="plant.position"):
        assembly = Assembly.read(SYSTEM, made[version])
        master = open_master(assembly, algorithm, step_size, library if in_c else None, 1e-3)
        try:
            steps = round(stop / step_size)
            master.drive(signals)
            recording = master.record([record], rows=steps + 1)
            master.initialize(stop_time=stop)
            master.advance(steps)
            return recording[record].copy()
        finally:
            master.close()

    return run


@pytest.fixture(scope="module")
def alone_once(made):
    """Return the position of the mass alone under a force, (points,)."""

    def run(force, algorithm, step_size, stop):
        assembly = Assembly.read(System([Component("plant", "x")], []), {"plant": made[2]["plant"]})
        master = open_master(assembly, algorithm, step_size, None, 1e-6)
        steps = round(stop / step_size)
        master.drive({PUSH: force})
        recording = master.record(["plant.position"], rows=steps + 1)
        master.initialize(stop_time=stop)
        master.advance(steps)
        found = recording["plant.position"].copy()
        master.close()
        return found

    return run


@pytest.fixture
def alone(alone_once):
    """The same."""
    return alone_once


def exact(step_size, reference=ROUND, push=PULSE, stop=STOP):
    """Return the position by the equations."""
    times = np.arange(round(stop / step_size) + 1) * step_size
    return solution(lambda t: reference.derivatives(t)[:2], lambda t: push.derivatives(t)[0], times)


def relative(found, expected):
    """Return the largest error relative to the largest value."""
    return np.abs(found - expected).max() / np.abs(expected).max()


# Against the equations ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("algorithm", [a for a in ALGORITHMS if a not in ERRORS])
def test_the_error_is_of_the_algorithms_order(position, algorithm):
    """Halving the step divides it by two where inputs are held, else by four."""
    coarse, fine = (relative(position({REFERENCE: ROUND, PUSH: PULSE}, algorithm, h), exact(h)) for h in (4e-3, 2e-3))
    assert fine < 0.04
    assert coarse / fine > (1.8 if algorithm in HELD else 3.4)


@pytest.mark.parametrize("algorithm", ERRORS)
def test_algorithms_that_choose_their_steps_meet_the_equations(position, algorithm):
    """As without drive."""
    assert relative(position({REFERENCE: ROUND, PUSH: PULSE}, algorithm, 0.01), exact(0.01)) < ERRORS[algorithm]


@pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
@pytest.mark.parametrize("algorithm", [a for a in ALGORITHMS if a not in (MONOLITHIC, MONOLITHIC_DAE)])
def test_both_loops_give_the_same_bits(position, algorithm, version):
    """More than one block of rows among them."""
    signals = {REFERENCE: Chirp(amplitude=1e-3, to=30.0), PUSH: Step(0.5, start=0.1234)}
    ways = [
        position(signals, algorithm, 1e-3, 5.0 if algorithm in HELD else 0.1, version, in_c) for in_c in (True, False)
    ]
    assert np.array_equal(*ways)
    assert np.abs(ways[0]).max() > 0


@pytest.mark.parametrize("algorithm", [a for a in ALGORITHMS if a != FEEDBACK])
def test_a_step_gives_the_step_response_of_a_mass_on_a_spring(alone, algorithm):
    """By the matrix exponential; the force jumps at a communication point."""
    found = alone(Step(2.0, start=0.1), algorithm, 1e-3, 0.3)
    matrix = np.array([[0, 1, 0], [-100.0, -0.5, 2.0], [0, 0, 0]])
    expected = [0.0 if k <= 100 else (expm(matrix * (k - 100) * 1e-3) @ [0, 0, 1])[0] for k in range(301)]
    assert relative(found, np.array(expected)) < 1e-6


# Jumps and tables -----------------------------------------------------------------------------------------------------


def test_a_jump_between_points_is_exact_where_steps_end_at_it(alone):
    """Error control and joint integration stop there; the others are up to a step late."""
    matrix = np.array([[0, 1, 0], [-100.0, -0.5, 0.5], [0, 0, 0]])
    late = np.arange(31) * 0.01 - 0.12345
    expected = np.array([(expm(matrix * max(time, 0.0)) @ [0, 0, 1])[0] for time in late])
    for algorithm, error in ((ERROR_CONTROLLED, 1e-4), (MONOLITHIC, 1e-9), (MONOLITHIC_DAE, 1e-6)):
        assert relative(alone(Step(0.5, start=0.12345), algorithm, 0.01, 0.3), expected) < error


@pytest.mark.parametrize("algorithm", ["gauss_seidel_linear", MONOLITHIC, MONOLITHIC_DAE])
def test_a_chirp_gives_the_motion_of_an_independent_integration(alone, algorithm):
    """Through the resonance of the mass at 1.6 Hz."""
    chirp = Chirp(amplitude=1.0, from_=0.5, to=5.0, duration=2.0, sweep="logarithmic")
    times = np.arange(1001) * 2e-3

    def rates(time, y):
        return [y[1], chirp.derivatives(np.array([time]))[0, 0] - 0.5 * y[1] - 100 * y[0]]

    expected = solve_ivp(rates, (0, 2), [0, 0], "DOP853", times, rtol=1e-12, atol=1e-15, max_step=0.02).y[0]
    assert relative(alone(chirp, algorithm, 2e-3, 2.0), expected) < (5e-6 if algorithm[0] == "g" else 1e-7)


@given(
    st.lists(st.floats(0.005, 0.2), min_size=1, max_size=8),
    st.lists(st.floats(-1, 1), min_size=9, max_size=9),
    st.sampled_from(["held", "linear", "smooth"]),
)
@settings(max_examples=10, deadline=None)
def test_tables_at_random_give_the_exact_motion(alone_once, gaps, values, interpolation):
    """Between rows the force is a polynomial, and the motion that of a linear system with its derivatives as states."""
    times = np.concatenate([[0.0], np.cumsum(gaps)])
    table = Table(times, np.array(values[: len(times)]), interpolation)
    found = alone_once(table, MONOLITHIC, 0.05, 0.4)
    matrix = np.zeros((6, 6))
    matrix[0, 1], matrix[1, :3] = 1, [-100.0, -0.5, 1.0]
    matrix[2, 3] = matrix[3, 4] = matrix[4, 5] = 1
    points = np.arange(9) * 0.05
    marks = np.unique(np.concatenate([points, times[times < 0.4]]))
    state, expected = np.zeros(2), {0.0: 0.0}
    for begin, end in pairwise(marks):
        force = table.derivatives(np.array([begin]), (end - begin) / 2)[:, 0]
        state = (expm(matrix * (end - begin)) @ [*state, *force])[:2]
        expected[end] = state[0]
    exact_ = np.array([expected[point] for point in points])
    assert np.abs(found - exact_).max() < 1e-9 * max(np.abs(table.values).max() / 100, 1e-6) + 1e-12


def test_rates_go_to_the_inputs_that_take_them(position):
    """The rate of the reference is driven as well, exactly at each point."""
    found = position({REFERENCE: ROUND}, "jacobi", 1e-3, record="pd.reference_rate")
    assert np.array_equal(found, ROUND.derivatives(np.arange(501) * 1e-3)[1])


def test_a_second_start_repeats_the_first(made, library):
    """Blocks of rows begin anew."""
    master = open_master(Assembly.read(SYSTEM, made[2]), "gauss_seidel_linear", 1e-3, library)
    master.drive({REFERENCE: ROUND})
    recording = master.record(["plant.position"], rows=301)
    found = []
    for _ in range(2):
        master.initialize(stop_time=0.3)
        master.advance(100)
        master.advance(200)
        found.append(recording["plant.position"].copy())
    master.close()
    assert np.array_equal(*found)


# Refusals -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("pd.position", "fed by a connection"),
        ("plant.position", "is no input"),
        ("plant.nothing", "is no input"),
    ],
    ids=["connected", "output", "unknown"],
)
def test_only_free_inputs_are_driven(made, library, name, words):
    """Anything else is refused."""
    master = open_master(Assembly.read(SYSTEM, made[2]), "jacobi", 1e-3, library)
    with pytest.raises(StructureError, match=words):
        master.drive({name: ROUND})
    master.close()


@pytest.mark.parametrize("algorithm", ["jacobi", ERROR_CONTROLLED, MONOLITHIC])
def test_a_function_that_fails_ends_the_run_with_its_reason(position, algorithm):
    """With the input, and the time."""

    def late(time: float) -> float:
        return 1.0 if time < 0.05 else float("nan")

    with pytest.raises(StepError, match=r"plant: push: not driven.*late.* returns nan at 0\.0\d+"):
        position({PUSH: Function(late)}, algorithm, 0.01)


def test_a_driven_input_cannot_be_set(made, library):
    """The signal feeds it."""
    master = open_master(Assembly.read(SYSTEM, made[2]), "jacobi", 1e-3, library)
    master.drive({PUSH: ROUND})
    master.initialize(stop_time=0.1)
    with pytest.raises(StructureError, match="driven by a signal"):
        master.set({PUSH: 1.0})
    master.close()
