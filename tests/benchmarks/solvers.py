"""Cost and error of the solvers in Co-Simulation FMUs, on the robot and on the stage.

    python tests/benchmarks/solvers.py

Every input follows a sine of a tenth of its nominal, held over each communication step, as most masters do. The cost is
the shortest processor time of three runs, by step, with the two calls that set inputs and step, about 2 us through
ctypes. The error is the largest of any state at 20 points of the run, in units of the largest value of that state,
against `exact` for the linear robot and RODAS5P with a tolerance of 1e-13 for the stage. CVODE is left out where
SUNDIALS is not installed.
"""

import ctypes
import math
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave

from hfsa.components._modelling.model import Kind
from hfsa.cosim.assembly.models import available_parts
from hfsa.fmus.c_code import Sources, generate
from hfsa.fmus.compile import compile_library
from hfsa.fmus.errors import ExportError

TOLERANCE, STEP, ORDER = "solver.relative_tolerance", "solver.maximum_step", "solver.maximum_order"
POINTS, ROUNDS = 20, 3

SETTINGS = (
    ("exact", {}),
    ("rosenbrock", {TOLERANCE: 1e-6}),
    ("rosenbrock", {TOLERANCE: 1e-8}),
    ("rosenbrock", {TOLERANCE: 1e-10}),
    ("rk4", {STEP: 1e-4}),
    ("rk4", {STEP: 1e-5}),
    ("cvode", {TOLERANCE: 1e-6}),
    ("cvode", {TOLERANCE: 1e-8}),
    ("cvode", {TOLERANCE: 1e-10}),
    ("cvode", {TOLERANCE: 1e-8, ORDER: 2.0}),
)


@dataclass(frozen=True)
class Case:
    """A part at a level, driven at a frequency [Hz], with a communication step size and an end [s]."""

    part: str
    level: str
    frequency: float
    step_size: float
    stop_time: float
    reference: tuple[str, dict[str, float]]


CASES = (
    Case("sdelta", "cartesian", 15.0, 1e-3, 0.2, ("exact", {})),
    Case("sdelta", "cartesian", 15.0, 1e-4, 0.2, ("exact", {})),
    Case("rrr_stage", "exact", 100.0, 1e-4, 0.02, ("rosenbrock", {TOLERANCE: 1e-13})),
    Case("rrr_stage", "exact", 100.0, 1e-5, 0.02, ("rosenbrock", {TOLERANCE: 1e-13})),
)


def run(case: Case, solver: str, settings: dict[str, float], folder: Path) -> tuple[np.ndarray, float]:
    """Return the states at `POINTS` points, shape (points, states), and the processor time of a step [s]."""
    model = available_parts()[case.part].model(case.level, solver=solver)
    sources = generate(model)
    folder = folder / f"{case.part}-{solver}"
    library = folder / "binaries" / fmpy.platform_tuple / f"{sources.name}{fmpy.sharedLibraryExtension}"
    if not library.exists():
        compile_library(sources, library.parent)
    count = round(case.stop_time / case.step_size)
    inputs = model.of(Kind.INPUT)
    phases = 2 * math.pi * case.frequency * case.step_size * np.arange(count)[:, None] + 0.7 * np.arange(len(inputs))
    driven = np.array([q.start for q in inputs]) + 0.1 * np.array([q.nominal for q in inputs]) * np.sin(phases)
    runs = [_once(case, sources, folder, library, settings, driven) for _ in range(ROUNDS)]
    return runs[0][0], min(cost for _, cost in runs)


def _once(
    case: Case, sources: Sources, folder: Path, library: Path, settings: dict[str, float], driven: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return states and cost of one instance, whose inputs are the rows of `driven`."""
    fmu = FMU2Slave(
        guid=sources.token,
        unzipDirectory=str(folder),
        modelIdentifier=sources.name,
        instanceName="it",
        libraryPath=str(library),
    )
    fmu.instantiate()
    names = {v.name: v.reference for v in sources.variables}
    fmu.setReal([names[name] for name in settings], list(settings.values()))
    fmu.setupExperiment()
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    columns = {role: [v.reference for v in sources.variables if v.role.value == role] for role in ("input", "state")}
    references = (ctypes.c_uint32 * driven.shape[1])(*columns["input"])
    rows = [(ctypes.c_double * driven.shape[1])(*row) for row in driven]
    component, size, h = ctypes.c_void_p(fmu.component), ctypes.c_size_t(driven.shape[1]), case.step_size
    set_real, do_step = (fmu.dll[name] for name in ("fmi2SetReal", "fmi2DoStep"))  # without fmpy's checks
    states, spent, every = [], 0.0, len(rows) // POINTS
    for point in range(POINTS):
        begin = time.process_time()
        for k in range(point * every, (point + 1) * every):
            set_real(component, references, size, rows[k])
            if do_step(component, ctypes.c_double(k * h), ctypes.c_double(h), 0):
                raise RuntimeError(f"{case.part} stopped at {k * h:g} s")
        spent += time.process_time() - begin
        states.append(fmu.getReal(columns["state"]))
    fmu.freeInstance()
    return np.array(states), spent / len(rows)


def main() -> None:
    """Print a table for each case."""
    with tempfile.TemporaryDirectory(prefix="hfsa-") as name:
        for case in CASES:
            expected, _ = run(case, *case.reference, Path(name))
            size = np.abs(expected).max(axis=0)
            print(f"\n{case.part} {case.level}: {len(size)} states, communication step {case.step_size:g} s")
            for solver, settings in SETTINGS:
                label = ", ".join(f"{key.partition('.')[2]} {value:g}" for key, value in settings.items())
                try:
                    states, cost = run(case, solver, settings, Path(name))
                except ExportError:
                    print(f"  {solver:11} {label:42} not for this model, or not on this machine")
                    continue
                off = (np.abs(states - expected).max(axis=0) / np.where(size, size, 1.0)).max()
                print(f"  {solver:11} {label:42} {1e6 * cost:8.1f} us   error {off:.0e}")


if __name__ == "__main__":
    main()
