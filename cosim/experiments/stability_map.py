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
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.actions.iterated import PASSES, TOLERANCE
from hfsa.cosim.analysis.stability import CoupledStep, Mode
from hfsa.cosim.assembly import cluster
from hfsa.cosim.assembly.assemble import Keep, Variants
from hfsa.cosim.assembly.build import with_ports
from hfsa.cosim.assembly.fuse import with_fusion
from hfsa.cosim.assembly.load_scene import load_scene, with_arguments
from hfsa.cosim.assembly.native_loop import BACKENDS, chosen_loop
from hfsa.cosim.experiments.arguments import checked
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.masters.algorithms import CANDIDATES, LIMITED, open_master
from hfsa.cosim.measurement import pool
from hfsa.cosim.measurement.trial import CRASHED
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

Index = tuple[int, ...]
"""Place of a point on the axes."""

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
    scheduler: str | None = None,
    report: Callable[[float, str], None] | None = None,
) -> StabilityMap:
    """Return the stability map of a scene over one or two axes.

    Args:
        name: name, path of a `.py`, `.toml` or `.ssp` file, or a `Scene`.
        arguments: other arguments of the scene, as typed.
        axes: axes of the map.
        fuse: groups of components, each compiled into one FMU, as typed.
        step_size: communication step size [s] (default: the scene's).
        algorithm: co-simulation algorithm (default: the scene's; for `auto` the cheapest).
        order: components in the order of their steps (default: the scene's).
        keep: `all` of the scene at each point, or what is `needed` by its outputs and limit flags.
        scheduler: address of a scheduler of dask.distributed, whose workers compute; FMUs are built here.
        report: function of the finished part, 0 to 1, and a word.

    Raises:
        StructureError: for an algorithm without a stability limit, conflicting axes, and where no point can be built.
    """
    _check_axes(axes, arguments, step_size)
    load = partial(_scene, name, fuse, algorithm, order)
    with cluster.on(scheduler) as executor:
        return _map(name, partial(_built, load, arguments, axes, step_size, keep), axes, executor, report)


def _map(
    name: str | Path | Scene,
    build: Callable[[Index], "_Point"],
    axes: Sequence[Axis],
    executor: Executor | None,
    report: Callable[[float, str], None] | None,
) -> StabilityMap:
    """Return the map of points that `build` makes by index; they are computed on `executor`, else in this process."""
    shape = tuple(len(axis.values) for axis in axes)
    growth, stable = np.full(shape, np.nan), np.zeros(shape, dtype=bool)
    points: dict[Index, _Point] = {}
    predictions: dict[Index, _Prediction] = {}
    refusals: dict[Index, str] = {}
    for index in np.ndindex(shape):
        try:
            points[index] = build(index)
        except ValueError as error:  # ModelError and StructureError: no such posture
            refusals[index] = str(error)
        if report is not None:
            report(0.3 * (len(points) + len(refusals)) / growth.size, "building FMUs")
    for index, found in _computed(_predicted, points, executor):
        if isinstance(found, _Prediction):
            predictions[index] = found
            growth[index], stable[index] = found.rate, found.is_stable
        else:
            refusals[index] = found or CRASHED
        if report is not None:
            part = (len(predictions) + len(refusals)) / growth.size
            report(0.3 + 0.4 * part, "matrices")
    messages = list(dict.fromkeys(refusals[index] for index in np.ndindex(shape) if index in refusals))
    if not predictions:
        raise StructureError(messages[0])
    verified = np.full(shape, -1, dtype=np.int8)
    chosen = _chosen(~np.isnan(growth), stable)
    simulated = {index: (points[index], predictions[index]) for index in chosen}
    for done, (index, agrees) in enumerate(_computed(_verified, simulated, executor), 1):
        verified[index] = -1 if agrees is None else agrees
        if report is not None:
            report(0.7 + 0.3 * done / len(chosen), "simulations")
    first = next(iter(points.values()))
    words = "scene" if isinstance(name, Scene) else str(name)
    return StabilityMap(words, first.algorithm, first.step_size, axes, growth, stable, verified, messages)


def _computed(
    work: Callable[[Any], Any], tasks: Mapping[Index, Any], executor: Executor | None
) -> Iterator[tuple[Index, Any]]:
    """Yield the results of tasks by index; `None` where a worker was lost with each attempt."""
    indices = {id(task): index for index, task in tasks.items()}
    work = work if executor is None else partial(pool.one_at_a_time, work)
    with closing(pool.results(work, list(tasks.values()), executor=executor)) as results:
        for task, result in results:
            yield indices[id(task)], result


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


@dataclass(frozen=True, eq=False)
class _Point:
    """Point of a map, as plain data: its assembly, and how it is stepped."""

    assembly: Assembly
    algorithm: str
    step_size: float


@dataclass(frozen=True)
class _Prediction:
    """Prediction for a point.

    Attributes:
        rate: fastest growth rate [1/s] of the modes that count; `is_stable`: whether the point is stable.
        contraction: contraction of a fixed-point iteration.
        mode: the fastest mode, `None` where there is none.
        rest: states at the equilibrium, and `nominal` values of variables, by full name.
    """

    rate: float
    is_stable: bool
    contraction: float
    mode: Mode | None
    rest: Mapping[str, float]
    nominal: Mapping[str, float]


def _built(
    load: Callable[[Mapping[str, str], float | None], Scene],
    arguments: Mapping[str, str],
    axes: Sequence[Axis],
    step_size: float | None,
    keep: Keep,
    index: Index,
) -> _Point:
    """Return a point of a map, its FMUs built."""
    values = {axis.name: float(axis.values[i]) for axis, i in zip(axes, index, strict=True)}
    step_size = values.pop(STEP_SIZE, step_size)
    typed = {key: repr(value) for key, value in values.items()}
    scene = load({**arguments, **typed}, step_size)
    if scene.algorithm not in LIMITED:
        raise StructureError(f"no stability map for {scene.algorithm}{nearest(scene.algorithm, LIMITED)}")
    return _Point(with_ports(Variants(scene, keep=keep).plain, scene.algorithm), scene.algorithm, scene.step_size)


def _predicted(point: _Point) -> _Prediction | str:
    """Return the prediction for a point, or the reason why there is none."""
    try:
        with point.assembly.open() as instances:
            cycle = CoupledStep(point.assembly.system, instances, point.algorithm)
            own, contraction = cycle.over(point.step_size), cycle.contraction(point.step_size)
            nominal = {
                f"{c}.{n}": abs(v.nominal)
                for c, i in instances.items()
                for n, v in i.fmu.variables.items()
                if v.is_real
            }
            states = {f"{c}.{state}" for c, i in instances.items() for state, _ in i.fmu.description.states}
        return _Prediction(
            own.growth(cycle.counting),
            bool(own.is_stable(cycle.counting) and contraction < 1),
            contraction,
            max(own.of(cycle.counting), key=lambda mode: mode.rate, default=None),
            {name: value for name, value in cycle.operating_point.items() if name in states},
            nominal,
        )
    except ValueError as error:  # StructureError: no equilibrium
        return str(error)


def _verified(task: tuple[_Point, _Prediction]) -> int:
    """Return whether a simulation agrees, as in `StabilityMap.verified`."""
    point, found = task
    if found.contraction >= 1:
        return int(len(_simulated(point, _random_states(found), FEWEST)) <= FEWEST)
    mode = found.mode
    if mode is None:
        return -1
    largest = max((abs(mode.shape[name]) / found.nominal[name] for name in found.rest), default=0.0)
    if largest == 0.0:
        return -1
    moved = {n: x + float((mode.shape[n] * MOVED / largest).real) for n, x in found.rest.items()}
    steps = _steps(mode, point.step_size)
    if abs(mode.rate) * steps * point.step_size < SLOW:
        return -1
    still, moving = _simulated(point, found.rest, steps), _simulated(point, moved, steps)
    rows = min(len(still), len(moving))
    if rows <= steps and found.contraction ** PASSES["fixed_point"] > TOLERANCE:  # the iteration converges too slowly
        return -1
    if rows <= steps:  # the deviation exceeds the bounds
        return int(mode.rate > 0)
    scale = np.array([found.nominal[name] for name in _observed(point)])
    size = np.linalg.norm((moving[:rows] - still[:rows]) / scale, axis=1)
    return int(_has_grown(size) == (mode.rate > 0))


def _random_states(found: _Prediction) -> dict[str, float]:
    """Return states with a random deviation: a diverging iteration need not be visible along a mode."""
    drawn = np.random.default_rng(0).uniform(-MOVED, MOVED, len(found.rest))
    return {n: x + share * found.nominal[n] for (n, x), share in zip(found.rest.items(), drawn, strict=True)}


def _steps(mode: Mode, h: float) -> int:
    """Return the number of steps of h [s] after which growth and decay of a mode can be distinguished."""
    steps = FOLDS / max(abs(mode.rate) * h, 1e-300)
    turns = 6 / (mode.frequency * h) if mode.frequency > 0 else 0.0
    return int(np.clip(max(steps, turns), FEWEST, MOST))


def _observed(point: _Point) -> list[str]:
    """Return the connected outputs of a point."""
    return list(dict.fromkeys(connection.start for connection in point.assembly.system.connections))


def _simulated(point: _Point, starts: Mapping[str, float], steps: int) -> NDArray[np.float64]:
    """Return the connected outputs at every communication point reached, (points, connections)."""
    library = chosen_loop(BACKENDS[0], lambda _: None)
    with closing(open_master(point.assembly, point.algorithm, point.step_size, library)) as master:
        recording = master.record(_observed(point), rows=steps + 1)
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
