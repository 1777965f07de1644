"""Results file: complete from the first moment, readable after kills and full disks, resumed only by its own sweep."""

import os
import random
import resource
import signal
import subprocess
import sys
import textwrap
import time
from dataclasses import replace

import h5py
import numpy as np
import pytest

from hfsa.cosim.results.files import (
    InstanceRecord,
    Plan,
    Point,
    ResultsError,
    RunFile,
    Signal,
    Status,
    SweepFile,
    SystemRecord,
    Theory,
    read_run,
    read_sweep,
)

PLAN = Plan(
    frequency=np.array([1.0, 10.0, 24.5, 50.0]),
    outputs=(Signal("robot.position[1]", "m"), Signal("robot.position[3]", "m"), Signal("robot.rotation[1]", "rad")),
    inputs=(Signal("reference.position[3]", "m", 1e-5), Signal("reference.rotation[1]", "rad", 1e-4)),
    settings={"method": "stepped", "settling_tolerance": 1e-3, "measurement_periods": 1, "step_size": 5e-5},
)
SYSTEM = SystemRecord(
    title="Shaker",
    scene="band = [1.0, 50.0]\n",
    instances=(
        InstanceRecord("robot", "SDelta", "SDelta.fmi3.fmu", "ab12", 3, "cartesian", "exact", {"damping": 0.01}),
    ),
    operating_point={"robot.pose": 0.15},
)


def point(i, k, scale=1.0):
    response = scale * np.array([1 + 1j, -2.0, -1e-20j])
    return Point(i, k, Status.DONE, response, np.full(3, 1e-4), np.full(3, 5e-4), wall_time=1.5)


THEORY = Theory(np.geomspace(1, 50, 7), np.arange(42.0).reshape(7, 3, 2) * (1 - 2j))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "deep" / "sweep.h5"


def test_a_measured_sweep_brings_its_theory_along(path):
    xarray = pytest.importorskip("xarray")
    SweepFile.create(path, replace(PLAN, theory=THEORY), SYSTEM).close()
    found = read_sweep(path).theory
    assert found is not None
    np.testing.assert_array_equal(found.frequency, THEORY.frequency)
    np.testing.assert_array_equal(found.response, THEORY.response)
    with xarray.open_dataset(path, group="theory", engine="h5netcdf") as theory:
        entry = theory.response.sel(output="robot.rotation[1]", input="reference.position[3]")
        np.testing.assert_array_equal(entry, THEORY.response[:, 2, 0])
    assert SweepFile.create(path, PLAN, SYSTEM, force=True).close() is None
    assert read_sweep(path).theory is None


def test_what_others_have_found_comes_with_the_scene(path):
    SweepFile.create(path, PLAN, replace(SYSTEM, scene=SYSTEM.scene + 'marks = { "test" = 25.0 }\n')).close()
    assert read_sweep(path).marks == {"test": 25.0}
    SweepFile.create(path, PLAN, SYSTEM, force=True).close()
    assert read_sweep(path).marks == {}


def test_what_is_written_is_read_by_name(path):
    with SweepFile.create(path, PLAN, SYSTEM) as file:
        file.write([point(0, 2), point(1, 2, 3.0)])
        file.write([Point(1, 3, Status.FAILED, wall_time=0.1, message="robot: fmi3DoStep returned error; é" * 30)])
    bode = read_sweep(path)
    assert [s.name for s in bode.outputs] == [s.name for s in PLAN.outputs]
    assert bode.inputs == PLAN.inputs
    assert bode.entry("robot.position[1]", "reference.rotation[1]")[2] == 3 + 3j
    assert np.isnan(bode.response[0]).all()
    assert bode.status.tolist() == [[0, 0], [0, 0], [1, 1], [0, 3]]
    assert bode.message[3, 1].startswith("robot: fmi3DoStep")
    assert bode.remaining_transient[2, 0, 0] == 5e-4
    assert bode.settings == PLAN.settings
    assert bode.attributes["status"] == "interrupted"
    for name in ("title", "created", "tool", "tool_version", "git_commit", "command", "python", "platform"):
        assert isinstance(bode.attributes[name], str)
    assert bode.attributes["format_version"] == "1"
    with pytest.raises(ResultsError, match=r"no signal 'robot.positon\[3\]'; did you mean robot.position\[3\]"):
        bode.entry("robot.positon[3]", "reference.position[3]")


def test_a_finished_sweep_is_complete(path):
    with SweepFile.create(path, PLAN, SYSTEM) as file:
        file.write([point(i, k) for i, k in file.unfinished()])
        assert file.unfinished() == []
    assert read_sweep(path).attributes["status"] == "complete"


def test_layout_is_that_of_the_design(path):
    with SweepFile.create(path, PLAN, SYSTEM) as file:
        file.write([point(0, 0)])
    with h5py.File(path) as file:
        bode = file["bode"]
        for name, dimensions in {
            "response": ("frequency", "output", "input"),
            "magnitude": ("frequency", "output", "input"),
            "phase": ("frequency", "output", "input"),
            "harmonic_distortion": ("frequency", "output", "input"),
            "harmonics": ("frequency", "harmonic", "output", "input"),
            "status": ("frequency", "input"),
            "wall_time": ("frequency", "input"),
            "steps": ("frequency", "input"),
            "amplitude": ("input",),
            "output_unit": ("output",),
            "input_unit": ("input",),
        }.items():
            assert tuple(bode[name].dims[i][0].name.split("/")[-1] for i in range(len(dimensions))) == dimensions, name
        for name, unit in {"frequency": "Hz", "phase": "rad", "response": "output_unit/input_unit"}.items():
            assert bode[name].attrs["units"] == bode[name].attrs["UNIT"] == unit
        assert h5py.check_enum_dtype(bode["status"].dtype) == {s.name.lower(): int(s) for s in Status}
        assert bode["status"].dtype.itemsize == 1
        assert bode["response"].dtype == np.complex128
        assert np.isnan(bode["response"].fillvalue)
        assert bode["phase"][0, 1, 0] == np.pi
        assert file["system"].attrs["scene"] == SYSTEM.scene
        robot = file["system/robot"]
        assert (robot.attrs["sha256"], robot.attrs["fmi_version"], robot.attrs["level"]) == ("ab12", 3, "cartesian")
        assert robot["start/variable"].asstr()[:].tolist() == ["damping"]
        assert file["system/operating_point/value"][:].tolist() == [0.15]


def test_equal_units_give_the_response_one_unit(path):
    for outputs, inputs, unit in (
        (("m", "m"), ("m",), "1"),
        (("m", "m"), ("rad",), "m/rad"),
        (("rad", "rad"), ("N.m",), "rad/(N.m)"),
    ):
        plan = replace(
            PLAN,
            outputs=[Signal(f"a.y[{i}]", u) for i, u in enumerate(outputs, 1)],
            inputs=[Signal("a.u", u) for u in inputs],
        )
        SweepFile.create(path, plan, SYSTEM, force=True).close()
        with h5py.File(path) as file:
            assert file["bode/magnitude"].attrs["units"] == unit


def test_xarray_opens_it_with_coordinates(path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    with SweepFile.create(path, PLAN, SYSTEM) as file:
        file.write([point(0, 2), Point(1, 0, Status.FAILED, message="é")])
    with xarray.open_dataset(path, group="bode", engine="h5netcdf") as bode:
        assert bode.response.dims == ("frequency", "output", "input")
        one = bode.response.sel(output="robot.position[1]", input="reference.position[3]", frequency=24.5)
        assert complex(one) == 1 + 1j
        assert bode.frequency.units == "Hz"
        meanings = ["pending", "done", "not_settled", "failed", "limited", "not_excited", "disagrees"]
        assert bode.status.attrs["flag_meanings"].split() == meanings
        assert bode.message.values[0, 1].decode() == "é"
        assert bode.amplitude.sel(input="reference.rotation[1]") == 1e-4


def test_resume_measures_what_is_pending_or_failed(path):
    with SweepFile.create(path, PLAN, SYSTEM) as file:
        file.write([point(0, k) for k in range(4)])
        file.write([point(1, 0), Point(1, 1, Status.FAILED, message="no"), replace(point(1, 2), status=Status(2))])
    with SweepFile.resume(path, PLAN, SYSTEM) as file:
        assert file.unfinished() == [(1, 1), (1, 3)]
        file.write([point(1, 1), point(1, 3)])
    bode = read_sweep(path)
    assert bode.attributes["status"] == "complete"
    assert bode.message[1, 1] == ""


@pytest.mark.parametrize(
    ("plan", "system", "message"),
    [
        ({"settings": {**PLAN.settings, "step_size": 2e-5}}, {}, "step_size is 5e-05 there and 2e-05 here"),
        ({"settings": {**PLAN.settings, "more": 1}}, {}, "more is not set there and 1 here"),
        ({"frequency": np.array([1.0, 2.0])}, {}, "frequency has 4 points from 1 to 50 Hz there and 2 from 1 to 2 Hz"),
        ({"frequency": PLAN.frequency + 1e-6}, {}, "4 from 1 to 50 Hz here at other values"),
        ({"outputs": PLAN.outputs[:1]}, {}, "outputs are .* there and robot.position.1. here"),
        ({"inputs": [replace(s, amplitude=1.0) for s in PLAN.inputs]}, {}, "amplitude is 1e-05, 0.0001 there and 1, 1"),
        ({}, {"instances": [replace(SYSTEM.instances[0], sha256="cd")]}, "the FMU of robot is another"),
        ({}, {"instances": []}, "instance robot is only there"),
        ({}, {"scene": "band = [1.0, 60.0]"}, "the scene is another"),
    ],
)
def test_resume_refuses_another_sweep_and_says_what_differs(path, plan, system, message):
    SweepFile.create(path, PLAN, SYSTEM).close()
    with pytest.raises(ResultsError, match=f"belongs to another sweep: .*{message}"):
        SweepFile.resume(path, replace(PLAN, **plan), replace(SYSTEM, **system))


def test_files_that_are_none_are_named(path, tmp_path):
    with pytest.raises(ResultsError, match="there is no file"):
        read_sweep(path)
    text = tmp_path / "text.h5"
    text.write_text("no HDF5")
    with pytest.raises(ResultsError, match=r"cannot open .*text.h5: it is no HDF5 file"):
        read_sweep(text)
    other = tmp_path / "other.h5"
    h5py.File(other, "w").close()
    with pytest.raises(ResultsError, match="format version None, expected 1"):
        read_sweep(other)


def test_a_file_in_use_is_refused(path):
    script = "import sys; from hfsa.cosim.results.files import read_sweep; read_sweep(sys.argv[1])"
    with SweepFile.create(path, PLAN, SYSTEM):
        done = subprocess.run([sys.executable, "-c", script, path], capture_output=True, text=True, check=False)
    assert "another process has it open" in done.stderr


WRITER = """
    import sys, time, numpy as np
    from hfsa.cosim.results.files import Point, Status, SweepFile
    import importlib.util
    spec = importlib.util.spec_from_file_location("plans", sys.argv[2])
    plans = importlib.util.module_from_spec(spec); spec.loader.exec_module(plans)
    from pathlib import Path
    path = Path(sys.argv[1])
    plan = plans.replace(plans.PLAN, frequency=np.linspace(1, 50, 4000))
    open_file = SweepFile.resume if path.exists() else SweepFile.create
    with open_file(path, plan, plans.SYSTEM) as file:
        print("ready", flush=True)
        for i, k in file.unfinished():
            file.write([plans.point(i, k, 1.0 + k)])
"""


@pytest.mark.slow
def test_a_kill_at_any_moment_leaves_a_file_that_resumes(path):
    random.seed(4)
    arguments = [sys.executable, "-c", textwrap.dedent(WRITER), str(path), __file__]
    done = -1
    for _ in range(8):
        child = subprocess.Popen(arguments, stdout=subprocess.PIPE)
        child.stdout.readline()
        time.sleep(random.uniform(0, 0.15))
        os.kill(child.pid, signal.SIGKILL)
        child.wait()
        child.stdout.close()
        bode = read_sweep(path)
        finished = bode.status == Status.DONE
        assert np.sum(finished) >= done
        done = np.sum(finished)
        expected = 1.0 + np.broadcast_to(np.arange(4000)[:, None], finished.shape)
        assert np.array_equal(bode.response[:, 1, :][finished], -2.0 * expected[finished])
    assert done > 0


def test_a_full_disk_is_noticed_before_the_work_and_spoils_nothing(path):
    SweepFile.create(path, PLAN, SYSTEM).close()
    before = path.read_bytes()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    plan = replace(PLAN, frequency=np.linspace(1, 50, 20_000))
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, hard))
    try:
        with pytest.raises(ResultsError, match=r"cannot write .*sweep.h5: File too large"):
            SweepFile.create(path, plan, SYSTEM, force=True)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert path.read_bytes() == before
    assert [p.name for p in path.parent.iterdir()] == ["sweep.h5"]


def test_a_disk_that_fills_up_later_stops_no_sweep(path):
    file = SweepFile.create(path, PLAN, SYSTEM)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size, hard))
    try:
        file.write([point(i, k) for i, k in file.unfinished()])
        file.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert read_sweep(path).attributes["status"] == "complete"


def test_a_disk_that_fails_is_an_error_and_the_file_stays_readable(path):
    file = SweepFile.create(path, PLAN, SYSTEM)
    file.write([point(0, 0)])
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, hard))
    try:
        with pytest.raises(ResultsError, match="cannot write"):
            file.write([point(0, 1)])
        with pytest.raises(ResultsError, match="cannot write"):
            file.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    bode = read_sweep(path)
    assert bode.status[:, 0].tolist()[0] == Status.DONE
    assert bode.response[0, 1, 0] == -2.0


def test_a_run_keeps_what_was_recorded_before_it_failed(path):
    file = RunFile(path, np.linspace(0, 1, 11), {"robot.position[3]": "m"}, SYSTEM)
    file.write(0, {"robot.position[3]": np.arange(4.0)})
    file.close(failure="robot: not finite at t = 0.4 s")
    values, units = read_run(path)
    assert np.array_equal(values["time"], np.linspace(0, 1, 11))
    assert np.array_equal(values["robot.position[3]"][:5], [0, 1, 2, 3, np.nan], equal_nan=True)
    assert units == {"time": "s", "robot.position[3]": "m"}
    with pytest.raises(ResultsError, match="holds no sweep; it has system, time"):
        read_sweep(path)
