"""Engineering numbers of a stage at level `continuum`, each with the error of its mesh.

Every number is computed twice, with triangles of the size h and of 2 h at the necks. While their difference falls with
the size, it is larger than the error of the finer one, whose numbers are returned. The error of a stress is not smaller
than half of the jump of the stress at its node (`stress.py`).
"""

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from hfsa.components._continuum.accuracy import reduction_error
from hfsa.components._continuum.design import Continuum, Solved
from hfsa.components._continuum.dynamics import largest_displacements
from hfsa.components._continuum.reduced import bonded, frequencies
from hfsa.components._continuum.stress import Peak, neck_stresses
from hfsa.components._mechanics.pzt import STROKE_IN_USE

FREQUENCIES = 6
"""Natural frequencies that are returned."""

_CORNERS = np.array(list(product((0.0, 1.0), repeat=3)))[1:]
"""Which stacks are at full stroke, shape (7, 3)."""


class _Number(NamedTuple):
    """A result, and the magnitude by which its error is given, of each entry or of all."""

    value: Any
    scale: Any


def elastic_numbers(
    design: Continuum, elongation: Sequence[float], voltage: Sequence[float], resolution: float
) -> dict[str, Any]:
    """Return the results of `analyze` at elongations (3,) [m] and voltages (3,) [V], limited to what stacks take.

    `resolution` is the smallest step of an elongation [m].
    """
    applied = np.clip(voltage, 0, design.stack.full_voltage)
    found = _numbers(design, np.array(elongation), applied, resolution)
    return {"elongation": np.array(elongation), **found, "saturated": (applied != voltage).astype(int)}


def _numbers(design: Continuum, elongation: np.ndarray, voltage: np.ndarray, resolution: float) -> dict[str, Any]:
    """Return the numbers of both meshes."""
    fine, coarse = (design.solved(size) for size in (design.size, 2 * design.size))
    linear, other = (_linear(design, solved, elongation, voltage, resolution) for solved in (fine, coarse))
    peaks, other_peaks = (_peaks(design, solved, elongation) for solved in (fine, coarse))
    errors = {name: _error(number, other[name]) for name, number in linear.items()}
    of_stress = {
        name: {neck: _stress_error(peak, other_peaks[name][neck]) for neck, peak in found.items()}
        for name, found in peaks.items()
    }
    errors["hinge_stress"] = max(of_stress["hinge_stress"].values())
    errors |= {f"peak_stress.{neck}": error for neck, error in of_stress["peak_stress"].items()}
    return {
        **{name: number.value for name, number in linear.items()},
        **{name: {neck: peak.stress for neck, peak in found.items()} for name, found in peaks.items()},
        "peak_stacks": {neck: _stacks(peak) for neck, peak in peaks["peak_stress"].items()},
        "allowed_stress": design.dimensions.hinge.allowed_stress,
        "hinge_limit": _limit(peaks["peak_stress"], design.dimensions.hinge.allowed_stress),
        "reduction_error": reduction_error(design, fine.stage),
        "mesh": design.size,
        "mesh_unknowns": fine.solution.piece.unknowns,
        "mesh_error": errors,
    }


def _linear(
    design: Continuum, solved: Solved, elongation: np.ndarray, voltage: np.ndarray, resolution: float
) -> dict[str, _Number]:
    """Return what follows from the matrices of a stage."""
    stage, stack = solved.stage, design.stack
    statics = stage.statics
    J, K = statics.jacobian, statics.on_stacks
    per_elongation = np.repeat(_largest(np.vstack([J[:2].ravel(), np.repeat(J[2], 2)]), axis=1), (2, 1))
    force = K @ elongation
    at_voltage = np.linalg.solve(K + stack.stiffness * np.eye(3), stack.coupling * voltage)
    return {
        "jacobian": _Number(J, per_elongation[:, None]),
        "pose": _Number(J @ elongation, per_elongation * _largest(elongation)),
        "range": _own(STROKE_IN_USE * np.abs(J).sum(axis=1)),
        "step": _own(resolution * np.abs(np.where(J == 0, np.inf, J)).min(axis=1)),
        "stiffness": _of_all(K),
        "platform_stiffness_free": _of_diagonal(statics.on_platform(0.0)),
        "platform_stiffness_bonded": _of_diagonal(statics.on_platform(stack.stiffness)),
        "platform_stiffness_blocked": _of_diagonal(statics.blocked),
        "piece_mass": _own(solved.solution.piece.weight),
        "natural_frequencies_hz": _own(_hertz(stage.stiffness, stage.mass)),
        "natural_frequencies_bonded_hz": _own(_hertz(*bonded(stage, stack)[:2])),
        "force": _of_all(force),
        "voltage": _of_all((force + stack.stiffness * elongation) / stack.coupling),
        "elongation_at_voltage": _of_all(at_voltage),
        "mode_at_voltage": _of_all(_at_rest(design, solved, voltage)),
        "pose_at_voltage": _Number(J @ at_voltage, per_elongation * _largest(at_voltage)),
    }


def _at_rest(design: Continuum, solved: Solved, voltage: np.ndarray) -> np.ndarray:
    """Return the coordinates of the modes of the small model in equilibrium at voltages [m]."""
    small = design.small(solved.stage)
    force = design.stack.coupling * voltage
    return largest_displacements(small, design.shape.links.radius) * (small.shapes[:3].T @ force) / small.omega**2


def _own(value: Any) -> _Number:
    """Return numbers by their own magnitudes."""
    return _Number(value, np.abs(value))


def _of_all(value: np.ndarray) -> _Number:
    """Return numbers of one unit by the largest of them."""
    return _Number(value, _largest(value))


def _of_diagonal(value: np.ndarray) -> _Number:
    """Return a matrix by the numbers on its diagonal: those beside it vanish by symmetry."""
    return _Number(value, np.sqrt(np.outer(np.diag(value), np.diag(value))))


def _largest(values: np.ndarray, axis: int | None = None) -> np.ndarray:
    """Return the largest magnitude."""
    return np.abs(values).max(axis=axis)


def _error(fine: _Number, coarse: _Number) -> float:
    """Return the largest difference of two results by the magnitudes of the first."""
    difference, scale = np.abs(fine.value - coarse.value), np.broadcast_to(fine.scale, np.shape(fine.value))
    return float(np.max(np.where(scale > 0, difference / np.where(scale > 0, scale, 1.0), 0.0)))


def _hertz(stiffness: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Return the lowest natural frequencies [Hz], ascending."""
    return frequencies(stiffness, mass)[:FREQUENCIES] / (2 * np.pi)


def _peaks(design: Continuum, solved: Solved, elongation: np.ndarray) -> dict[str, dict[str, Peak]]:
    """Return the peaks of all twelve necks at elongations, and of those of leg 1 over the stroke of all stacks."""
    statics = solved.stage.statics
    necks = neck_stresses(*solved.solution, design.shape.material, statics.interface)

    def motions(elongations: np.ndarray) -> np.ndarray:
        return np.hstack([elongations, elongations @ statics.jacobian.T])

    at = motions(elongation[None])
    over = motions(STROKE_IN_USE * _CORNERS)
    return {
        "hinge_stress": {f"{neck}{leg + 1}": found.peak(leg, at) for neck, found in necks.items() for leg in range(3)},
        "peak_stress": {neck: found.peak(0, over) for neck, found in necks.items()},
    }


def _stacks(peak: Peak) -> str:
    """Return in words which stacks are at full stroke where the neck of leg 1 has its peak."""
    return ", ".join(f"{i + 1}" for i in np.flatnonzero(_CORNERS[peak.case]))


def _limit(peaks: Mapping[str, Peak], allowed: float) -> str:
    """Return in words the neck with the largest stress over the stroke of the stacks, beside the allowable stress."""
    neck = max(peaks, key=lambda name: peaks[name].stress)
    stress = peaks[neck].stress
    return (
        f"the necks {neck} have the largest stress over {1e6 * STROKE_IN_USE:g} um, {stress / 1e6:.4g} MPa, "
        f"{stress / allowed:.3g} of the allowable {allowed / 1e6:.4g} MPa"
    )


def _stress_error(fine: Peak, coarse: Peak) -> float:
    """Return the relative error of the peak of a neck."""
    if fine.stress == 0:
        return 0.0
    return max(abs(fine.stress - coarse.stress), fine.jump) / fine.stress
