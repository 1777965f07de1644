"""Responses of a scene: linearised, by the one-step matrix, and swept; and differences between them."""

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.assembly import build
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.linear.linearize import linear_response
from hfsa.cosim.measurement.rig import Rig, Settings, Task
from hfsa.cosim.measurement.sweep import Bench
from hfsa.cosim.results.records import Point, Status
from hfsa.cosim.systems.scene import Scene

Opened = Callable[[dict[str, Path]], dict[str, Instance]]


@cache
def scene(name: str, **arguments) -> Scene:
    """Return a scene by name, loaded once."""
    return load_scene(name, arguments)


def linear(
    opened: Opened, at: Scene, inputs: Sequence[str], outputs: Sequence[str], frequency: ArrayLike
) -> np.ndarray:
    """Return the response of the linearised scene, (frequencies, outputs, inputs)."""
    return linear_response(at.system, opened(build.build(at.system).files), inputs, outputs, np.atleast_1d(frequency))


def one_step(
    opened: Opened,
    at: Scene,
    excited: str,
    outputs: Sequence[str],
    frequency: ArrayLike,
    algorithm: str = "gauss_seidel",
    step_size: float | None = None,
) -> np.ndarray:
    """Return the settled response of a stepped sweep, (frequencies, outputs)."""
    system = build.instrument(at, excited, outputs)
    coupled = CoupledStep(system, opened(build.build(system).files), algorithm, source="source", lock_in="lock_in")
    return coupled.over(step_size or at.step_size).response(np.atleast_1d(frequency))


def swept(
    library: Path,
    at: Scene,
    excited: str,
    outputs: Sequence[str],
    frequency: ArrayLike,
    step_size: float | None = None,
    amplitude: float = 1.0,
) -> list[Point]:
    """Return the points of a stepped sweep."""
    system = build.instrument(at, excited, outputs)
    bench = Bench(build.build(system), tuple(outputs), library=library)
    settings = Settings(step_size=step_size or at.step_size, settling_tolerance=1e-4)
    rig = Rig(bench, settings)
    points = [rig.measure(Task(0, 0, bench, settings, float(f), amplitude)) for f in np.atleast_1d(frequency)]
    rig.close()
    return points


def responses(points: Sequence[Point]) -> np.ndarray:
    """Return the responses of points, all done and without a message, (points, outputs)."""
    assert {(point.status, point.message) for point in points} == {(Status.DONE, "")}
    return np.array([point.response for point in points])


def errors(found: np.ndarray, expected: np.ndarray) -> tuple[float, float]:
    """Return the largest difference in dB and in degrees."""
    ratio = found / expected
    return np.abs(20 * np.log10(np.abs(ratio))).max(), np.abs(np.degrees(np.angle(ratio))).max()


def ahead(found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Return the phase lead of a response over the expected one [deg]."""
    return np.degrees(np.angle(found / expected))


def assert_close(found: np.ndarray, expected: np.ndarray) -> None:
    """Responses agree to 0.05 dB and 0.5 degrees."""
    decibels, degrees = errors(found, expected)
    assert decibels < 0.05
    assert degrees < 0.5
