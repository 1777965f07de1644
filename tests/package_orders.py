"""Packages of scenes of ours, with the trajectories of tools by the order in which they exchange values."""

import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from fmpy.ssp.ssd import read_ssd

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
