"""The solvers: one list of them everywhere; exact to rounding, order 5 and its tolerance, order 4."""

import ctypes
import math
import re
import subprocess
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from hfsa.components import Model
from hfsa.components._modelling.model import SOLVERS as NAMES
from hfsa.fmus._solvers import SOLVERS
from hfsa.fmus.c_code import RUNTIME
from hfsa.fmus.compile import FLAGS, compiler

N = 4


def declared() -> set[str]:
    """Solvers that the generated table can point to."""
    lists = re.findall(r"extern const Solver ([^;]+);", (RUNTIME / "model.h").read_text())
    return {name.strip().removeprefix("hfsa_") for names in lists for name in names.split(",")}


def defined() -> set[str]:
    """Solvers that a file of their name defines."""
    found = r"^const Solver hfsa_{} = "
    files = RUNTIME.glob("*.c")
    return {file.stem for file in files if re.search(found.format(file.stem), file.read_text(), re.MULTILINE)}


def documented() -> set[str]:
    """Solvers in the table of `docs/your-tool.md`."""
    text = (Path(__file__).parents[2] / "docs/your-tool.md").read_text()
    return set(re.findall(r"^\| `(\w+)` \|", text.split("## Solvers of Co-Simulation")[1], re.MULTILINE))


@pytest.mark.parametrize(
    ("place", "names"),
    [
        ("SOLVERS of components/_modelling/model.py", set(NAMES)),
        ("a file fmus/runtime/NAME.c with `const Solver hfsa_NAME`", defined()),
        ("`extern const Solver` in fmus/runtime/model.h", declared()),
        ("the table of docs/your-tool.md", documented()),
    ],
    ids=["models", "runtime", "header", "page"],
)
def test_every_place_that_lists_solvers_lists_those_of_the_table(place, names):
    lacking, unknown = set(SOLVERS) - names, names - set(SOLVERS)
    assert not lacking, f"fmus/_solvers.py has {lacking}, {place} has not"
    assert not unknown, f"{place} has {unknown}, fmus/_solvers.py has not"


@pytest.fixture(scope="session")
def loop(tmp_path_factory) -> ctypes.CDLL:
    """harness/loop.c as a library."""
    library = tmp_path_factory.mktemp("loop") / "loop.so"
    source = Path(__file__).parent / "harness" / "loop.c"
    subprocess.run(
        [*compiler(), *FLAGS, "-fvisibility=default", "-shared", str(source), "-o", str(library)], check=True
    )
    return ctypes.CDLL(str(library))


def many_steps(loop: ctypes.CDLL, it, step_size: float, count: int, first: int = 0) -> None:
    do_step = ctypes.cast(getattr(it.fmu.dll, f"fmi{it.version}DoStep"), ctypes.c_void_p)
    call = getattr(loop, f"steps{it.version}")
    component = ctypes.c_void_p(it.fmu.component)
    status = call(do_step, component, ctypes.c_double(step_size), ctypes.c_int64(first), ctypes.c_int64(count))
    assert status == 0, it.messages


def linear() -> Model:
    """Any x' = A x + B u: every entry is a parameter, so one binary serves all matrices."""
    m = Model("Linear", "Any linear system")
    a = m.parameter(f"a[1..{N * N}]", [0.0] * (N * N), "1/s", "A by rows")
    b = m.parameter(f"b[1..{N}]", [0.0] * N, "1/s", "B")
    u = m.input("u", "1", "Input")
    x = m.state(f"x[1..{N}]", "1", "States")
    m.der[x] = ca.reshape(a, N, N).T @ x + b * u
    m.output("y", ca.sum1(x), "1", "Sum")
    return m


def start_linear(it, A, b, x0, u: float):
    it.set({f"a[{i + 1}]": value for i, value in enumerate(np.asarray(A, float).ravel())})
    it.set({f"b[{i + 1}]": value for i, value in enumerate(b)})
    it.set({f"x[{i + 1}]": value for i, value in enumerate(x0)})
    it.set({"u": u})
    return it.initialize()


def states(it) -> np.ndarray:
    return np.array(it.get(*it.names("state")))


def block(*parts) -> np.ndarray:
    A = np.zeros((N, N))
    at = 0
    for part in parts:
        part = np.atleast_2d(part)
        A[at : at + len(part), at : at + len(part)] = part
        at += len(part)
    return A


def oscillator(omega: float, damping: float = 0.0) -> np.ndarray:
    return np.array([[0.0, 1.0], [-(omega**2), -damping]])


ROTATION = np.linalg.qr(np.random.default_rng(3).normal(size=(N, N)))[0]
MATRICES = {
    "undamped": block(oscillator(30.0), oscillator(200.0)),
    "damped": block(oscillator(50.0, 3.0), oscillator(400.0, 40.0)),
    "defective": np.diag([-2.0] * N) + np.diag([1.0] * (N - 1), 1),
    "integrators": np.diag([1.0] * (N - 1), 1),
    "zero": np.zeros((N, N)),
    "coupled": ROTATION @ np.diag([-1.0, -30.0, -200.0, -5.0]) @ ROTATION.T,
    "unstable": block(3.0, -1.0, oscillator(10.0)),
    "nonnormal": np.triu(np.full((N, N), 1e3), 1) - np.diag([1.0, 2.0, 3.0, 4.0]),
}


def hold(A, b, x, u, h, slope=0.0, curvature=0.0) -> np.ndarray:
    """x(t + h) by one exponential of the system with its input and the derivatives of it as states."""
    n = len(x)
    big = np.zeros((n + 3, n + 3))
    big[:n, :n], big[:n, n], big[n, n + 1], big[n + 1, n + 2] = A, b, 1.0, 1.0
    return expm(big * h)[:n] @ np.concatenate([x, [u, slope, curvature]])


# exact ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", MATRICES)
@pytest.mark.parametrize("h", [1e-3, 0.02])
@pytest.mark.parametrize("derivatives", [(), (-3.0,), (-3.0, 500.0)])
def test_exact_equals_the_matrix_exponential(instance, version, name, h, derivatives):
    """Inputs held, on lines and on parabolas, ten steps, every kind of matrix."""
    A, b = MATRICES[name], np.array([1.0, -2.0, 0.5, 3.0])
    x, u = np.array([1.0, 0.3, -0.7, 0.2]), 0.7
    it = start_linear(instance(linear(), version), A, b, x, u)
    for k in range(10):
        if derivatives:
            it.move({"u": derivatives})
        it.step(k * h, h)
        x = hold(A, b, x, u, h, *derivatives)
        u += sum(d * h**n / n for n, d in enumerate(derivatives, 1))
        scale = max(np.abs(x).max(), 1.0)
        np.testing.assert_allclose(states(it) / scale, x / scale, atol=1e-12)
    assert it.get("u") == pytest.approx([u])


@pytest.mark.parametrize("h", [1e-3, 1.0])
def test_exact_knows_the_slow_mode_beside_one_a_million_million_times_faster(instance, h):
    """Rates of 1 and 1e12, coupled one way: the closed form to 1e-12, where a scaled e^z alone would keep 4 digits."""
    fast, slow = 1e12, 1.0
    A = block(-slow, -fast, -2.0, 0.0)
    A[1, 0] = fast
    b = np.array([1.0, 0.0, 1.0, 1.0])
    it = start_linear(instance(linear()), A, b, [1.0, 5.0, 1.0, 0.0], 0.5)
    it.step(0.0, h)
    first = 0.5 + 0.5 * math.exp(-h)
    # the fast state follows the slow one with a lag of 1/fast
    expected = [first, first + 0.5 * math.exp(-h) / fast, 0.25 + 0.75 * math.exp(-2 * h), 0.5 * h]
    np.testing.assert_allclose(states(it), expected, rtol=1e-12)


def pair() -> Model:
    """Two masses, each on a soft spring to the ground, and a spring a million million times stiffer between them."""
    m = Model("Pair", "Stiffly coupled pair of masses")
    k = m.parameter("stiffness", 1e12, "N/m", "Spring between")
    x = m.state("x[1..2]", "m", "Positions", start=1.0)
    v = m.state("v[1..2]", "m/s", "Velocities")
    m.der[x] = v
    m.der[v] = ca.vertcat(-k * (x[0] - x[1]) - x[0], k * (x[0] - x[1]) - x[1])
    m.output("middle", ca.sum1(x) / 2, "m", "Middle")
    return m


def test_exact_keeps_a_stiff_pair_of_masses_together(instance):
    """They move together with the frequency of the soft springs, 1 rad/s; powers of scipy's expm miss by 1e-5."""
    it = instance(pair()).initialize()
    it.step(0.0, 0.01, 100)
    np.testing.assert_allclose(it.get("x[1]", "x[2]"), math.cos(1.0), rtol=1e-6)


@pytest.mark.parametrize("damping", [0.0, 1e-9])
def test_exact_keeps_the_energy_of_an_oscillator_for_a_million_steps(instance, loop, version, damping):
    omega, h, count = 2 * math.pi * 50.0, 1e-3, 1_000_000
    it = start_linear(
        instance(linear(), version), block(oscillator(omega, damping), 0, 0), [0.0] * N, [1.0, 0, 0, 0], 0.0
    )
    many_steps(loop, it, h, count)
    x, v, *_ = states(it)
    energy = x**2 + (v / omega) ** 2
    assert energy == pytest.approx(math.exp(-damping * h * count), rel=1e-9)


def test_exact_follows_a_parameter_and_a_step_size(instance):
    """Matrices are made anew when a parameter or the step changes, and found again when it changes back."""
    A = MATRICES["damped"].copy()
    x = np.array([1.0, 0.0, 0.5, -2.0])
    it = start_linear(instance(linear()), A, np.zeros(N), x, 0.0)
    time = 0.0
    for k, h in enumerate([1e-3, 2e-3, 1e-3, 5e-4] * 6):
        A[1, 0] = -2500.0 * (1 + k % 3)
        it.set({f"a[{N + 1}]": A[1, 0]})
        it.step(time, h)
        time += h
        x = expm(A * h) @ x
        np.testing.assert_allclose(states(it), x, rtol=1e-11, atol=1e-13)


def test_exact_rests_exactly_at_an_equilibrium(instance, version):
    """No rounding drives what stands still."""
    it = instance("mass_on_spring", version)
    it.set({"base.position": 0.123, "mass.position": 0.123})
    it.initialize()
    it.step(0.0, 1e-3, 50)
    assert states(it).tolist() == [0.123, 0.0]


def test_exact_refuses_what_has_no_finite_matrices(instance):
    it = start_linear(instance(linear()), block(1e3, 0, 0, 0), [0.0] * N, [1.0] * N, 0.0)
    with it.refused("state x[1]", "inf"):
        it.step(0.0, 1.0)
    assert states(it).tolist() == [1.0] * N


def test_a_mixed_model_equals_its_discretisation(instance, version):
    """Mass under sampled control: the step over many ticks equals z' = z-map after expm over each sample time."""
    it = instance("hybrid", version)
    it.set({"target": 0.3})
    it.initialize()
    A, T = oscillator(20.0, 0.5), 2e-3
    x, z = np.array([1.0, 0.0]), 0.0
    seen = []
    for _ in range(25):
        seen.append(x[0] + 0.3)
        z = 0.9 * z - 0.2 * x[1] + 3 * 0.3
        x = hold(A, np.array([0.0, 1.0]), x, z + 0.3, T)
    it.step(0.0, 5e-3, 10)
    np.testing.assert_allclose(it.get("position", "velocity", "force", "seen"), [*x, z, seen[-1]], rtol=1e-12)


# rosenbrock -----------------------------------------------------------------------------------------------------------


FINE = {"rtol": 3e-14, "atol": 1e-14}


def reference(model_name: str, inputs, time: float) -> np.ndarray:
    """Another integrator, near rounding."""
    if model_name == "pendulum":
        (torque,) = inputs

        def f(t, x):
            return [x[1], -9.81 / 0.5 * math.sin(x[0]) - 0.1 * x[1] + torque(t) * math.cos(3 * t)]

        x0 = [0.4, 0.0]
    else:

        def f(t, x):
            q, v = x[:2], x[2:]
            c = math.cos(q[1])
            mass = np.array([[3 + 2 * c, 1 + c], [1 + c, 1]])
            force = np.array([u(t) for u in inputs]) - 5.0 * np.sin(q) * math.cos(t) - 0.1 * v
            return np.concatenate([v, np.linalg.solve(mass, force)])

        x0 = [0.3, -0.2, 0.0, 0.0]
    return solve_ivp(f, (0, time), x0, method="DOP853", **FINE).y[:, -1]


@pytest.mark.parametrize("model_name", ["pendulum", "two_link"])
def test_rosenbrock_has_order_5(instance, model_name):
    """Tolerance out of the way, equal steps in one communication step, time and moving inputs in the derivative."""
    derivatives, errors, steps = [(3.0, 10.0), (-2.0, 15.0)], [], [0.1, 0.05, 0.025, 0.0125]
    inputs = [lambda t, s=s, c=c: 0.5 + s * t + c * t**2 / 2 for s, c in derivatives]
    for step in steps:
        it = instance(model_name)
        names = it.names("input")
        expected = reference(model_name, inputs[: len(names)], 0.4)
        it.set({"solver.relative_tolerance": 1e6, "solver.maximum_step": step})
        it.set(dict.fromkeys(names, 0.5))
        it.initialize()
        it.move(dict(zip(names, derivatives, strict=False)))
        it.step(0.0, 0.4)
        errors.append(np.abs(states(it) - expected).max())
    orders = np.diff(np.log(errors)) / np.diff(np.log(steps))
    assert errors[0] < 1e-2
    assert orders[-1] == pytest.approx(5.0, abs=0.35)


def test_rosenbrock_has_order_5_along_an_input_that_alone_depends_on_time(instance, models):
    """Without its motion in the derivative it is of order 2."""
    model, errors = models["van_der_pol"](), []
    model.solver = "rosenbrock"
    expected = solve_ivp(
        lambda t, x: [x[1], (1 - x[0] ** 2) * x[1] - x[0] + 3 * t + 9 * t**2], (0, 0.4), [2, 0], "DOP853", **FINE
    )
    for step in (0.05, 0.025):
        it = instance(model)
        it.set({"solver.relative_tolerance": 1e6, "solver.maximum_step": step})
        it.initialize()
        it.move({"u": (3.0, 18.0)})
        it.step(0.0, 0.4)
        errors.append(np.abs(np.array(it.get("x", "v")) - expected.y[:, -1]).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(5.0, abs=0.35)


@pytest.mark.parametrize("model_name", ["pendulum", "two_link"])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-10])
@pytest.mark.parametrize("step", [0.4, 0.01])
def test_rosenbrock_keeps_its_tolerance(instance, model_name, tolerance, step):
    it = instance(model_name)
    names = it.names("input")
    it.set({"solver.relative_tolerance": tolerance, **dict.fromkeys(names, 1.0)})
    it.initialize()
    it.step(0.0, step, round(2.0 / step))
    expected = reference(model_name, [lambda t: 1.0] * len(names), 2.0)
    scale = np.array([v.nominal for v in it.variables if v.role.value == "state"]) + np.abs(expected)
    assert np.max(np.abs(states(it) - expected) / scale) < 30 * tolerance


def stiff() -> Model:
    """After Prothero and Robinson: x relaxes to sin t at any rate, and pulls a slow state along."""
    m = Model("Stiff", "Stiff relaxation")
    rate = m.parameter("rate", 1e6, "1/s", "Rate")
    x = m.state("x", "1", "Relaxed")
    y = m.state("y", "1", "Slow", start=1.0)
    m.der[x] = -rate * (x - ca.sin(m.time)) * (1 + 0.1 * y**2) + ca.cos(m.time)
    m.der[y] = -x * y
    m.output("error", x - ca.sin(m.time), "1", "Error")
    return m


@pytest.mark.parametrize("rate", [1e3, 1e9])
def test_rosenbrock_takes_long_steps_on_stiff_models(instance, rate):
    """20 communication steps of 0.05 s, each 5e7 time constants long, within tolerance and at once."""
    it = instance(stiff())
    it.set({"rate": rate, "solver.relative_tolerance": 1e-6})
    it.initialize()
    it.step(0.0, 0.05, 20)
    x, y = states(it)
    assert x == pytest.approx(math.sin(1.0), abs=1e-6)
    assert y == pytest.approx(math.exp(math.cos(1.0) - 1), abs=1e-5)


def blow_up() -> Model:
    m = Model("BlowUp", "x' = x^2 is infinite at t = 1/x(0)")
    x = m.state("x", "1", "State", start=1.0)
    m.der[x] = x**2
    m.output("y", x, "1", "State")
    return m


def test_rosenbrock_says_where_and_for_what_it_cannot_go_on(instance, version):
    it = instance(blow_up(), version).initialize()
    it.step(0.0, 0.5)
    assert it.get("x") == pytest.approx([2.0], rel=1e-7)
    with it.refused("logStatusDiscard", "no step from 1.0000000", "state x"):
        it.step(0.5, 1.0)
    assert it.get("time") == [0.5]
    assert it.get("x") == pytest.approx([2.0], rel=1e-7)
    it.step(0.5, 0.25)
    assert it.get("x") == pytest.approx([4.0], rel=1e-7)


def test_rosenbrock_serves_short_and_long_steps_in_turn(instance):
    """The step it carries over is a guess, not a promise."""
    it = instance("pendulum").initialize()
    time = 0.0
    for step in [1e-3] * 100 + [0.9] + [1e-6] * 100 + [0.9999]:
        it.step(time, step)
        (time,) = it.get("time")
    expected = reference("pendulum", [lambda t: 0.0], time)
    np.testing.assert_allclose(states(it), expected, rtol=1e-6)


# rk4 ------------------------------------------------------------------------------------------------------------------


def test_rk4_has_order_4(instance):
    errors, steps = [], [0.02, 0.01, 0.005]

    def f(t, x):
        return [x[1], (1 - x[0] ** 2) * x[1] - x[0] + 0.3 + 2.0 * t + 3.0 * t**2]

    expected = solve_ivp(f, (0, 1), [2.0, 0.0], method="DOP853", **FINE).y[:, -1]
    for step in steps:
        it = instance("van_der_pol")
        it.set({"solver.maximum_step": step, "u": 0.3})
        it.initialize()
        it.move({"u": (2.0, 6.0)})
        it.step(0.0, 1.0)
        errors.append(np.abs(states(it) - expected).max())
    orders = np.diff(np.log(errors)) / np.diff(np.log(steps))
    assert orders[-1] == pytest.approx(4.0, abs=0.15)


def test_rk4_divides_a_step_into_equal_ones(instance):
    """A step of 1 s with steps of at most 0.3 s is four of 0.25 s."""
    ends = []
    for maximum in (0.3, 0.25):
        it = instance("van_der_pol")
        it.set({"solver.maximum_step": maximum})
        it.initialize()
        it.step(0.0, 1.0)
        ends.append(states(it).tolist())
    assert ends[0] == ends[1]
    with it.refused("logStatusDiscard", "solver.maximum_step"):
        it.step(1.0, 1e9)
