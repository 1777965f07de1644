"""Few points that stand for a neck: where its largest von Mises stress is, for any motion of elongations and pose.

    found peak >= (1 - tolerance) peak         for all motions l, q of a sample

A neck carries three resultants, whatever moves it, so that few points suffice. They are found by adding that of the
worst motion of the sample until none is worse than the tolerance.
"""

import numpy as np

from hfsa.components._continuum.elements import von_mises
from hfsa.components._continuum.stress import NeckStress

TOLERANCE = 0.01
"""Largest share of a peak that is not found."""
_MOTIONS = 1000
_SEED = 1


def few_points(found: NeckStress, stiffness: np.ndarray) -> np.ndarray:
    """Return the stresses xx, yy, xy by l and q at few points of a neck, for each leg, shape (3, p, 3, 6).

    `stiffness` is that on l and q (6, 6); the motions of the sample have equal energies.
    """
    directions = np.random.default_rng(_SEED).standard_normal((_MOTIONS, len(stiffness)))
    motions = np.linalg.solve(np.linalg.cholesky(stiffness).T, directions.T).T
    # the three legs are alike: what is enough for one is so for the others
    stress = np.einsum("pkm,cm->cpk", found.by_motion[0], motions)
    equivalent = von_mises(stress, found.material)
    peaks = equivalent.max(axis=1)
    chosen: list[int] = []
    best = np.zeros(_MOTIONS)
    while (best / peaks).min() < 1 - TOLERANCE:
        worst = int(np.argmin(best / peaks))
        chosen.append(int(np.argmax(equivalent[worst])))
        best = np.maximum(best, equivalent[:, chosen[-1]])
    return found.by_motion[:, chosen]
