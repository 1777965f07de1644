"""Where a scene is stable, over one or two of its arguments: the fastest growth at every point, checked by simulation.

    axes = [parse_axis("bandwidth=1:200:20"), parse_axis("step_size=1e-5:1e-3:20")]
    found = stability_map("sdelta_hfsa", {"law": "ctc"}, axes, algorithm="jacobi")
    found.growth, found.verified                   # (20, 20) each

At each point the scene is built with those arguments, its FMUs are linearised about the equilibrium, and the one-step
matrix of the algorithm tells how fast the fastest mode grows. All points beside one that differs in stability, and a
random sample of the others, are simulated: from the equilibrium, moved a little along that mode, with the algorithm
itself. A point agrees where what is simulated grows as predicted or decays as predicted; a mode too slow to tell is
left out.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim import build
from hfsa.cosim._compiled import LOOPS, chosen_loop
from hfsa.cosim._fuse import fused, with_fusion
from hfsa.cosim.algorithms import open_master
from hfsa.cosim.instance import StepError, open_instances
from hfsa.cosim.stability import Cycle, Kind, Mode
from hfsa.cosim.step_limits import LIMITED, counting
from hfsa.cosim.system import Scene, StructureError, nearest

STEP_SIZE = "step_size"
"""Name of the communication step [s] among the arguments of a map."""

SAMPLE = 20
"""Points beside those next to a border that are simulated."""

MOVED = 1e-3
"""By how much of its nominal the state that a mode moves most is moved."""

FEWEST, MOST, FOLDS = 60, 40_000, 4.0
"""Steps of a simulation at least and at most; times that the mode should grow or decay by e within it."""

SLOW = 0.2
"""Times that a mode must grow or decay by e within the steps there are, to be told."""

GEOMETRIC = 10.0
"""Ratio of an axis' ends from which its points are evenly spaced by ratio."""

_AXIS = re.compile(r"^(?P<name>[^=]+)=(?P<low>[^:]+):(?P<high>[^:]+):(?P<points>\d+)$")


@dataclass(frozen=True)
class Axis:
    """An argument and its values, (n,), in the argument's unit."""

    name: str
    values: NDArray[np.float64]


@dataclass(frozen=True)
class StabilityMap:
    """What was found over one or two axes, arrays of their shape.

    Attributes:
        growth: of the fastest mode that counts [1/s], NaN where the scene cannot be built.
        verified: 1 where a simulation agrees, 0 where it does not, -1 where there was none or the mode is too slow.
        messages: why points could not be built, each once.
    """

    scene: str
    algorithm: str
    step_size: float
    axes: Sequence[Axis]
    growth: NDArray[np.float64]
    verified: NDArray[np.int8]
    messages: Sequence[str]

    @property
    def agreement(self) -> tuple[int, int]:
        """Points at which a simulation agrees, and points that were simulated."""
        return int((self.verified == 1).sum()), int((self.verified >= 0).sum())


def parse_axis(words: str) -> Axis:
    """Return the axis of `NAME=FROM:TO:N`; `StructureError` for other words."""
    match = _AXIS.match(words)
    try:
        assert match is not None
        low, high, points = float(match["low"]), float(match["high"]), int(match["points"])
    except (AssertionError, ValueError):
        raise StructureError(f"--vary {words}: expected NAME=FROM:TO:N, such as bandwidth=1:100:20") from None
    if not (math.isfinite(low) and math.isfinite(high) and low < high and points >= 2):
        raise StructureError(f"--vary {words}: expected FROM below TO, and 2 points or more")
    spaced = np.geomspace if low > 0 and high / low >= GEOMETRIC else np.linspace
    return Axis(match["name"].strip(), spaced(low, high, points))


def stability_map(
    name: str,
    arguments: Mapping[str, str],
    axes: Sequence[Axis],
    *,
    fuse: Sequence[str] = (),
    step_size: float | None = None,
    algorithm: str | None = None,
    report: Callable[[float, str], None] | None = None,
) -> StabilityMap:
    """Return the map of a scene over one or two axes.

    `arguments` are the scene's others, `fuse` groups of components that become one FMU each, both as typed.
    `report` is called with the part done, 0 to 1. `StructureError` for an algorithm without a known limit, more axes,
    and where no point at all can be built, with the first reason.
    """
    if not 1 <= len(axes) <= 2:
        raise StructureError(f"a map takes one or two --vary; found {len(axes)}")
    shape = tuple(len(axis.values) for axis in axes)
    points = {index: _Point(name, arguments, axes, index, fuse, step_size, algorithm) for index in np.ndindex(shape)}
    growth, messages = np.full(shape, np.nan), {}
    for done, (index, point) in enumerate(points.items(), 1):
        try:
            growth[index] = point.growth()
        except ValueError as error:  # ModelError and StructureError: no such posture, no equilibrium
            messages.setdefault(str(error), index)
        if report is not None:
            report(0.7 * done / len(points), "matrices")
    if np.isnan(growth).all():
        raise StructureError(next(iter(messages)))
    verified = np.full(shape, -1, dtype=np.int8)
    chosen = _chosen(growth)
    for done, index in enumerate(chosen, 1):
        verified[index] = points[index].verified()
        if report is not None:
            report(0.7 + 0.3 * done / len(chosen), "simulations")
    scene = points[(0,) * len(shape)].scene
    return StabilityMap(name, scene.algorithm, scene.step_size, axes, growth, verified, list(messages))


class _Point:
    """One point of a map."""

    def __init__(
        self,
        name: str,
        arguments: Mapping[str, str],
        axes: Sequence[Axis],
        index: Sequence[int],
        fuse: Sequence[str],
        step_size: float | None,
        algorithm: str | None,
    ):
        values = {axis.name: float(axis.values[i]) for axis, i in zip(axes, index, strict=True)}
        step_size = values.pop(STEP_SIZE, step_size)
        changes = {"step_size": step_size, "algorithm": algorithm}
        self._load = lambda: replace(
            with_fusion(
                build.load_scene(name, {**arguments, **{key: repr(value) for key, value in values.items()}}), fuse
            ),
            **{key: value for key, value in changes.items() if value is not None},
        )
        self.scene: Scene
        self._mode: Mode | None = None

    def growth(self) -> float:
        """Return the fastest growth [1/s] of the modes that count."""
        self.scene = scene = self._load()
        if scene.algorithm not in LIMITED:
            raise StructureError(f"no map is known of {scene.algorithm}{nearest(scene.algorithm, LIMITED)}")
        self._system = fused(scene.system, scene.fuse)
        self._files = build.build(self._system)
        with open_instances(self._files) as instances:
            cycle = Cycle(self._system, instances, scene.algorithm)
            own = cycle.over(scene.step_size)
            kind: Kind = counting(cycle, self._system, instances, scene.step_size)
            nominal = {
                f"{c}.{n}": abs(v.nominal)
                for c, i in instances.items()
                for n, v in i.fmu.variables.items()
                if v.is_real
            }
            states = {f"{c}.{state}" for c, i in instances.items() for state, _ in i.fmu.description.states}
        self._mode = max(own.of(kind), key=lambda mode: mode.rate, default=None)
        self._rest = {name: value for name, value in cycle.operating_point.items() if name in states}
        self._nominal = nominal
        return own.growth(kind)

    def verified(self) -> int:
        """Return whether a simulation agrees, as `StabilityMap.verified`."""
        scene, mode = self.scene, self._mode
        if mode is None:
            return -1
        h = scene.step_size
        steps = int(np.clip(FOLDS / max(abs(mode.rate) * h, 1e-300), FEWEST, MOST))
        if mode.frequency > 0:
            steps = int(np.clip(max(steps, 6 / (mode.frequency * h)), FEWEST, MOST))
        if abs(mode.rate) * steps * h < SLOW:
            return -1
        largest = max((abs(mode.shape[name]) / self._nominal[name] for name in self._rest), default=0.0)
        if largest == 0.0:
            return -1
        moved = {n: x + float((mode.shape[n] * MOVED / largest).real) for n, x in self._rest.items()}
        still, moving = self._simulated(self._rest, steps), self._simulated(moved, steps)
        rows = min(len(still), len(moving))
        if rows < steps:  # it left every bound
            return int(mode.rate > 0)
        size = np.linalg.norm((moving[:rows] - still[:rows]) / self._scale, axis=1)
        third = rows // 3
        first, last = size[third : 2 * third].max(), size[-third:].max()
        return int((last > first) == (mode.rate > 0))

    def _simulated(self, starts: Mapping[str, float], steps: int) -> NDArray[np.float64]:
        """Return what crosses connections at every point, (points, connections), as far as the run comes."""
        scene = self.scene
        names = list(dict.fromkeys(connection.start for connection in self._system.connections))
        self._scale = np.array([self._nominal[name] for name in names])
        library = chosen_loop(LOOPS[0], lambda _: None)
        with closing(open_master(self._files, self._system, scene.algorithm, scene.step_size, library)) as master:
            recording = master.record(names, rows=steps + 1)
            try:
                master.initialize(starts=starts)
                master.advance(steps)
            except StepError:
                pass
            return recording.values.copy()


def _chosen(growth: NDArray[np.float64]) -> list[tuple[int, ...]]:
    """Return the points to simulate: beside a border, and a sample of the others that is the same every time."""
    stable = growth <= 0
    border, others = [], []
    for index in np.ndindex(growth.shape):
        if np.isnan(growth[index]):
            continue
        beside = [
            tuple(i + sign * (k == axis) for k, i in enumerate(index))
            for axis in range(growth.ndim)
            for sign in (1, -1)
        ]
        inside = [p for p in beside if all(0 <= i < n for i, n in zip(p, growth.shape, strict=True))]
        is_beside = any(stable[p] != stable[index] for p in inside if not np.isnan(growth[p]))
        (border if is_beside else others).append(index)
    drawn = np.random.default_rng(0).permutation(len(others))[:SAMPLE]
    return [*border, *(others[i] for i in drawn)]


def default_path(name: str) -> Path:
    """Return where the map of a scene is written without `-o`."""
    return Path("results", f"{Path(name).stem}_stability.h5")
