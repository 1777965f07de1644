"""Elastostatic and elastodynamic numbers of the SDelta at a posture, in SI units, for `analyze`."""

from typing import Any

import numpy as np

from hfsa.components._mechanics import cartesian_numbers as cartesian
from hfsa.components._mechanics.modes import Damping, damping_rates, modes
from hfsa.components._mechanics.sdelta_generalized import generalized_modes, mass_matrix, ritz_mass
from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC
from hfsa.components._mechanics.sdelta_kinematics import Kinematics
from hfsa.components._mechanics.sdelta_robot import Robot
from hfsa.components._mechanics.sdelta_stiffness import paths, shafts_at_joints, spring_forces

UNITS = cartesian.units("_S", "_C", "_P", center="_C") | {
    "rod_stiffness": "N/m",
    "shaft_stiffness": "N.m/rad",
    "shaft_along": "N/m",
    "shaft_across": "N/m",
    "joint_stiffness": "N/m",
    "minimum_energy_S": "1, rad/m; 1, rad/m; m/rad, 1; m/rad, 1",
    "mode_shapes": "rad/m; 1",
    "generalized_mass": "kg.m2, kg.m; kg.m, kg",
    "ritz_frequencies_hz": "Hz",
    "ritz_excess": "1",
    "cartesian_frequencies_hz": "Hz",
    "cartesian_excess": "1",
    "relative_damping": "1",
    "motor_angles": "rad",
    "tube_slides": "m",
    "tube_angles": "rad",
    "limb_lengths": "m",
    "jacobian": "1; m/rad",
    "attitude": "1",
    "inertia_parameters_S": "kg; kg.m; kg.m; kg.m; kg.m2; kg.m2; kg.m2; kg.m2; kg.m2; kg.m2",
    "limb_rows_S": "m, 1",
    "drive_paths": "m/rad, 1",
    "condition_number": "1",
    "determinant": "m3",
    "assembly": "1",
    "regularity": "1",
}
"""Units of the numbers, in the notation of `_modelling/parts.py`."""

NEARLY_SINGULAR = 1e3
"""Condition number above which a posture is close to a singularity."""


def kinematic_numbers(robot: Robot) -> dict[str, Any]:
    """Return the coordinates of motors, tubes and limbs at the posture, N, D_J, the Jacobian and how regular it is."""
    limbs = robot.kinematics.limbs
    is_rounding = np.abs(limbs.slide) < np.finfo(float).eps * limbs.length  # exactly 0 at the symmetric posture
    return {
        "motor_angles": robot.kinematics.motor_angles,
        "tube_slides": np.where(is_rounding, 0.0, limbs.slide),
        "tube_angles": limbs.angle,
        "limb_lengths": limbs.length,
        "limb_rows_S": robot.kinematics.rows(),
        "drive_paths": paths(robot.kinematics),
        "jacobian": robot.kinematics.jacobian(),
        "attitude": robot.kinematics.Q,
        "inertia_parameters_S": robot.body.parameters,
        "condition_number": robot.kinematics.condition_number,
        "determinant": robot.kinematics.determinant,
        "assembly": assembly(robot.kinematics),
        "regularity": _regularity(robot.kinematics.condition_number),
    }


def elastostatic_numbers(robot: Robot, point: np.ndarray | None) -> dict[str, Any]:
    """Return the elastostatic properties of the platform on its limbs.

    `point` (3,) is a further point of reference P, from S in world axes [m].
    """
    length = robot.machine.mechanism.geometry.platform_radius
    return {**cartesian.static_numbers(robot.stiffness, _places(robot, point), length), **spring_numbers(robot)}


def elastodynamic_numbers(robot: Robot, point: np.ndarray | None, damping_model: Damping) -> dict[str, Any]:
    """Return the elastodynamic properties of the platform on its limbs without inertia; `point` as above."""
    length = robot.machine.mechanism.geometry.platform_radius
    found = cartesian.modal_numbers(robot.mass, robot.stiffness, _places(robot, point), "_C", length)
    omega = modes(robot.mass, robot.stiffness).omega
    return {**found, "relative_damping": damping_rates(omega, damping_model) / (2 * omega)}


def _places(robot: Robot, point: np.ndarray | None) -> dict[str, np.ndarray]:
    """Return the points of reference S, C and P by label, from C."""
    return {"_S": -robot.offset, "_C": np.zeros(3)} | ({} if point is None else {"_P": point - robot.offset})


def spring_numbers(robot: Robot) -> dict[str, Any]:
    """Return the stiffnesses of rods and shafts, alone and at the joints of the platform, and their deflections."""
    k, springs = shafts_at_joints(robot.kinematics, robot.springs), robot.springs
    return {
        "rod_stiffness": springs.rod,
        "shaft_stiffness": springs.shaft,
        "shaft_along": k[0::2],
        "shaft_across": k[1::2],
        "joint_stiffness": robot.limb_stiffness,
        "minimum_energy_S": springs.compliance[:, None] * spring_forces(robot.kinematics, springs, np.zeros(3)),
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
        "modal_screws_C": cartesian.unit_screws(
            robot.of_limbs @ found.shapes, robot.machine.mechanism.geometry.platform_radius
        ),
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


def warned(numbers: dict[str, Any]) -> dict[str, Any]:
    """Return the numbers, with the lowest frequency in the sentence on a posture close to a singularity."""
    if numbers["condition_number"] <= NEARLY_SINGULAR or "natural_frequencies_hz" not in numbers:
        return numbers
    lowest = f"; the lowest natural frequency falls to {numbers['natural_frequencies_hz'][0]:.3g} Hz"
    return {**numbers, "regularity": numbers["regularity"] + lowest}


def assembly(kinematics: Kinematics) -> str:
    """Return in words whether a pose may be reached from the symmetric one: det N has its sign, or the other one.

    Poses of the other sign are behind a singularity on every path.
    """
    mechanism = kinematics.mechanism
    home = Kinematics.of(SYMMETRIC.matrix, np.array(SYMMETRIC.position), mechanism)
    if kinematics.determinant * home.determinant > 0:
        return "that of the symmetric posture, by the sign of det N"
    return "another one than that of the symmetric posture: every path between them passes a singularity"


def _regularity(condition_number: float) -> str:
    """Return in words whether a posture is regular or close to a singularity."""
    if condition_number <= NEARLY_SINGULAR:
        return "regular"
    return f"close to a singularity: condition number {condition_number:.3g}, beyond {NEARLY_SINGULAR:g}"
