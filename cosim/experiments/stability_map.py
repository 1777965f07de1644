"""Stability map of a scene over one or two of its arguments, verified by simulation.

    axes = [parse_axis("posture.rotation[3]=0:40:9"), parse_axis("step_size=1e-5:1e-3:20")]
    found = stability_map("sdelta_hfsa", {"law": "ctc"}, axes, algorithm="jacobi")
    found.stable, found.growth, found.verified     # (9, 20) each

At each point the scene is built with these arguments and its FMUs are linearised about the equilibrium. The one-step
matrix of the algorithm gives the growth rate of the fastest mode and, for an iterative algorithm, whether its
fixed-point iteration converges. All points next to the stability border, and a random sample of the others, are
simulated with the algorithm from a state that deviates from the equilibrium along the fastest mode. A point agrees
where the deviation grows or decays as predicted, and where a diverging iteration stops the run. Modes too slow to
judge are left out.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.actions.iterated import PASSES, TOLERANCE
from hfsa.cosim.analysis.stability import CoupledStep, Mode
from hfsa.cosim.assembly.assemble import Keep, Variants
from hfsa.cosim.assembly.build import with_ports
from hfsa.cosim.assembly.fuse import with_fusion
from hfsa.cosim.assembly.load_scene import load_scene, with_arguments
from hfsa.cosim.assembly.native_loop import BACKENDS, chosen_loop
from hfsa.cosim.experiments.arguments import checked
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.masters.algorithms import CANDIDATES, LIMITED, open_master
from hfsa.cosim.results.stability_map import GEOMETRIC, Axis, StabilityMap
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import nearest
from hfsa.cosim.systems.scene import AUTO, Scene
from hfsa.cosim.systems.system import in_order

STEP_SIZE = "step_size"
"""Name of the axis for the communication step size [s]."""

SAMPLE = 20
"""Number of simulated points in addition to those next to the border."""

MOVED = 1e-3
"""Initial deviation of the state with the largest share in the mode, relative to its nominal value."""

FEWEST, MOST, FOLDS = 60, 40_000, 4.0
"""Least and largest number of steps of a simulation; number of factors e by which the mode should grow or decay."""

SLOW = 0.2
"""Least number of factors e within a simulation for which growth and decay can be distinguished."""

FAR = 1e3
"""Ratio to the initial deviation above which it has grown with certainty; its inverse is rounding noise."""

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


@checked()
def stability_map(
    name: str | Path | Scene,
    arguments: Mapping[str, str],
    axes: Sequence[Axis],
    *,
    fuse: Sequence[str] = (),
    step_size: float | None = None,
    algorithm: str | None = None,
    order: Sequence[str] = (),
    keep: Literal["needed", "all"] = "all",
    report: Callable[[float, str], None] | None = None,
) -> StabilityMap:
    """Return the stability map of a scene over one or two axes.

    Args:
        name: name, path of a `.py` or `.toml` file, or a `Scene`.
        arguments: other arguments of the scene, as typed.
        axes: axes of the map.
        fuse: groups of components, each compiled into one FMU, as typed.
        step_size: communication step size [s] (default: the scene's).
        algorithm: co-simulation algorithm (default: the scene's; for `auto` the cheapest).
        order: components in the order of their steps (default: the scene's).
        keep: `all` of the scene at each point, or what is `needed` by its outputs and limit flags.
        report: function of the finished part, 0 to 1, and a word.

    Raises:
        StructureError: for an algorithm without a stability limit, conflicting axes, and where no point can be built.
    """
    _check_axes(axes, arguments, step_size)
    shape = tuple(len(axis.values) for axis in axes)
    load = partial(_scene, name, fuse, algorithm, order)
    points = {index: _Point(load, arguments, axes, index, step_size, keep) for index in np.ndindex(shape)}
    growth, stable, messages = np.full(shape, np.nan), np.zeros(shape, dtype=bool), {}
    for done, (index, point) in enumerate(points.items(), 1):
        try:
            growth[index], stable[index] = point.predict()
        except ValueError as error:  # ModelError and StructureError: no such posture, no equilibrium
            messages.setdefault(str(error), index)
        if report is not None:
            report(0.7 * done / len(points), "matrices")
    if np.isnan(growth).all():
        raise StructureError(next(iter(messages)))
    verified = np.full(shape, -1, dtype=np.int8)
    chosen = _chosen(~np.isnan(growth), stable)
    for done, index in enumerate(chosen, 1):
        verified[index] = points[index].verify()
        if report is not None:
            report(0.7 + 0.3 * done / len(chosen), "simulations")
    scene = points[(0,) * len(shape)].scene
    words = "scene" if isinstance(name, Scene) else str(name)
    return StabilityMap(words, scene.algorithm, scene.step_size, axes, growth, stable, verified, list(messages))


def _check_axes(axes: Sequence[Axis], arguments: Mapping[str, str], step_size: float | None) -> None:
    """Raise `StructureError` unless there are one or two distinct axes that no other option sets."""
    if not 1 <= len(axes) <= 2:
        raise StructureError(f"a map takes one or two --vary; found {len(axes)}")
    names = [axis.name for axis in axes]
    if names[1:] == names[:1]:
        raise StructureError(f"--vary {names[0]} is given twice; expected another argument for the second axis")
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
    """Return the scene of a point."""
    loaded = with_arguments(name, arguments) if isinstance(name, Scene) else load_scene(str(name), arguments)
    scene = with_fusion(loaded, fuse)
    # one algorithm for all points; `auto` might choose a different one at each
    algorithm = algorithm or (CANDIDATES[0] if scene.algorithm == AUTO else None)
    changes = {"step_size": step_size, "algorithm": algorithm, "system": in_order(scene.system, order)}
    return replace(scene, **{key: value for key, value in changes.items() if value is not None})


class _Point:
    """Point of a map."""

    def __init__(
        self,
        load: Callable[[Mapping[str, str], float | None], Scene],
        arguments: Mapping[str, str],
        axes: Sequence[Axis],
        index: Sequence[int],
        step_size: float | None,
        keep: Keep,
    ):
        values = {axis.name: float(axis.values[i]) for axis, i in zip(axes, index, strict=True)}
        step_size = values.pop(STEP_SIZE, step_size)
        typed = {key: repr(value) for key, value in values.items()}
        self._load = partial(load, {**arguments, **typed}, step_size)
        self.scene: Scene
        self._keep: Keep = keep
        self._mode: Mode | None = None

    def predict(self) -> tuple[float, bool]:
        """Return the fastest growth rate [1/s] of the modes that count, and whether the point is stable."""
        self.scene = scene = self._load()
        if scene.algorithm not in LIMITED:
            raise StructureError(f"no stability map for {scene.algorithm}{nearest(scene.algorithm, LIMITED)}")
        self._assembly = with_ports(Variants(scene, keep=self._keep).plain, scene.algorithm)
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

    def verify(self) -> int:
        """Return whether a simulation agrees, as in `StabilityMap.verified`."""
        if self._contraction >= 1:
            return int(len(self._simulated(self._random_states(), FEWEST)) <= FEWEST)
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
        if (
            rows <= steps and self._contraction ** PASSES["fixed_point"] > TOLERANCE
        ):  # the iteration converges too slowly
            return -1
        if rows <= steps:  # the deviation exceeds the bounds
            return int(mode.rate > 0)
        size = np.linalg.norm((moving[:rows] - still[:rows]) / self._scale, axis=1)
        return int(_has_grown(size) == (mode.rate > 0))

    def _random_states(self) -> dict[str, float]:
        """Return states with a random deviation: a diverging iteration need not be visible along a mode."""
        drawn = np.random.default_rng(0).uniform(-MOVED, MOVED, len(self._rest))
        return {n: x + share * self._nominal[n] for (n, x), share in zip(self._rest.items(), drawn, strict=True)}

    def _steps(self, mode: Mode) -> int:
        """Return the number of steps after which growth and decay of a mode can be distinguished."""
        h = self.scene.step_size
        steps = FOLDS / max(abs(mode.rate) * h, 1e-300)
        turns = 6 / (mode.frequency * h) if mode.frequency > 0 else 0.0
        return int(np.clip(max(steps, turns), FEWEST, MOST))

    def _simulated(self, starts: Mapping[str, float], steps: int) -> NDArray[np.float64]:
        """Return the connected outputs at every communication point reached, (points, connections)."""
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

    A deviation that saturates has grown; one that has decayed to rounding noise has not.
    """
    third = len(size) // 3
    start, first, last = size[:2].max(), size[third : 2 * third].max(), size[-third:].max()
    return bool(FAR * last > start and (last > first or size.max() > FAR * start))


def _chosen(built: NDArray[np.bool_], stable: NDArray[np.bool_]) -> list[tuple[int, ...]]:
    """Return the points to simulate: those next to the border, and a reproducible sample of the others."""
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
