"""Co-Simulation instance: equal in FMI 2 and 3, of hfsa and foreign FMUs; reset, saved states, failures."""

import gc
import multiprocessing
import os
import pickle
import subprocess
import sys
import tempfile
from ctypes import c_double
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from hfsa.cosim.fmi.co_simulation import Fmu, Instance, StepError
from hfsa.cosim.systems.errors import StructureError

VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])


def position(plant: Instance, force: float, steps: int, h: float = 1e-3) -> list[float]:
    """Positions after each step from rest under a constant force."""
    plant.start(0.0, None, {"force": force})
    handle = plant.handle(["position"])
    found = []
    for k in range(steps):
        plant.step(k * h, h)
        found.append(float(plant.get(handle)[0]))
    return found


@VERSIONS
def test_a_run_and_its_repetition(files, open_fmu, version):
    plant = open_fmu(files["Plant", version])
    A = np.array([[0, 1, 0], [-100, -0.5, 2.0], [0, 0, 0]])
    exact = [(expm(A * k * 1e-3) @ [0, 0, 1])[0] for k in range(1, 21)]
    first = position(plant, 2.0, 20)
    np.testing.assert_allclose(first, exact, rtol=1e-12)
    assert position(plant, 2.0, 20) == first  # reset: nothing is left of the first run
    assert position(plant, 0.0, 1) == [0.0]


@VERSIONS
def test_description(files, version):
    fmu = Fmu.load(files["Plant", version])
    assert (fmu.name, fmu.version) == ("Plant", version)
    assert fmu.description.states == (("x", "der(x)"), ("v", "der(v)"))
    force, acceleration = fmu.variables["force"], fmu.variables["acceleration"]
    assert (force.causality, force.unit, force.start) == ("input", "N", 0.0)
    assert force.base_unit == (1, 1, -2, 0, 0, 0, 0, 0, 1, 0)
    assert fmu.variables["position"].dependencies == ()
    assert acceleration.dependencies == ("force",)
    assert not fmu.description.is_sampled
    sampled = Fmu.load(files["SampledPd", version])
    assert sampled.description.is_sampled
    assert sampled.variables["force"].dependencies == ()  # held between ticks


@VERSIONS
def test_an_output_follows_an_input_without_a_step(files, open_fmu, version):
    plant = open_fmu(files["Plant", version])
    plant.start()
    handle = plant.handle(["acceleration", "position"])
    plant.set(plant.handle(["force"]), [3.0])
    assert plant.get(handle).tolist() == [3.0, 0.0]


@VERSIONS
def test_prepared_calls_share_an_array(files, open_fmu, version):
    """Output and input of two instances share one array, without a copy."""
    plant, controller = open_fmu(files["Plant", version]), open_fmu(files["Pd", version])
    shared = np.zeros(2)
    get = plant.getter(plant.handle(["position"], shared[1:]))
    put = controller.setter(controller.handle(["position"], shared[1:]))
    time, size = c_double(0.0), c_double(0.5)
    step = plant.stepper(time, size)
    gc.collect()  # the calls keep all they need alive
    plant.start(values={"x": 1.0})
    controller.start()
    assert get.run() == put.run() == 0
    assert shared.tolist() == [0.0, 1.0]
    assert controller.get(controller.handle(["force"]))[0] == -(40.0 + 2.0 / 0.02)
    assert step.run() == 0
    get.run()
    assert shared[1] == pytest.approx((expm(np.array([[0, 1], [-100, -0.5]]) * 0.5) @ [1, 0])[0], rel=1e-12)


@VERSIONS
def test_state_is_kept_bit_for_bit(files, open_fmu, version):
    plant, other = open_fmu(files["Plant", version]), open_fmu(files["Plant", version])
    plant.start(values={"force": 1.0})
    plant.step(0.0, 1e-3)
    state = plant.save()
    data = plant.serialize(state)
    handle = plant.handle(["position", "velocity"])
    plant.step(1e-3, 1e-3)
    once = plant.get(handle).copy()
    plant.restore(state)
    plant.step(1e-3, 1e-3)
    assert plant.get(handle).tolist() == once.tolist()
    other.start()
    other.restore(other.deserialize(data))
    other.step(1e-3, 1e-3)
    assert other.get(other.handle(["position", "velocity"])).tolist() == once.tolist()
    plant.release(state)
    with pytest.raises(StepError):
        plant.deserialize(data[:-1])


@VERSIONS
def test_a_state_is_saved_over_another(files, open_fmu, version):
    plant = open_fmu(files["Plant", version])
    plant.start(values={"force": 1.0})
    slot = plant.save()
    handle, save, restore = plant.handle(["position"]), plant.saver(slot), plant.restorer(slot)
    plant.step(0.0, 1e-3)
    assert save.run() == 0
    here = plant.get(handle).copy()
    plant.step(1e-3, 1e-3)
    there = plant.get(handle).copy()
    assert restore.run() == 0
    assert plant.get(handle).tolist() == here.tolist() != there.tolist()


@VERSIONS
def test_an_input_on_a_parabola(files, open_fmu, version):
    """The force grows from 1 N by 3 N/s and 40 N/s2 during the step."""
    plant = open_fmu(files["Plant", version])
    plant.start(values={"force": 1.0})
    derivatives = np.array([[3.0], [40.0]])
    for order in (1, 2):
        assert plant.has_input_derivatives(["force"], order)
        put = plant.derivative_setter(plant.handle(["force"], derivatives[order - 1]), order)
        assert put.run() == 0
    plant.step(0.0, 0.1)
    A = np.diag([1.0, 1.0, 1.0, 1.0], 1)
    A[1, :2] = [-100, -0.5]
    exact = expm(0.1 * A) @ [0, 0, 1.0, 3.0, 40.0]
    assert plant.get(plant.handle(["position"]))[0] == pytest.approx(exact[0], rel=1e-12)


@VERSIONS
def test_derivatives(files, open_fmu, version):
    plant = open_fmu(files["Plant", version])
    plant.start(values={"force": 1.0})
    J = plant.jacobian(["der(x)", "der(v)", "acceleration"], ["x", "v", "force"])
    np.testing.assert_array_equal(J, [[0, 1, 0], [-100, -0.5, 1], [-100, -0.5, 1]])
    plant.step(0.0, 1e-3)
    handle = plant.handle(["position"])
    assert plant.output_derivatives(handle)[0] == plant.get(plant.handle(["velocity"]))[0]


@VERSIONS
def test_wrong_names(files, open_fmu, version):
    plant = open_fmu(files["Plant", version], "body")
    with pytest.raises(StructureError, match=r"body has no variable 'forse'; did you mean force"):
        plant.handle(["forse"])
    with pytest.raises(StructureError, match=r"body\.position is a continuous output without a start value"):
        plant.enter(values={"position": 1.0})


@VERSIONS
def test_a_value_that_is_not_a_number(files, open_fmu, version):
    plant = open_fmu(files["Plant", version], "body")
    plant.start(0.25)
    plant.set(plant.handle(["force"]), [np.nan])
    with pytest.raises(StepError, match=rf"body: fmi{version}DoStep: error at t = 0\.25 s: .*force") as caught:
        plant.step(0.25, 1e-3)
    again = pickle.loads(pickle.dumps(caught.value))  # it comes back from a worker process as it was
    assert (again.instance, again.status, again.time) == ("body", "error", 0.25)
    assert str(again) == str(caught.value)
    assert position(plant, 0.0, 1) == [0.0]  # and the instance runs again after a reset


# Of another maker -----------------------------------------------------------------------------------------------------

STATUS = {2: "discard", 3: "error", 4: "fatal"}


@VERSIONS
def test_without_reset_an_instance_is_made_anew(foreign, open_fmu, version):
    it = open_fmu(foreign[version])
    for u in (3.0, 5.0):
        it.start(1.0, None, {"u": u})
        it.step(1.0, 0.5)
        assert it.get(it.handle(["y", "time"])).tolist() == [u / 2, 1.5]


@VERSIONS
@pytest.mark.parametrize("behaviour", STATUS)
def test_a_failed_step_says_what_the_fmu_said(foreign, open_fmu, version, behaviour):
    it = open_fmu(foreign[version], "spring")
    it.start(values={"behaviour": behaviour, "at": 0.1})
    it.step(0.0, 0.1)
    with pytest.raises(StepError, match="the spring is broken") as caught:
        it.step(0.1, 0.1)
    assert (caught.value.instance, caught.value.status, caught.value.time) == ("spring", STATUS[behaviour], 0.1)
    it.start()
    it.step(0.0, 0.1)


def test_a_step_may_end_the_run(foreign, open_fmu):
    it = open_fmu(foreign[3])
    it.start(values={"behaviour": 5})
    with pytest.raises(StepError, match="terminated"):
        it.step(0.0, 0.1)


@VERSIONS
def test_what_an_fmu_does_not_offer(foreign, open_fmu, version):
    it = open_fmu(foreign[version])
    it.start()
    with pytest.raises(StructureError, match=r"Foreign\.fmu does not offer directional derivatives"):
        it.jacobian(["y"], ["u"])
    with pytest.raises(StructureError, match="to get and set its state"):
        it.save()
    assert not it.has_input_derivatives(["u"], 1)
    with pytest.raises(StructureError, match="input derivatives of order 1 of u"):
        it.derivative_setter(it.handle(["u"]), 1)
    with pytest.raises(StructureError, match="output derivatives"):
        it.output_derivatives(it.handle(["y"]))
    with pytest.raises(StepError, match=rf"it: fmi{version}GetInt.*: error"):
        it.get(it.handle(["count"]))


def test_what_is_no_fmu(tmp_path):
    with pytest.raises(StructureError, match="there is no file"):
        Fmu.load(tmp_path / "x.fmu")
    (tmp_path / "x.fmu").write_text("nothing")
    with pytest.raises(StructureError, match=r"x\.fmu is not a readable FMU"):
        Fmu.load(tmp_path / "x.fmu")


# Again and again ------------------------------------------------------------------------------------------------------


def resident() -> int:
    """Resident memory in pages."""
    return int(Path("/proc/self/statm").read_text().split()[1])


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="counts what Linux tells of a process")
@VERSIONS
def test_a_thousand_runs_leave_nothing_behind(files, foreign, version, monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    def runs(n: int) -> None:
        for _ in range(n):
            with Instance(Fmu.load(files["Plant", version]), "plant") as plant:
                plant.start(values={"force": 1.0})
                plant.step(0.0, 1e-3)
                plant.save()
        with Instance(Fmu.load(foreign[version]), "foreign") as it:
            for _ in range(n):
                it.start()

    runs(100)
    gc.collect()
    folders, open_files, before = os.listdir(tmp_path), len(os.listdir("/proc/self/fd")), resident()
    runs(1000)
    gc.collect()
    assert os.listdir(tmp_path) == folders
    assert len(os.listdir("/proc/self/fd")) == open_files
    assert resident() - before < 256  # pages: 1 MB, or a kilobyte per run


def test_close_removes_the_folder(files):
    fmu = Fmu(files["Plant", 2])
    folder = Path(fmu.library._fmu.unzipDirectory)
    assert folder.is_dir()
    fmu.close()
    assert not folder.exists()


WORKER = """
import sys, multiprocessing
from concurrent.futures import ProcessPoolExecutor
from hfsa.cosim.fmi.co_simulation import Fmu, Instance

def run(file):
    with Instance(Fmu.load(file), "it") as it:
        it.start()

if __name__ == "__main__":
    with ProcessPoolExecutor(1, multiprocessing.get_context(sys.argv[2])) as pool:
        pool.submit(run, sys.argv[1]).result()
    run(sys.argv[1])
"""


@pytest.mark.parametrize("method", multiprocessing.get_all_start_methods())
def test_processes_leave_no_folder_behind(files, tmp_path, method):
    (tmp_path / "worker.py").write_text(WORKER)
    command = [sys.executable, "worker.py", str(files["Plant", 2]), method]
    with tempfile.TemporaryDirectory() as here:  # a short path: the fork server's socket has 107 characters at most
        subprocess.run(command, cwd=tmp_path, env={**os.environ, "TMPDIR": here}, check=True)
        assert [name for name in os.listdir(here) if name.startswith("hfsa-")] == []
