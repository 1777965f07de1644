"""Pose of the SDelta robot at given motor angles, by following its motors from a known posture.

    theta(s) = theta_start + s (theta - theta_start), 0 <= s <= 1,    N dx = L J_L dtheta

Motor angles belong to several poses, the assemblies of the robot; it changes from one to another only through a
singularity, det N = 0. The pose is that of the assembly of the start, which by default is the symmetric posture: it is
followed along a straight line of motor angles in steps that cannot jump. A path that meets a singularity, or a tube at
the end of its travel, is refused with the share of it that is possible.
"""

from typing import Any

import numpy as np

from hfsa.components._mechanics.sdelta_direct import follow_motors
from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC, Posture, angles
from hfsa.components._mechanics.sdelta_kinematics import THESIS, Mechanism
from hfsa.components._mechanics.sdelta_numbers import assembly

UNITS = {
    "position": "m",
    "rotation": "rad",
    "attitude": "1",
    "posture": "1",
    "tube_slides": "m",
    "tube_angles": "rad",
    "limb_lengths": "m",
    "condition_number": "1",
    "determinant": "m3",
    "assembly": "1",
    "path_shares": "1",
    "path_condition_numbers": "1",
    "path_determinants": "m3",
}
"""Units of the numbers, in the notation of `_modelling/parts.py`."""

Motors = tuple[float, float, float, float, float, float]


def analyze(
    *,
    motors: Motors = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    start: Posture = SYMMETRIC,
    mechanism: Mechanism = THESIS,
) -> dict[str, Any]:
    """Return the pose of the rigid robot at motor angles, and how regular the path to it is.

    Args:
        motors: motor angles, 0 at the symmetric posture, in the order L1, R1, L2, R2, L3, R3 [rad].
        start: posture from where the motors turn; rotation in degrees, position of S in metres.
        mechanism: `geometry`, circumradii of the triangles of base and platform [m], `gear`, motor turns per turn of a
            tube, and `pitch`, travel of a nut per turn of its motor [m].

    Returns:
        position: position of S in the world frame, (3,) [m].
        rotation: angles of intrinsic rotations about z, x, y, (3,) [rad].
        attitude: Q, platform to world, (3, 3).
        posture: arguments of `analyze sdelta` for this pose.
        tube_slides, tube_angles: u_j [m] and phi_j [rad], (3,).
        limb_lengths: lengths of the limbs, (3,) [m].
        condition_number: condition number from platform to tubes, rotations weighted by the platform's radius.
        determinant: det N about S.
        assembly: in words, whether it is the assembly of the symmetric posture.
        path_shares: shares of the path at the ends of its steps, from 0 to 1, (n,).
        path_condition_numbers, path_determinants: condition number and det N there, of one sign, (n,).

    Raises:
        ModelError: a start that is singular or out of reach; a path that meets a singularity or the end of a tube's
            travel.
    """
    found = follow_motors(np.array(motors), start, mechanism)
    there = found.kinematics
    turned = angles(there.Q)
    return {
        "position": there.position,
        "rotation": np.deg2rad(turned),
        "attitude": there.Q,
        "posture": f"-p posture.rotation={_typed(turned)} -p posture.position={_typed(there.position)}",
        "tube_slides": there.limbs.slide,
        "tube_angles": there.limbs.angle,
        "limb_lengths": there.limbs.length,
        "condition_number": there.condition_number,
        "determinant": there.determinant,
        "assembly": assembly(there),
        "path_shares": found.shares,
        "path_condition_numbers": found.condition_numbers,
        "path_determinants": found.determinants,
    }


def _typed(values: np.ndarray) -> str:
    """Return numbers as an argument of the command line, to the last digits that matter."""
    return ",".join(f"{value:.12g}" if abs(value) > 1e-12 else "0" for value in values)
