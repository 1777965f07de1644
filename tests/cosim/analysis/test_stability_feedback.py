"""Step limits of linearised feedback: none where a plant closes its loop itself, one where plants are coupled.

    mass 1 --- k, c --- mass 2        the law of both forces is one FMU, each mass another

Each mass takes its own motion into account within a step, and that of the other on a line at the rate of the
communication point.
"""

import numpy as np
import pytest
from mass_and_law import law, plant

from hfsa.components import Model
from hfsa.components._modelling.feedback_ports import with_linear_feedback
from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, Connection, System

ALGORITHM = "linearized_feedback"
SENSED = ("position", "velocity")


def spring() -> Model:
    """A spring with a damper between two masses, and a weaker one from the first to the ground."""
    m = Model("Spring", "Springs on two masses")
    q = [m.input(f"position[{i}]", "m", "Position") for i in (1, 2)]
    v = [m.input(f"velocity[{i}]", "m/s", "Velocity") for i in (1, 2)]
    force = 1e4 * (q[0] - q[1]) + 2 * (v[0] - v[1])
    m.output("force[1]", -force - 1e3 * q[0], "N", "Force on the first")
    m.output("force[2]", force, "N", "Force on the second")
    return m


@pytest.fixture(scope="module")
def made(exported):
    """FMUs by name; `bare` is the mass without ports."""
    ported = with_linear_feedback(plant(), [("force", name) for name in SENSED])
    models = {"bare": plant(), "mass": ported, "law": law(), "spring": spring()}
    return {name: exported(model)[2] for name, model in models.items()}


@pytest.fixture
def alone(opened, made):
    """A mass under the law: the system, and its instances with ports or without."""
    sensed = [Connection(f"mass.{name}", f"law.{name}") for name in SENSED]
    system = System([Component("mass", "x"), Component("law", "x")], [Connection("law.force", "mass.force"), *sensed])
    return system, lambda name: opened({"mass": made[name], "law": made["law"]})


@pytest.fixture
def coupled(opened, made):
    """Two masses and what couples them."""
    connections = [Connection(f"spring.force[{i}]", f"mass[{i}].force") for i in (1, 2)]
    connections += [Connection(f"mass[{i}].{name}", f"spring.{name}[{i}]") for i in (1, 2) for name in SENSED]
    components = [
        Component("mass[1]", "x"),
        Component("mass[2]", "x", start={"damping": 1.0}),
        Component("spring", "x"),
    ]
    return System(components, connections), opened(
        {"mass[1]": made["mass"], "mass[2]": made["mass"], "spring": made["spring"]}
    )


def test_a_plant_that_closes_its_loop_itself_has_no_limit(alone):
    """Kp = 5e16, Kv = 6e8: its modes are the loop's own, -1e8 and -5e8 1/s, whatever the step; held forces grow."""
    system, instances = alone
    for coupled in (CoupledStep(system, instances(name), ALGORITHM) for name in ("bare", "mass")):
        modes = coupled.over(1e-9).modes
        assert [mode.rate for mode in modes] == pytest.approx([-1e8, -5e8], rel=1e-6)
        assert all(coupled.over(step_size).is_stable() for step_size in np.geomspace(1e-10, 1e-2, 9))
    held = CoupledStep(system, instances("bare"), "gauss_seidel")
    assert not any(held.over(step_size).is_stable() for step_size in (1e-6, 1e-5, 1e-4))


@pytest.mark.parametrize("step_size", [1e-8, 1e-6, 1e-5, 1e-4])
def test_without_a_limit_it_decays_in_simulation(alone, step_size):
    """At 10 ns at the rate of the slower mode; at more than a microsecond nothing is left after a step or two."""
    system, instances = alone
    master = make_master(instances("mass"), system, "linearized_feedback", step_size)
    recording = master.record(["mass.q"], 21)
    master.initialize(starts={"mass.q": 1.0})
    master.advance(20)
    found = np.abs(recording["mass.q"])
    if step_size == 1e-8:
        assert np.log(found[20] / found[10]) / (10 * step_size) == pytest.approx(-1e8, rel=1e-6)
    else:
        assert found[3:].max() < 1e-6


def test_held_forces_grow_at_those_steps(alone):
    system, instances = alone
    master = make_master(instances("mass"), system, "gauss_seidel", 1e-6)
    recording = master.record(["mass.q"], 21)
    master.initialize(starts={"mass.q": 1.0})
    with pytest.raises(StepError):
        master.advance(200)
    assert abs(recording["mass.q"][3]) > 1e6


def test_plants_that_cross_have_a_limit(coupled):
    """6.74 ms, beyond 0.44 ms for held forces, but below 24.2 ms for iterated ones."""
    system, instances = coupled
    limits = {
        name: CoupledStep(system, instances, name).stability_limits(1e-4, 0.1, points=40)
        for name in (ALGORITHM, "gauss_seidel", "quasi_newton")
    }
    assert limits == {
        ALGORITHM: pytest.approx([6.743e-3], rel=1e-3),
        "gauss_seidel": pytest.approx([0.4363e-3], rel=1e-3),
        "quasi_newton": pytest.approx([24.19e-3], rel=1e-3),
    }


@pytest.mark.parametrize("factor", [0.5, 0.98, 1.02, 1.5])
def test_crossing_plants_grow_and_decay_as_predicted(coupled, factor):
    """At the rate of the slowest mode, seen early and late over the motion of the first mass."""
    system, instances = coupled
    step_size = factor * 6.743e-3
    mode = CoupledStep(system, instances, ALGORITHM).over(step_size).modes[0]
    assert (mode.rate > 0) == (factor > 1)
    master = make_master(instances, system, "linearized_feedback", step_size)
    steps = 4000 if abs(mode.rate) * step_size < 0.02 else 400
    recording = master.record(["mass[1].q"], steps + 1)
    master.initialize(starts={"mass[1].q": 1.0})
    master.advance(steps)
    window, first, last = steps // 10, steps // 4, steps * 7 // 8
    early, late = (np.linalg.norm(recording["mass[1].q"][k : k + window]) for k in (first, last))
    assert np.log(late / early) / ((last - first) * step_size) == pytest.approx(mode.rate, rel=0.02)


def test_what_has_nothing_to_feed_back_is_refused(opened, files):
    system = System([Component("plant", "x")])
    with pytest.raises(StructureError, match="there is nothing to feed back"):
        CoupledStep(system, opened({"plant": files["Plant", 2]}), ALGORITHM)
