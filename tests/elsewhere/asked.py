"""What the tools are asked: FMUs of ours with moving inputs, and a scene as a package, with our own trajectories.

Every input is a sine of its own, nominal values high, held over steps or linear in time within them.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from co_simulation_loop import trajectory
from fmpy import read_model_description
from package_orders import Case, elements, in_the_order_of_fmpy, in_the_order_of_omsimulator, made
from task import Task

from hfsa.components._modelling.model import Kind, Model
from hfsa.cosim.assembly.fuse import models_to_export
from hfsa.fmus.export import export

STEP, STEPS = 1e-4, 500
PACKAGE_STEP, PACKAGE_STEPS = 50e-6, 200


@dataclass(frozen=True)
class Part:
    """An FMU to try: a part with arguments; `amplitude` scales the inputs [nominal values]."""

    part: str
    level: str | None = None
    arguments: Mapping[str, Any] = field(default_factory=dict)
    amplitude: float = 1.0

    @property
    def title(self) -> str:
        return self.part if self.level is None else f"{self.part} {self.level}"


PARTS = (
    Part("mass_on_spring", amplitude=1e-3),
    Part("sdelta", amplitude=1e-3),
    Part("c_drive", amplitude=1e-3),
    Part("pd", "sampled"),
    Part("pd", "continuous"),
    Part("pzt_stack", "hysteretic"),
    Part("rrr_stage", "flexible_hinges"),
    Part("tba_accelerometer", "nonlinear"),
    Part("lock_in", arguments={"window": 0.02}),
    Part("sine_source", arguments={"frequency": 40.0}),
)


@dataclass(frozen=True)
class Request:
    """A task and what is expected.

    Attributes:
        title: name of the part or scene.
        expected: outputs after each step, (steps, outputs), by how the tool moves inputs or passes values.
        scale: what the error of each output is relative to, (outputs,).
        compared: whether a row is judged, (steps,).
    """

    title: str
    task: Task
    expected: Mapping[str, np.ndarray]
    scale: np.ndarray
    compared: np.ndarray

    def error(self, found: np.ndarray, kind: str) -> float:
        """Return the largest error of an output relative to its scale, infinite where it is not finite."""
        expected = self.expected[kind]
        error = np.where(near_switches(expected), 0.0, np.abs(found - expected))[self.compared].max(axis=0)
        return float((error / self.scale).max()) if np.isfinite(found).all() else math.inf


def near_switches(expected: np.ndarray) -> np.ndarray:
    """Return where a flag, an output of -1, 0 and 1 only, switches or may be a step away from it, (steps, outputs)."""
    flags = np.isin(expected, (-1.0, 0.0, 1.0)).all(axis=0)
    switches = np.diff(expected, axis=0) != 0
    unknown = np.ones((1, expected.shape[1]), dtype=bool)
    return flags & (np.vstack([unknown, switches]) | np.vstack([switches, unknown]))


def ranges(expected: np.ndarray) -> np.ndarray:
    """Return the range of each output about zero, (outputs,), 1 where it is zero."""
    found = np.ptp(np.vstack([np.zeros(expected.shape[1]), expected]), axis=0)
    return np.where(found > 0, found, 1.0)


def signals(model: Model, amplitude: float) -> np.ndarray:
    """Return inputs at the communication points, (STEPS + 1, inputs)."""
    inputs = model.of(Kind.INPUT)
    times = STEP * np.arange(STEPS + 1)[:, None]
    frequencies = 20.0 + 7.0 * np.arange(len(inputs))
    start = np.array([q.start for q in inputs])
    nominal = np.array([q.nominal for q in inputs])
    return start + amplitude * nominal * np.sin(2 * np.pi * frequencies * times)


def between_ticks(sample_time: float | None) -> np.ndarray:
    """Return which rows are not at a tick, (STEPS,): there a tool may show the value before or after it."""
    if sample_time is None:
        return np.ones(STEPS, dtype=bool)
    ticks = STEP * np.arange(1, STEPS + 1) / sample_time
    return np.abs(ticks - np.round(ticks)) > 1e-6


def of_parts(folder: Path, parts: tuple[Part, ...] = PARTS) -> Iterator[Request]:
    """Yield the requests of each part: FMI 2 and 3, both interfaces."""
    for part in parts:
        (model,) = models_to_export(part.part, part.level, part.arguments)
        inputs = [q.name for q in model.of(Kind.INPUT)]
        outputs = [q.name for q in model.of(Kind.OUTPUT, Kind.SAMPLED_OUTPUT)]
        values = signals(model, part.amplitude)
        ticks = [q.start for q in model.of(Kind.PARAMETER) if q.name == "sample_time"]
        files = {version: export(model, folder / part.title.replace(" ", "_"), (version,))[0] for version in (2, 3)}
        expected = {
            kind: trajectory(files[2], inputs, outputs, values, STEP, linear=kind == "linear")
            for kind in ("held", "linear")
        }
        for version, file in files.items():
            description = read_model_description(file)
            references = {v.name: v.valueReference for v in description.modelVariables}
            for interface in ("CS", "ME"):
                task = Task(
                    file=str(file),
                    fmi=version,
                    interface=interface,
                    name=model.name,
                    token=description.guid if version == 2 else description.instantiationToken,
                    inputs=inputs,
                    outputs=outputs,
                    references={name: references[name] for name in (*inputs, *outputs)},
                    step_size=STEP,
                    signals=values.tolist(),
                    has_events=bool(ticks),
                )
                yield Request(
                    part.title, task, expected, ranges(expected["held"]), between_ticks(ticks[0] if ticks else None)
                )


def of_package(folder: Path) -> Iterator[Request]:
    """Yield the requests of the whole robot under control, as packages of FMI 2 and 3."""
    for version in (2, 3):
        place = folder / f"sdelta_hfsa_{version}"
        place.mkdir(parents=True, exist_ok=True)
        case = made(place, "sdelta_hfsa", PACKAGE_STEP, PACKAGE_STEPS, version, frequency=20.0)
        expected = {
            "plain": case.expected,
            "zero first": in_the_order_of_fmpy(case, place / "fmpy"),
            "through": in_the_order_of_omsimulator(case, place / "omsimulator"),
        }
        outputs = [".".join(name) for name in elements(case)]
        task = Task(
            file=str(case.file),
            fmi=version,
            interface="SSP",
            name="model",
            token="",
            inputs=[],
            outputs=outputs,
            references=_references(case, place / "fmpy"),
            step_size=PACKAGE_STEP,
            signals=[[]] * (PACKAGE_STEPS + 1),
            has_events=True,
        )
        # two of its positions are zero but for rounding
        scale = np.full(len(outputs), np.abs(case.expected).max())
        yield Request("sdelta_hfsa", task, expected, scale, np.ones(PACKAGE_STEPS, dtype=bool))


def _references(case: Case, unpacked: Path) -> dict[str, int]:
    """Return the value references of the outputs of a package."""
    found = {}
    for element, variable in elements(case):
        description = read_model_description(unpacked / "resources" / f"{element}.fmu")
        found[f"{element}.{variable}"] = next(
            v.valueReference for v in description.modelVariables if v.name == variable
        )
    return found
