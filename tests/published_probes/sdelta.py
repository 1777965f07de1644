"""Numbers of the SDelta that no analysis returns: its springs, inertia, compliance, screws and modes."""

from typing import Any

import numpy as np

from hfsa.components import _sdelta_stiffness, sdelta
from hfsa.components._elastostatics import eigenscrews, twist_compliant_axes, wrench_compliant_axes
from hfsa.components._modes import modal_damping, modes
from hfsa.components._screws import axis, skew
from hfsa.components._sdelta_geometry import PLATFORM_RADIUS, SYMMETRIC, Posture
from hfsa.components._sdelta_inertia import CUBE, Payload, with_payload
from hfsa.components._sdelta_kinematics import DRIVES_MATRIX, Kinematics
from hfsa.components._sdelta_stiffness import PRESETS, limb_stiffness, stiffness

_EXAMPLE = (0.005, 0.003, 0.155)
"""Position of S in the SDelta's example away from symmetry [m]."""


def sdelta_geometry() -> dict[str, Any]:
    """At the symmetric posture: limbs, N, and T^-1 of the motors."""
    kinematics = Kinematics.at(SYMMETRIC)
    return {
        "length": kinematics.limbs.length,
        "angle": kinematics.limbs.angle,
        "pose_to_motors": np.linalg.inv(kinematics.jacobian()),
        "determinant": np.linalg.det(kinematics.rows()),
    }


def sdelta_springs(preset: str) -> dict[str, Any]:
    """Springs of a preset: rod and shaft, the shaft as felt along and about the C axis, and the limbs'."""
    springs, kinematics = PRESETS[preset], Kinematics.at(SYMMETRIC)
    slide, turn = springs.shaft / (DRIVES_MATRIX**2).sum(axis=1)[:2]
    return {
        "rod": springs.rod,
        "shaft": springs.shaft,
        "shaft_alone": _sdelta_stiffness._SHAFT,
        "slide": slide,
        "turn": turn / kinematics.limbs.length[0] ** 2,
        "limb": limb_stiffness(kinematics, springs)[:2],
    }


def sdelta_inertia(payload: bool) -> dict[str, Any]:
    """The platform with its cube or alone."""
    body = with_payload(CUBE if payload else Payload(0.0, (0, 0, 0), (0, 0, 0)))
    return {
        "mass": body.mass,
        "height": body.center[2],
        "about_C": np.diag(body.tensor),
        "about_S": np.diag(body.about(np.zeros(3))),
    }


def sdelta_at_mass_centre() -> dict[str, Any]:
    """Matrices about C: their diagonals, and the entries (1, 5) and (2, 4), the only others."""
    numbers = sdelta.analyze()
    K = numbers["stiffness_C"]
    matrices = {
        "stiffness": K,
        "frequency": numbers["frequency_matrix_C"],
        "damping": 0.01 * modal_damping(numbers["mass_C"], K),
    }
    return {name: _blocks(matrix) for name, matrix in matrices.items()}


def sdelta_compliance(preset: str) -> dict[str, Any]:
    """Compliance at S, as the matrices about C."""
    found = _blocks(np.linalg.inv(stiffness(Kinematics.at(SYMMETRIC), PRESETS[preset], np.zeros(3))))
    (rotation, about_z), (translation, along_z) = ((found[n][:2], found[n][2]) for n in ("rotation", "translation"))
    return {
        "rotation": rotation,
        "rotation_about_z": about_z,
        "translation": translation,
        "translation_along_z": along_z,
        "coupling": found["coupling"],
    }


def _blocks(matrix: np.ndarray) -> dict[str, Any]:
    diagonal = np.diag(matrix)
    return {"rotation": diagonal[:3], "translation": diagonal[3:], "coupling": [matrix[0, 4], matrix[1, 3]]}


def sdelta_meeting_point(preset: str) -> np.ndarray:
    """Height above S at which each horizontal eigenscrew and compliant axis crosses the vertical through S."""
    K = stiffness(Kinematics.at(SYMMETRIC), PRESETS[preset], np.zeros(3))
    screws = np.hstack([found(K).screws for found in (eigenscrews, wrench_compliant_axes, twist_compliant_axes)]).T
    axes = [axis(screw, PLATFORM_RADIUS) for screw in screws]
    return np.array([one.point[2] for one in axes if abs(one.direction[2]) < 1e-6])


def sdelta_modes() -> dict[str, Any]:
    """The lower (1) and upper (4) tilting mode: heights of its axis, sizes of its shape in rotation and translation."""
    numbers = sdelta.analyze()
    height = [axis(numbers["modal_screws_C"][:, i], PLATFORM_RADIUS).point[2] for i in (0, 3)]
    shapes = modes(numbers["mass_C"], numbers["stiffness_C"]).shapes
    sizes = np.linalg.norm(shapes.reshape(2, 3, 6), axis=1)[:, [0, 3]]
    return {
        "above_C": np.array(height),
        "above_S": np.array(height) + with_payload(CUBE).center[2],
        "rotation": sizes[0],
        "translation": sizes[1],
    }


def sdelta_example_with_its_slips() -> np.ndarray:
    """Natural frequencies [Hz] of the thesis' example (eqs 4.45 to 4.51), its slips put in: 10 / 180 rad, Q for Q^T."""
    posture = Posture((np.rad2deg(10 / 180), 5, 8), _EXAMPLE)
    Q, body = posture.matrix, with_payload(CUBE)
    d = Q @ body.center
    M = body.matrix(Q)
    M[:3, :3] = Q.T @ body.about(np.zeros(3)) @ Q + body.mass * skew(d) @ skew(d)
    return modes(M, stiffness(Kinematics.at(posture), PRESETS["ch4"], d)).omega / (2 * np.pi)


def sdelta_example_offset() -> np.ndarray:
    """C - S in the thesis' example."""
    return Posture((10, 5, 8), _EXAMPLE).matrix @ with_payload(CUBE).center
