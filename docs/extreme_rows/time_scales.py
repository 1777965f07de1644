"""Periods of a nanosecond and of a thousand seconds: free motion and a response of the mass on a spring."""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from extreme_rows.bench import moved, point, relative, spring_response
from extreme_rows.row import Accuracy, Found, Row
from hfsa.cosim import load_scene

PERIODS = (1e-9, 1e3)
"""Periods without damping [s]."""
LIGHTEST = 1e-9
"""Smallest mass of the part [kg]."""
POINTS, STEPS = 100, 10_000
"""Steps in a period, and steps of a run."""
RATIO = 0.01
"""Damping ratio."""
STATE = "mass.mass.position"


def rows() -> Iterator[Row]:
    """Yield the rows."""
    for period in PERIODS:
        yield Row(
            "time scale",
            f"`mass_on_spring`, period of {period:g} s, damping ratio {RATIO:g}, released, {STEPS} steps of "
            f"{period / POINTS:g} s",
            Accuracy("position", "a decaying cosine", 1e-11),
            partial(released, period),
            is_cheap=True,
        )
        for share in (0.5, 1.0):
            yield Row(
                "time scale",
                f"`mass_on_spring`, period of {period:g} s, damping ratio {RATIO:g}, driven at {share / period:g} Hz",
                Accuracy("response", "k / (k - m omega^2 + j c omega)", 1e-3),
                partial(driven, period, share),
                is_cheap=True,
            )


def spring(period: float) -> dict[str, float]:
    """Return stiffness [N/m], damping [N.s/m] and mass [kg]: the lightest for a short period, else 1 kg."""
    mass, omega = LIGHTEST if period < 1 else 1.0, 2 * math.pi / period
    return {"stiffness": mass * omega**2, "damping": 2 * RATIO * mass * omega, "mass": mass}


def released(period: float) -> Found:
    """Return the error of the position, relative to its start."""
    starts = {f"mass.{name}": value for name, value in spring(period).items()}
    scene = load_scene("mass_on_spring")
    time, found = moved(scene.system, period / POINTS, STEPS, [STATE], {**starts, STATE: 1e-3})
    decay = RATIO * 2 * math.pi / period
    fast = decay * math.sqrt(1 / RATIO**2 - 1)
    exact = 1e-3 * np.exp(-decay * time) * (np.cos(fast * time) + decay / fast * np.sin(fast * time))
    return Found(relative(found[:, 0], exact))


def driven(period: float, share: float) -> Found:
    """Return the error of the response at a share of the natural frequency."""
    given = spring(period)
    arguments = {f"mass.{name}": value for name, value in given.items()}
    frequency = share / period
    scene = replace(load_scene("mass_on_spring"), band=(0.1 / period, 2 / period))
    found = point(
        scene,
        arguments,
        "mass.base.position",
        ["mass.position"],
        frequency,
        1e-6,
        step_size=period / POINTS,
        settling_time=1e3 * period,
    )[0]
    return Found(abs(found / spring_response(frequency, **given) - 1), f"{abs(found):.5g} times the base")
