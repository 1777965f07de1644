"""Numbers of the SDelta that no analysis returns: springs, inertia, compliance and axes at the symmetric posture."""

from typing import Any

import numpy as np

from hfsa.components import sdelta
from hfsa.components._mechanics.elastostatics import eigenscrews, twist_compliant_axes, wrench_compliant_axes
from hfsa.components._mechanics.modes import damping_matrix
from hfsa.components._mechanics.screws import axis, shift
from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC, THESIS_GEOMETRY
from hfsa.components._mechanics.sdelta_inertia import CUBE, Payload, with_payload
from hfsa.components._mechanics.sdelta_kinematics import THESIS, Kinematics
from hfsa.components._mechanics.sdelta_stiffness import THESIS_SHAFTS, limb_stiffness, springs_of, stiffness


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
    springs, kinematics = springs_of(preset), Kinematics.at(SYMMETRIC)
    slide, turn = springs.shaft / (THESIS.drives_matrix**2).sum(axis=1)[:2] / [1, kinematics.limbs.length[0] ** 2]
    return {
        "rod": springs.rod,
        "shaft": springs.shaft,
        "shaft_alone": THESIS_SHAFTS.alone,
        "slide": slide,
        "turn": turn,
        "by_rod": [slide / springs.rod, turn / springs.rod],
        "limb": limb_stiffness(kinematics, springs)[:2],
    }


def sdelta_inertia(payload: bool) -> dict[str, Any]:
    """The platform with its cube or alone."""
    body = with_payload(CUBE if payload else Payload(0.0, (0, 0, 0), (0, 0, 0)))
    to_S = shift(-body.center)
    return {
        "mass": body.mass,
        "height": body.center[2],
        "about_C": np.diag(body.tensor),
        "about_S": np.diag(body.about(np.zeros(3))),
        "matrix_C": body.matrix(np.eye(3)),
        "matrix_S": to_S.T @ body.matrix(np.eye(3)) @ to_S,
    }


def sdelta_at_mass_centre() -> dict[str, Any]:
    """Matrices about C: their diagonals, and the entries (1, 5) and (2, 4), the only others."""
    numbers = sdelta.analyze()
    K = numbers["stiffness_C"]
    matrices = {
        "stiffness": K,
        "frequency": numbers["frequency_matrix_C"],
        "damping": 0.01 * damping_matrix(numbers["mass_C"], K),
    }
    return {name: _blocks(matrix) for name, matrix in matrices.items()}


def sdelta_compliance(preset: str) -> dict[str, Any]:
    """Compliance at S, as the matrices about C."""
    return _blocks(np.linalg.inv(_stiffness(preset)))


def sdelta_compliance_differences(finite_elements: list[float]) -> np.ndarray:
    """Differences of c11, c22, c33, c15, c24, c44, c55, c66 by finite elements from those of the rods, by these."""
    model = np.concatenate([sdelta_compliance("ch3_rods")[name] for name in ("rotation", "coupling", "translation")])
    return np.abs(np.array(finite_elements) / model - 1)


def sdelta_loss_by_drives() -> dict[str, Any]:
    """What rods and shafts have less of kappa, kappa_t and kappa_r than the rods alone, by these."""
    full, rods = (sdelta.analyze(stiffness=preset) for preset in ("ch3_full", "ch3_rods"))
    return {name: 1 - full[name] / rods[name] for name in ("kappa", "kappa_t", "kappa_r")}


def sdelta_axes(preset: str) -> dict[str, Any]:
    """Eigenscrews, wrench- and twist-compliant axes at S in ascending order of stiffness: points, directions, pitches.

    Equal stiffnesses have any axes in a plane: those along X and Y are taken. An axis along Z points down.
    """
    K = _stiffness(preset)
    found = {"eigen": eigenscrews(K), "wrench": wrench_compliant_axes(K), "twist": twist_compliant_axes(K)}
    return {name: _described(one.stiffness, one.screws) for name, one in found.items()}


def _stiffness(preset: str) -> np.ndarray:
    """K of a preset about S."""
    return stiffness(Kinematics.at(SYMMETRIC), springs_of(preset), np.zeros(3))


def _blocks(matrix: np.ndarray) -> dict[str, Any]:
    """Diagonal and the entries (1, 5), (2, 4) of a matrix."""
    diagonal = np.diag(matrix)
    return {"rotation": diagonal[:3], "translation": diagonal[3:], "coupling": [matrix[0, 4], matrix[1, 3]]}


def _described(values: np.ndarray, screws: np.ndarray) -> dict[str, Any]:
    """Points, directions and pitches of screws, columns of unit rotation, by row."""
    screws = np.where(screws[2] > 0.5, -screws, screws)
    for i in np.flatnonzero(np.isclose(values[1:], values[:-1])):
        screws[:, i : i + 2] = screws[:, i : i + 2] @ np.linalg.inv(screws[:2, i : i + 2])
    axes = [axis(screw, THESIS_GEOMETRY.platform_radius) for screw in screws.T]
    return {
        "point": np.array([one.point for one in axes]),
        "direction": screws[:3].T,
        "pitch": np.array([one.pitch for one in axes]),
    }
