"""Answer of the verb `stability` as data for JSON and as text: longest stable steps, or a map."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hfsa.cosim.analysis.sampling import SamplingLimit
from hfsa.cosim.analysis.stability import OSCILLATORY
from hfsa.cosim.analysis.step_limits import StepLimit
from hfsa.cosim.assembly.assemble import Keep
from hfsa.cosim.commands._reports import algorithm_data, order_data
from hfsa.cosim.commands._shell import rendered, table
from hfsa.cosim.experiments.orders import with_computed_order
from hfsa.cosim.experiments.setup import Setup, default_path, set_up, with_levels
from hfsa.cosim.experiments.stability import Stability, limits_of
from hfsa.cosim.experiments.stability_map import STEP_SIZE, parse_axis, stability_map
from hfsa.cosim.figures.stability_map import stability_map_figure
from hfsa.cosim.figures.style import save
from hfsa.cosim.results.stability_map import Axis, StabilityMap, write_stability_map
from hfsa.cosim.results.target import check_new, check_picture
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import AUTO

CHOOSES = "chooses its steps"
"""Note for an algorithm that chooses its communication steps."""

_MODES = ("oscillatory modes", "aperiodic modes")
_LEGEND = f"growth of the fastest growing mode: oscillatory from {OSCILLATORY:g} Hz on; aperiodic: free motion, decay"

Report = Callable[[float, str], None]
"""Function of the finished part, 0 to 1, and a word."""


@dataclass(frozen=True)
class StabilityRequest:
    """Options of the verb `stability`; `None` stands for the default.

    Attributes:
        fuse: groups of components, each compiled into one FMU, as typed.
        step_size: communication step size [s] (default: the scene's).
        algorithm: the only algorithm (default: all; for a map the scene's).
        order: order of steps, as typed (default: the scene's).
        vary: axes of a map, as typed; empty for limits.
        file: file of the map.
        force: whether to replace an existing results file.
        keep: what is judged of the scene, one of `assemble.Keep`.
        scheduler: address of a scheduler whose workers compute the points of a map.
    """

    fuse: Sequence[str] = ()
    step_size: float | None = None
    algorithm: str | None = None
    order: str | None = None
    vary: Sequence[str] = ()
    file: Path | None = None
    force: bool = False
    keep: Keep = "all"
    scheduler: str | None = None


def stability_answer(
    name: str,
    arguments: Mapping[str, str],
    request: StabilityRequest,
    report: Report = lambda *_: None,
    warn: Callable[[str], None] = print,
) -> tuple[dict[str, Any], str, bool]:
    """Return limits or a map as data and as text, and whether all simulations agree.

    `StructureError` for conflicting options, and for a scene without equilibrium.
    """
    path = request.file or default_path(name, "_stability")
    if request.vary:
        check_new(path, request.force)
        check_picture(_picture(path))
    changes = {"step_size": request.step_size, "algorithm": request.algorithm}
    setup = set_up(name, arguments, request.fuse, order=request.order, file=request.file, **changes)
    axes = [parse_axis(words) for words in request.vary]
    for sentence in setup.disagreements or _disagreements_on(axes, name, arguments):
        warn(sentence)
    if not request.vary:
        if request.file is not None or request.force:
            option = "--force" if request.file is None else f"-o {request.file}"
            raise StructureError(
                f"{option}: limits are printed, as text or with --json; only a map has a file, which takes "
                "--vary NAME=FROM:TO:N"
            )
        found = limits_of(setup, request.algorithm, report, request.keep)
        if found.left_out:
            warn(found.left_out)
        return _limits_data(found), _limits_text(found), True
    found = stability_map(
        name,
        arguments,
        axes,
        fuse=request.fuse,
        step_size=request.step_size,
        algorithm=request.algorithm if request.algorithm != AUTO else None,
        order=_names(setup),
        keep=request.keep,
        scheduler=request.scheduler,
        report=report,
    )
    agree, simulated = found.agreement
    return *_map(found, setup.title, path, request.force), agree == simulated


def _disagreements_on(axes: Sequence[Axis], name: str, arguments: Mapping[str, str]) -> Sequence[str]:
    """Return the disagreements between parts of a scene at the first end of the axes where there are any."""
    for end in (0, -1):
        varied = {axis.name: repr(float(axis.values[end])) for axis in axes if axis.name != STEP_SIZE}
        try:
            if found := set_up(name, {**arguments, **varied}).disagreements:
                return found
        except ValueError:  # the point cannot be built: the map reports the reason
            continue
    return ()


def _limits_data(found: Stability) -> dict[str, Any]:
    """Return the limits of a scene as plain data."""
    sampling = found.sampling
    return {
        "step_size": found.step_size,
        "algorithm": found.algorithm,
        "choice": algorithm_data(found.choice),
        "order": order_data(found.order),
        "growth": found.growth,
        "oscillatory_from": OSCILLATORY,
        "sample_time": None
        if sampling is None
        else {"own": sampling.sample_time, "longest": _number(sampling.longest)},
        "algorithms": [_entry(limit) for limit in found.limits]
        + [{"algorithm": name, "note": CHOOSES} for name in found.choosing],
    }


def _limits_text(found: Stability) -> str:
    """Return the limits of a scene as text."""
    lines = [
        f"{found.title}: communication steps about the equilibrium",
        *(choice.sentence for choice in (found.order, found.choice) if choice),
        _table(found.step_size, found.limits, found.choosing),
        *([_LEGEND] if found.limits else []),
        *(limit.message for limit in found.limits if limit.message),
        *_without_steps(found.sampling, found.growth),
    ]
    return "\n".join(lines)


def _names(setup: Setup) -> list[str]:
    """Return the components of a scene in the requested order; empty without one."""
    if setup.order is None:
        return []
    scene, _ = with_computed_order(with_levels(setup.scene, None)[0], setup.order)
    return [component.name for component in scene.system.components]


def _picture(path: Path) -> Path:
    """Return the path of the picture beside the file of a map."""
    return path.with_suffix(".png")


def _map(found: StabilityMap, title: str, path: Path, force: bool) -> tuple[dict[str, Any], str]:
    """Write a map and its picture; return a summary as data and as text."""
    write_stability_map(path, found, title, force)
    picture = _picture(path)
    save(stability_map_figure(found, title), picture)
    agree, simulated = found.agreement
    data = {
        "file": path,
        "picture": picture,
        "algorithm": found.algorithm,
        "axes": {axis.name: axis.values.tolist() for axis in found.axes},
        "stable": int(found.stable.sum()),
        "points": int(found.growth.size),
        "simulated": simulated,
        "agree": agree,
        "messages": list(found.messages),
    }
    lines = [
        f"{path}, {picture}: {found.algorithm} on {title}",
        f"  stable at {data['stable']} of {data['points']} points",
        f"  simulated {simulated}, of which {agree} agree ({100 * agree / max(simulated, 1):.4g} %)",
        *(f"  not built: {message}" for message in found.messages),
    ]
    return data, "\n".join(lines)


def _entry(limit: StepLimit) -> dict[str, Any]:
    """Return the limit of an algorithm as plain data."""
    if limit.message:
        return {"algorithm": limit.algorithm, "note": limit.message}
    return {
        "algorithm": limit.algorithm,
        "longest_step": _number(limit.longest),
        "is_unlimited": math.isinf(limit.longest),
        "is_stable": limit.is_stable,
        "oscillatory_growth": _number(limit.oscillatory),
        "aperiodic_growth": _number(limit.aperiodic),
    }


def _number(value: float) -> float | None:
    """Return a number for JSON: `None` for infinity."""
    return value if math.isfinite(value) else None


def _table(step_size: float, limits: Sequence[StepLimit], choosing: Sequence[str]) -> str:
    """Return the table of limits; `choosing` are the algorithms that choose their steps."""
    rows = table("algorithm", "longest stable step", f"at {step_size:.4g} s", *_MODES)
    for limit in limits:
        if limit.message:
            rows.add_row(limit.algorithm, "not offered", "", "", "")
            continue
        longest = "none found" if math.isinf(limit.longest) else f"{limit.longest:.5g} s" if limit.longest else "none"
        verdict = {True: "stable", False: "UNSTABLE", None: "does not fit"}[limit.is_stable]
        rows.add_row(limit.algorithm, longest, verdict, _rate(limit.oscillatory), _rate(limit.aperiodic))
    for name in choosing:
        rows.add_row(name, CHOOSES, "", "", "")
    return rendered(rows)


def _without_steps(sampling: SamplingLimit | None, growth: float | None) -> Iterator[str]:
    """Yield a line about the stability of a scene without communication steps."""
    if sampling is not None:
        longest = "at every one examined" if math.isinf(sampling.longest) else f"up to {sampling.longest:.5g} s"
        found = longest if sampling.longest else "at none examined"
        yield f"sample time {sampling.sample_time:.5g} s; without communication steps stable {found}"
    elif growth is not None:
        yield f"without communication steps the fastest growth is {growth:.4g} 1/s"


def _rate(growth: float) -> str:
    """Return a growth rate as text."""
    return "none" if math.isinf(growth) else f"{growth:+.4g} 1/s"
