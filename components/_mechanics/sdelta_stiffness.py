"""Stiffness of the SDelta robot: bending of the rods at their tips, and torsion of the shafts of the C-drives.

The twists psi of the shafts and the tip deflections gamma of the rods, q = [psi; gamma], are springs in series,

    N dx = D_J q,  D_J = [L J_L, 1],    K_q = diag(k_s 1, k_r 1)                                  (eqs 3.18, 3.20)
    K_D = (D_J K_q^-1 D_J^T)^-1, diagonal,    K = N^T K_D N                                              (eq 3.27)

The limb carries no force along its own axis.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from hfsa.components._mechanics.sdelta_kinematics import DRIVES_MATRIX, Kinematics
from hfsa.components._modelling.model import ModelError

_ROD_LENGTH = 0.115
_ROD_DIAMETER = 0.0115
_TITANIUM_MODULUS = 105e9
_ROD_BEAM = 3 * _TITANIUM_MODULUS * (np.pi * _ROD_DIAMETER**4 / 64) / _ROD_LENGTH**3
"""Tip stiffness of the rod as a beam, 3 E I / l^3 [N/m] (eq 3.8; E inferred from eqs 4.34 and 4.47)."""
_ROD_FEA = 100 / 6.6506e-4
"""Tip stiffness of the rod by finite elements, 100 N over its deflection [N/m] (eq 3.49)."""

_SHAFT_LENGTH = 0.040
_SHAFT_DIAMETER = 0.016
_STEEL_SHEAR_MODULUS = 75e9
_SHAFT = _STEEL_SHEAR_MODULUS * (np.pi * _SHAFT_DIAMETER**4 / 32) / _SHAFT_LENGTH
"""Torsional stiffness of the motor shaft alone [N.m/rad] (eqs 3.50, 3.51)."""
_COUPLING = 3400.0
"""Torsional stiffness of the coupling [N.m/rad] (eq 3.52)."""
_DRIVE = _SHAFT * _COUPLING / (_SHAFT + _COUPLING)
"""Shaft and coupling in series [N.m/rad] (eq 3.53)."""


@dataclass(frozen=True)
class Springs:
    """Stiffnesses of the elastic elements of the robot.

    Attributes:
        rod: tip stiffness k_r of each rod, in either direction [N/m].
        shaft: torsional stiffness k_s of each motor shaft with its coupling [N.m/rad]; infinite for a rigid one.

    Raises:
        ModelError: a stiffness that is not positive.
    """

    rod: float
    shaft: float = np.inf

    def __post_init__(self):
        for name, value in (("rod", self.rod), ("shaft", self.shaft)):
            if not value > 0:
                raise ModelError(f"stiffness of the {name} is {value}, expected a positive number")

    @property
    def compliance(self) -> np.ndarray:
        """Diagonal of K_q^-1, six shafts and six rod tips, shape (12,) [rad/(N.m) and m/N]."""
        return np.repeat([1 / self.shaft, 1 / self.rod], 6)


Preset = Literal["ch3_full", "ch3_rods", "ch4", "ch4_full"]

PRESETS: dict[str, Springs] = {
    "ch3_full": Springs(_ROD_FEA, _DRIVE),
    "ch3_rods": Springs(_ROD_FEA),
    "ch4": Springs(_ROD_BEAM),
    "ch4_full": Springs(_ROD_BEAM, _DRIVE),
}
"""Sets of stiffnesses in the thesis: chapter 3 with and without the shafts, chapter 4 without and with the shafts.

Chapter 4 includes the rods alone, as beams; this is inferred from its matrices (eqs 4.34, 4.47).
"""


def limb_stiffness(kinematics: Kinematics, springs: Springs) -> np.ndarray:
    """Return the diagonal of K_D, stiffness at the joints along e_c and e_n by limb, shape (6,) [N/m] (eq 3.29)."""
    return 1 / (_paths(kinematics) ** 2 @ springs.compliance)


def stiffness(kinematics: Kinematics, springs: Springs, offset: np.ndarray) -> np.ndarray:
    """Return K = N^T K_D N about the reference point S + `offset`, shape (6, 6) (eq 3.27)."""
    N = kinematics.rows(offset)
    return N.T @ (limb_stiffness(kinematics, springs)[:, None] * N)


def spring_forces(kinematics: Kinematics, springs: Springs, offset: np.ndarray) -> np.ndarray:
    """Return the torques of the shafts and the forces at the rod tips per displacement of S + `offset`, shape (12, 6).

    G = D_J^T (D_J K_q^-1 D_J^T)^-1 N. The deflections of minimum energy are K_q^-1 G, from which the stiffness follows
    independently as K = G^T K_q^-1 G (eq 3.24).
    """
    D_J = _paths(kinematics)
    return D_J.T @ np.linalg.solve(D_J * springs.compliance @ D_J.T, kinematics.rows(offset))


def _paths(kinematics: Kinematics) -> np.ndarray:
    """Return D_J, shape (6, 12)."""
    return np.hstack([kinematics.lever[:, None] * DRIVES_MATRIX, np.eye(6)])
