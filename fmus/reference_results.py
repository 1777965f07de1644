"""Reference results inside an FMU: an example with its inputs, which an importer repeats to see that it runs the FMU.

    add_reference_results(Path("built/MassOnSpring.fmi3.fmu"))

The files follow the layered standard fmi-ls-ref of FMI 2 and 3, a draft (1.0.0-rc.1): under
`extra/org.fmi-standard.fmi-ls-ref/` a manifest, the inputs and the outputs as CSV. The example is a Co-Simulation from
rest with the step of the default experiment, at most `_STEPS` of them. Input i is a sine about its start value with
i periods in all, held within each step. The outputs are those after each step.
"""

import csv
import io
import zipfile
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.model_description import ModelDescription, ModelVariable, read_model_description
from lxml import etree

from hfsa.fmus.errors import ExportError
from hfsa.fmus.export import appearing, pack

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"

TOLERANCE = 1e-9
"""Largest difference of an output from its reference, over the largest value of the output, that a platform makes."""

_STEPS = 200
_NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
_NAME = "example"


def add_reference_results(file: Path) -> None:
    """Add the example to an FMU with a binary for this platform; the file is replaced.

    Raises:
        ExportError: no default experiment, no Co-Simulation or no output; an example that does not run; a file that
            cannot be written.
    """
    description = read_model_description(file, validate=False)
    experiment = description.defaultExperiment
    outputs = [v for v in description.modelVariables if v.causality == "output"]
    if description.coSimulation is None or experiment is None or not experiment.stepSize or not outputs:
        raise ExportError(f"{file.name} has no reference results: it needs Co-Simulation, a step size and an output")
    step = float(experiment.stepSize)
    steps = min(_STEPS, round(float(experiment.stopTime or 1.0) / step))
    stimuli = _stimuli([v for v in description.modelVariables if v.causality == "input"], step, steps)
    found = _outputs(file, description, stimuli, [str(v.name) for v in outputs], step, steps)
    with zipfile.ZipFile(file) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    with appearing(file) as unfinished:
        pack(unfinished, files | _files(stimuli, found, step, steps))


def _stimuli(inputs: list[ModelVariable], step: float, steps: int) -> np.ndarray:
    """Return time and inputs at the communication points, a structured array of shape (steps + 1,)."""
    names = ["time", *(str(v.name) for v in inputs)]
    table = np.zeros(steps + 1, dtype=[(name, np.float64) for name in names])
    table["time"] = np.arange(steps + 1) * step
    for i, v in enumerate(inputs, 1):
        amplitude = 0.1 * float(v.nominal or 1.0)
        values = float(v.start or 0.0) + amplitude * np.sin(2 * np.pi * i * np.arange(steps + 1) / steps)
        low, high = float(v.min or -np.inf), float(v.max or np.inf)
        table[str(v.name)] = np.clip(values, low, high)
    return table


def _outputs(
    file: Path, description: ModelDescription, stimuli: np.ndarray, outputs: list[str], step: float, steps: int
) -> np.ndarray:
    """Return time and outputs from the start on, a structured array of shape (steps + 1,)."""
    options: dict[str, Any] = {"input": stimuli} if len(stimuli.dtype.names or ()) > 1 else {}
    try:
        found = fmpy.simulate_fmu(
            str(file),
            validate=False,
            model_description=description,
            fmi_type="CoSimulation",
            stop_time=step * steps,
            step_size=step,
            output_interval=step,
            output=outputs,
            **options,
        )
    except Exception as error:  # fmpy raises bare exceptions for an FMU that refuses a call
        raise ExportError(f"{file.name} has no reference results: {error}") from error
    if len(found) != steps + 1 or not all(np.isfinite(found[name]).all() for name in outputs):
        raise ExportError(f"{file.name} has no reference results: its outputs are not finite in {steps} steps")
    return found


def _files(stimuli: np.ndarray, found: np.ndarray, step: float, steps: int) -> dict[str, bytes]:
    """Return the files of the layered standard by path in the archive."""
    tables = {"Stimuli": stimuli, "References": found} if len(stimuli.dtype.names or ()) > 1 else {"References": found}
    names = {element: f"{_NAME}-{element.lower()}.csv" for element in tables}
    return {
        f"{FOLDER}/fmi-ls-manifest.xml": _manifest(names, step, steps),
        "documentation/fmi-ls-ref.txt": _sentences(names).encode(),
        **{f"{FOLDER}/{names[element]}": _csv(table) for element, table in tables.items()},
    }


def _manifest(names: dict[str, str], step: float, steps: int) -> bytes:
    """Return the manifest."""
    told = {
        "name": "org.fmi-standard.fmi-ls-ref",
        "version": "1.0.0-rc.1",
        "description": "Layered Standard providing reference stimuli and results for an FMU.",
    }
    attributes = {f"{{{_NAMESPACE}}}fmi-ls-{key}": text for key, text in told.items()}
    root = etree.Element("fmiReferences", attributes, nsmap={"fmi-ls": _NAMESPACE})
    more = {"startTime": "0.0", "stopTime": repr(step * steps), "stepSize": repr(step), "tolerance": repr(TOLERANCE)}
    text = "Sines at the inputs, held within each step of Co-Simulation"
    experiment = etree.SubElement(root, "Experiment", {"name": _NAME, "description": text, **more})
    for element, name in names.items():
        etree.SubElement(experiment, element, {"source": name, "type": "text/csv"})
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _sentences(names: dict[str, str]) -> str:
    """Return what an importer should know of the example."""
    return (
        f"Reference results, {FOLDER}/{names['References']}: outputs of a Co-Simulation with all start values as they\n"
        "are in the model description. At each communication point set the inputs to the row of that time, if there\n"
        "are inputs, then step to the next row. An output may differ from its column by the tolerance of the manifest\n"
        "times the largest value in the column.\n"
    )


def _csv(table: np.ndarray) -> bytes:
    """Return a structured array as CSV with names in the first row; each number is exactly that of the array."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table.dtype.names or ())
    writer.writerows([repr(float(value)) for value in row] for row in table)
    return text.getvalue().encode()
