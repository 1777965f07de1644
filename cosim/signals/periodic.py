"""Interpolation of periodic values: what a sampled motion is at phase 0, from samples near it.

    places = [n + j * spacing for j in range(7)]
    weights = closing_weights(turn * np.array(places))     # turn: phase of the source per step [rad]
    state_at_phase_0 = weights @ samples

Through an odd number 2 m + 1 of samples there is one trigonometric polynomial of degree m. It is exact for a motion of
m harmonics, at whatever spacing; for close samples it tends to the polynomial of degree 2 m.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def closing_weights(phase: ArrayLike) -> NDArray[np.float64]:
    """Return the weights of samples at phases [rad], an odd number of them, (n,), that give the value at phase 0.

    Weights are not finite where two phases are equal but for whole turns.
    """
    x = np.asarray(phase, dtype=float)
    if len(x) % 2 == 0:
        raise ValueError(f"{len(x)} samples, expected an odd number")
    weights = np.ones(len(x))
    with np.errstate(divide="ignore", invalid="ignore"):
        for i in range(len(x)):
            others = np.arange(len(x)) != i
            weights[others] *= np.sin(-x[i] / 2) / np.sin((x[others] - x[i]) / 2)
    return weights
