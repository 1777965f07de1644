"""Elastostatic and elastodynamic numbers of the SDelta at a posture, in SI units, for `analyze`."""

from typing import Any

import numpy as np

from hfsa.components._mechanics.elastostatics import eigenscrews, rms, twist_compliant_axes, wrench_compliant_axes
from hfsa.components._mechanics.modes import Damping, damping_rates, frequency_matrix, modes
from hfsa.components._mechanics.screws import shift, unit_screw
from hfsa.components._mechanics.sdelta_generalized import generalized_modes, mass_matrix, ritz_mass
from hfsa.components._mechanics.sdelta_robot import Robot

UNITS = {
    "stiffness_S": "N.m/rad, N; N, N/m",
    "stiffness_C": "N.m/rad, N; N, N/m",
    "mass_C": "kg.m2, kg.m; kg.m, kg",
    "frequency_matrix_C": "rad/s",
    "natural_frequencies_hz": "Hz",
    "mode_shapes": "rad/m; 1",
    "generalized_mass": "kg.m2, kg.m; kg.m, kg",
    "ritz_excess": "1",
    "cartesian_excess": "1",
    "ritz_frequencies_hz": "Hz",
    "cartesian_frequencies_hz": "Hz",
    "relative_damping": "1",
    "modal_screws_C": "1; m",
    "eigenstiffness": "N",
    "eigenpitch": "m",
    "translational_stiffness": "N/m",
    "torsional_stiffness": "N.m/rad",
    "kappa": "N",
    "kappa_t": "N/m",
    "kappa_r": "N.m/rad",
    "motor_angles": "rad",
    "tube_slides": "m",
    "tube_angles": "rad",
    "limb_lengths": "m",
    "jacobian": "1; m/rad",
    "attitude": "1",
    "inertia_parameters_S": "kg; kg.m; kg.m; kg.m; kg.m2; kg.m2; kg.m2; kg.m2; kg.m2; kg.m2",
}
"""Units of the numbers, in the notation of `_modelling/parts.py`."""


def kinematic_numbers(robot: Robot) -> dict[str, Any]:
    """Return the coordinates of motors, tubes and limbs at the posture, and the Jacobian of the motors."""
    limbs = robot.kinematics.limbs
    is_rounding = np.abs(limbs.slide) < np.finfo(float).eps * limbs.length  # exactly 0 at the symmetric posture
    return {
        "motor_angles": robot.kinematics.motor_angles,
        "tube_slides": np.where(is_rounding, 0.0, limbs.slide),
        "tube_angles": limbs.angle,
        "limb_lengths": limbs.length,
        "jacobian": robot.kinematics.jacobian(),
        "attitude": robot.kinematics.Q,
        "inertia_parameters_S": robot.body.parameters,
    }


def elastic_numbers(robot: Robot, damping_model: Damping) -> dict[str, Any]:
    """Return the elastostatic and elastodynamic properties of the platform on its limbs without inertia."""
    to_C = shift(-robot.offset)
    K_S = to_C.T @ robot.stiffness @ to_C
    screws = eigenscrews(K_S)
    translational, torsional = wrench_compliant_axes(K_S).stiffness, twist_compliant_axes(K_S).stiffness
    omega, shapes = modes(robot.mass, robot.stiffness)
    return {
        "stiffness_S": K_S,
        "stiffness_C": robot.stiffness,
        "mass_C": robot.mass,
        "frequency_matrix_C": frequency_matrix(robot.mass, robot.stiffness),
        "natural_frequencies_hz": omega / (2 * np.pi),
        "relative_damping": damping_rates(omega, damping_model) / (2 * omega),
        "modal_screws_C": _unit_screws(robot, shapes),
        "eigenstiffness": screws.stiffness,
        "eigenpitch": screws.pitch,
        "translational_stiffness": translational,
        "torsional_stiffness": torsional,
        "kappa": rms(screws.stiffness),
        "kappa_t": rms(translational),
        "kappa_r": rms(torsional),
    }


def generalized_numbers(robot: Robot, damping_model: Damping) -> dict[str, Any]:
    """Return the modes of shafts and rods with the inertia of the limbs, beside those of six degrees of freedom."""
    M_E = mass_matrix(robot)
    found = generalized_modes(robot, M_E)
    six, ritz = modes(robot.mass, robot.stiffness).omega, modes(ritz_mass(robot, M_E), robot.stiffness).omega
    return {
        "natural_frequencies_hz": found.omega / (2 * np.pi),
        "relative_damping": _finite_ratios(found.omega, damping_model),
        "mode_shapes": found.shapes,
        "modal_screws_C": _unit_screws(robot, robot.of_limbs @ found.shapes),
        "ritz_frequencies_hz": ritz / (2 * np.pi),
        "ritz_excess": ritz / found.omega[:6] - 1,
        "cartesian_frequencies_hz": six / (2 * np.pi),
        "cartesian_excess": six / found.omega[:6] - 1,
        "generalized_mass": M_E,
    }


def _finite_ratios(omega: np.ndarray, damping_model: Damping) -> np.ndarray:
    """Return the damping ratios of modes over the given one; that of a mode without inertia is not defined, NaN."""
    finite = np.isfinite(omega)
    ratios = np.full(len(omega), np.nan)
    ratios[finite] = damping_rates(omega[finite], damping_model) / (2 * omega[finite])
    return ratios


def _unit_screws(robot: Robot, shapes: np.ndarray) -> np.ndarray:
    """Return displacements, columns of six, as screws of unit rotation or, without any, of unit translation."""
    radius = robot.machine.geometry.platform_radius
    return np.column_stack([unit_screw(column, radius) for column in shapes.T])
