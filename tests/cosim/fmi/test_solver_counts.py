"""Counts of the solvers inside the FMUs of a run: per instance, in sum, in either loop, fused, and recorded."""

import pytest

from hfsa.components import Model
from hfsa.cosim.assembly.build import build
from hfsa.cosim.assembly.fuse import fused, with_fusion
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.fmi.co_simulation import open_instances
from hfsa.cosim.fmi.model_exchange import ModelExchangeInstance
from hfsa.cosim.fmi.solver_counts import solver_counts, total
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.systems.system import Component, Connection, System

LONGEST = 1e-3
each_version = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])


def mass() -> Model:
    """A mass on a spring, by rk4."""
    m = Model("CountedMass", "Mass")
    u = m.input("force", "N", "Force")
    x, v = m.state("position", "m", "Position", start=1.0), m.state("velocity", "m/s", "Velocity")
    m.der[x] = v
    m.der[v] = u - x
    m.output("seen", x, "m", "Position")
    m.solver = "rk4"
    return m


def damper() -> Model:
    """A filter of first order that pulls the mass back, by RODAS5P."""
    m = Model("CountedDamper", "Filter")
    u = m.input("seen", "m", "Position")
    x = m.state("filtered", "m", "Position")
    m.der[x] = 10.0 * (u - x)
    m.output("force", -x, "N", "Force")
    m.solver = "rosenbrock"
    return m


@pytest.fixture
def pair(exported):
    """The system of the two, and their files, by FMI version."""

    def made(version: int) -> tuple[System, dict]:
        files = {"mass": exported(mass())[version], "damper": exported(damper())[version]}
        components = [Component(name, str(file)) for name, file in files.items()]
        wires = [Connection("mass.seen", "damper.seen"), Connection("damper.force", "mass.force")]
        return System(components, wires), files

    return made


@each_version
@pytest.mark.parametrize("backend", ["python", "c"])
def test_counts_of_each_instance_and_their_sums(pair, opened, library, version, backend):
    system, files = pair(version)
    master = make_master(opened(files), system, "gauss_seidel", 2.5 * LONGEST, library if backend == "c" else None)
    starts = {"mass.solver.maximum_step": LONGEST}
    for _ in range(2):  # each initialization begins at zero
        master.initialize(starts=starts)
        master.advance(40)
        found = master.solver_counts
        assert found["mass"] == {"steps": 120, "evaluations": 480}
        assert found["damper"]["steps"] >= 40
        sums = {f"solver_{name}": sum(own.get(name, 0) for own in found.values()) for name in found["damper"]}
        assert master.statistics == {"steps": 40, **sums}
        assert sums["solver_steps"] == 120 + found["damper"]["steps"]


def test_a_rejected_communication_step_counts_too(pair, opened):
    """Iterated coupling steps the instances again in each pass, so that passes show in the counts of their solvers."""
    system, files = pair(2)
    counted = {}
    for algorithm in ("jacobi", "fixed_point"):
        master = make_master(opened(files), system, algorithm, LONGEST)
        master.initialize(starts={"mass.solver.maximum_step": LONGEST})
        master.advance(10)
        counted[algorithm] = master.solver_counts["mass"]["steps"]
    assert counted["jacobi"] == 10
    assert counted["fixed_point"] == master.statistics["passes"] > 10


def test_other_fmus_have_none(files, opened, foreign):
    """Linear and sampled parts, and FMUs of others."""
    instances = opened({"plant": files["Plant", 2], "law": files["SampledPd", 3], "other": foreign[2]})
    assert solver_counts(instances) == {}
    assert total({}) == {}


def test_model_exchange_has_none(pair, opened):
    system, files = pair(2)
    with open_instances(files, ModelExchangeInstance) as instances:
        master = make_master(instances, system, "monolithic", 0.1)
        master.initialize()
        master.advance(2)
        assert master.statistics == {"steps": 2}


def test_a_recorded_counter_does_not_stop_a_run(pair, opened, library):
    """A count grows without a bound, and is no signal that diverges."""
    system, files = pair(2)
    master = make_master(opened(files), system, "gauss_seidel", 1.0, library)
    recording = master.record(["mass.solver.evaluations"], rows=4)
    master.initialize(starts={"mass.solver.maximum_step": LONGEST})
    master.advance(3)
    assert recording["mass.solver.evaluations"].tolist() == [0.0, 4000.0, 8000.0, 12000.0]


@pytest.mark.slow
def test_a_fused_fmu_counts_once_for_all_its_members(opened):
    """The members share a solver; a name of a member's counter is that of the fused FMU."""
    scene = load_scene("stage_tracking")
    system = fused(scene.system, with_fusion(scene, ["controller,voltage,stage,stacks"]).fuse)
    master = make_master(opened(build(system).files), system, "gauss_seidel", 20e-6)
    master.initialize()
    master.advance(10)
    (own,) = (counts for name, counts in master.solver_counts.items() if name == "fused")
    assert own["steps"] >= 10
    assert own["evaluations"] == 8 * own["steps"] + 7 * own["rejected_steps"]
    assert system.split("stage.solver.steps") == ("fused", "solver.steps")
    assert master.read(["stage.solver.steps"]).tolist() == [own["steps"]]
