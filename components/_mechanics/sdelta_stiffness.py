"""Stiffness of the SDelta robot: bending of the rods at their tips, and torsion of the shafts of the C-drives.

The twists psi of the shafts and the tip deflections gamma of the rods, q = [psi; gamma], are springs in series,

    N dx = D_J q,  D_J = [L J_L, 1],    K_q = diag(k_s 1, k_r 1)                                  (eqs 3.18, 3.20)
    K_D = (D_J K_q^-1 D_J^T)^-1, diagonal,    K = N^T K_D N                                              (eq 3.27)

The limb carries no force along its own axis.
"""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from hfsa.components._mechanics.sdelta_geometry import require_positive
from hfsa.components._mechanics.sdelta_kinematics import Kinematics
from hfsa.components._modelling.model import ModelError, one_of


@dataclass(frozen=True)
class Rods:
    """Rods of the limbs, clamped in the tubes; by default those of the thesis, of titanium (eq 3.48).

    Attributes:
        length: free length l_r [m].
        diameter: diameter d_r [m].
        elastic_modulus: Young's modulus E [Pa] (inferred from eqs 4.34 and 4.47).
        density: density [kg/m3] (assumed).
        tip_stiffness: stiffness k_r of a tip across the rod [N/m] (default: that of the preset).

    Raises:
        ModelError: a value that is not positive and finite.
    """

    length: float = 0.115
    diameter: float = 0.0115
    elastic_modulus: float = 105e9
    density: float = 4500.0
    tip_stiffness: float | None = None

    def __post_init__(self):
        require_positive(self, "rods", "m", "m", "Pa", "kg/m3", "N/m")

    @property
    def as_beam(self) -> float:
        """Tip stiffness of a beam, 3 E I / l_r^3 [N/m] (eq 3.8)."""
        return 3 * self.elastic_modulus * (np.pi * self.diameter**4 / 64) / self.length**3

    @property
    def mass(self) -> float:
        """Mass of a rod [kg]."""
        return self.density * np.pi / 4 * self.diameter**2 * self.length


THESIS_RODS = Rods()
"""The rods of the thesis."""
_FINITE_ELEMENTS = 100 / 6.6506e-4 / THESIS_RODS.as_beam
"""Tip stiffness by finite elements, 100 N over the deflection of the thesis' rod (eq 3.49), over that of a beam."""


@dataclass(frozen=True)
class Shafts:
    """Motor shafts with their couplings; by default those of the thesis, of steel (eqs 3.50, 3.52).

    Attributes:
        length: length l_s [m].
        diameter: diameter d_s [m].
        shear_modulus: shear modulus G [Pa].
        coupling: torsional stiffness k_2 of the coupling [N.m/rad].

    Raises:
        ModelError: a value that is not positive and finite.
    """

    length: float = 0.040
    diameter: float = 0.016
    shear_modulus: float = 75e9
    coupling: float = 3400.0

    def __post_init__(self):
        require_positive(self, "shafts", "m", "m", "Pa", "N.m/rad")

    @property
    def alone(self) -> float:
        """Torsional stiffness k_1 of a shaft without its coupling [N.m/rad] (eq 3.51)."""
        return self.shear_modulus * (np.pi * self.diameter**4 / 32) / self.length

    @property
    def stiffness(self) -> float:
        """Torsional stiffness k_s of shaft and coupling in series [N.m/rad] (eq 3.53)."""
        return self.alone * self.coupling / (self.alone + self.coupling)


THESIS_SHAFTS = Shafts()
"""The shafts of the thesis."""


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

RODS_ONLY = ("ch3_rods", "ch4")
"""Presets with rigid shafts."""

PRESETS = get_args(Preset)
"""Sets of stiffnesses in the thesis: chapter 3 with and without the shafts, chapter 4 without and with the shafts.

Chapter 4 includes the rods alone, as beams; this is inferred from its matrices (eqs 4.34, 4.47). Chapter 3 takes the
rods by finite elements; that factor, 0.846, is kept for other rods.
"""


def springs_of(preset: str, rods: Rods = THESIS_RODS, shafts: Shafts = THESIS_SHAFTS) -> Springs:
    """Return the stiffnesses of rods and shafts by a preset; `ModelError` for an unknown one."""
    one_of(preset, PRESETS, "stiffness")
    tip = rods.as_beam * (_FINITE_ELEMENTS if preset.startswith("ch3") else 1.0)
    return Springs(rods.tip_stiffness or tip, np.inf if preset in RODS_ONLY else shafts.stiffness)


def limb_stiffness(kinematics: Kinematics, springs: Springs) -> np.ndarray:
    """Return the diagonal of K_D, stiffness at the joints along e_c and e_n by limb, shape (6,) [N/m] (eq 3.29)."""
    return 1 / (paths(kinematics) ** 2 @ springs.compliance)


def shafts_at_joints(kinematics: Kinematics, springs: Springs) -> np.ndarray:
    """Return k'_s and k''_s by limb, stiffness of the shafts at the joints, shape (6,) [N/m] (eqs 3.26c, 3.55).

    It is infinite for rigid shafts.
    """
    compliance = paths(kinematics)[:, :6] ** 2 @ springs.compliance[:6]
    return np.divide(1.0, compliance, out=np.full(6, np.inf), where=compliance > 0)


def stiffness(kinematics: Kinematics, springs: Springs, offset: np.ndarray) -> np.ndarray:
    """Return K = N^T K_D N about the reference point S + `offset`, shape (6, 6) (eq 3.27)."""
    N = kinematics.rows(offset)
    return N.T @ (limb_stiffness(kinematics, springs)[:, None] * N)


def spring_forces(kinematics: Kinematics, springs: Springs, offset: np.ndarray) -> np.ndarray:
    """Return the torques of the shafts and the forces at the rod tips per displacement of S + `offset`, shape (12, 6).

    G = D_J^T (D_J K_q^-1 D_J^T)^-1 N. The deflections of minimum energy are K_q^-1 G, from which the stiffness follows
    independently as K = G^T K_q^-1 G (eq 3.24).
    """
    D_J = paths(kinematics)
    return D_J.T @ np.linalg.solve(D_J * springs.compliance @ D_J.T, kinematics.rows(offset))


def paths(kinematics: Kinematics) -> np.ndarray:
    """Return D_J, shape (6, 12)."""
    return np.hstack([kinematics.lever[:, None] * kinematics.mechanism.drives_matrix, np.eye(6)])
