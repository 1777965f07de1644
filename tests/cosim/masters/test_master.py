"""Master with either stepping loop: each algorithm against its discrete equations and two foreign masters."""

import signal
import threading

import numpy as np
import pytest
from algorithm_groups import HELD
from scipy.linalg import expm
from spring_loop import KD, KP, LOOP, TF

from hfsa.cosim.fmi.co_simulation import StepError, open_instances
from hfsa.cosim.masters.algorithms import check_algorithm, make_master
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, Connection, System

VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])


@pytest.fixture(params=["python", "c"])
def master(request, opened, library):
    """Make masters from component -> file, start values by component, and connections; everything holds for both."""

    def make(files, connections=(), algorithm="gauss_seidel", step_size=1e-3, starts=None):
        starts = starts or {}
        system = System([Component(n, "x", start=starts.get(n, {})) for n in files], connections)
        return make_master(opened(files), system, algorithm, step_size, library if request.param == "c" else None)

    return make


def loop(master, files, version, algorithm, controller="Pd", **more):
    found = {"plant": files["Plant", version], "pd": files[controller, version]}
    return master(found, LOOP, algorithm, starts={"plant": {"x": 1.0}}, **more)


def held(A: list, B: list, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Exact step of x' = A x + B u over h with u held."""
    n = len(A)
    E = expm(np.block([[np.array(A, float), np.array(B, float)], [np.zeros((1, n + 1))]]) * h)
    return E[:n, :n], E[:n, n]


# Trajectories ---------------------------------------------------------------------------------------------------------


def trajectory(algorithm: str, h: float, steps: int) -> np.ndarray:
    """Positions of plant and PD controller at the communication points, from the discrete equations."""
    Ap, Bp = held([[0, 1], [-100, -0.5]], [[0], [1]], h)
    Ac, Bc = held([[-1 / TF]], [[1 / TF]], h)

    def force(position: float) -> float:
        return -KP * position - KD * (position - w) / TF

    x, w, told = np.array([1.0, 0.0]), 0.0, 1.0
    found = [x[0]]
    for _ in range(steps):
        before = x[0]
        if algorithm == "jacobi_plain":
            f = force(told)  # the controller still has the position of the point before
            told = x[0]
        else:
            f = force(x[0])
        x = Ap @ x + Bp * f
        w = Ac[0, 0] * w + Bc[0] * (x[0] if algorithm == "gauss_seidel" else before)
        found.append(x[0])
    return np.array(found)


@VERSIONS
@pytest.mark.parametrize("algorithm", HELD)
def test_trajectory(master, files, version, algorithm):
    m = loop(master, files, version, algorithm, step_size=5e-3)
    recording = m.record(["plant.position", "plant.force", "pd.position"], rows=201)
    m.initialize()
    m.advance(120)
    m.advance(80)
    expected = trajectory(algorithm, 5e-3, 200)
    np.testing.assert_allclose(recording["plant.position"], expected, rtol=0, atol=1e-12)
    assert recording.time.tolist() == [k * 5e-3 for k in range(201)]
    assert recording["pd.position"].tolist() == recording["plant.position"].tolist()
    if algorithm != "jacobi_plain":
        assert recording["plant.force"][0] == -(KP + KD / TF)


def test_the_algorithms_differ(master, files):
    """No algorithm passes the test of another."""
    runs = [trajectory(algorithm, 5e-3, 200) for algorithm in HELD]
    assert min(np.abs(a - b).max() for i, a in enumerate(runs) for b in runs[:i]) > 1e-3


@pytest.mark.parametrize("algorithm", HELD)
@pytest.mark.parametrize(("every", "ticks"), [(1, 1), (2, 1), (5, 1), (1, 2)], ids=["1:1", "2:1", "5:1", "1:2"])
def test_sampled_instances_step_first(master, files, algorithm, every, ticks):
    """A tick every `every` steps, or `ticks` in a step: the plant has the new force at once, or (plain) late."""
    sample_time = 0.01
    h = sample_time * ticks / every
    m = loop(master, files, 2, algorithm, "SampledPd", step_size=h)
    recording = m.record(["plant.position"], rows=101)
    m.initialize(2.0)
    m.advance(100)
    A, B = held([[0, 1], [-100, -0.5]], [[0], [1]], h)
    x, last, f, expected = np.array([1.0, 0.0]), 0.0, 0.0, [1.0]
    for k in range(100):
        before = f
        if k % every == 0:
            for _ in range(ticks):  # the input is held within the step
                f = -KP * x[0] - KD * (x[0] - last) / sample_time
                last = x[0]
        x = A @ x + B * (before if algorithm == "jacobi_plain" else f)
        expected.append(x[0])
    np.testing.assert_allclose(recording["plant.position"], expected, rtol=0, atol=1e-12)


def test_a_tick_reaches_through_direct_feedthrough(master, files, foreign):
    """The acceleration has direct feedthrough from the force, so its targets step with the force of this tick."""
    found = {"watcher": foreign[2], "plant": files["Plant", 2], "pd": files["SampledPd", 2]}
    connections = [*LOOP, Connection("plant.acceleration", "watcher.u")]
    m = master(found, connections, "jacobi", step_size=0.01, starts={"plant": {"x": 1.0}})
    m.initialize()
    m.advance(1)
    force = -(KP + KD / 0.01)
    assert m.read(["watcher.y"])[0] == pytest.approx(0.01 * (force - 100.0), rel=1e-14)


def test_the_order_of_components_is_the_order_of_steps(master, files):
    found = {"pd": files["Pd", 2], "plant": files["Plant", 2]}
    m = master(found, LOOP, "gauss_seidel", step_size=5e-3, starts={"plant": {"x": 1.0}})
    m.initialize()
    m.advance(50)
    assert [a.instance for a in m.cycle if hasattr(a, "groups")] == ["pd", "plant"]
    # the controller steps first, from the position of the point; the plant then has the force at the step's end
    A, B = held([[0, 1], [-100, -0.5]], [[0], [1]], 5e-3)
    Ac, Bc = held([[-1 / TF]], [[1 / TF]], 5e-3)
    x, w = np.array([1.0, 0.0]), 0.0
    for _ in range(50):
        w = Ac[0, 0] * w + Bc[0] * x[0]
        x = A @ x + B * (-KP * x[0] - KD * (x[0] - w) / TF)
    assert m.read(["plant.position"])[0] == pytest.approx(x[0], abs=1e-12)


def test_nothing_is_fetched_or_set_twice(master, files):
    """One get and one set per connection and step, for every algorithm."""
    for algorithm in HELD:
        m = loop(master, files, 2, algorithm)
        assert sorted(type(action).__name__ for action in m.cycle) == sorted(2 * ["Stepper", "Group", "Transfer"])


# Other masters --------------------------------------------------------------------------------------------------------


STEPS = 1000


@pytest.fixture(scope="module")
def plain(files):
    """Position and force of the loop by `jacobi_plain`, by FMI version."""
    found = {}
    for version in (2, 3):
        with open_instances({"plant": files["Plant", version], "pd": files["Pd", version]}) as instances:
            m = make_master(
                instances, System([Component("plant", "x"), Component("pd", "x")], LOOP), "jacobi_plain", 1e-3
            )
            recording = m.record(["plant.position"], rows=STEPS + 1)
            m.initialize(starts={"plant.x": 1.0})
            m.advance(STEPS)
            found[version] = recording["plant.position"].copy()
    return found


PEER_VALUES = {"plant::x": 1.0}
PEER_LOOP = [(c.start.replace(".", "::", 1), c.end.replace(".", "::", 1)) for c in LOOP]


@VERSIONS
def test_parity_with_ecos(files, plain, ecos, version):
    found = ecos({"plant": files["Plant", version], "pd": files["Pd", version]}, 1e-3, PEER_VALUES, PEER_LOOP)
    positions = found.run(["plant::position"], STEPS)[:, 0]
    np.testing.assert_allclose(positions, plain[version][1:], rtol=0, atol=1e-9)


def test_parity_with_libcosim(files, plain, libcosim):
    found = libcosim({"plant": files["Plant", 2], "pd": files["Pd", 2]}, 1e-3, PEER_VALUES, PEER_LOOP)
    np.testing.assert_allclose(found.run(["plant::position"], STEPS)[:, 0], plain[2][1:], rtol=0, atol=1e-9)


# Initialization -------------------------------------------------------------------------------------------------------


def test_values_agree_before_the_first_step(master, files):
    m = loop(master, files, 2, "gauss_seidel")
    m.initialize(starts={"plant.x": 3.0})
    force = -3.0 * (KP + KD / TF)
    found = m.read(["pd.position", "pd.force", "plant.force", "plant.acceleration"])
    np.testing.assert_allclose(found, [3.0, force, force, force - 300.0], rtol=1e-15)
    assert m.time == 0.0


def test_a_run_begins_anew(master, files):
    m = loop(master, files, 2, "gauss_seidel")
    recording = m.record(["plant.position"], rows=51)
    runs = []
    for start_time in (0.0, 0.0, 5.0):
        m.initialize(start_time)
        m.advance(50)
        runs.append(recording.values.copy())
    assert runs[0].tolist() == runs[1].tolist()
    np.testing.assert_allclose(runs[2], runs[0], atol=1e-12)
    assert recording.time[-1] == 5.0 + 50 * 1e-3


def test_start_values_that_do_not_exist_or_are_no_numbers(master, files):
    m = loop(master, files, 2, "gauss_seidel")
    with pytest.raises(StructureError, match="did you mean"):
        m.initialize(starts={"plant.forc": 1.0})
    with pytest.raises(StructureError, match="no component is called 'plnt'; did you mean plant"):
        m.initialize(starts={"plnt.x": 1.0})
    for value in (np.nan, -np.inf):
        with pytest.raises(StructureError, match=rf"plant\.x starts at {value:g}, expected a finite number"):
            m.initialize(starts={"plant.v": 1.0, "plant.x": value})
    with pytest.raises(StructureError, match="initialize it first"):
        m.advance(1)


@pytest.mark.parametrize(("gain", "settles"), [(0.5, True), (-2.0, False)])
def test_values_that_do_not_settle(master, foreign, gain, settles):
    """Two FMUs with undeclared direct feedthrough from each other: y = 1 + gain u, both ways."""
    lie = {"behaviour": 7.0, "at": gain}
    connections = [Connection("a.y", "b.u"), Connection("b.y", "a.u")]
    m = master({"a": foreign[2], "b": foreign[2]}, connections, starts={"a": lie, "b": lie})
    if settles:
        m.initialize()
        np.testing.assert_allclose(m.read(["a.y", "b.y"]), 2.0, rtol=1e-11)
    else:
        with pytest.raises(StepError, match=r"a\.y -> b\.u|b\.y -> a\.u") as caught:
            m.initialize()
        assert caught.value.status == "does not settle"


@pytest.mark.parametrize(("step", "fitting"), [(3e-3, "0.00333333333"), (0.014, "0.01"), (1e-2 * 1.001, "0.01")])
def test_a_step_that_does_not_fit_the_ticks(master, files, step, fitting):
    m = loop(master, files, 2, "gauss_seidel", "SampledPd", step_size=step)
    with pytest.raises(StructureError, match=rf"pd\.sample_time is 0\.01 s .* fits is {fitting} s"):
        m.initialize()


# Recording, and the end of a run --------------------------------------------------------------------------------------


def test_recording_every_tenth(master, files):
    m = loop(master, files, 2, "gauss_seidel", step_size=5e-3)
    recording = m.record(["pd.position", "plant.velocity"], rows=5, every=10)
    m.initialize()
    m.advance(93)
    assert recording.rows == 10  # more than was asked for: it grows
    assert recording.time.tolist() == [k * 10 * 5e-3 for k in range(10)]
    expected = trajectory("gauss_seidel", 5e-3, 93)[::10]
    np.testing.assert_allclose(recording["pd.position"], expected, rtol=0, atol=1e-12)
    assert recording.values.shape == (10, 2)


def test_setting_between_steps(master, files):
    m = master({"plant": files["Plant", 3]}, step_size=1e-3)
    m.initialize()
    m.set({"plant.force": 2.0})
    assert m.read(["plant.acceleration"])[0] == 2.0
    m = loop(master, files, 3, "jacobi")
    m.initialize()
    with pytest.raises(StructureError, match=r"plant\.force is fed by a connection"):
        m.set({"plant.force": 2.0})


@pytest.mark.parametrize(
    ("starts", "status", "words"),
    [
        ({"behaviour": 6.0, "at": 0.05}, "not finite", "spring: y: not finite at t = 0.06 s: value nan"),
        ({"u": 20_500.0}, "out of bounds", "spring: y: out of bounds at t = 0.05 s: value 1025, expected -inf to 1000"),
        ({"behaviour": 3.0, "at": 0.05}, "error", "spring: fmi2DoStep: error at t = 0.05 s: the spring is broken"),
    ],
)
@pytest.mark.parametrize("connected", [True, False])
def test_a_response_that_leaves_its_bounds(master, foreign, starts, status, words, connected):
    """Connected or only recorded; all rows until then are kept, the wrong one included."""
    connections = [Connection("spring.y", "other.u")] if connected else []
    m = master({"spring": foreign[2], "other": foreign[2]}, connections, step_size=0.01, starts={"spring": starts})
    recording = m.record(["other.u" if connected else "spring.y"], rows=101)
    m.initialize()
    with pytest.raises(StepError) as caught:
        m.advance(100)
    assert str(caught.value).startswith(f"{words}; ")
    assert (caught.value.instance, caught.value.status) == ("spring", status)
    last = 5 if connected or status == "error" else round(caught.value.time / 0.01)
    assert recording.time.tolist()[:5] == [0.0, 0.01, 0.02, 0.03, 0.04]
    assert last <= recording.rows <= last + 1
    with pytest.raises(StructureError, match="initialize it first"):
        m.advance(1)


def test_a_warning_is_noted_once(master, foreign):
    m = master({"spring": foreign[2]}, step_size=0.01, starts={"spring": {"behaviour": 1.0}})
    m.initialize()
    m.advance(10)
    assert m.warnings == {"spring": "spring: fmi2DoStep: warning at t = 0 s: the spring is broken"}
    assert m.time == 10 * 0.01


def test_an_interrupted_run_keeps_what_it_has(master, files):
    m = loop(master, files, 2, "gauss_seidel", step_size=5e-3)
    recording = m.record(["plant.position"], rows=1000)
    m.initialize()
    threading.Timer(0.2, signal.raise_signal, [signal.SIGINT]).start()
    with pytest.raises(KeyboardInterrupt):
        m.advance(100_000_000)
    assert recording.rows > 100
    expected = trajectory("gauss_seidel", 5e-3, 100)
    np.testing.assert_allclose(recording["plant.position"][:101], expected, rtol=0, atol=1e-12)


def test_wrong_wiring_is_refused_before_anything_runs(master, files):
    found = {"a": files["Pd", 2], "b": files["Plant", 2]}
    with pytest.raises(StructureError, match=r"b\.acceleration is in m/s2, but a\.position in m"):
        master(found, [Connection("b.acceleration", "a.position")])
    with pytest.raises(StructureError, match="did you mean gauss_seidel"):
        master(found, algorithm="gauss-seidel")


def test_a_name_that_is_no_algorithm_is_refused_with_the_nearest():
    with pytest.raises(StructureError, match="no algorithm is called 'gaus_seidel'; did you mean gauss_seidel"):
        make_master({}, System([]), "gaus_seidel")
    with pytest.raises(StructureError, match=r"no algorithm is called 'aut'; did you mean auto"):
        check_algorithm("aut")
    check_algorithm("auto")
