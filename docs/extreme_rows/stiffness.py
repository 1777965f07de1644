"""Stiffness ratios of 1e12: two masses on springs of 1 and 1e12 N/m, one behind the other, apart and in one FMU."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from extreme_rows.bench import moved, relative
from extreme_rows.row import Accuracy, Found, Row
from hfsa.cosim.assembly.fuse import fused
from hfsa.cosim.systems.system import Component, Connection, System

SOFT, STIFF = 1.0, 1e12
OMEGA = np.sqrt(STIFF)
"""Of the stiff mass [rad/s]; that of the soft one is 1 rad/s."""
CRITICAL = 2 * OMEGA
LAG = 2 / OMEGA
"""Time by which the stiff mass follows its base late [s], while the base moves slowly."""
NAMES = ["first.mass.position", "second.mass.position"]
STEPS = 1000


def rows() -> Iterator[Row]:
    """Yield the rows."""
    ratio = f"{STIFF / SOFT:g}"
    for is_fused in (False, True):
        where, late = ("in one FMU", f"t - {LAG:g} s") if is_fused else ("in two FMUs", "t")
        for step_size in (1e-3, 1e-2):
            yield Row(
                "stiffness",
                f"`mass_on_spring` twice {where}, the soft one behind the stiff one, ratio {ratio}, base shifted, "
                f"{STEPS} steps of {step_size:g} s",
                Accuracy("positions", f"1 and 1 - cos({late})", 1e-11),
                partial(soft_behind, is_fused, step_size),
            )
        yield Row(
            "stiffness",
            f"`mass_on_spring` twice {where}, the stiff one behind the soft one, ratio {ratio}, soft one released, "
            f"{STEPS} steps of 1 ms",
            Accuracy("positions", f"cos(t) and cos({late})", 1e-11),
            partial(stiff_behind, is_fused),
        )
    yield Row(
        "stiffness",
        f"`mass_on_spring` of {STIFF:g} N/m without damping, released, {STEPS} steps of 1 ms",
        Accuracy("position", "cos(1e6 t), to the rounding of its phase", 4e-7),
        fast,
    )


def chain(first: float, second: float, is_fused: bool) -> System:
    """Return a mass behind another, of spring constants [N/m]; the stiff spring alone is damped, critically."""
    parts = [
        Component(name, "mass_on_spring", start={"stiffness": k, "damping": CRITICAL if k == STIFF else 0.0})
        for name, k in (("first", first), ("second", second))
    ]
    system = System(parts, [Connection("first.position", "second.base.position")])
    return fused(system, [["first", "second"]]) if is_fused else system


def positions(system: System, step_size: float, starts: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return times and both positions; `starts` and names are those before fusing."""
    named = {name: system.own_name(name) for name in [*NAMES, *starts]}
    begin = {named[name]: value for name, value in starts.items()}
    return moved(system, step_size, STEPS, [named[name] for name in NAMES], begin)


def soft_behind(is_fused: bool, step_size: float) -> Found:
    """Return the error of both positions after the base was shifted by 1 m, from the first step on."""
    time, found = positions(chain(STIFF, SOFT, is_fused), step_size, {"first.base.position": 1.0})
    exact = np.column_stack([np.ones_like(time), 1 - np.cos(time - LAG * is_fused)])
    return Found(relative(found[1:], exact[1:]))


def stiff_behind(is_fused: bool) -> Found:
    """Return the error of both positions after the soft mass was released at 1 m."""
    starts = {"first.mass.position": 1.0, "second.mass.position": 1.0}
    time, found = positions(chain(SOFT, STIFF, is_fused), 1e-3, starts)
    exact = np.column_stack([np.cos(time), np.cos(time - LAG * is_fused)])
    return Found(relative(found[1:], exact[1:]))


def fast() -> Found:
    """Return the error of the stiff mass alone."""
    system = System([Component("first", "mass_on_spring", start={"stiffness": STIFF, "damping": 0.0})])
    time, found = moved(system, 1e-3, STEPS, NAMES[:1], {NAMES[0]: 1.0})
    return Found(relative(found[:, 0], np.cos(OMEGA * time)))
