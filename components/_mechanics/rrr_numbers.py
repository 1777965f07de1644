"""Numbers of `analyze rrr_stage`: kinematics, statics and dynamics in the coordinates of the stacks."""

from typing import Any

import casadi as ca
import numpy as np

from hfsa.components._mechanics import rrr_dynamics as dynamics
from hfsa.components._mechanics.modes import modes
from hfsa.components._mechanics.pzt import STROKE_IN_USE, Stack
from hfsa.components._mechanics.rrr_design import Design
from hfsa.components._mechanics.rrr_dynamics import Mechanism
from hfsa.components._mechanics.rrr_kinematics import forward, inverse, newton
from hfsa.components._mechanics.rrr_limits import hinge_numbers

Triple = tuple[float, float, float]

CORNERS = STROKE_IN_USE * np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
"""Corners of the elongations in use, (8, 3) [m]."""

_ON_POSE = "N/m, N/m, N; N/m, N/m, N; N, N, N.m/rad"

UNITS = {
    "jacobian": "1; 1; rad/m",
    "pose": "m; m; rad",
    "range": "m; m; rad",
    "step": "m; m; rad",
    "hinge_stiffness": "N.m/rad",
    "hinge_stiffness_along": "N/m",
    "hinge_stiffness_across": "N/m",
    "hinge_angle": "rad",
    "hinge_stress": "Pa",
    "allowed_angle": "rad",
    "allowed_stress": "Pa",
    "hinge_limit": "1",
    "peak_stress": "Pa",
    "peak_stacks": "1",
    "platform_stiffness_free": _ON_POSE,
    "platform_stiffness_bonded": _ON_POSE,
    "platform_stiffness_blocked": _ON_POSE,
    "piece_mass": "kg",
    "reduction_error": "1",
    "mesh": "m",
    "mesh_unknowns": "1",
    "mesh_error": "1",
    "elongation": "m",
    "inertia": "kg",
    "stiffness": "N/m",
    "natural_frequencies_hz": "Hz",
    "natural_frequencies_bonded_hz": "Hz",
    "force": "N",
    "voltage": "V",
    "elongation_at_voltage": "m",
    "mode_at_voltage": "m",
    "pose_at_voltage": "m; m; rad",
    "saturated": "1",
}
"""Units of the results of `analyze`, in the notation of `_modelling/parts.py`."""


def kinematic_numbers(J: np.ndarray, elongation: Triple, resolution: float) -> dict[str, Any]:
    """Return the numbers that follow from a Jacobian alone."""
    return {
        "jacobian": J,
        "pose": J @ np.array(elongation),
        "elongation": np.array(elongation),
        "range": np.ptp(CORNERS @ J.T, axis=0),
        "step": _steps(J, resolution),
    }


def dynamic_numbers(
    level: str, design: Design, stack: Stack, elongation: Triple, voltage: Triple, resolution: float
) -> dict[str, Any]:
    """Return the numbers of levels `constant_jacobian` and `exact`."""
    mechanism = design.mechanism(level, ca.SX.sym("p", 3), ca.SX.sym("v", 3))
    numbers = _on_stacks(mechanism)
    reached = forward(design.links_at_rest, elongation)
    at = reached if level == "exact" else np.array(elongation)
    J, found, inertia, elastic, force, angles = (np.array(value).squeeze() for value in numbers(at))
    poses = np.array([np.array(numbers(_coordinates(level, design, corner))[1]).ravel() for corner in CORNERS.tolist()])
    applied = np.clip(voltage, 0, stack.full_voltage)
    elongation_at_voltage, pose_at_voltage = _at_voltage(mechanism, stack, applied)
    return {
        "jacobian": J,
        "pose": found,
        "elongation": np.array(elongation),
        "range": np.ptp(poses, axis=0),
        "step": _steps(J, resolution),
        **hinge_numbers(design.hinge, angles, np.array(elongation)),
        "inertia": inertia,
        "stiffness": elastic,
        "natural_frequencies_hz": _frequencies(inertia, elastic),
        "natural_frequencies_bonded_hz": _frequencies(
            inertia + stack.tip_mass * np.eye(3), elastic + stack.stiffness * np.eye(3)
        ),
        "force": force,
        "voltage": (force + stack.stiffness * np.array(elongation)) / stack.coupling,
        "elongation_at_voltage": elongation_at_voltage,
        "pose_at_voltage": pose_at_voltage,
        "saturated": (applied != voltage).astype(int),
    }


def _steps(jacobian: np.ndarray, resolution: float) -> np.ndarray:
    """Return the least steps of the pose by a stack that moves it, (3,) [m, m, rad]; infinite where none does."""
    return resolution * np.abs(np.where(jacobian == 0, np.inf, jacobian)).min(axis=1)


def _on_stacks(mechanism: Mechanism) -> ca.Function:
    """Return the function from coordinates to Jacobian, pose, inertia, stiffness, holding force and hinge angles."""
    p, terms = mechanism.coordinates, dynamics.terms(mechanism)
    to_pose, to_stacks = ca.vertsplit(terms.slope, 3)
    from_stacks = ca.inv(to_stacks)
    force = from_stacks.T @ terms.elastic
    return ca.Function(
        "on_stacks",
        [p],
        [
            to_pose @ from_stacks,
            mechanism.pose,
            from_stacks.T @ terms.mass @ from_stacks,
            ca.jacobian(force, p) @ from_stacks,
            force,
            mechanism.hinges,
        ],
    )


def _coordinates(level: str, design: Design, elongation: Triple | list[float]) -> np.ndarray:
    """Return the mechanism's coordinates at elongations [m], (3,)."""
    return forward(design.links_at_rest, elongation) if level == "exact" else np.array(elongation)


def elongations_at(level: str, design: Design, pose: Triple) -> Triple:
    """Return the elongations of a pose: of the links at level `exact`, else by the Jacobian."""
    if level == "exact":
        return tuple(inverse(design.links_at_rest, pose, "rrr_stage").tolist())
    return tuple(np.linalg.solve(design.jacobian_at_rest, pose).tolist())


def _at_voltage(mechanism: Mechanism, stack: Stack, voltage: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return elongations (3,) [m] and pose (3,) [m, m, rad] in equilibrium of hinges and stacks."""
    p, elongation, terms = mechanism.coordinates, mechanism.elongation, dynamics.terms(mechanism)
    pull = ca.inv(terms.slope[3:, :]).T @ terms.elastic + stack.stiffness * elongation
    residual = pull - stack.coupling * ca.DM(voltage)
    balance = newton(p, residual, np.zeros(3), f"rrr_stage: no equilibrium at {voltage} V")
    found = ca.Function("found", [p], [elongation, mechanism.pose])(balance)
    return np.array(found[0]).ravel(), np.array(found[1]).ravel()


def _frequencies(inertia: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Return the natural frequencies [Hz], ascending."""
    return modes(inertia, stiffness).omega / (2 * np.pi)
