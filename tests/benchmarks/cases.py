"""Cases of the benchmarks: a loop of two small FMUs, dominated by the master, and the robot, controlled or shaken."""

from dataclasses import dataclass, replace
from pathlib import Path

from hfsa.components import Model
from hfsa.cosim.assembly.build import build, instrument
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.systems.system import Component, Connection, System
from hfsa.fmus.export import export


@dataclass(frozen=True)
class Case:
    """A system of FMI 2 FMUs and how long it is stepped.

    `watched` is an output by full name, whose last value shows that all masters did the same; `steps` is a number for
    a fast master.
    """

    title: str
    system: System
    files: dict[str, Path]
    step_size: float
    steps: int
    watched: str


def two_fmus(folder: Path, solver: str) -> Case:
    """A mass on a spring under PD control with a filtered derivative, 1 ms; `solver` is the mass's."""
    files = [export(model, folder, (2,))[0] for model in (_plant(solver), _pd())]
    connections = [Connection("plant.position", "pd.position"), Connection("pd.force", "plant.force")]
    system = System([Component("plant", "plant", start={"x": 1.0}), Component("pd", "pd")], connections)
    return Case(f"two FMUs, mass by {solver}", system, dict(zip(("plant", "pd"), files, strict=True)), 1e-3, 100_000,
                "plant.position")  # fmt: skip


def robot() -> Case:
    """Scene `sdelta_hfsa` with its instruments, as a sweep has it."""
    scene = load_scene("sdelta_hfsa")
    system = instrument(scene, "reference.command.position[3]")
    return Case("sdelta_hfsa", system, build(system).files, scene.step_size, 20_000, "robot.platform.position[3]")


def shaken_robot() -> Case:
    """Scene `sdelta_shaker` under a vertical sine of 10 Hz: source, reference and robot in a row, step 4 ms."""
    scene = load_scene("sdelta_shaker")
    shaken = instrument(scene, "reference.command.position[3]")
    components = [component for component in shaken.components if component.name != "lock_in"]
    components[0] = replace(components[0], start={**components[0].start, "frequency": 10.0})
    joined = [connection for connection in shaken.connections if not connection.end.startswith("lock_in.")]
    system = System(components, joined)
    return Case("Robot, shaken", system, build(system).files, 4e-3, 500, "robot.platform.position[3]")


def _plant(solver: str) -> Model:
    m = Model("Plant", "Mass on a spring, driven by a force")
    force = m.input("force", "N", "Force on the mass")
    x = m.state("x", "m", "Position")
    v = m.state("v", "m/s", "Velocity")
    m.der[x] = v
    m.der[v] = (force - 0.5 * v - 100.0 * x) / 1.0
    m.output("position", x, "m", "Position")
    m.solver = solver
    return m


def _pd() -> Model:
    m = Model("Pd", "PD controller with a filtered derivative")
    u = m.input("position", "m", "Measured position")
    w = m.state("filtered", "m", "Filtered position")
    m.der[w] = (u - w) / 0.02
    m.output("force", -40.0 * u - 2.0 * (u - w) / 0.02, "N", "Force")
    return m
