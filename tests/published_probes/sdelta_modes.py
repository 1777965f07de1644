"""Numbers of the SDelta that no analysis returns: mode shapes and screws, at symmetry and in the thesis' example."""

from typing import Any

import numpy as np

from hfsa.components import sdelta
from hfsa.components._mechanics.modes import frequency_matrix, modes
from hfsa.components._mechanics.screws import axis, shift, skew
from hfsa.components._mechanics.sdelta_geometry import THESIS_GEOMETRY, Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE, with_payload
from hfsa.components._mechanics.sdelta_kinematics import Kinematics
from hfsa.components._mechanics.sdelta_stiffness import springs_of, stiffness

_EXAMPLE = (0.005, 0.003, 0.155)
"""Position of S in the example [m]."""
_SIGNS, _EXAMPLE_SIGNS = (1, 1, 1, 1, -1, 1), (-1, -1, 1, 1, -1, 1)
"""Of the largest number of each mode, as printed: a mode has two."""


def sdelta_modes(point: str) -> dict[str, Any]:
    """Modes of the symmetric posture, seen at S or C; those of equal frequency turn about X and Y."""
    found = sdelta.analyze()
    offset = with_payload(CUBE).center if point == "S" else np.zeros(3)
    return _modes(found["mass_C"], found["stiffness_C"], offset, _SIGNS)


def sdelta_frequency_differences(finite_elements: list[float]) -> np.ndarray:
    """Differences of natural frequencies by finite elements [Hz] from those of the model, by these."""
    return np.abs(np.array(finite_elements) / sdelta.analyze()["natural_frequencies_hz"] - 1)


def sdelta_example() -> dict[str, Any]:
    """The thesis' example away from symmetry: matrices and modes about C."""
    posture = Posture((10, 5, 8), _EXAMPLE)
    Q, body = posture.matrix, with_payload(CUBE)
    return {"attitude": Q, **_about_mass_centre(posture, body.matrix(Q), np.zeros(3))}


def sdelta_example_with_its_slips() -> dict[str, Any]:
    """The same with the thesis' slips put in: 10 / 180 rad for 10 deg, Q^T I_S Q for Q I_S Q^T, modes about S."""
    posture = Posture((np.rad2deg(10 / 180), 5, 8), _EXAMPLE)
    Q, body = posture.matrix, with_payload(CUBE)
    d, M = Q @ body.center, body.matrix(Q)
    M[:3, :3] = Q.T @ body.about(np.zeros(3)) @ Q + body.mass * skew(d) @ skew(d)
    return _about_mass_centre(posture, M, d)


def _about_mass_centre(posture: Posture, M: np.ndarray, seen_from: np.ndarray) -> dict[str, Any]:
    """Matrices about C at a posture of the example, and modes at C - `seen_from`."""
    offset = posture.matrix @ with_payload(CUBE).center
    K = stiffness(Kinematics.at(posture), springs_of("ch4"), offset)
    return {
        "offset": offset,
        "inertia": M[:3, :3],
        "stiffness": K,
        "frequency_matrix": frequency_matrix(M, K),
        **_modes(M, K, seen_from, _EXAMPLE_SIGNS),
    }


def _modes(M: np.ndarray, K: np.ndarray, offset: np.ndarray, signs: tuple[int, ...]) -> dict[str, Any]:
    """Modes of M and K about C, seen at C - `offset`: frequencies, shapes, screws, and points and pitches by row."""
    omega, shapes = modes(M, K)
    for i in np.flatnonzero(np.isclose(omega[1:], omega[:-1])):
        turns = shapes[:2, i : i + 2]
        shapes[:, i : i + 2] = shapes[:, i : i + 2] @ turns.T / np.linalg.norm(turns[:, 0])
    shapes *= signs * np.sign(shapes[np.abs(shapes).argmax(axis=0), range(6)])
    shapes = shift(offset) @ shapes
    turn, slide = np.linalg.norm(shapes.reshape(2, 3, 6), axis=1)
    axes = [axis(shape, THESIS_GEOMETRY.platform_radius) for shape in shapes.T]
    return {
        "omega": omega,
        "squares": omega**2,
        "natural_frequencies_hz": omega / (2 * np.pi),
        "shapes": shapes,
        "screws": shapes / np.where(turn > 1e-6 * slide, turn, slide),
        "point": np.array([one.point for one in axes]),
        "pitch": np.array([one.pitch for one in axes]),
    }
