"""Instances in processes of their own: the same bits as here, by every algorithm and every call."""

import os
import signal
import time
from contextlib import closing

import numpy as np
import pytest
from hostile_fmu import hostile_fmu
from spring_loop import loop

from hfsa.cosim.assembly.isolation import isolation_library
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.co_simulation import Fmu, Instance, StepError
from hfsa.cosim.fmi.isolation import host
from hfsa.cosim.fmi.isolation.waiting import interrupted_by, limited
from hfsa.cosim.masters.algorithms import open_master
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, System

VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
ALGORITHMS = ("gauss_seidel", "jacobi_linear", "quasi_newton", "error_controlled", "monolithic")


@pytest.fixture
def isolated(scene_cache):
    """Open instances in processes of their own, closed after the test."""
    made = []

    def make(file, name="it") -> Instance:
        made.append(Instance(Fmu.load(file, "co_simulation", isolation_library()), name))
        return made[-1]

    yield make
    for instance in made:
        instance.close()


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """The FMU of bad manners."""
    return hostile_fmu(tmp_path_factory.mktemp("hostile"))


@VERSIONS
@pytest.mark.parametrize("algorithm", [pytest.param(name, id=name) for name in ALGORITHMS])
def test_every_algorithm_gives_the_same_bits(files, library, version, algorithm):
    system, paths = loop(files, version)
    foreign = System([Component(c.name, "it.fmu", start=c.start) for c in system.components], system.connections)
    found = []
    for isolation in (None, isolation_library()):
        assembly = Assembly.read(foreign, paths, isolation)
        with closing(open_master(assembly, algorithm, 0.01, library)) as master:
            recording = master.record(["plant.position", "pd.force"], rows=51)
            master.initialize()
            master.advance(50)
            found.append((recording.time.tobytes(), recording.values.tobytes()))
    assert found[0] == found[1]
    assert np.ptp(np.frombuffer(found[0][1])) > 1.0


@VERSIONS
def test_every_call_gives_the_same_bits(files, open_fmu, isolated, version):
    found = []
    for make in (open_fmu, isolated):
        plant = make(files["Plant", version])
        plant.start(0.0, 1.0, {"x": 0.25, "force": 2.0})
        outputs = plant.handle(["position", "velocity", "acceleration"])
        plant.step(0.0, 0.01)
        state = plant.save()
        data = plant.serialize(state)
        seen = [plant.get(outputs).copy(), plant.output_derivatives(plant.handle(["position"]))]
        seen.append(plant.jacobian(["acceleration", "der(v)"], ["force", "x"]))
        plant.step(0.01, 0.01)
        seen.append(plant.get(outputs).copy())
        plant.restore(plant.deserialize(data))
        seen.append(plant.get(outputs).copy())
        plant.release(state)
        found.append([values.tolist() for values in seen])
    assert found[0] == found[1]
    assert found[1][0] == found[1][-1]


def test_each_instance_has_a_process_which_ends_with_it(hostile, isolated):
    instances = [isolated(hostile, f"box[{i}]") for i in range(3)]
    processes = []
    for instance in instances:
        instance.start(0.0, None, {})
        processes.append(int(instance.get(instance.handle(["process"]))[0]))
    assert len({*processes, os.getpid()}) == 4
    for instance in instances:
        instance.close()
    for process in processes:
        with pytest.raises(ProcessLookupError):
            os.kill(process, 0)


def test_after_its_process_has_died_an_instance_starts_anew(hostile, isolated):
    box = isolated(hostile, "box")
    for _ in range(2):
        box.start(0.0, None, {"manner": 1, "at": 1e9})
        box.step(0.0, 0.1)
        assert box.get(box.handle(["y"]))[0] == 0.1
        os.kill(int(box.get(box.handle(["process"]))[0]), signal.SIGKILL)
        with pytest.raises(StepError, match=r"box: fmi2DoStep: lost at t = 0\.1 s: its process was ended by SIGKILL"):
            box.step(0.1, 0.1)


def test_no_file_or_memory_is_left_of_many_instances(hostile, isolated):
    def held() -> int:
        return len(os.listdir("/proc/self/fd"))

    isolated(hostile).close()
    before = held()
    for _ in range(20):
        isolated(hostile).close()
    assert held() == before


def test_a_call_is_given_up_for_what_is_asked_from_outside(hostile, isolated):
    box = isolated(hostile, "box")
    box.start(0.0, None, {"manner": 6, "at": 0.0})
    end = time.monotonic() + 0.3
    with interrupted_by(lambda: time.monotonic() > end), pytest.raises(KeyboardInterrupt):
        box.step(0.0, 0.1)
    box.start(0.0, None, {"manner": 6, "at": 0.0})
    with limited(0.3), pytest.raises(StepError) as caught:
        box.step(0.0, 0.1)
    assert (caught.value.status, caught.value.time, caught.value.exit_code) == ("overdue", 0.0, 4)


def test_more_values_than_fit_are_an_error_and_no_overrun(hostile, isolated, monkeypatch):
    monkeypatch.setattr(host, "_SHARED", 1 << 18)
    box = isolated(hostile, "box")
    box.start(0.0, None, {})
    many = box.handle(["y"] * 40_000)
    with pytest.raises(StepError, match="one call moves more values than the memory shared"):
        box.get(many)
    assert box.get(box.handle(["y"])).tolist() == [0.0]


def test_a_binary_that_cannot_be_loaded_is_told(foreign, isolated, tmp_path, rewritten):
    broken = rewritten(foreign[2], "\x7fELF", "\x7fFLE")
    with pytest.raises(StructureError, match="cannot be loaded on"):
        isolated(broken)
