"""Reference results inside an FMU: the files of the layered standard, and that an importer meets them."""

import csv
import io
import shutil
import zipfile
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from fmpy.model_description import read_model_description
from fmpy.simulation import instantiate_fmu
from lxml import etree

from hfsa.components import Model
from hfsa.components.sine_source import sine_source
from hfsa.controllers.pd import pd
from hfsa.fmus.check import examine
from hfsa.fmus.errors import ExportError
from hfsa.fmus.export import export
from hfsa.fmus.reference_results import FOLDER, add_reference_results

VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])


def table(archive: zipfile.ZipFile, name: str) -> tuple[list[str], np.ndarray]:
    """Names and rows of a CSV file of the standard's folder."""
    names, *rows = csv.reader(io.StringIO(archive.read(f"{FOLDER}/{name}").decode()))
    return names, np.array(rows, dtype=float)


def repeated(folder: Path, stimuli, outputs: list[str], step: float, steps: int) -> np.ndarray:
    """Outputs after each step, with the raw calls of the standard and nothing of what wrote the file."""
    description = read_model_description(folder)
    references = {v.name: v.valueReference for v in description.modelVariables}
    fmu = instantiate_fmu(folder, description, "CoSimulation")
    two = description.fmiMajorVersion == 2
    if two:
        fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    rows = []
    for k in range(steps):
        if stimuli is not None:
            names, values = stimuli
            (fmu.setReal if two else fmu.setFloat64)([references[n] for n in names[1:]], list(values[k, 1:]))
        fmu.doStep(k * step, step)
        rows.append((fmu.getReal if two else fmu.getFloat64)([references[n] for n in outputs]))
    fmu.terminate()
    fmu.freeInstance()
    return np.array(rows)


@VERSIONS
@pytest.mark.parametrize("part", ["mass_on_spring", "pd", "sine_source"])
def test_an_importer_meets_the_results(exported, mass_on_spring_files, tmp_path, part, version):
    files = {"mass_on_spring": mass_on_spring_files, "pd": None, "sine_source": None}[part]
    files = files or exported({"pd": pd, "sine_source": sine_source}[part]())
    file = shutil.copy(files[version], tmp_path / "it.fmu")
    add_reference_results(Path(file))
    assert examine(Path(file)).problems == []
    with zipfile.ZipFile(file) as archive:
        manifest = etree.fromstring(archive.read(f"{FOLDER}/fmi-ls-manifest.xml"))
        experiment = manifest.find("Experiment")
        names, expected = table(archive, experiment.find("References").get("source"))
        inputs = experiment.find("Stimuli")
        stimuli = None if inputs is None else table(archive, inputs.get("source"))
        archive.extractall(tmp_path / "inside")
        assert "documentation/fmi-ls-ref.txt" in archive.namelist()
    assert (stimuli is None) == (part == "sine_source")
    space = "{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-"
    assert manifest.get(f"{space}name") == "org.fmi-standard.fmi-ls-ref"
    assert {f"{space}version", f"{space}description"} <= set(manifest.attrib)
    step, stop, tolerance = (float(experiment.get(key)) for key in ("stepSize", "stopTime", "tolerance"))
    steps = round(stop / step)
    np.testing.assert_allclose(expected[:, 0], np.arange(steps + 1) * step, rtol=1e-12, atol=1e-15)
    found = repeated(tmp_path / "inside", stimuli, names[1:], step, steps)
    largest = np.abs(expected[:, 1:]).max(axis=0)
    assert largest.max() > 0
    assert (np.abs(found - expected[1:, 1:]) <= tolerance * largest).all()


def test_what_has_no_output_has_no_results(tmp_path):
    m = Model("Silent", "No output")
    m.der[m.state("x", "1", "State")] = m.input("u", "1/s", "Rate")
    (file,) = export(m, tmp_path, [3])
    before = file.read_bytes()
    with pytest.raises(ExportError, match=r"Silent.fmi3.fmu has no reference results: it needs .* an output"):
        add_reference_results(file)
    assert file.read_bytes() == before


def test_outputs_that_are_not_finite_are_refused(tmp_path):
    """The input of the example passes values that have no root."""
    m = Model("Root", "Root of the input")
    m.output("y", ca.sqrt(m.input("u", "1", "In") + 0.05), "1", "Out")
    (file,) = export(m, tmp_path, [2])
    before = file.read_bytes()
    with pytest.raises(ExportError, match=r"Root.fmi2.fmu has no reference results"):
        add_reference_results(file)
    assert file.read_bytes() == before
