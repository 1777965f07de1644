"""Values at the ends of what a double holds: denormals are numbers, and what is no number is refused by name."""

import math
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from extreme_rows.bench import moved, point, sentences
from extreme_rows.row import Accuracy, Found, Message, Row
from hfsa.cosim import load_scene
from hfsa.cosim.assembly.build import build
from hfsa.cosim.assembly.native_loop import stepping_library
from hfsa.cosim.masters.algorithms import open_master

SMALLEST = 5e-324
"""Smallest denormal."""
INPUT = "mass.base.position"
ARGUMENTS = (
    ("mass_on_spring", "damping", "mass.damping starts at {}"),
    ("mass_on_spring", "mass.mass", "mass.* {}, expected a"),
    ("sdelta_shaker", "payload.mass", "payload.mass is {} kg"),
    ("sdelta_shaker", "damping", "robot.damping_ratio starts at {}"),
    ("sdelta_hfsa", "bandwidth", "bandwidth is {}"),
    ("accelerometer_shaker", "angle", "angle is {} deg"),
    ("stage_bode", "bias", "bias is {} V"),
    ("stage_tracking", "sample_time", "step_size is {}"),
    ("stage_extremes", "proportional_gain", "proportional_gain is {}"),
    ("beam_payload", "payload.mass", "mass {} kg"),
    ("beam_bode", "damping_ratio", "damping_ratio starts at {}"),
)
"""Scene, argument, and the pattern of the message for a value."""


def rows() -> Iterator[Row]:
    """Yield the rows."""
    for force in (SMALLEST, 1e-310, 1e-300, 1e300):
        yield Row(
            "value",
            f"`mass_on_spring`, base at {force:g} m, 1000 steps",
            Accuracy("position", f"{force:g} times the motion for 1 m, to the last bits of a denormal", 1e-9),
            partial(scaled, force),
            is_cheap=True,
        )
    for amplitude in (1e-310, SMALLEST):
        yield Row(
            "value",
            f"`mass_on_spring`, sweep with an amplitude of {amplitude:g} m",
            Message("amplitude .* expected at least 1e-100"),
            partial(point, "mass_on_spring", {}, INPUT, ["mass.position"], 10.0, amplitude),
            is_cheap=True,
        )
    yield Row(
        "value",
        "`mass_on_spring`, run with an amplitude of 1e+300 m",
        Message("diverged at", "a warning"),
        partial(sentences, "mass_on_spring", {}, amplitude=1e300, stop_time=0.01),
        is_cheap=True,
    )
    for value in (math.nan, math.inf):
        for scene, name, pattern in ARGUMENTS:
            yield Row(
                "value",
                f"`{scene}`, `{name}` of {value:g}",
                Message(pattern.format(f"{value:g}")),
                partial(sentences, scene, {name: value}, stop_time=1e-3),
                is_cheap=scene == "mass_on_spring",
            )
        for name in ("amplitude", "frequency", "step_size", "stop_time"):
            yield Row(
                "value",
                f"`mass_on_spring`, {name} of {value:g}",
                Message(f"{name} is {value:g}, expected a positive number"),
                partial(sentences, "mass_on_spring", {}, **{"stop_time": 1e-3, name: value}),
                is_cheap=True,
            )
        yield Row(
            "value",
            f"`mass_on_spring`, base at {value:g} m from 5 ms on",
            Message(rf"at t = 0\.005 s: input base\.position is {value:g}"),
            partial(fed, value),
            is_cheap=True,
        )
    for name in ("stiffness", "damping"):
        yield Row(
            "value",
            f"`mass_on_spring`, {name} of 1e+308",
            Message(r"mass: its states change at up to 1e\+308 1/s"),
            partial(sentences, "mass_on_spring", {f"mass.{name}": 1e308}, stop_time=1e-3),
            is_cheap=True,
        )


def scaled(value: float) -> Found:
    """Return the error of the motion for a base at a value, beyond the last bits of a denormal."""
    system = load_scene("mass_on_spring").system
    ends = [moved(system, 1e-4, 1000, ["mass.position"], {INPUT: base})[1] for base in (value, 1.0)]
    off = np.abs(ends[0] - value * ends[1])
    largest = np.abs(value * ends[1]).max()
    rounding = 200 * SMALLEST
    return Found(float(np.maximum(off - rounding, 0).max() / largest))


def fed(value: float) -> Any:
    """Raise the error of a master whose input is set to a value in the middle of a run."""
    master = open_master(build(load_scene("mass_on_spring").system), "gauss_seidel", 1e-3, stepping_library())
    try:
        master.initialize()
        master.advance(5)
        master.set({INPUT: value})
        master.advance(5)
        return f"it ran to {master.time:g} s"
    finally:
        master.close()
