"""The 3-RRR stage by plain arithmetic: planar linkage, hinges and bodies, with derivatives by central differences."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import fsolve

POLAR = np.radians([120.0, 0.0, -120.0])


@dataclass(frozen=True)
class Linkage:
    """Dimensions of a stage in SI units, with the letters of the source."""

    L_AB: float
    L_BC: float
    R: float
    psi1: float
    psi2: float
    R0: float
    E: float
    b: float
    t: float
    r: float
    M_e: float
    I_e: float
    M_ab: float
    I_ab: float
    M_bc: float

    @property
    def K_b(self) -> float:  # noqa: N802 (the source's letter)
        """Stiffness of a hinge [N.m/rad] (eq 2.3)."""
        return 2 * self.E * self.b * self.t**2.5 / (9 * np.pi * self.r**0.5)

    @cached_property
    def rest(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A, B, C as complex numbers, (3,) each, by the triangle A B C of each leg and its sides."""
        C = self.R * np.exp(1j * POLAR)
        # law of cosines for A C from the angle psi2 at C, with A B on the far side
        half = self.L_BC * np.cos(self.psi2)
        diagonal = half + np.sqrt(self.L_AB**2 - (self.L_BC * np.sin(self.psi2)) ** 2)
        A = C - diagonal * np.exp(1j * (self.psi1 + POLAR))
        B = C - self.L_BC * np.exp(1j * (self.psi1 + self.psi2 + POLAR))
        return A, B, C

    def elongations(self, pose: np.ndarray) -> np.ndarray:
        """Return l (3,) at a pose, by the law of cosines of each leg."""
        A, B, C = self.rest
        diagonal = pose[0] + 1j * pose[1] + C * np.exp(1j * pose[2]) - A

        def direction(side: np.ndarray) -> np.ndarray:
            cosine = (self.L_AB**2 + np.abs(side) ** 2 - self.L_BC**2) / (2 * self.L_AB * np.abs(side))
            return np.exp(-1j * np.arccos(cosine)) * side / np.abs(side)

        return -self.R0 * np.angle(direction(diagonal) / ((B - A) / self.L_AB))

    def pose(self, elongation: np.ndarray) -> np.ndarray:
        """Return the pose (3,) at elongations."""
        scale = np.array([1e-5, 1e-5, 1e-3])

        def miss(scaled: np.ndarray) -> np.ndarray:
            return (self.elongations(scale * scaled) - elongation) / 1e-5

        return scale * fsolve(miss, np.zeros(3), xtol=1e-13)

    def turns(self, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the turns of cranks and couplers (3,) each [rad]."""
        A, B, C = self.rest
        cranks = -self.elongations(pose) / self.R0
        at_B = A + (B - A) * np.exp(1j * cranks)
        couplers = np.angle((pose[0] + 1j * pose[1] + C * np.exp(1j * pose[2]) - at_B) / (C - B))
        return cranks, couplers

    def hinges(self, pose: np.ndarray) -> np.ndarray:
        """Return the angles of A1, A2, A3, B1, ..., C3 from rest (9,) [rad]."""
        cranks, couplers = self.turns(pose)
        return np.concatenate([cranks, cranks - couplers, couplers - pose[2]])

    def places(self, pose: np.ndarray) -> np.ndarray:
        """Return what the masses move with, x, y, yaw, cranks, couplers' middles and turns, (15,)."""
        A, B, C = self.rest
        cranks, couplers = self.turns(pose)
        at_B = A + (B - A) * np.exp(1j * cranks)
        middle = (at_B + pose[0] + 1j * pose[1] + C * np.exp(1j * pose[2])) / 2
        return np.concatenate([pose, cranks, middle.real, middle.imag, couplers])

    @cached_property
    def jacobian(self) -> np.ndarray:
        """J0, (3, 3)."""
        return np.linalg.inv(derivative(self.elongations))

    @cached_property
    def mass(self) -> np.ndarray:
        """M on the elongations at rest, (3, 3) [kg]."""
        rod = self.M_bc * self.L_BC**2 / 12
        weights = [self.M_e, self.M_e, self.I_e, *[self.I_ab] * 3, *[self.M_bc] * 6, *[rod] * 3]
        slopes = derivative(self.places) @ self.jacobian
        return slopes.T @ np.diag(weights) @ slopes

    @cached_property
    def stiffness(self) -> np.ndarray:
        """K on the elongations at rest, (3, 3) [N/m]."""
        slopes = derivative(self.hinges) @ self.jacobian
        return self.K_b * slopes.T @ slopes

    def force(self, elongation: np.ndarray) -> np.ndarray:
        """Return the forces (3,) [N] that hold the elongations, by the gradient of the energy."""
        pose = self.pose(elongation)
        to_pose = np.linalg.inv(derivative(self.elongations, pose))
        return to_pose.T @ (self.K_b * derivative(self.hinges, pose).T @ self.hinges(pose))


def derivative(function, at: np.ndarray | None = None) -> np.ndarray:
    """Return the derivatives of a function of a pose by central differences, (n, 3)."""
    at, steps = np.zeros(3) if at is None else at, np.diag([1e-6, 1e-6, 1e-4])
    return np.column_stack([(function(at + s) - function(at - s)) / (2 * s.sum()) for s in steps])


def frequencies(mass: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Return the natural frequencies, ascending [Hz]."""
    return np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real)) / (2 * np.pi)
