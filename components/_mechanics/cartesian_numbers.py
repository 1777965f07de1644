"""Numbers of a rigid body on springs from its stiffness and mass matrices alone, in SI units, rotation first.

Matrices and points of axes depend on a point of reference; there is one set for each of several places, named by their
labels, `stiffness_S`. Eigenstiffnesses, frequencies, directions and pitches are the same for all. Axes of repeated
values are along x and y where they can be.

A vector of each axis is a column: directions (3, n), points (3, n), of the axis closest to the place. The point of a
translation is zero and its pitch infinite.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from hfsa.components._mechanics.bands import tracking_band
from hfsa.components._mechanics.eigenbasis import ROTATION_AXES, TRANSLATION_AXES, canonical_eigenvectors
from hfsa.components._mechanics.elastostatics import eigenscrews, indices, twist_compliant_axes, wrench_compliant_axes
from hfsa.components._mechanics.modes import (
    Modes,
    cholesky_frequency_matrix,
    dynamic_matrix,
    frequency_matrix,
    modes,
)
from hfsa.components._mechanics.screws import axis, kind_of, seen_from, shift, unit_screw

Places = Mapping[str, np.ndarray]
"""Places by label, `_S`, from the reference point of the matrices, shape (3,) [m]."""

BAND = 0.05
"""Deviation of a response from 1 that bounds `tracking_band_hz`."""

_ROUNDING = 1e-11
"""Coordinate of a point that is rounding, by the size of the body."""

_STIFFNESS = "N.m/rad, N; N, N/m"
_AT_PLACES = {
    "stiffness": _STIFFNESS,
    "compliance": "rad/(N.m), 1/N; 1/N, m/N",
    "eigenscrew_points": "m",
    "wrench_compliant_points": "m",
    "twist_compliant_points": "m",
    "mass": "kg.m2, kg.m; kg.m, kg",
    "dynamic_matrix": "rad2/s2, 1/(m.s2); m/s2, 1/s2",
    "modal_matrix": "rad/m; 1",
    "modal_points": "m",
    "tracking_band_hz": "Hz",
}
_ANYWHERE = {
    "eigenstiffness": "N",
    "eigenpitch": "m",
    "eigenscrew_directions": "1",
    "translational_stiffness": "N/m",
    "wrench_compliant_directions": "1",
    "wrench_compliant_pitches": "m",
    "torsional_stiffness": "N.m/rad",
    "twist_compliant_directions": "1",
    "twist_compliant_pitches": "m",
    "kappa": "N",
    "kappa_t": "N/m",
    "kappa_r": "N.m/rad",
    "natural_frequencies_hz": "Hz",
    "modal_kinds": "1",
    "modal_directions": "1",
    "modal_pitches": "m",
}
_AT_CENTER = {"frequency_matrix": "rad/s", "squared_frequency_matrix_cholesky": "rad2/s2", "modal_screws": "1; m"}


def units(*labels: str, center: str) -> dict[str, str]:
    """Return the units of the numbers at places with these labels, one of which is the centre of mass."""
    return (
        {name + label: unit for name, unit in _AT_PLACES.items() for label in labels}
        | _ANYWHERE
        | {name + center: unit for name, unit in _AT_CENTER.items()}
    )


def static_numbers(K: np.ndarray, places: Places, length: float) -> dict[str, Any]:
    """Return the elastostatic numbers of a stiffness matrix, shape (6, 6).

    Args:
        K: stiffness about the reference point.
        places: points of reference of the numbers.
        length: size of the body, by which a rotation is told from a translation [m].

    Raises:
        ModelError: a stiffness that is not positive definite.
    """
    about = {label: seen_from(K, offset) for label, offset in places.items()}
    screws, forces, moments = eigenscrews(K), wrench_compliant_axes(K), twist_compliant_axes(K)
    return {
        **{f"stiffness{label}": matrix for label, matrix in about.items()},
        **{f"compliance{label}": np.linalg.inv(matrix) for label, matrix in about.items()},
        "eigenstiffness": screws.stiffness,
        "eigenpitch": screws.pitch,
        "eigenscrew_directions": _directions(screws.screws, length),
        **_points("eigenscrew", screws.screws, places, length),
        "translational_stiffness": forces.stiffness,
        "wrench_compliant_directions": _directions(forces.screws, length),
        "wrench_compliant_pitches": _pitches(forces.screws, length),
        **_points("wrench_compliant", forces.screws, places, length),
        "torsional_stiffness": moments.stiffness,
        "twist_compliant_directions": _directions(moments.screws, length),
        "twist_compliant_pitches": _pitches(moments.screws, length),
        **_points("twist_compliant", moments.screws, places, length),
        **indices(K)._asdict(),
    }


def modal_numbers(M: np.ndarray, K: np.ndarray, places: Places, center: str, length: float) -> dict[str, Any]:
    """Return the elastodynamic numbers of mass and stiffness matrices, shape (6, 6), about the same point.

    Arguments and errors as in `static_numbers`; `center` is the label of the place that is the centre of mass, where
    alone M is block diagonal and its square root has a meaning, or empty where there is none.
    """
    M_at = {label: seen_from(M, offset) for label, offset in places.items()}
    K_at = {label: seen_from(K, offset) for label, offset in places.items()}
    found = axial_modes(M, K, length)
    motions = [axis(shape, length) for shape in found.shapes.T]
    numbers = {
        **{f"mass{label}": matrix for label, matrix in M_at.items()},
        **{f"dynamic_matrix{label}": dynamic_matrix(M_at[label], K_at[label]) for label in places},
        "natural_frequencies_hz": found.omega / (2 * np.pi),
        **{f"modal_matrix{label}": shift(-offset) @ found.shapes for label, offset in places.items()},
        "modal_kinds": [kind_of(motion, length) for motion in motions],
        "modal_directions": _directions(found.shapes, length),
        "modal_pitches": _pitches(found.shapes, length),
        **_points("modal", found.shapes, places, length),
        **{f"tracking_band_hz{at}": tracking_band(M_at[at], K_at[at], BAND) / (2 * np.pi) for at in places},
    }
    if center:
        numbers |= {
            f"frequency_matrix{center}": frequency_matrix(M_at[center], K_at[center]),
            f"squared_frequency_matrix_cholesky{center}": cholesky_frequency_matrix(M_at[center], K_at[center]),
            f"modal_screws{center}": unit_screws(numbers[f"modal_matrix{center}"], length),
        }
    return numbers


def axial_modes(M: np.ndarray, K: np.ndarray, length: float) -> Modes:
    """Return the modes of a body, those of a repeated frequency with axes along x and y; the largest entry positive."""
    omega, H = modes(M, K)
    weights = np.repeat([length, 1.0], 3)[:, None]
    size = np.linalg.norm(weights * H, axis=0).max()
    scaled = canonical_eigenvectors(omega, weights * H / size, [ROTATION_AXES, TRANSLATION_AXES])
    shapes = size * scaled / weights
    return Modes(omega, shapes * np.sign(np.sum(shapes * unit_screws(shapes, length), axis=0)))


def unit_screws(shapes: np.ndarray, length: float) -> np.ndarray:
    """Return displacements, columns of six, as screws of unit rotation or, without any, of unit translation."""
    return np.column_stack([unit_screw(column, length) for column in shapes.T])


def _directions(screws: np.ndarray, length: float) -> np.ndarray:
    """Return the directions of the axes of screws, columns, shape (3, n)."""
    return np.column_stack([axis(screw, length).direction for screw in screws.T])


def _pitches(screws: np.ndarray, length: float) -> np.ndarray:
    """Return the pitches of screws, shape (n,) [m]; those within rounding of 0 are 0."""
    pitches = np.array([axis(screw, length).pitch for screw in screws.T])
    return np.where(np.abs(pitches) < _ROUNDING * length, 0.0, pitches)


def _points(name: str, screws: np.ndarray, places: Places, length: float) -> dict[str, np.ndarray]:
    """Return the points of the axes of screws that are closest to each place, columns, shape (3, n) [m].

    Coordinates within rounding of 0 are 0.
    """
    found = {}
    for label, offset in places.items():
        points = np.column_stack([axis(screw, length).point for screw in (shift(-offset) @ screws).T])
        found[f"{name}_points{label}"] = np.where(np.abs(points) < _ROUNDING * length, 0.0, points)
    return found
