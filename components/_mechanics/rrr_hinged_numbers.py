"""Numbers of `analyze rrr_stage` at level `flexible_hinges`: statics and dynamics on necks that give."""

from typing import Any

import numpy as np

from hfsa.components._mechanics.modes import modes
from hfsa.components._mechanics.pzt import Stack
from hfsa.components._mechanics.rrr_hinged import NECKS, Hinged
from hfsa.components._mechanics.rrr_limits import reached
from hfsa.components._mechanics.rrr_numbers import Triple, kinematic_numbers


def hinged_numbers(
    stage: Hinged, stack: Stack, elongation: Triple, voltage: Triple, resolution: float
) -> dict[str, Any]:
    """Return the results at elongations [m] and voltages [V], which are limited to the range of the stack."""
    lengths, K, J = np.array(elongation), stage.stiffness_on_stacks, stage.jacobian
    force, applied = K @ lengths, np.clip(voltage, 0, stack.full_voltage)
    at_voltage = np.linalg.solve(K + stack.stiffness * np.eye(3), stack.coupling * applied)
    deformed = stage.deformations @ np.concatenate([lengths, J @ lengths])
    stresses = np.array([max(stage.neck.stresses(*load)) for load in deformed * stage.neck.stiffness])
    along, across, bending = stage.neck.stiffness
    return {
        **kinematic_numbers(J, elongation, resolution),
        "hinge_stiffness": bending,
        "hinge_stiffness_along": along,
        "hinge_stiffness_across": across,
        "hinge_angle": dict(zip(NECKS, deformed[:, 2].tolist(), strict=True)),
        "hinge_stress": dict(zip(NECKS, stresses.tolist(), strict=True)),
        "allowed_stress": stage.neck.hinge.allowed_stress,
        "hinge_limit": _limit(stage, stresses, lengths),
        "inertia": stage.mass_on_stacks,
        "stiffness": K,
        "platform_stiffness_free": stage.stiffness_of_platform(0.0),
        "platform_stiffness_bonded": stage.stiffness_of_platform(stack.stiffness),
        "platform_stiffness_blocked": stage.stiffness[3:, 3:],
        "natural_frequencies_hz": _frequencies(stage.stiffness, stage.mass),
        "natural_frequencies_bonded_hz": _frequencies(*stage.on_stacks(stack.stiffness, stack.tip_mass)),
        "force": force,
        "voltage": (force + stack.stiffness * lengths) / stack.coupling,
        "elongation_at_voltage": at_voltage,
        "pose_at_voltage": J @ at_voltage,
        "saturated": (applied != voltage).astype(int),
    }


def _frequencies(stiffness: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Return the three lowest natural frequencies [Hz], ascending; those beyond are of levers between their necks."""
    return modes(mass, stiffness).omega[:3] / (2 * np.pi)


def _limit(stage: Hinged, stresses: np.ndarray, elongation: np.ndarray) -> str:
    """Return in words the neck of the largest stress, and from which elongations on it exceeds the allowable one."""
    worst, allowed = int(np.argmax(stresses)), stage.neck.hinge.allowed_stress
    stress = stresses[worst]
    if not stress:
        return f"no neck is stressed; {allowed / 1e6:.4g} MPa are allowable"
    said = f"neck {NECKS[worst]} is stressed most, by {stress / 1e6:.4g} MPa, {stress / allowed:.3g} of the allowable "
    return f"{said}{allowed / 1e6:.4g} MPa{reached(stress / allowed, elongation)}"
