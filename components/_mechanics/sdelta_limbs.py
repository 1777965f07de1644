"""Inertia of the limbs of the SDelta: rotors, screws and tubes of its C-drives."""

from dataclasses import dataclass

import numpy as np

from hfsa.components._mechanics.sdelta_kinematics import Transmission
from hfsa.components._modelling.model import ModelError


@dataclass(frozen=True)
class LimbInertia:
    """Inertia of the moving parts of a limb, but for its rod.

    Attributes:
        rotor_inertia: J_m of the rotor of a motor, by default Yaskawa SGMAH-08A [kg.m2] (manufacturer's catalogue).
        screw_inertia: J_psi of screw, half of the coupling and nut, on the shaft's angle [kg.m2] (assumed).
        tube_mass: m_tube [kg] (assumed).
        tube_inertia: I_tube about the C axis [kg.m2] (assumed).

    Raises:
        ModelError: a rotor without inertia; another value that is negative; a value that is not finite.
    """

    rotor_inertia: float = 0.672e-4
    screw_inertia: float = 1.0e-4
    tube_mass: float = 1.0
    tube_inertia: float = 3.0e-3

    def __post_init__(self):
        values = {"screw_inertia": self.screw_inertia, "tube_mass": self.tube_mass, "tube_inertia": self.tube_inertia}
        if not (np.isfinite(self.rotor_inertia) and self.rotor_inertia > 0):
            raise ModelError(f"limbs.rotor_inertia is {self.rotor_inertia:g} kg.m2, expected a finite number above 0")
        for name, value in values.items():
            if not (np.isfinite(value) and value >= 0):
                raise ModelError(f"limbs.{name} is {value:g}, expected a finite number, 0 or more")

    @property
    def tube(self) -> np.ndarray:
        """Inertia of the tube on slide and angle, shape (2, 2) [kg, kg.m2]."""
        return np.diag([self.tube_mass, self.tube_inertia])

    def on_motors(self, transmission: Transmission) -> np.ndarray:
        """Return M_th of one drive on its two motor angles, rotors, screws and tube, shape (2, 2) [kg.m2]."""
        J_C = transmission.matrix
        return (self.rotor_inertia + self.screw_inertia) * np.eye(2) + J_C.T @ self.tube @ J_C


THESIS_LIMBS = LimbInertia()
"""Limbs of the thesis' motors with assumed screws and tubes."""
