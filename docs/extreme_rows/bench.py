"""What rows measure with: a system run in the time domain, one point of a sweep, free motion of a part.

Right values come from the other side: from closed forms, or from the equations of a part (`left_wing`), differentiated
by CasADi and never compiled.
"""

import math
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import expm

from extreme_rows.row import Found
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind, Model
from hfsa.cosim import run, sweep
from hfsa.cosim.assembly.build import build, with_ports
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.assembly.models import available_parts
from hfsa.cosim.assembly.native_loop import stepping_library
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.masters.algorithms import open_master
from hfsa.cosim.results.records import Status
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import System


class PointError(ValueError):
    """A point of a sweep that failed or that a limit spoils; its message is that of the point."""


def moved(
    system: System,
    step_size: float,
    steps: int,
    names: Sequence[str],
    starts: Mapping[str, float] | None = None,
    algorithm: str = "gauss_seidel",
    every: int = 1,
) -> tuple[np.ndarray, np.ndarray]:
    """Return times (points,) [s] and values (points, names) of a run of a system; errors as of a master."""
    master = open_master(with_ports(build(system), algorithm), algorithm, step_size, stepping_library())
    try:
        recording = master.record(names, rows=steps // every + 1, every=every)
        master.initialize(starts=starts)
        master.advance(steps)
        return np.array(recording.time), np.column_stack([recording[name] for name in names])
    finally:
        master.close()


def point(
    scene: str | Scene,
    arguments: Mapping[str, Any],
    excited: str,
    observed: Sequence[str],
    frequency: float,
    amplitude: float,
    **options: Any,
) -> np.ndarray:
    """Return the response of outputs, (outputs,), swept in steps at one frequency [Hz]; `PointError` if it failed."""
    with scratch() as folder:
        found = sweep(
            scene,
            arguments,
            inputs=[excited],
            outputs=observed,
            low=frequency,
            high=frequency,
            points=1,
            amplitude=amplitude,
            path=folder / "sweep.h5",
            warn=lambda _: None,
            **options,
        )
        if found.status[0, 0] != Status.DONE:
            raise PointError(found.message[0, 0])
        return found.response[0, :, 0]


def sentences(scene: str, arguments: Mapping[str, Any], **options: Any) -> str:
    """Return the warnings of a run, and the error that ends it early; errors before it starts are raised."""
    given: list[str] = []
    with scratch() as folder:
        try:
            run(scene, arguments, path=folder / "run.h5", warn=given.append, **options)
        except StepError as error:
            given.append(str(error))
    return " / ".join(given)


def free_motion(scene: str, arguments: Mapping[str, Any], component: str, step_size: float, steps: int) -> Found:
    """Return the error of a part's motion from a start of all its states, against the exponential of its equations.

    Errors and motion are measured in the nominal values of the states.
    """
    system = load_scene(scene, arguments).system
    part = system[component]
    model, given = left_wing(scene, arguments, component)
    linear = linearize(model, given)
    names = [label.replace("/", ".") for label in linear.state_labels]
    nominal = np.array([model[name].nominal for name in names])
    start = 1e-3 * nominal * np.cos(np.arange(len(names)))
    rest = {name: float(part.start.get(name, 0.0)) for name in names}
    starts = {f"{component}.{name}": rest[name] + value for name, value in zip(names, start, strict=True)}
    time, found = moved(system, step_size, steps, list(starts), starts, every=max(1, steps // 10))
    exact = np.array([expm(linear.A * t) @ start for t in time])
    off = np.abs(found - list(rest.values()) - exact) / nominal
    return Found(off.max() / (np.abs(exact) / nominal).max())


def left_wing(scene: str, arguments: Mapping[str, Any], component: str) -> tuple[Model, dict[str, float]]:
    """Return the equations of a component, and its start values that are numbers, by name."""
    part = load_scene(scene, arguments).system[component]
    model = available_parts()[part.part].model(part.level, **part.arguments)
    names = {q.name for q in model.of(Kind.PARAMETER, Kind.INPUT, Kind.STATE)}
    return model, {name: float(value) for name, value in part.start.items() if name in names}


def spring_response(frequency: float, stiffness: float, damping: float, mass: float) -> complex:
    """Return the response of the mass on a spring to its base."""
    omega = 2 * math.pi * frequency
    return stiffness / (stiffness - mass * omega**2 + 1j * damping * omega)


def transfer(linear: Any, omega: float, excited: Mapping[str, complex], observed: Sequence[str]) -> np.ndarray:
    """Return complex amplitudes of outputs of a linearised part, for amplitudes of its inputs, at omega [rad/s]."""
    u = np.zeros(linear.ninputs, complex)
    for name, value in excited.items():
        u[linear.input_labels.index(name.replace(".", "/"))] = value
    x = np.linalg.solve(1j * omega * np.eye(linear.nstates) - linear.A, linear.B @ u)
    rows = [linear.output_labels.index(name.replace(".", "/")) for name in observed]
    return (linear.C @ x + linear.D @ u)[rows]


def relative(found: np.ndarray, exact: np.ndarray) -> float:
    """Return the largest difference over the largest exact value."""
    return float(np.abs(np.subtract(found, exact)).max() / np.abs(exact).max())


@contextmanager
def scratch():
    """Give a folder for results files that is removed afterwards."""
    with tempfile.TemporaryDirectory() as folder:
        yield Path(folder)
