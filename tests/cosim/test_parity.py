"""The shipped scenes in other masters: the same FMUs, stepped by ecos and libcosim, go where `jacobi_plain` goes."""

import numpy as np
import pytest

import hfsa.cosim.scenes
from hfsa.components._parts import find
from hfsa.cosim.build import build, instrument, load_scene
from hfsa.cosim.instance import open_instances
from hfsa.cosim.master import Master
from hfsa.cosim.system import System

STEPS = 1500
FREQUENCY = 20.0


def name(full: str) -> str:
    """The name that other masters use."""
    component, _, variable = full.partition(".")
    return f"{component}::{variable}"


class Excited:
    """A scene with a sine at its last input, without the lock-in amplifier, and what `jacobi_plain` makes of it."""

    def __init__(self, scene_name: str, version: int):
        scene = load_scene(scene_name)
        system = instrument(scene, scene.inputs[-1], fmi=version)
        components = [c for c in system.components if c.name != "lock_in"]
        self.system = System(components, [c for c in system.connections if not c.end.startswith("lock_in.")])
        self.files = build(self.system, fmi=version)
        self.outputs, self.step_size = scene.outputs, scene.step_size
        self.values = {f"{c.name}::{v}": value for c in components for v, value in c.start.items()}
        self.values |= {"source::frequency": FREQUENCY}
        self.connections = [(name(c.start), name(c.end)) for c in self.system.connections]

    def run_here(self) -> np.ndarray:
        instances = open_instances(self.files)
        try:
            master = Master(instances, self.system, "jacobi_plain", self.step_size)
            recording = master.record(self.outputs, rows=STEPS + 1)
            master.initialize(starts={"source.frequency": FREQUENCY})
            master.advance(STEPS)
            return recording.values[1:].copy()
        finally:
            for instance in instances.values():
                instance.close()

    def run_there(self, peer) -> np.ndarray:
        there = peer(self.files, self.step_size, self.values, self.connections)
        return there.run([name(output) for output in self.outputs], STEPS)


def compare(here: np.ndarray, there: np.ndarray) -> None:
    scale = np.abs(here).max()
    assert scale > 1e-8, "the scene must move"
    np.testing.assert_allclose(there, here, rtol=0, atol=1e-9 * scale)


@pytest.fixture(scope="module", params=sorted(find([hfsa.cosim.scenes])))
def scene(request) -> str:
    return request.param


@pytest.mark.parametrize("version", [2, 3])
def test_ecos(scene, version, ecos):
    excited = Excited(scene, version)
    compare(excited.run_here(), excited.run_there(ecos))


def test_libcosim(scene, libcosim):
    excited = Excited(scene, 2)
    compare(excited.run_here(), excited.run_there(libcosim))
