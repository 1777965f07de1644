"""CVODE inside a Co-Simulation FMU: accurate, without a memory from step to step, silent; or a clear refusal.

Where SUNDIALS' static libraries are not installed, only the refusal is tested.
"""

import zipfile

import fmpy
import numpy as np
import pytest

from hfsa.components import Model
from hfsa.fmus._sundials import sundials
from hfsa.fmus.c_code import generate
from hfsa.fmus.check import check
from hfsa.fmus.compile import CVODE, compile_library, source_files
from hfsa.fmus.errors import ExportError
from hfsa.fmus.export import export


@pytest.fixture(scope="module")
def installed() -> None:
    """Skip where an FMU cannot be linked to SUNDIALS."""
    try:
        sundials()
    except ExportError as error:
        pytest.skip(str(error))


@pytest.fixture
def solved(models, installed):
    """A model of conftest.py with this solver, by name."""

    def made(name: str) -> Model:
        model = models[name]()
        model.solver = "cvode"
        return model

    return made


def states(it) -> np.ndarray:
    return np.array(it.get(*it.names("state")))


# Without SUNDIALS -----------------------------------------------------------------------------------------------------


def test_what_is_missing_is_said_with_what_there_is(models, monkeypatch, tmp_path):
    monkeypatch.setenv("SUNDIALS_ROOT", str(tmp_path))
    model = models["pendulum"]()
    model.solver = "cvode"
    with pytest.raises(ExportError, match=r"libsundials-dev.*has no include/cvode/cvode.h and 6 more.*'rosenbrock'"):
        compile_library(generate(model), tmp_path / "out")
    (tmp_path / "include" / "cvode").mkdir(parents=True)
    (tmp_path / "include" / "cvode" / "cvode.h").touch()
    with pytest.raises(ExportError, match=r"has no libsundials_cvode.a and 5 more"):
        compile_library(generate(model), tmp_path / "out")


def test_other_fmus_need_nothing_of_it(models, monkeypatch, tmp_path):
    """Neither those of other solvers nor those that have nothing to solve carry its source."""
    monkeypatch.setenv("SUNDIALS_ROOT", str(tmp_path))
    stateless = models["gain"]()
    stateless.solver = "cvode"
    for model in (models["pendulum"](), stateless):
        assert CVODE not in source_files(generate(model))
        compile_library(generate(model), tmp_path / "out")


# With it --------------------------------------------------------------------------------------------------------------


def test_the_fmu_brings_all_of_it_along(installed, tmp_path):
    """Checked as every export is: no name of SUNDIALS is exported, both interfaces run; its licence goes along."""
    model = Model("Decay", "Decay")
    x = model.state("x", "1", "State", start=1.0)
    model.der[x] = -(x**2)
    model.solver = "cvode"
    for file in export(model, tmp_path):
        assert check(file) == []
        names = zipfile.ZipFile(file).namelist()
        assert {"sources/cvode.c", "documentation/licenses/sundials.txt"} <= set(names)
        result = fmpy.simulate_fmu(str(file), stop_time=3.0, output_interval=0.5, output=["x"])
        np.testing.assert_allclose(result["x"], 1 / (1 + result["time"]), rtol=1e-6)


@pytest.mark.parametrize("name", ["pendulum", "two_link"])
def test_it_keeps_its_tolerance(instance, models, solved, version, name):
    """Along moving inputs, with steps shorter and longer than its own, against RODAS5P at 1e-12."""

    def run(model: Model, tolerance: float, step: float) -> np.ndarray:
        it = instance(model, version)
        it.set({"solver.relative_tolerance": tolerance, **dict.fromkeys(it.names("input"), 1.0)})
        it.initialize()
        for k in range(round(1.2 / step)):
            it.move(dict.fromkeys(it.names("input"), (3.0 - k * step, 5.0)))
            it.step(k * step, step)
        return states(it)

    for step in (0.4, 0.01):
        expected = run(models[name](), 1e-12, step)
        errors = [np.abs(run(solved(name), tolerance, step) - expected).max() for tolerance in (1e-5, 1e-8)]
        assert errors[0] < 1e-2
        assert errors[1] < 1e-5
        assert errors[1] < 0.05 * errors[0]


def test_ticks_inside_a_step(instance, solved, version):
    """The mass under sampled control, against the exact solution of the same model."""
    ends = []
    for model in (solved("hybrid"), "hybrid"):
        it = instance(model, version).initialize()
        it.set({"target": 0.3})
        it.move({"target": (2.0, -9.0)})
        it.step(0.0, 9e-3)
        ends.append(it.get("position", "velocity", "force", "seen", "target"))
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-6)


def test_a_step_depends_on_the_state_alone(instance, solved, version):
    """Repeated after others, in another instance, or with its memory full: the same bits."""
    it, fresh = (instance(solved("two_link"), version).initialize() for _ in range(2))
    it.set({"torque[1]": 2.0})
    it.step(0.0, 0.02, 10)
    state = it.state()
    it.step(0.2, 0.05)
    first = states(it).tolist()
    it.set({"torque[1]": -30.0})
    it.step(0.25, 0.3)
    it.restore(state)
    it.step(0.2, 0.05)
    assert states(it).tolist() == first
    it.restore(state)
    received = fresh.deserialize(it.serialize(state))
    fresh.restore(received)
    fresh.step(0.2, 0.05)
    assert states(fresh).tolist() == first
    for one, kept in ((it, state), (fresh, received)):
        one.free_state(kept)


def test_it_says_where_and_for_what_it_cannot_go_on(instance, installed, version, capfd):
    """Discard, the instance as it was before, and nothing printed."""
    m = Model("Explosion", "x' = x^2 is infinite at t = 1/x(0)")
    calm = m.state("calm", "1", "Constant", start=1.0)
    x = m.state("x", "1", "State", start=1.0)
    m.der[calm] = 0
    m.der[x] = x**2
    m.solver = "cvode"
    it = instance(m, version).initialize()
    it.step(0.0, 0.5)
    before = it.get("x", "calm")
    with it.refused("logStatusDiscard", "CVODE stopped at time", "state x"):
        it.step(0.5, 1.0)
    assert it.get("time", "x", "calm") == [0.5, *before]
    it.step(0.5, 0.25)
    assert it.get("x") == pytest.approx([4.0], rel=1e-5)
    assert "".join(capfd.readouterr()) == ""


def test_its_settings(instance, solved, version):
    """Lower orders and shorter steps act; an order that is none is refused."""
    exact = instance("chain", version).initialize()
    exact.step(0.0, 0.2)
    errors = []
    for settings in ({}, {"solver.maximum_order": 1.0}, {"solver.maximum_step": 1e-5}):
        it = instance(solved("chain"), version)
        it.set({"solver.relative_tolerance": 1e-3, **settings})
        it.initialize().step(0.0, 0.2)
        errors.append(np.abs(states(it) - states(exact)).max())
    assert errors[1] > 10 * errors[0]
    assert errors[2] < 0.6 * errors[0]
    it = instance(solved("chain"), version)
    for order in (0.0, 6.0):
        with it.refused("solver.maximum_order", f"cannot be {order:g}"):
            it.set({"solver.maximum_order": order})
