"""The accelerometer in scenes: names, and the response from the numbers of the part."""

import numpy as np
from numpy.typing import ArrayLike

from hfsa.components import tba_accelerometer

NATURAL = {"mems": 5818.9, "optimum": 881.0, "rapid_prototype": 251.86}
"""Natural frequency in the plane of each design [Hz]."""
DAMPING = {"mems": 0.005, "optimum": 0.005, "rapid_prototype": 0.03}
"""Damping ratio there."""

SENSOR = [f"sensor.acceleration_estimate[{i}]" for i in (1, 2)]
IDEAL = [f"ideal.acceleration_estimate[{i}]" for i in (1, 2)]
PLACE = [f"sensor.proof_mass.position[{i}]" for i in (1, 2, 3)]
X = "reference.command.position[1]"
VOLTS = "stack[1].command.voltage"


def sensitivity(design: str, frequency: ArrayLike) -> np.ndarray:
    """Return -Gamma / (M s^2 + D s + K) along x, y, z by the part's numbers, (frequencies, 3) [s2]."""
    found = tba_accelerometer.analyze(design=design)
    M, K = found["mass"], found["stiffness"]
    zeta = np.array([DAMPING[design]] * 2 + [0.03 if design == "rapid_prototype" else 0.02])
    s = 2j * np.pi * np.atleast_1d(frequency)[:, None]
    return -found["driven_mass"] / (M * s**2 + 2 * zeta * np.sqrt(K * M) * s + K)


def gain(design: str, frequency: ArrayLike) -> np.ndarray:
    """Return the estimate by the true acceleration along x, (frequencies,)."""
    at = sensitivity(design, frequency)[:, 0]
    return at / sensitivity(design, 0.0)[0, 0]


def shaken(axis: int) -> str:
    """Return the input of the sensor's shaker along an axis."""
    return f"sensor.base.acceleration[{axis}]"
