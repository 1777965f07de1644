"""Communication steps at 0.98 and 1.02 of the longest stable one, in simulation, for each algorithm with a limit.

The system starts in its critical mode. Its rate of decay or growth, which the one-step matrix states, is that of its
size at its frequency, through a Hann window early and one late.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np

from extreme_rows.bench import moved
from extreme_rows.row import Accuracy, Found, Message, Row
from hfsa.cosim import load_scene
from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.analysis.step_limits import longest_stable
from hfsa.cosim.assembly.build import build
from hfsa.cosim.fmi.co_simulation import open_instances
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import System

EACH = ("jacobi_plain", "jacobi", "jacobi_linear", "gauss_seidel", "gauss_seidel_linear", "gauss_seidel_quadratic")
"""Algorithms with a limit on every system."""
FACTORS = (0.98, 1.02)
WITHOUT_LIMIT = (10.0, 20.0)
"""Steps of an algorithm without a limit, over the scene's."""
CONVERGING = 0.8
"""Step at which the passes of `fixed_point` converge within their number, over that at which they never do."""
LONGEST = 3_000_000
"""Most steps between the windows."""

FORCES = tuple(f"robot.drive[{j}].{kind}" for j in (1, 2, 3) for kind in ("force", "torque"))
SYSTEMS = {
    "sdelta_hfsa": ("`sdelta_hfsa` without control", {}, FORCES),
    "beam_payload": ("`beam_payload`, massless suspension", {"suspension": "massless"}, ()),
    "stage_bode": ("`stage_bode`", {}, ()),
}
"""By scene: name in the table, arguments, and signals in which the mode is seen if not in the states.

Free drives drift; the springs' forces do not.
"""


def rows() -> Iterator[Row]:
    """Yield the rows."""
    rate = Accuracy("rates of decay and growth", "the one-step matrix", 0.05)
    both = " and ".join(f"{factor:g}" for factor in FACTORS)
    for scene, (name, _, _) in SYSTEMS.items():
        for algorithm in (*EACH, *(() if scene == "stage_bode" else ("quasi_newton",))):
            yield Row(
                "step", f"{name}, {both} of the limit of `{algorithm}`", rate, partial(beside_limit, scene, algorithm)
            )
        if scene == "stage_bode":
            continue
        yield Row(
            "step",
            f"{name}, {CONVERGING:g} and {FACTORS[1]:g} of the limit of `fixed_point`",
            Message("does not converge"),
            partial(diverging_passes, scene),
        )
    times = " and ".join(f"{ratio:g}" for ratio in WITHOUT_LIMIT)
    for algorithm in ("fixed_point", "quasi_newton"):
        yield Row(
            "step",
            f"`stage_bode`, {times} times its step with `{algorithm}`, which has no limit",
            Accuracy("rates of decay", "the one-step matrix", 0.05),
            partial(without_limit, "stage_bode", algorithm),
        )


def scene_of(name: str) -> Scene:
    """Return a scene whose system has no ticks."""
    scene = load_scene(name, SYSTEMS[name][1])
    if name != "sdelta_hfsa":
        return scene
    system, gone = scene.system, {"controller", "reference"}
    inner = [c for c in system.connections if not {system.split(c.start)[0], system.split(c.end)[0]} & gone]
    return Scene(
        **{**vars(scene), "system": System([c for c in system.components if c.name not in gone], inner), "inputs": []}
    )


def beside_limit(name: str, algorithm: str) -> Found:
    """Return the largest error of a rate; infinite where a mode does not decay below the limit and grow above it."""
    scene = scene_of(name)
    with open_instances(build(scene.system).files) as instances:
        coupled = CoupledStep(scene.system, instances, algorithm)
        limit = longest_stable(coupled, algorithm, scene.step_size, [])
    found = [rates(scene, coupled, algorithm, factor * limit, SYSTEMS[name][2]) for factor in FACTORS]
    turns = all((rate > 0) == (factor > 1) for factor, (rate, _) in zip(FACTORS, found, strict=True))
    error = max(abs(rate / exact - 1) for rate, exact in found) if turns else np.inf
    return Found(error, f"limit {limit:.4g} s, {' and '.join(f'{rate:+.4g}' for rate, _ in found)} 1/s")


def without_limit(name: str, algorithm: str) -> Found:
    """Return the largest error of a rate at steps far above the scene's; infinite where there is a limit or growth."""
    scene = scene_of(name)
    with open_instances(build(scene.system).files) as instances:
        coupled = CoupledStep(scene.system, instances, algorithm)
        limit = longest_stable(coupled, algorithm, scene.step_size, [])
    found = [rates(scene, coupled, algorithm, ratio * scene.step_size, ()) for ratio in WITHOUT_LIMIT]
    decays = np.isinf(limit) and all(rate < 0 for rate, _ in found)
    error = max(abs(rate / exact - 1) for rate, exact in found) if decays else np.inf
    return Found(error, f"{' and '.join(f'{rate:+.4g}' for rate, _ in found)} 1/s")


def rates(
    scene: Scene, coupled: CoupledStep, algorithm: str, step_size: float, observed: tuple[str, ...]
) -> tuple[float, float]:
    """Return the rate of the critical mode in simulation, and that of the one-step matrix [1/s]."""
    step = coupled.over(step_size)
    mode = step.of(coupled.counting)[0]
    # free motion may grow faster, and leaks into the windows when it is large
    fastest = max(step.growth(), abs(mode.rate))
    first = window = max(round(10 / (mode.frequency * step_size)), 60)
    apart = min(max(round(1 / (fastest * step_size)), window), LONGEST)
    steps = first + apart + window
    connectors, states = build(scene.system), list(mode.shape)
    nominal = {name: connectors.connector(name).nominal for name in states}
    size = max(abs(value) / nominal[name] for name, value in mode.shape.items())
    size *= 10 * np.exp(max(step.growth(), 0.0) * steps * step_size)
    rest = {name: coupled.operating_point.get(name, 0.0) for name in states}
    starts = {name: rest[name] + mode.shape[name].real / size for name in states}
    names = list(observed) or states
    _, found = moved(scene.system, step_size, steps, names, starts, algorithm)
    scale = [connectors.connector(name).nominal for name in names]
    found = (found - [rest.get(name, 0.0) for name in names]) / scale
    turned = np.hanning(window) * np.exp(-2j * np.pi * mode.frequency * step_size * np.arange(window))
    early, late = (np.linalg.norm(turned @ found[k : k + window]) for k in (first, first + apart))
    return float(np.log(late / early) / (apart * step_size)), mode.rate


def diverging_passes(name: str) -> str:
    """Raise the message of passes that diverge, after a run in which they converge."""
    scene = scene_of(name)
    with open_instances(build(scene.system).files) as instances:
        coupled = CoupledStep(scene.system, instances, "fixed_point")
        limit = longest_stable(coupled, "fixed_point", scene.step_size, [])
        operating_point = coupled.operating_point
    if not 0 < limit < np.inf:
        raise StructureError(f"the limit is {limit:g} s")
    states = list(coupled.over(limit).modes[0].shape)
    assembly = build(scene.system)
    starts = {name: operating_point.get(name, 0.0) + 1e-3 * assembly.connector(name).nominal for name in states}
    for factor in (CONVERGING, FACTORS[1]):
        _, found = moved(scene.system, factor * limit, 1000, states, starts, "fixed_point")
        if not np.isfinite(found).all():
            return "values that are not finite"
    return "it converged"
