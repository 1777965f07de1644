"""Packages of ours in the tools that run them: one file, unchanged, with the trajectory of `jacobi_plain`.

Each tool reads what it can. ecos and libcosim read parameter sets; fmpy and fmutool do not, and run on the start values
inside the FMUs. All fetch all outputs, set all inputs, and step all, as `jacobi_plain` does, but fmpy begins with
zeros, and OMSimulator passes values at once through FMUs with direct feedthrough.
"""

import ctypes
import importlib.util
import logging
import sys
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd, validate_tree
from lxml import etree

from hfsa.cosim import load_scene, run
from hfsa.cosim.experiments.package import package
from hfsa.cosim.fmi.co_simulation import open_instances


@dataclass(frozen=True)
class Case:
    """A package with the outputs to compare: after each of the steps, (steps, outputs), by `jacobi_plain`."""

    file: Path
    outputs: list[str]
    step_size: float
    steps: int
    expected: np.ndarray


def made(folder: Path, scene: str, step_size: float, steps: int, fmi: int = 2, **sine: float) -> Case:
    """Return the package of a scene, and its own run."""
    file = package(scene, path=folder / "model.ssp", step_size=step_size, fmi=fmi, warn=lambda _: None, **sine).file
    found = run(
        scene,
        algorithm="jacobi_plain",
        step_size=step_size,
        stop_time=steps * step_size,
        keep="all",
        path=folder / "run.h5",
        warn=lambda _: None,
        **sine,
    )
    outputs = list(load_scene(scene).outputs)
    return Case(file, outputs, step_size, steps, np.array([found[name][1:] for name in outputs]).T)


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(("mass_on_spring", 1e-4, 500, 2, {"frequency": 10.0}), id="mass_on_spring"),
        pytest.param(("mass_on_spring", 1e-4, 500, 3, {"frequency": 10.0}), id="mass_on_spring-fmi3"),
        pytest.param(("sdelta_hfsa", 50e-6, 200, 2, {"frequency": 20.0}), id="sdelta_hfsa", marks=pytest.mark.slow),
    ],
)
def case(request, tmp_path_factory) -> Case:
    scene, step_size, steps, fmi, sine = request.param
    return made(tmp_path_factory.mktemp(scene), scene, step_size, steps, fmi, **sine)


def agrees(found: np.ndarray, case: Case) -> None:
    """Every output is that of `jacobi_plain` to 1e-9 of its largest value."""
    assert found.shape == case.expected.shape
    scale = np.abs(case.expected).max(axis=0)
    assert scale.max() > 0
    assert (np.abs(found - case.expected).max(axis=0) <= 1e-9 * scale.max()).all()


def needs(module: str) -> None:
    """Skip a test where a tool is missing."""
    if importlib.util.find_spec(module) is None:
        pytest.skip(f"{module} is not installed")


def elements(case: Case) -> list[tuple[str, str]]:
    """Element and connector of each output."""
    named = {e.name: e for e in read_ssd(str(case.file)).system.elements}
    found = []
    for output in case.outputs:
        component, _, variable = output.partition(".")
        element = component.replace("[", "_").replace("]", "")
        assert variable in [connector.name for connector in named[element].connectors]
        found.append((element, variable))
    return found


def test_the_description_is_valid(case):
    """By the schema of the standard, as fmpy has it, and so are the parameter sets."""
    with zipfile.ZipFile(case.file) as archive:
        validate_tree(etree.fromstring(archive.read("SystemStructure.ssd")), "SystemStructureDescription.xsd")
        sets = [name for name in archive.namelist() if name.endswith(".ssv")]
        assert sets
        for name in sets:
            validate_tree(etree.fromstring(archive.read(name)), "SystemStructureParameterValues.xsd")
        places = {component.source for component in read_ssd(str(case.file)).system.elements}
        assert places <= set(archive.namelist())


def test_ecos(case):
    needs("ecospy")
    ctypes.CDLL(str(Path(sys.prefix) / "lib" / "libtbb.so.12"), ctypes.RTLD_GLOBAL)
    import ecospy

    names = ["::".join(place) for place in elements(case)]
    simulation = ecospy.EcosSimulation(case.step_size, ssp_path=str(case.file))
    simulation.init(parameter_set="start")
    rows = []
    for _ in range(case.steps):
        simulation.step()
        rows.append([simulation.get_real(name) for name in names])
    agrees(np.array(rows), case)


def is_fmi3(case: Case) -> bool:
    with zipfile.ZipFile(case.file) as archive:
        first = next(name for name in archive.namelist() if name.endswith(".fmu"))
        (case.file.parent / "one.fmu").write_bytes(archive.read(first))
    return read_model_description(case.file.parent / "one.fmu", validate=False).fmiVersion.startswith("3")


def test_libcosim(case, tmp_path):
    needs("libcosimpy")
    if is_fmi3(case):
        pytest.skip("libcosim has no FMI 3")
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    with zipfile.ZipFile(case.file) as archive:
        archive.extractall(tmp_path)
    execution = CosimExecution.from_ssp_file(str(case.file))
    observer = CosimObserver.create_last_value()
    assert execution.add_observer(observer)
    slaves = {info.name.decode(): info.index for info in execution.slave_infos()}
    places = []
    for element, variable in elements(case):
        description = read_model_description(tmp_path / "resources" / f"{element}.fmu")
        reference = next(v.valueReference for v in description.modelVariables if v.name == variable)
        places.append((slaves[element], reference))
    rows = []
    for _ in range(case.steps):
        assert execution.step()  # by the step of the package
        rows.append([observer.last_real_values(slave, [reference])[0] for slave, reference in places])
    agrees(np.array(rows), case)


@contextmanager
def by_hand(case: Case, folder: Path) -> Iterator[tuple[Callable[[], None], Callable[[], None], Callable[[], list]]]:
    """Yield a way to set all fed inputs to zero, to fetch all outputs and set all inputs, and to step and observe."""
    structure = read_ssd(str(case.file)).system
    with zipfile.ZipFile(case.file) as archive:
        archive.extractall(folder)
    with open_instances({e.name: folder / e.source for e in structure.elements}) as instances:
        for instance in instances.values():
            instance.start()

        def port(element: str, name: str):
            return instances[element], instances[element].handle([name])

        wires = [
            (port(c.startElement, c.startConnector), port(c.endElement, c.endConnector)) for c in structure.connections
        ]
        observed = [port(*place) for place in elements(case)]
        times = iter(range(case.steps))

        def clear() -> None:
            for _, (taker, entry) in wires:
                taker.set(entry, [0.0])

        def exchange() -> None:
            values = [giver.get(output).copy() for (giver, output), _ in wires]
            for value, (_, (taker, entry)) in zip(values, wires, strict=True):
                taker.set(entry, value)

        def step() -> list:
            k = next(times)
            for instance in instances.values():
                instance.step(k * case.step_size, case.step_size)
            return [instance.get(handle)[0] for instance, handle in observed]

        yield clear, exchange, step


def in_the_order_of_fmpy(case: Case, folder: Path) -> np.ndarray:
    """What `jacobi_plain` does if no output is fetched before the first step, so that its inputs are zero."""
    with by_hand(case, folder) as (clear, exchange, step):
        rows = []
        for k in range(case.steps):
            exchange() if k else clear()
            rows.append(step())
    return np.array(rows)


def in_the_order_of_omsimulator(case: Case, folder: Path) -> np.ndarray:
    """What `jacobi_plain` does if values pass at once through all FMUs that let them, before all step."""
    with by_hand(case, folder) as (_, exchange, step):
        rows = []
        for _ in range(case.steps):
            for _ in read_ssd(str(case.file)).system.elements:
                exchange()
            rows.append(step())
    return np.array(rows)


def test_fmpy(case, tmp_path):
    """The first step has inputs of zero in fmpy: it sets them before it has fetched an output."""
    if is_fmi3(case):
        pytest.skip("fmpy simulates packages of FMI 2 only")
    found = simulate_ssp(str(case.file), stop_time=(case.steps - 0.5) * case.step_size, step_size=case.step_size)
    expected = replace(case, expected=in_the_order_of_fmpy(case, tmp_path))
    agrees(np.array([found[f"{element}.{variable}"] for element, variable in elements(case)]).T, expected)


def test_fmutool_makes_a_container(case, tmp_path):
    needs("fmu_manipulation_toolbox")
    from fmu_manipulation_toolbox.assembly import Assembly

    logging.getLogger("fmu_manipulation_toolbox").setLevel(logging.CRITICAL)
    (tmp_path / "model.ssp").write_bytes(case.file.read_bytes())
    assembly = Assembly("model.ssp", default_step_size=case.step_size, fmu_directory=tmp_path)
    assembly.make_fmu(fmi_version=3 if is_fmi3(case) else 2)
    names = [".".join(("model", *place)) for place in elements(case)]
    found = simulate_fmu(
        tmp_path / "model.fmu",
        fmi_type="CoSimulation",
        step_size=case.step_size,
        output_interval=case.step_size,
        stop_time=case.steps * case.step_size,
        output=names,
    )
    agrees(np.array([found[name][1:] for name in names]).T, case)


def test_omsimulator(case, tmp_path):
    """It passes values through FMUs with direct feedthrough before each step; its other order is that of the rest."""
    needs("OMSimulator")
    if is_fmi3(case):
        pytest.skip("OMSimulator takes the dependencies of FMI 3 for positions instead of value references")
    from OMSimulator import SSP, CRef

    model = SSP(str(case.file)).instantiate()
    model.setResultFile("")
    model.setStopTime(case.steps * case.step_size)
    model.initialize()  # the step is that of the package
    rows = []
    for _ in range(case.steps):
        model.doStep()
        rows.append([model.getValue(CRef("model", *place)) for place in elements(case)])
    model.terminate()
    model.delete()
    agrees(np.array(rows), replace(case, expected=in_the_order_of_omsimulator(case, tmp_path)))
