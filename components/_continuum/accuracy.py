"""How far the small model of a stage is from the stage: responses from the stacks' forces to the pose.

    error(omega) = |H_small - H| / |H|        spectral norms; the yaw is scaled by the distance of the bolts from O

with structural damping of twice the modal one, K (1 + 2 i zeta), the same in both.
"""

import numpy as np

from hfsa.components._continuum.design import Continuum
from hfsa.components._continuum.reduced import Reduced, bonded
from hfsa.components._continuum.stage import Stage

BANDS = (1e3, 3e3, 5e3)
"""Ends of the bands of which the largest errors are returned [Hz]."""
DAMPING = 0.01
"""Damping ratio."""
_STEP = 5.0
"""Distance of the frequencies at which responses are compared [Hz]."""


def reduction_error(design: Continuum, stage: Stage) -> dict[str, float]:
    """Return the largest errors of the small model of a stage from 0 to the ends of `BANDS`."""
    small = design.small(stage)
    scale = np.array([1.0, 1.0, design.shape.links.radius])[:, None]
    frequencies = np.arange(_STEP, BANDS[-1] + _STEP / 2, _STEP)
    found = []
    for whole, reduced in zip(_of_stage(design, stage, frequencies), _of_small(small, frequencies), strict=True):
        difference = np.linalg.norm(scale * (reduced - whole), 2)
        found.append(difference / np.linalg.norm(scale * whole, 2))
    errors = np.array(found)
    return {f"to {end / 1e3:g} kHz": float(errors[frequencies <= end].max()) for end in BANDS}


def _of_stage(design: Continuum, stage: Stage, frequencies: np.ndarray) -> np.ndarray:
    """Return the responses of the pose to forces of the stacks, by all modes, shape (k, 3, 3) [m/N; rad/N]."""
    K, M, _ = bonded(stage, design.stack)
    s = (2 * np.pi * frequencies) ** 2
    forces = np.eye(len(K))[:, :3]
    dynamic = (1 + 2j * DAMPING) * K - s[:, None, None] * M
    return np.linalg.solve(dynamic, np.broadcast_to(forces, (len(s), *forces.shape)))[:, 3:6]


def _of_small(small: Reduced, frequencies: np.ndarray) -> np.ndarray:
    """Return the same responses of the small model."""
    s = (2 * np.pi * frequencies) ** 2
    gains = 1 / ((1 + 2j * DAMPING) * small.omega**2 - s[:, None])
    modal = np.einsum("in,kn,jn->kij", small.shapes[3:], gains, small.shapes[:3])
    return modal + small.residual[3:, :3] / (1 + 2j * DAMPING)
