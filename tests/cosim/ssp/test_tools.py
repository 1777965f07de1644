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
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd, validate_tree
from lxml import etree
from package_orders import Case, elements, in_the_order_of_fmpy, in_the_order_of_omsimulator, made


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
