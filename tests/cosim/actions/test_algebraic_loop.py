"""Algebraic loops: solved at the start and at every point for every gain, by either stepping loop, else an error."""

import numpy as np
import pytest
from algorithm_groups import EXTRAPOLATED, HELD, ITERATED

from hfsa.components import Model
from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.feedthrough import refuse_loops
from hfsa.cosim.systems.system import Component, Connection, System

RING = [Connection("a.y", "b.u"), Connection("b.y", "a.u")]
VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
each_algorithm = pytest.mark.parametrize("algorithm", [*HELD, *EXTRAPOLATED, *ITERATED])


def gain() -> Model:
    """A gain without a state."""
    m = Model("Gain", "y = g u + h u^2 + 1")
    g = m.parameter("g", 0.5, "1", "Gain")
    h = m.parameter("h", 0.0, "1", "Curvature")
    u = m.input("u", "1", "Input")
    m.output("y", g * u + h * u * u + 1, "1", "Output")
    return m


def body() -> Model:
    """A mass with direct feedthrough from force to acceleration."""
    m = Model("Body", "Mass on a spring")
    force = m.input("force", "N", "Force")
    x = m.state("x", "m", "Position", start=1.0)
    v = m.state("v", "m/s", "Velocity")
    m.der[x], m.der[v] = v, force - 100 * x
    m.output("acceleration", force - 100 * x, "m/s2", "Acceleration")
    m.output("position", x, "m", "Position")
    return m


def accelerating() -> Model:
    """A force with direct feedthrough from the acceleration, like a further mass."""
    m = Model("Added", "Added mass")
    mass = m.parameter("mass", 3.0, "kg", "Added mass")
    a = m.input("acceleration", "m/s2", "Acceleration")
    m.output("force", -mass * a, "N", "Force")
    return m


@pytest.fixture(scope="module")
def parts(exported):
    models = gain(), body(), accelerating()
    return {(model.name, version): file for model in models for version, file in exported(model).items()}


@pytest.fixture(params=["python", "c"])
def ring(request, parts, opened, library):
    """Make masters of the ring."""

    def make(start, version=2, algorithm="gauss_seidel"):
        system = System([Component(name, "x", start=start) for name in "ab"], RING)
        found = dict.fromkeys("ab", parts["Gain", version])
        return make_master(opened(found), system, algorithm, 0.1, library if request.param == "c" else None)

    return make


@VERSIONS
@each_algorithm
@pytest.mark.parametrize(("g", "expected"), [(0.5, 2.0), (-2.0, 1 / 3), (1e3, 1 / (1 - 1e3)), (0.0, 1.0)])
def test_the_ring_is_solved_at_the_start_and_at_every_step(ring, version, algorithm, g, expected):
    master = ring({"g": g}, version, algorithm)
    recording = master.record(["a.y", "b.y"], rows=51)
    master.initialize()
    master.advance(50)
    np.testing.assert_allclose(recording.values, expected, rtol=4e-15, atol=4e-13 if g > 1 else 0)


def test_a_curved_ring_is_solved_by_as_many_inverses_as_it_takes(ring):
    """Symmetric solutions: h y^2 + (g - 1) y + 1 = 0."""
    master = ring({"g": -2.0, "h": 0.5})
    master.initialize()
    assert master.read(["a.y"])[0] == pytest.approx(min(np.roots([0.5, -3.0, 1.0])), rel=1e-12)


def test_a_ring_without_a_solution_is_an_error(ring):
    with pytest.raises(StepError, match=r"a\.y|b\.y.*not solved after \d+ passes.*residual"):
        ring({"g": 1.0, "h": 1.0}).initialize()  # y = y + y^2 + 1


def test_a_gain_of_one_is_an_error(ring):
    with pytest.raises(StepError, match="loop gain 1"):
        ring({"g": 1.0}).initialize()


@each_algorithm
@pytest.mark.parametrize("way", ["python", "c"])
def test_a_mass_added_through_a_loop_is_a_mass(parts, opened, library, way, algorithm):
    """X'' = -100 x + f, f = -3 x'': oscillates at 5 rad/s for small steps; a = -25 x at every point."""
    system = System(
        [Component("body", "x"), Component("added", "x")],
        [Connection("body.acceleration", "added.acceleration"), Connection("added.force", "body.force")],
    )
    found = {"body": parts["Body", 2], "added": parts["Added", 2]}
    errors = []
    for steps in (200, 400):
        master = make_master(opened(found), system, algorithm, 0.2 / steps, library if way == "c" else None)
        recording = master.record(["body.position", "body.acceleration"], rows=steps + 1)
        master.initialize()
        master.advance(steps)
        np.testing.assert_allclose(recording["body.acceleration"], -25 * recording["body.position"], atol=1e-12)
        errors.append(abs(recording["body.position"][-1] - np.cos(5 * 0.2)))
    order = 1 if algorithm in HELD else 3 if algorithm.endswith("quadratic") else 2
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.3)
    modes = CoupledStep(system, opened(found), algorithm).over(1e-3).modes
    assert min(abs(2 * np.pi * mode.frequency - 5.0) for mode in modes) < 0.05


def test_a_loop_can_be_refused(parts, opened):
    system = System([Component(name, "x") for name in "ab"], RING)
    connectors = {n: i.fmu.variables for n, i in opened(dict.fromkeys("ab", parts["Gain", 2])).items()}
    with pytest.raises(StructureError, match=r"algebraic loop: ([ab]\.[uy] -> ){4}"):
        refuse_loops(system, connectors)


FOLLOW = 7.0


@VERSIONS
@pytest.mark.parametrize("way", ["python", "c"])
@pytest.mark.parametrize("g", [0.5, -2.0])
def test_an_fmu_without_derivatives_is_asked_by_differences(opened, foreign, library, rewritten, version, way, g):
    """An output with direct feedthrough, y = 1 + at u, without declared dependencies."""
    file = rewritten(foreign[version], ' dependencies=""', "")
    system = System([Component(name, "x", start={"behaviour": FOLLOW, "at": g}) for name in "ab"], RING)
    found = opened(dict.fromkeys("ab", file))
    master = make_master(found, system, "gauss_seidel", 0.1, library if way == "c" else None)
    recording = master.record(["a.y", "b.y"], rows=11)
    master.initialize()
    master.advance(10)
    np.testing.assert_allclose(recording.values, 1 / (1 - g), rtol=1e-9)
