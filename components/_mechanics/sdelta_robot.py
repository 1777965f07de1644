"""The SDelta robot at a posture: its dimensions, and its matrices with respect to the centre of mass C."""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from hfsa.components._mechanics.sdelta_geometry import Posture
from hfsa.components._mechanics.sdelta_inertia import THESIS_PLATFORM, Inertia, Payload, Platform, with_payload
from hfsa.components._mechanics.sdelta_kinematics import THESIS, Kinematics, Mechanism
from hfsa.components._mechanics.sdelta_limbs import THESIS_LIMBS, LimbInertia
from hfsa.components._mechanics.sdelta_stiffness import (
    THESIS_RODS,
    THESIS_SHAFTS,
    Rods,
    Shafts,
    Springs,
    limb_stiffness,
    paths,
    springs_of,
    stiffness,
)
from hfsa.components._modelling.arguments import ArgumentGroup
from hfsa.components._modelling.model import ModelError


@dataclass(frozen=True)
class Structure(ArgumentGroup):
    """Dimensions of what carries the platform; by default those of the thesis.

    Attributes:
        mechanism: triangles of base and platform, and transmission of the drives.
        rods, shafts: dimensions and material.
        platform: mass [kg] and moments of inertia [kg.m2] of the platform without payload.
    """

    mechanism: Mechanism = THESIS
    rods: Rods = THESIS_RODS
    shafts: Shafts = THESIS_SHAFTS
    platform: Platform = THESIS_PLATFORM

    def body(self, payload: Payload) -> Inertia:
        """Return the inertia of the platform with a payload."""
        return with_payload(payload, self.platform)

    def with_limbs(self, limbs: LimbInertia = THESIS_LIMBS) -> "Machine":
        """Return the robot with an inertia of its limbs."""
        return Machine(**{field.name: getattr(self, field.name) for field in fields(Structure)}, limbs=limbs)


@dataclass(frozen=True)
class Machine(Structure):
    """Dimensions of the robot; by default those of the thesis.

    Attributes:
        limbs: inertia of rotors, screws and tubes.
    """

    limbs: LimbInertia = THESIS_LIMBS

    @property
    def drive_inertia(self) -> np.ndarray:
        """M_th of all three drives on the motor angles, shape (6, 6) [kg.m2]."""
        return np.kron(np.eye(3), self.limbs.on_motors(self.mechanism.transmission))


THESIS_STRUCTURE, THESIS_MACHINE = Structure(), Machine()
"""Those of the thesis."""


@dataclass(frozen=True)
class Robot:
    """The robot at a posture; matrices are with respect to C, rotation first, world axes.

    Attributes:
        machine: its dimensions.
        kinematics: first-order kinematics.
        springs: stiffnesses of rods and shafts.
        body: inertia of platform and payload.
        extra_inertia: factor eps of the inertia of screws, tubes and rods at level `generalized`.
    """

    machine: Machine
    kinematics: Kinematics
    springs: Springs
    body: Inertia
    extra_inertia: float = 1.0

    @classmethod
    def at(
        cls, posture: Posture, preset: str, payload: Payload, machine: Machine, extra_inertia: float = 1.0
    ) -> "Robot":
        """Return the robot at a posture with a preset of stiffnesses and a payload.

        Raises:
            ModelError: a singular posture or one out of reach; rods that are longer than a limb; an unknown preset; an
                `extra_inertia` below 0.
        """
        if not (np.isfinite(extra_inertia) and extra_inertia >= 0):
            raise ModelError(f"extra_inertia is {extra_inertia:g}, expected a finite number, 0 or more")
        springs = springs_of(preset, machine.rods, machine.shafts)
        kinematics = Kinematics.at(posture, machine.mechanism)
        shortest = int(np.argmin(kinematics.limbs.length))
        if not kinematics.limbs.length[shortest] > machine.rods.length:
            raise ModelError(
                f"rods.length is {machine.rods.length:g} m, but limb {shortest + 1} is "
                f"{kinematics.limbs.length[shortest]:.4g} m long at this posture; expected a shorter rod"
            )
        return cls(machine, kinematics, springs, machine.body(payload), extra_inertia)

    @cached_property
    def offset(self) -> np.ndarray:
        """C - S, world axes, shape (3,) [m]."""
        return self.kinematics.Q @ self.body.center

    @cached_property
    def rows(self) -> np.ndarray:
        """N, rows of the limbs, shape (6, 6)."""
        return self.kinematics.rows(self.offset)

    @cached_property
    def limb_stiffness(self) -> np.ndarray:
        """K_D, stiffness at the joints, shape (6,) [N/m]."""
        return limb_stiffness(self.kinematics, self.springs)

    @cached_property
    def mass(self) -> np.ndarray:
        """M, mass matrix, shape (6, 6)."""
        return self.body.matrix(self.kinematics.Q)

    @cached_property
    def of_limbs(self) -> np.ndarray:
        """N^-1 D_J, from shafts and rod tips to the displacement of C, shape (6, 12)."""
        return np.linalg.solve(self.rows, paths(self.kinematics))

    @cached_property
    def stiffness(self) -> np.ndarray:
        """K, stiffness matrix, shape (6, 6)."""
        return stiffness(self.kinematics, self.springs, self.offset)
