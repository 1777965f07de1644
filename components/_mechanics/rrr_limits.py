"""Hinges of the 3-RRR stage at given elongations: their angles, stresses and shares of the allowable angle."""

from typing import Any

import numpy as np

from hfsa.components._mechanics.rrr_hinge import HINGES, Hinge


def hinge_numbers(hinge: Hinge, angles: np.ndarray, elongation: np.ndarray) -> dict[str, Any]:
    """Return the results of an analysis about the nine hinges at angles (9,) [rad] and elongations (3,) [m]."""
    return {
        "hinge_stiffness": hinge.stiffness,
        "hinge_angle": dict(zip(HINGES, angles.tolist(), strict=True)),
        "hinge_stress": dict(zip(HINGES, (hinge.stress_per_angle * np.abs(angles)).tolist(), strict=True)),
        "allowed_angle": hinge.allowed_angle,
        "allowed_stress": hinge.allowed_stress,
        "hinge_limit": hinge_limit(hinge, angles, elongation),
    }


def hinge_limit(hinge: Hinge, angles: np.ndarray, elongation: np.ndarray) -> str:
    """Return in words the hinge that bends most, and from which elongations on it is beyond its allowable angle.

    These are in proportion to the given ones, by the angles that are.
    """
    worst = int(np.argmax(np.abs(angles)))
    bends, allowed = abs(angles[worst]), hinge.allowed_angle
    if not bends:
        return f"no hinge bends; {allowed * 1e3:.4g} mrad are allowable"
    said = f"hinge {HINGES[worst]} bends most, by {bends * 1e3:.4g} mrad, {bends / allowed:.3g} of the allowable "
    return f"{said}{allowed * 1e3:.4g} mrad{reached(bends / allowed, elongation)}"


def reached(share: float, elongation: np.ndarray) -> str:
    """Return from which elongations on a limit is exceeded, as the end of a sentence; nothing where it is not.

    `share` is the share of the limit at `elongation` (3,) [m], with which it grows.
    """
    if share <= 1:
        return ""
    limits = ", ".join(f"{1e6 * value / share + 0.0:.4g}" for value in elongation)
    return f"; it is beyond it from elongations of {limits} um on"
