"""Shared fixtures: parts at every level, their FMUs, a model as printed, and two foreign masters."""

import ctypes
import fcntl
import os
import signal
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from appendix_d2 import PrintedStage, assembled
from fmpy import read_model_description
from hypothesis import settings
from published import entries, numbers

import hfsa.components
import hfsa.controllers
from hfsa.components import Model
from hfsa.components._modelling.catalogue import find
from hfsa.fmus.c_code import generate
from hfsa.fmus.export import export, file_of
from hfsa.fmus.model_description import Version

PARTS = {name: part for name, part in find([hfsa.components, hfsa.controllers]).items() if part.build}
# of what can be built here: an extra may be missing
VARIANTS = [
    (n, level) for n, part in PARTS.items() for level in part.levels or (None,) if level not in part.unavailable
]

Files = dict[int, Path]
VERSIONS: tuple[Version, ...] = (2, 3)

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.register_profile("fuzz", max_examples=500, derandomize=False, deadline=None, print_blob=True)
settings.load_profile("repeatable")  # --hypothesis-profile=fuzz, of `make fuzz`, looks further


def pytest_generate_tests(metafunc):
    """A test with an argument `variant` runs for every part at every level, so a new part needs no new test."""
    if "variant" in metafunc.fixturenames:
        ids = [name if level is None else f"{name}-{level}" for name, level in VARIANTS]
        metafunc.parametrize("variant", VARIANTS, ids=ids, scope="session")


@pytest.fixture(scope="session", autouse=True)
def ctrl_c() -> Iterator[None]:
    """Handle Ctrl-C in tests and their processes, also where a background shell ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="session", autouse=True)
def scene_cache(request) -> Iterator[Path]:
    """Built scenes and solved meshes are kept from one test run to the next, by content, beside pytest's own cache."""
    folder = Path(request.config.cache.mkdir("hfsa"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HFSA_CACHE", str(folder))
        yield folder


@pytest.fixture(scope="session")
def exported(tmp_path_factory) -> Callable[[Model], Files]:
    """Export a model once, by whichever of the processes of a test run needs it first; files by FMI version."""
    base = tmp_path_factory.getbasetemp()
    shared = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "exported"
    shared.mkdir(exist_ok=True)

    def files(model: Model) -> Files:
        folder = shared / generate(model).token.strip("{}")
        with open(folder.with_suffix(".lock"), "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not folder.is_dir():
                unfinished = folder.with_suffix(".unfinished")
                export(model, unfinished)
                unfinished.rename(folder)
        return {version: file_of(model, folder, version) for version in VERSIONS}

    return files


@pytest.fixture(scope="session")
def part_model(variant: tuple[str, str | None]) -> Model:
    name, level = variant
    return PARTS[name].model(level=level)


@pytest.fixture(scope="session")
def part_files(part_model: Model, exported) -> Files:
    return exported(part_model)


@pytest.fixture(scope="session")
def mass_on_spring_files(exported) -> Files:
    return exported(PARTS["mass_on_spring"].model())


@pytest.fixture(scope="session")
def printed_stage() -> Callable[[ca.SX, ca.SX], PrintedStage]:
    """Symbols of elongations and their rates, each (3, 1), to D.2 of the stage's source in its printed numbers."""
    printed: dict[str, list[float]] = {}
    for entry in entries():
        if entry.evaluation.probe == "stage_as_appendix_d2":
            printed.setdefault(entry.key.partition("[")[0], []).extend(numbers(entry.printed))
    return partial(assembled, {name: np.array(found) for name, found in printed.items()})


class Ecos:
    """A system in ecos, stepped get all, set all, step all; names are instance::variable."""

    def __init__(self, files, h, values, connections=()):
        import ecospy

        structure = ecospy.EcosSimulationStructure()
        for name, file in files.items():
            structure.add_model(name, str(file))
        for start, end in connections:
            structure.make_real_connection(start, end)
        structure.add_parameter_set("start", {name: float(value) for name, value in values.items()})
        self.simulation = ecospy.EcosSimulation(h, structure=structure)
        self.simulation.init(parameter_set="start")

    def run(self, names, steps):
        """Values after each step, (steps, names)."""
        rows = []
        for _ in range(steps):
            self.simulation.step()
            rows.append([self.simulation.get_real(name) for name in names])
        return np.array(rows)


class Libcosim:
    """A system in libcosim, FMI 2 only; everything else as in `Ecos`."""

    def __init__(self, files, h, values, connections=()):
        from libcosimpy.CosimExecution import CosimExecution
        from libcosimpy.CosimObserver import CosimObserver
        from libcosimpy.CosimSlave import CosimLocalSlave

        self.execution = CosimExecution.from_step_size(round(h * 1e9))
        self.observer = CosimObserver.create_last_value()
        assert self.execution.add_observer(self.observer)
        self.slaves = [CosimLocalSlave(str(file), name) for name, file in files.items()]
        self.places = {}
        for (name, file), slave in zip(files.items(), self.slaves, strict=True):
            index = self.execution.add_local_slave(slave)
            for v in read_model_description(file).modelVariables:
                self.places[f"{name}::{v.name}"] = (index, v.valueReference)
        for name, value in values.items():
            assert self.execution.real_initial_value(*self.places[name], value)
        for start, end in connections:
            assert self.execution.connect_real_variables(*self.places[start], *self.places[end]) == 0

    def run(self, names, steps):
        """Values after each step, (steps, names)."""
        rows = []
        for _ in range(steps):
            assert self.execution.step()
            rows.append([self.observer.last_real_values(i, [r])[0] for i, r in (self.places[n] for n in names)])
        return np.array(rows)


@pytest.fixture(scope="session")
def ecos() -> type[Ecos]:
    """Ecos needs libtbb, which lies beside the interpreter."""
    ctypes.CDLL(str(Path(sys.prefix) / "lib" / "libtbb.so.12"), ctypes.RTLD_GLOBAL)
    return Ecos


@pytest.fixture(scope="session")
def libcosim() -> type[Libcosim]:
    return Libcosim
