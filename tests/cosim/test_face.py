"""The public face of the right wing: functions with the defaults of the command line, and results as objects."""

import inspect
import multiprocessing
import typing
import warnings
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import hfsa.cosim
from hfsa.cosim import compare, load_scene, open_loop, read, run, stability, sweep
from hfsa.cosim.assembly import build, fmu_cache, fuse
from hfsa.cosim.fmi import description
from hfsa.cosim.measurement import rig
from hfsa.cosim.results.files import Bode
from hfsa.cosim.results.run import Run

HEIGHT, COMMAND = "robot.platform.position[3]", "reference.command.position[3]"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def counted(monkeypatch) -> dict[str, Counter]:
    """Count what is worked out for an FMU: its key, its description, fusing and building."""
    counts: dict[str, Counter] = {"keys": Counter(), "descriptions": Counter(), "builds": Counter()}
    key, parse, built = fmu_cache._key, description.read_raw, build.fmu_file

    def counted_key(component, *more):
        counts["keys"][component.part, repr(component.arguments)] += 1
        return key(component, *more)

    def counted_parse(stream, where):
        counts["descriptions"][where] += 1
        return parse(stream, where)

    def counted_build(component, *more):
        counts["builds"][component.name] += 1
        return built(component, *more)

    monkeypatch.setattr(fmu_cache, "_keys", {})
    monkeypatch.setattr(fmu_cache, "_key", counted_key)
    monkeypatch.setattr(description, "read_raw", counted_parse)
    monkeypatch.setattr(build, "fmu_file", counted_build)
    description._read.cache_clear()
    description._interface_description.cache_clear()
    return counts


@pytest.mark.parametrize("method", ["linear", "stepped"])
def test_a_sweep_of_six_inputs_builds_each_fmu_once_and_reads_each_description_once(counted, method):
    bode = sweep("sdelta_hfsa", method=method, low=40.0, high=40.0, points=1, jobs=1, settling_tolerance=0.1)
    assert len(bode.inputs) == 6
    assert max(counted["keys"].values()) == 1
    assert max(counted["descriptions"].values()) == 1
    components = {component.name for component in load_scene("sdelta_hfsa").system.components}
    recorded_by_runs = {"rotation_error", "position_error"}
    assert all(counted["builds"][name] == (name not in recorded_by_runs) for name in components)
    assert counted["builds"]["lock_in"] == (0 if method == "linear" else 6)  # one for each input's units


def test_a_scene_without_groups_is_never_fused(monkeypatch):
    monkeypatch.setattr(fuse, "_with_group", None)
    sweep("mass_on_spring", points=1, jobs=1)


def test_sweeps_leave_no_rig_and_no_process_behind():
    for number in range(4):
        sweep("mass_on_spring", {"damping": 5.0 + number}, points=2, jobs=1, path=f"{number}.h5")
    sweep("mass_on_spring", {"damping": 5.0}, points=2, jobs=2)
    assert rig._rigs == {}
    assert multiprocessing.active_children() == []


def test_results_are_objects_with_arrays(folder):
    bode = sweep("mass_on_spring", {"damping": 5}, points=3, jobs=1)
    assert bode.path == Path("results/mass_on_spring.h5")
    as_read = read(bode.path)
    assert isinstance(as_read, Bode)
    assert np.array_equal(as_read.response, bode.response)
    table = bode.to_xarray()
    picked = table.response.sel(output="mass.position", input="mass.base.position")
    assert np.array_equal(picked, bode.entry("mass.position", "mass.base.position"))
    assert table.frequency.attrs["units"] == "Hz"
    found = run("mass_on_spring", {"damping": 5}, frequency=12.0, stop_time=0.1, record=["mass.mass.velocity"])
    assert found.path == Path("results/mass_on_spring_run.h5")
    assert found.time[-1] == pytest.approx(0.1)
    assert found["mass.mass.velocity"].shape == found.time.shape
    assert found.to_xarray()["mass.position"].attrs["units"] == "m"
    assert isinstance(read(found.path), Run)
    with pytest.raises(hfsa.cosim.results.files.ResultsError, match=r"no variable 'mass.positon'; did you mean"):
        found["mass.positon"]


def test_a_scene_object_takes_arguments_of_its_components_and_a_named_file():
    scene = load_scene("mass_on_spring", {"damping": 2})
    bode = sweep(scene, {"mass.damping": 5}, points=2, jobs=1, path="own.h5")
    named = sweep("mass_on_spring", {"damping": 5}, points=2, jobs=1)
    assert np.array_equal(bode.response, named.response)
    with pytest.raises(ValueError, match="name the file"):
        sweep(scene, points=2)


def test_warnings_are_pythons_unless_somebody_takes_them():
    arguments = {"law": "pd_ff", "stack": "linear", "motion": "three_axis"}
    how = {"algorithm": "gauss_seidel", "stop_time": 1e-3, "step_size": 10e-6}
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        run("stage_tracking", arguments, **how)
    assert any("hides" in str(warning.message) for warning in found)
    taken = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run("stage_tracking", arguments, **how, warn=taken.append, path="b.h5")
    assert taken == [str(warning.message) for warning in found]


def test_margins_and_limits_as_numbers():
    found = open_loop("sdelta_hfsa", "controller.axis[1].command")
    assert found.margins.is_stable
    assert found.path.is_file()
    limits = {limit.algorithm: limit.longest for limit in stability("mass_on_spring").limits}
    assert limits["gauss_seidel"] > 0
    runs = compare("mass_on_spring", {"damping": [0.5, 2.0]}, stop_time=0.05, jobs=1).runs
    assert [run.values["damping"] for run in runs] == [0.5, 2.0]
    assert runs[0].outcome.groups[0].peak > 0


@pytest.mark.parametrize("name", sorted(set(hfsa.cosim.__all__)))
def test_public_names_are_typed_and_documented(name):
    member = getattr(hfsa.cosim, name)
    assert inspect.getdoc(member)
    if inspect.isfunction(member):
        signature = inspect.signature(member)
        assert signature.return_annotation is not inspect.Signature.empty
        assert all(p.annotation is not inspect.Parameter.empty for p in signature.parameters.values())


def classes(annotation) -> set[type]:
    """Classes of this project in an annotation."""
    inner = annotation if isinstance(annotation, list) else typing.get_args(annotation)
    own = {annotation} if getattr(annotation, "__module__", "").startswith("hfsa.") else set()
    return own.union(*map(classes, inner))


@pytest.mark.parametrize("name", [n for n in hfsa.cosim.__all__ if inspect.isfunction(getattr(hfsa.cosim, n))])
def test_what_a_public_function_takes_is_public(name):
    taken = typing.get_type_hints(getattr(hfsa.cosim, name))
    needed = {c for word, annotation in taken.items() if word != "return" for c in classes(annotation)}
    assert needed <= {getattr(hfsa.cosim, public) for public in hfsa.cosim.__all__}


def test_a_name_that_is_not_public_is_an_attribute_error():
    assert set(hfsa.cosim.__all__) <= set(dir(hfsa.cosim))
    with pytest.raises(AttributeError, match="swep"):
        hfsa.cosim.swep  # noqa: B018
