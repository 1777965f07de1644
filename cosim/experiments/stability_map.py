"""Where a scene is stable, over one or two of its arguments: the fastest growth at every point, checked by simulation.

    axes = [parse_axis("posture.rotation[3]=0:40:9"), parse_axis("step_size=1e-5:1e-3:20")]
    found = stability_map("sdelta_hfsa", {"law": "ctc"}, axes, algorithm="jacobi")
    found.stable, found.growth, found.verified     # (9, 20) each

At each point the scene is built with those arguments, its FMUs are linearised about the equilibrium, and the one-step
matrix of the algorithm tells how fast the fastest mode grows, and where a fixed point is looked for, whether its passes
lead to it. All points beside one that differs in stability, and a random sample of the others, are simulated: from the
equilibrium, moved a little along that mode, with the algorithm itself. A point agrees where what is simulated grows as
predicted or decays as predicted, and passes that lead nowhere stop the run; what is too slow to tell is left out.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.actions.iterated import PASSES, TOLERANCE
from hfsa.cosim.analysis.stability import CoupledStep, Mode
from hfsa.cosim.assembly.assemble import assemble
from hfsa.cosim.assembly.build import with_ports
from hfsa.cosim.assembly.fuse import with_fusion
from hfsa.cosim.assembly.load_scene import load_scene, with_arguments
from hfsa.cosim.assembly.native_loop import BACKENDS, chosen_loop
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.masters.algorithms import CANDIDATES, LIMITED, open_master
from hfsa.cosim.results.stability_map import GEOMETRIC, Axis, StabilityMap
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import nearest
from hfsa.cosim.systems.scene import AUTO, Scene
from hfsa.cosim.systems.system import in_order

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

FAR = 1e3
"""Times as large as at the beginning that a deviation has grown for sure, or as small that it has died out."""

_AXIS = re.compile(r"^(?P<name>[^=]+)=(?P<low>[^:]+):(?P<high>[^:]+):(?P<points>\d+)$")


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
    name: str | Path | Scene,
    arguments: Mapping[str, str],
    axes: Sequence[Axis],
    *,
    fuse: Sequence[str] = (),
    step_size: float | None = None,
    algorithm: str | None = None,
    order: Sequence[str] = (),
    report: Callable[[float, str], None] | None = None,
) -> StabilityMap:
    """Return the map of a scene over one or two axes.

    `arguments` are the scene's others, `fuse` groups of components that become one FMU each, both as typed; `order`
    holds components in that of their steps.
    `report` is called with the part done, 0 to 1. `StructureError` for an algorithm without a known limit, axes that
    do not go with each other or with the rest, and where no point at all can be built, with the first reason.
    """
    _check_axes(axes, arguments, step_size)
    shape = tuple(len(axis.values) for axis in axes)
    load = partial(_scene, name, fuse, algorithm, order)
    points = {index: _Point(load, arguments, axes, index, step_size) for index in np.ndindex(shape)}
    growth, stable, messages = np.full(shape, np.nan), np.zeros(shape, dtype=bool), {}
    for done, (index, point) in enumerate(points.items(), 1):
        try:
            growth[index], stable[index] = point.judged()
        except ValueError as error:  # ModelError and StructureError: no such posture, no equilibrium
            messages.setdefault(str(error), index)
        if report is not None:
            report(0.7 * done / len(points), "matrices")
    if np.isnan(growth).all():
        raise StructureError(next(iter(messages)))
    verified = np.full(shape, -1, dtype=np.int8)
    chosen = _chosen(~np.isnan(growth), stable)
    for done, index in enumerate(chosen, 1):
        verified[index] = points[index].verified()
        if report is not None:
            report(0.7 + 0.3 * done / len(chosen), "simulations")
    scene = points[(0,) * len(shape)].scene
    words = "scene" if isinstance(name, Scene) else str(name)
    return StabilityMap(words, scene.algorithm, scene.step_size, axes, growth, stable, verified, list(messages))


def _check_axes(axes: Sequence[Axis], arguments: Mapping[str, str], step_size: float | None) -> None:
    """Raise `StructureError` for none or more axes than two, and for one that is said twice."""
    if not 1 <= len(axes) <= 2:
        raise StructureError(f"a map takes one or two --vary; found {len(axes)}")
    names = [axis.name for axis in axes]
    if names[1:] == names[:1]:
        raise StructureError(f"--vary {names[0]} is said twice; the second axis of a map is another argument")
    if step_size is not None and STEP_SIZE in names:
        raise StructureError(f"--vary {STEP_SIZE} and --step {step_size:g}: leave one out")
    for name in names:
        if name in arguments:
            raise StructureError(f"--vary {name} and -p {name}={arguments[name]}: leave one out")


def _scene(
    name: str | Path | Scene,
    fuse: Sequence[str],
    algorithm: str | None,
    order: Sequence[str],
    arguments: Mapping[str, str],
    step_size: float | None,
) -> Scene:
    """Return a scene as it is looked at."""
    loaded = with_arguments(name, arguments) if isinstance(name, Scene) else load_scene(str(name), arguments)
    scene = with_fusion(loaded, fuse)
    # one algorithm for all points, as each would choose another
    algorithm = algorithm or (CANDIDATES[0] if scene.algorithm == AUTO else None)
    changes = {"step_size": step_size, "algorithm": algorithm, "system": in_order(scene.system, order)}
    return replace(scene, **{key: value for key, value in changes.items() if value is not None})


class _Point:
    """One point of a map."""

    def __init__(
        self,
        load: Callable[[Mapping[str, str], float | None], Scene],
        arguments: Mapping[str, str],
        axes: Sequence[Axis],
        index: Sequence[int],
        step_size: float | None,
    ):
        values = {axis.name: float(axis.values[i]) for axis, i in zip(axes, index, strict=True)}
        step_size = values.pop(STEP_SIZE, step_size)
        typed = {key: repr(value) for key, value in values.items()}
        self._load = partial(load, {**arguments, **typed}, step_size)
        self.scene: Scene
        self._mode: Mode | None = None

    def judged(self) -> tuple[float, bool]:
        """Return the fastest growth [1/s] of the modes that count, and whether the point is stable."""
        self.scene = scene = self._load()
        if scene.algorithm not in LIMITED:
            raise StructureError(f"no map is known of {scene.algorithm}{nearest(scene.algorithm, LIMITED)}")
        self._assembly = with_ports(assemble(scene), scene.algorithm)
        with self._assembly.open() as instances:
            cycle = CoupledStep(self._assembly.system, instances, scene.algorithm)
            own, self._contraction = cycle.over(scene.step_size), cycle.contraction(scene.step_size)
            nominal = {
                f"{c}.{n}": abs(v.nominal)
                for c, i in instances.items()
                for n, v in i.fmu.variables.items()
                if v.is_real
            }
            states = {f"{c}.{state}" for c, i in instances.items() for state, _ in i.fmu.description.states}
        self._mode = max(own.of(cycle.counting), key=lambda mode: mode.rate, default=None)
        self._rest = {name: value for name, value in cycle.operating_point.items() if name in states}
        self._nominal = nominal
        return own.growth(cycle.counting), own.is_stable(cycle.counting) and self._contraction < 1

    def verified(self) -> int:
        """Return whether a simulation agrees, as `StabilityMap.verified`."""
        if self._contraction >= 1:
            return int(len(self._simulated(self._anywhere(), FEWEST)) <= FEWEST)
        mode = self._mode
        if mode is None:
            return -1
        largest = max((abs(mode.shape[name]) / self._nominal[name] for name in self._rest), default=0.0)
        if largest == 0.0:
            return -1
        moved = {n: x + float((mode.shape[n] * MOVED / largest).real) for n, x in self._rest.items()}
        steps = self._steps(mode)
        if abs(mode.rate) * steps * self.scene.step_size < SLOW:
            return -1
        still, moving = self._simulated(self._rest, steps), self._simulated(moved, steps)
        rows = min(len(still), len(moving))
        if rows <= steps and self._contraction ** PASSES["fixed_point"] > TOLERANCE:  # too slow to lead to it in time
            return -1
        if rows <= steps:  # it left every bound
            return int(mode.rate > 0)
        size = np.linalg.norm((moving[:rows] - still[:rows]) / self._scale, axis=1)
        return int(_has_grown(size) == (mode.rate > 0))

    def _anywhere(self) -> dict[str, float]:
        """Return states moved in no direction in particular: passes may lead nowhere in one that no mode shares."""
        drawn = np.random.default_rng(0).uniform(-MOVED, MOVED, len(self._rest))
        return {n: x + share * self._nominal[n] for (n, x), share in zip(self._rest.items(), drawn, strict=True)}

    def _steps(self, mode: Mode) -> int:
        """Return the steps after which a mode can be told to grow or decay."""
        h = self.scene.step_size
        steps = FOLDS / max(abs(mode.rate) * h, 1e-300)
        turns = 6 / (mode.frequency * h) if mode.frequency > 0 else 0.0
        return int(np.clip(max(steps, turns), FEWEST, MOST))

    def _simulated(self, starts: Mapping[str, float], steps: int) -> NDArray[np.float64]:
        """Return what crosses connections at every point, (points, connections), as far as the run comes."""
        scene = self.scene
        names = list(dict.fromkeys(connection.start for connection in self._assembly.system.connections))
        self._scale = np.array([self._nominal[name] for name in names])
        library = chosen_loop(BACKENDS[0], lambda _: None)
        with closing(open_master(self._assembly, scene.algorithm, scene.step_size, library)) as master:
            recording = master.record(names, rows=steps + 1)
            try:
                master.initialize(starts=starts)
                master.advance(steps)
            except StepError:
                pass
            return recording.values.copy()


def _has_grown(size: NDArray[np.float64]) -> bool:
    """Whether a deviation, (points,), grows from the middle third to the last.

    It also does where something saturates by then, and does not where it has died out and rounding is left.
    """
    third = len(size) // 3
    start, first, last = size[:2].max(), size[third : 2 * third].max(), size[-third:].max()
    return bool(FAR * last > start and (last > first or size.max() > FAR * start))


def _chosen(built: NDArray[np.bool_], stable: NDArray[np.bool_]) -> list[tuple[int, ...]]:
    """Return the points to simulate: beside a border, and a sample of the others that is the same every time."""
    border, others = [], []
    for index in np.ndindex(built.shape):
        if not built[index]:
            continue
        beside = [
            tuple(i + sign * (k == axis) for k, i in enumerate(index)) for axis in range(built.ndim) for sign in (1, -1)
        ]
        inside = [p for p in beside if all(0 <= i < n for i, n in zip(p, built.shape, strict=True))]
        is_beside = any(stable[p] != stable[index] for p in inside if built[p])
        (border if is_beside else others).append(index)
    drawn = np.random.default_rng(0).permutation(len(others))[:SAMPLE]
    return [*border, *(others[i] for i in drawn)]
