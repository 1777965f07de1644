"""Shipped scenes in other masters: the same FMUs, stepped by ecos and libcosim, agree with `jacobi_plain`."""

from dataclasses import replace

import numpy as np
import pytest

import hfsa.cosim.scenes
from hfsa.components._modelling.catalogue import find
from hfsa.cosim.assembly.build import build, instrument
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.fmi.co_simulation import open_instances
from hfsa.cosim.fmi.description import describe
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import System

STEPS = 1500
FREQUENCY = 20.0
ROUNDING = 1e-21
"""Tolerance in SI units for outputs that should stay at rest."""

STEP_SIZES = {"stage_bode": 10e-6}
"""Steps [s] other than the scene's: ecos adds them up, and 5 us to times whose last digit shows in a pose of 5 pm."""


def name(full: str) -> str:
    """The name that other masters use."""
    component, _, variable = full.partition(".")
    return f"{component}::{variable}"


def excited(scene: Scene, version: int) -> System:
    """The system with a sine at the scene's last input, without the lock-in amplifier."""
    system = instrument(scene, scene.inputs[-1], fmi=version)
    components = [
        replace(c, start={**c.start, "frequency": FREQUENCY}) if c.name == "source" else c
        for c in system.components
        if c.name != "lock_in"
    ]
    return System(components, [c for c in system.connections if not c.end.startswith("lock_in.")])


class Moving:
    """A scene with an excitation or its own motion, and its run by `jacobi_plain`."""

    def __init__(self, scene_name: str, version: int):
        scene = load_scene(scene_name)
        self.system = excited(scene, version) if scene.inputs else scene.system
        self.files = build(self.system, fmi=version).files
        self.outputs, self.step_size = scene.outputs, STEP_SIZES.get(scene_name, scene.step_size)
        self.values = {f"{c.name}::{v}": value for c in self.system.components for v, value in c.start.items()}
        self.connections = [(name(c.start), name(c.end)) for c in self.system.connections]

    def units(self) -> np.ndarray:
        """Unit of each output, (outputs,)."""
        named = map(self.system.split, self.outputs)
        return np.array([describe(self.files[component]).variables[name].unit for component, name in named])

    def follows_at_once(self) -> np.ndarray:
        """Whether each output has direct feedthrough from a connected input, (outputs,)."""
        fed = {connection.end for connection in self.system.connections}
        return np.array([self._follows(*self.system.split(output), fed) for output in self.outputs])

    def _follows(self, component: str, variable: str, fed: set[str]) -> bool:
        inputs = describe(self.files[component]).variables[variable].dependencies
        return inputs is None or any(f"{component}.{name}" in fed for name in inputs)

    def run_here(self) -> np.ndarray:
        with open_instances(self.files) as instances:
            master = make_master(instances, self.system, "jacobi_plain", self.step_size)
            recording = master.record(self.outputs, rows=STEPS + 1)
            master.initialize()
            master.advance(STEPS)
            return recording.values[1:].copy()

    def run_there(self, peer) -> np.ndarray:
        there = peer(self.files, self.step_size, self.values, self.connections)
        return there.run([name(output) for output in self.outputs], STEPS)


def compare(moving: Moving, here: np.ndarray, there: np.ndarray, which: np.ndarray | slice = slice(None)) -> None:
    """Each output to 3e-9 of its largest value; rounding of outputs at rest is not compared."""
    scale, units = np.abs(here).max(axis=0), moving.units()
    assert scale.max() > 1e-13, "the scene must move"
    of_its_unit = np.array([scale[units == unit].max() for unit in units])
    allowed = 3e-9 * scale + 1e-12 * of_its_unit + ROUNDING
    assert np.all((np.abs(there - here) <= allowed)[:, which])


SCENES = sorted(find([hfsa.cosim.scenes]))
IN_BOTH = ("mass_on_spring", "sdelta_hfsa")
"""Scenes whose FMI 3 FMUs are built in every run of the tests; those of the others take minutes."""


@pytest.mark.parametrize("scene", SCENES)
def test_ecos(scene, ecos):
    moving = Moving(scene, 2)
    compare(moving, moving.run_here(), moving.run_there(ecos))


@pytest.mark.parametrize("scene", [s if s in IN_BOTH else pytest.param(s, marks=pytest.mark.slow) for s in SCENES])
def test_ecos_fmi3(scene, ecos):
    moving = Moving(scene, 3)
    compare(moving, moving.run_here(), moving.run_there(ecos))


@pytest.mark.parametrize("scene", SCENES)
def test_libcosim(scene, libcosim):
    """It reads outputs before it sets inputs, so direct feedthrough belongs to the inputs of the step before."""
    moving = Moving(scene, 2)
    compare(moving, moving.run_here(), moving.run_there(libcosim), ~moving.follows_at_once())
