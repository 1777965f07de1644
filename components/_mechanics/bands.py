"""Band of a body on springs within which it follows the commanded motion of its base.

The body follows a commanded pose r by x = G r; with H^T M H = 1 and the damping ratio zeta in every mode

    G_ii - 1 = sum_k c_k w^2 / (omega_k^2 - w^2 + 2 i zeta omega_k w),    c_k = H_ik (H^-1)_ki

A mode with a small share c_k leaves the band near its resonance if c_k / (2 zeta) is beyond the tolerance.
"""

import numpy as np

from hfsa.components._mechanics.modes import modes

DAMPING_RATIO = 0.01
"""Damping ratio of every mode."""

_WIDTHS = np.linspace(-50, 50, 2001)
"""Frequencies about a resonance, in units of its width zeta omega, 0.05 apart."""
_BISECTIONS = 50


def tracking_band(M: np.ndarray, K: np.ndarray, tolerance: float) -> np.ndarray:
    """Return the lowest frequency at which |G_ii - 1| is the tolerance, for every coordinate i, shape (n,) [rad/s].

    The tolerance is below 1, the error at high frequencies. It is found between points that resolve every resonance.
    """
    omega, H = modes(M, K)
    shares = H * (M @ H)
    near = omega[:, None] * (1 + DAMPING_RATIO * _WIDTHS)
    grid = np.unique(np.concatenate([near.ravel(), np.geomspace(1e-3 * omega[0], 100 * omega[-1], 2000)]))
    first = np.argmax(_errors(omega, shares, grid) > tolerance, axis=1)
    low, high = np.where(first > 0, grid[first - 1], 0.0), grid[first]
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        beyond = np.array([_errors(omega, row, w)[0, 0] > tolerance for row, w in zip(shares, middle, strict=True)])
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return high


def _errors(omega: np.ndarray, shares: np.ndarray, w: np.ndarray | float) -> np.ndarray:
    """Return |G_ii - 1| for rows of shares, shape (rows, frequencies)."""
    w = np.atleast_1d(w)
    damped = omega[:, None] ** 2 - w**2 + 2j * DAMPING_RATIO * omega[:, None] * w
    return np.abs(np.atleast_2d(shares) @ (w**2 / damped))
