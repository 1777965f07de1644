"""Derivatives of sampled signals by central differences over five points, and of a motion given by its rotation.

    first   (x[-2] - 8 x[-1] + 8 x[+1] - x[+2]) / (12 h)
    second  (-x[-2] + 16 x[-1] - 30 x[0] + 16 x[+1] - x[+2]) / (12 h^2)

Both are exact for polynomials of degree four; of a sine of angular frequency w the relative error of the first is
(h w)^4 / 30 and that of the second (h w)^4 / 90.
"""

import numpy as np
from numpy.typing import NDArray

REACH = 2
"""Samples at each end that have no derivative."""

_FIRST = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12
_SECOND = np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / 12


def derivatives(samples: NDArray[np.float64], step: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the first and second derivatives along the first axis, without `REACH` samples at each end.

    `samples` are `step` [s] apart. `ValueError` for fewer than five.
    """
    count = len(samples) - 2 * REACH
    if count < 1:
        raise ValueError(f"{len(samples)} samples, expected five or more")
    stacked = np.stack([samples[i : i + count] for i in range(2 * REACH + 1)])
    first, second = np.tensordot(_FIRST, stacked, 1), np.tensordot(_SECOND, stacked, 1)
    return first / step, second / step**2
