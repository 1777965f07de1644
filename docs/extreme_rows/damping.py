"""Damping from none to critical: free motion of parts, and a response beside an undamped resonance."""

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from extreme_rows.bench import free_motion, moved, point, spring_response
from extreme_rows.row import Accuracy, Found, Row
from hfsa.cosim import load_scene

OMEGA = 100.0
"""Of the mass on a spring without damping [rad/s]."""
STATE = "mass.mass.position"

PARTS = (
    ("sdelta_shaker", "damping", "robot", 5e-5, 4000),
    ("accelerometer_shaker", "damping", "sensor", 2e-7, 5000),
    ("beam_bode", "damping_ratio", "stage", 5e-7, 20_000),
    ("beam_payload", "damping_ratio", "payload", 1e-6, 20_000),
)
"""Scene, name of its damping ratio, component, step [s] and number of steps."""


def rows() -> Iterator[Row]:
    """Yield the rows."""
    for damping, words, curve in (
        (0.0, "no damping", "cos(omega t)"),
        (2 * OMEGA, "critical damping", "(1 + omega t) exp(-omega t)"),
    ):
        yield Row(
            "damping",
            f"`mass_on_spring`, {words}, released, 1000 steps of 1 ms",
            Accuracy("position", curve, 1e-13),
            partial(released, damping),
            is_cheap=True,
        )
    for scene, name, component, step, steps in PARTS:
        for ratio in (0.0, 1.0):
            yield Row(
                "damping",
                f"`{scene}`, damping ratio {ratio:g} of every mode, all states released, {steps} steps of {step:g} s",
                Accuracy("motion", "the exponential of the part's equations", 1e-10),
                partial(free_motion, scene, {name: ratio}, component, step, steps),
            )
    for ratio in (0.999, 1.001):
        yield Row(
            "damping",
            f"`mass_on_spring`, no damping, driven at {ratio:g} of its resonance",
            Accuracy("response", "1 / (1 - r^2)", 1e-3),
            partial(beside_resonance, ratio),
        )


def released(damping: float) -> Found:
    """Return the error of the position, relative to its start."""
    scene = load_scene("mass_on_spring", {"damping": damping})
    time, found = moved(scene.system, 1e-3, 1000, [STATE], {STATE: 1e-3})
    phase = OMEGA * time
    exact = (1 + phase) * np.exp(-phase) if damping else np.cos(phase)
    return Found(np.abs(found[:, 0] / 1e-3 - exact).max())


def beside_resonance(ratio: float) -> Found:
    """Return the error of the response."""
    frequency = ratio * OMEGA / (2 * math.pi)
    found = point("mass_on_spring", {"damping": 0.0}, "mass.base.position", ["mass.position"], frequency, 1e-6)[0]
    exact = spring_response(frequency, 1e4, 0.0, 1.0)
    return Found(abs(found / exact - 1), f"{found.real:.5g} times the base")
