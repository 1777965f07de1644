"""The stepping loop in C equals the one in Python, bit for bit, however a run ends; and its build."""

import resource
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from algorithm_groups import EXTRAPOLATED, HELD, ITERATED

from hfsa.cosim.assembly import compiled, native_loop
from hfsa.cosim.assembly.build import build, instrument
from hfsa.cosim.assembly.load_scene import available_scenes, load_scene
from hfsa.cosim.assembly.native_loop import chosen_loop, stepping_library
from hfsa.cosim.fmi.isolation import sources as isolation
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.masters.native import headers
from hfsa.cosim.masters.native.headers import library_name
from hfsa.cosim.masters.native.library import EXTENSION_SUFFIXES, installed_library
from hfsa.cosim.results.files import read_run
from hfsa.cosim.systems.system import Component, Connection, System
from hfsa.fmus.compile import compiler
from hfsa.fmus.errors import ExportError

VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
ROOT = Path(__file__).parents[3]


# The same bits --------------------------------------------------------------------------------------------------------


IN_BOTH = ("mass_on_spring", "sdelta_hfsa")
"""Scenes whose FMI 3 FMUs are built in every run of the tests; those of the others take minutes."""
QUICK = dict.fromkeys(available_scenes(), HELD) | {"stage_tracking": (*HELD, *ITERATED)}
"""Algorithms of which each scene is stepped in every run of the tests."""
CASES = [
    pytest.param(
        name,
        version,
        algorithm,
        marks=[] if name in IN_BOTH or (version == 2 and algorithm in QUICK[name]) else pytest.mark.slow,
    )
    for name in available_scenes()
    for version in (2, 3)
    for algorithm in (*HELD, *EXTRAPOLATED, *ITERATED)
]


@pytest.mark.parametrize(("name", "version", "algorithm"), CASES)
def test_every_scene_has_the_same_bits(both, name, version, algorithm):
    scene = load_scene(name)
    system, names, starts = scene.system, list(scene.outputs), {}
    if scene.inputs:
        system = instrument(scene, scene.inputs[-1], fmi=version)
        names += ["lock_in.gain[1].real", "source.value"]
        starts = {"lock_in.window": 100 * scene.step_size, "source.frequency": scene.band[1]}

    def run(master):
        recording = master.record(names, rows=11, every=3)
        master.initialize(0.7 if scene.inputs else 0.0, starts=starts)
        for steps in (1, 2, 0, 697, 300):
            master.advance(steps)
        assert recording.rows == 334
        assert recording.values.any(axis=0).mean() >= 0.25, "what is recorded must move"
        return recording

    python, c = both(system, build(system, version).files, run, algorithm, scene.step_size)
    assert python == c
    assert python[0] is None


@VERSIONS
@pytest.mark.parametrize("every", [1, 4])
@pytest.mark.parametrize("connected", [True, False], ids=["connected", "recorded"])
@pytest.mark.parametrize(
    ("starts", "ending"),
    [
        ({"behaviour": 1.0, "at": 0.05}, None),
        ({"behaviour": 2.0, "at": 0.05}, "discard"),
        ({"behaviour": 3.0, "at": 0.05}, "error"),
        ({"behaviour": 4.0, "at": 0.05}, "fatal"),
        ({"behaviour": 5.0, "at": 0.05}, "terminated"),
        ({"behaviour": 6.0, "at": 0.05}, "not finite"),
        ({"u": 20_500.0}, "out of bounds"),
    ],
)
def test_every_end_of_a_run_is_the_same(both, foreign, version, every, connected, starts, ending):
    connections = [Connection("spring.y", "other.u")] if connected else []
    components = [Component("spring", "x", start={"u": 1.0, **starts}), Component("other", "x")]

    def run(master):
        recording = master.record(["spring.y", "other.y"], rows=5, every=every)
        master.initialize()
        master.advance(20)
        master.advance(20)
        return recording

    if ending == "terminated" and version == 2:
        ending = None  # FMI 2 has no such request
    files = {"spring": foreign[version], "other": foreign[version]}
    python, c = both(System(components, connections), files, run)
    assert python == c
    failure, rows, time, warnings, _ = python
    if ending is None:
        assert (failure, rows, time) == (None, 1 + 40 // every, 0.4)
        assert list(warnings) == (["spring"] if starts["behaviour"] == 1.0 else [])
    else:
        assert failure[1] == ending
        assert time < 0.1


def test_warnings_before_an_error(both, foreign):
    """A warning is removed from the log at once, so that a later error has its own text alone."""

    def run(master):
        recording = master.record(["spring.y"], rows=5)
        master.initialize()
        master.advance(10)
        master.set({"spring.behaviour": 3.0})
        master.advance(10)
        return recording

    system = System([Component("spring", "x", start={"behaviour": 1.0, "at": 0.05})])
    python, c = both(system, {"spring": foreign[3]}, run)
    assert python == c
    advice = "the run cannot continue; check its inputs and parameters"
    assert python[0] == (f"spring: fmi3DoStep: error at t = 0.1 s: the spring is broken; {advice}", "error", 0.1)
    assert python[3] == {"spring": "spring: fmi3DoStep: warning at t = 0.05 s: the spring is broken"}


def test_an_instance_made_anew_is_found(both, foreign):
    """The foreign FMU cannot reset: its component is another in the second run."""

    def run(master):
        recording = master.record(["spring.y"], rows=5)
        for u in (1.0, 2.0):
            master.initialize(starts={"spring.u": u})
            master.advance(10)
        assert recording["spring.y"][-1] == pytest.approx(0.2)
        return recording

    python, c = both(System([Component("spring", "x")]), {"spring": foreign[2]}, run)
    assert python == c


def test_the_command_line_runs_either_loop(capsys, tmp_path):
    from hfsa.cosim.cli import main

    found = []
    for loop in ("c", "python"):
        file = tmp_path / f"{loop}.h5"
        assert main(["run", "mass_on_spring", "--backend", loop, "--stop", "0.3", "-o", str(file)]) == 0
        values, _ = read_run(file)
        found.append({name: array.tobytes() for name, array in values.items()})
    assert found[0] == found[1]
    assert capsys.readouterr().err == ""


# Again and again ------------------------------------------------------------------------------------------------------


def _kept() -> tuple[int, int, int]:
    """Memory [bytes] and open files of this process, and folders of unzipped FMUs."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return (
        pages * resource.getpagesize(),
        len(list(Path("/proc/self/fd").iterdir())),
        len(list(Path(tempfile.gettempdir()).glob("hfsa-*"))),
    )


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads /proc")
@pytest.mark.parametrize("way", ["python", "c"])
def test_a_thousand_runs_keep_nothing(files, foreign, opened, library, way, tmp_path, monkeypatch):
    """Neither instances that reset nor the foreign one, which is made anew in each run."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    system = System(
        [Component("plant", "x", start={"x": 1.0}), Component("pd", "x"), Component("other", "x")],
        [
            Connection("plant.position", "pd.position"),
            Connection("pd.force", "plant.force"),
            Connection("plant.velocity", "other.u"),
        ],
    )
    found = opened({"plant": files["Plant", 2], "pd": files["SampledPd", 3], "other": foreign[2]})
    master = make_master(found, system, "gauss_seidel", 0.01, library if way == "c" else None)
    recording = master.record(["plant.position", "pd.force"], rows=11)

    def runs(n):
        for _ in range(n):
            master.initialize(stop_time=1.0)
            master.advance(20)
        return recording.values.tobytes()

    first, before = runs(100), _kept()
    last, after = runs(1000), _kept()
    assert first == last
    assert after[1:] == before[1:]
    assert after[0] - before[0] < 500 * 1000  # half a kilobyte per run


# Where the library comes from -----------------------------------------------------------------------------------------


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("HFSA_CACHE", str(tmp_path))
    monkeypatch.setattr(native_loop, "installed_library", lambda: None)
    return tmp_path


def test_it_is_compiled_once(empty_cache, monkeypatch):
    library = stepping_library()
    monkeypatch.setattr(compiled, "compile_files", None)
    assert stepping_library() == library
    assert [file for file in empty_cache.rglob("*") if file.is_file()] == [library]


def test_several_may_compile_at_once(empty_cache):
    with ThreadPoolExecutor(3) as pool:
        found = set(pool.map(lambda _: stepping_library(), range(3)))
    assert [file for file in empty_cache.rglob("*") if file.is_file()] == list(found)


def test_without_a_compiler_python_steps_and_says_so(empty_cache, monkeypatch):
    def none(*_, **__):
        raise ExportError("no C compiler: tried cc, gcc, clang")

    monkeypatch.setattr(compiled, "compile_files", none)
    messages = []
    assert chosen_loop("c", messages.append) is None
    (sentence,) = messages
    assert sentence.startswith("the stepping loop runs in Python")
    assert sentence.endswith("no C compiler: tried cc, gcc, clang")
    assert not [file for file in empty_cache.rglob("*") if file.is_file()]
    assert chosen_loop("python", messages.append) is None
    assert len(messages) == 1


def test_a_library_of_another_source_is_not_taken(tmp_path, monkeypatch):
    other = shutil.copytree(headers.FOLDER, tmp_path / "native")
    for name in ("newton.h", "headers.py"):
        before = library_name(other)
        with open(other / name, "ab") as file:
            file.write(b"\n")
        assert library_name(other) != before
    monkeypatch.setattr(headers, "library_name", lambda: library_name(other))
    assert installed_library() is None


def test_no_compiler_warns_of_it(tmp_path):
    for name, text in headers.sources().items():
        (tmp_path / name).write_text(text)
    words = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-c", *tmp_path.glob("*.c")]
    subprocess.run([*compiler(), *words], cwd=tmp_path, check=True)


def test_setup_names_the_library_as_it_is_looked_for(tmp_path):
    """Built in a copy, as by an installation, it is found there and steps."""
    for name in ("setup.py", "pyproject.toml", "README.md", "LICENSE"):
        (tmp_path / name).write_bytes((ROOT / name).read_bytes())
    shutil.copytree(headers.FOLDER, tmp_path / "cosim/masters/native", ignore=shutil.ignore_patterns("_step_*"))
    shutil.copytree(isolation.FOLDER, tmp_path / "cosim/fmi/isolation", ignore=shutil.ignore_patterns("_stand_in_*"))
    command = [sys.executable, "setup.py", "-q", "build_ext", "--build-lib", "built"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    (library,) = (tmp_path / "built").rglob("_step_*")
    assert library.name.startswith(f"{library_name()}.")
    assert library.name.removeprefix(library_name()) in EXTENSION_SUFFIXES
    (stand_in,) = (tmp_path / "built").rglob("_stand_in_*")
    assert stand_in.name.removeprefix(isolation.library_name()) in EXTENSION_SUFFIXES
    assert make_master({}, System([]), library=library).time == 0.0
