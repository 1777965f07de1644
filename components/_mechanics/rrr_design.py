"""Design of the 3-RRR stage: links, hinges and masses, or a Jacobian, a stiffness and an inertia in their place.

    constant_jacobian   pose = J l,  J given or that of the links
    stiffness, mass     K and M at rest on the elongations; what they have beyond those of the links and hinges is added
                        as constant springs and masses between the stacks, at both dynamic levels:

    P + l^T (K - K0) l / 2,    T + l'^T (M - M0) l' / 2

so that the changes of K and M over the elongations remain those of the links. The momentum of the links, by which an
acceleration of the base acts, is not changed.
"""

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from hfsa.components._mechanics import rrr_dynamics as dynamics
from hfsa.components._mechanics.rrr_dynamics import Mechanism
from hfsa.components._mechanics.rrr_hinge import THESIS_HINGE, Hinge
from hfsa.components._mechanics.rrr_kinematics import AS_NAMED, LinkChanges, Links, jacobian, links
from hfsa.components._mechanics.rrr_masses import THESIS_MASSES, Masses
from hfsa.components._modelling.model import ModelError

Matrix = tuple[float, float, float, float, float, float, float, float, float]
"""A matrix of shape (3, 3), row by row."""

_SYMMETRIC = 1e-9
"""Largest difference of a matrix and its transpose, relative to its largest element."""


@dataclass(frozen=True)
class Design:
    """Arguments of a stage; by default those of the source.

    Attributes:
        kinematics: parameter set of the links.
        changes: dimensions in place of those of the set.
        hinge: dimensions and material of the hinges.
        masses: masses of the links.
        given_jacobian: J in place of that of the links, row by row [m/m; m/m; rad/m].
        given_stiffness: stiffness on the elongations at rest, row by row [N/m].
        given_mass: inertia on the elongations at rest, row by row [kg].

    Raises:
        ModelError: a given Jacobian that is singular; a given stiffness or mass that is not symmetric and positive
            definite.
    """

    kinematics: str = "nominal"
    changes: LinkChanges = AS_NAMED
    hinge: Hinge = THESIS_HINGE
    masses: Masses = THESIS_MASSES
    given_jacobian: Matrix | None = None
    given_stiffness: Matrix | None = None
    given_mass: Matrix | None = None

    def __post_init__(self):
        if self.given_jacobian is not None:
            J = _matrix("jacobian", self.given_jacobian)
            if np.linalg.matrix_rank(J / np.linalg.norm(J, axis=1, keepdims=True).clip(1e-300)) < 3:
                raise ModelError(f"jacobian is {J.tolist()}, which is singular; expected three independent rows")
        for name, given, unit in (("stiffness", self.given_stiffness, "N/m"), ("mass", self.given_mass, "kg")):
            if given is not None:
                _check_definite(name, _matrix(name, given), unit)

    @cached_property
    def links(self) -> Links:
        """Links at rest; `ModelError` for a set without, or links that do not close."""
        return links(self.kinematics, self.changes)

    @cached_property
    def jacobian(self) -> np.ndarray:
        """J from elongations to pose, shape (3, 3) [m/m; m/m; rad/m]."""
        if self.given_jacobian is not None:
            return _matrix("jacobian", self.given_jacobian)
        return jacobian(self.kinematics, self.changes)

    def mechanism(self, level: str, coordinates: ca.SX, rates: ca.SX) -> Mechanism:
        """Return the mechanism at level `constant_jacobian` or `exact` over symbols (3, 1) of coordinates and rates.

        Raises:
            ModelError: a given Jacobian at level `exact`, as that is a function of the links.
        """
        built = self._of_links(level, coordinates, rates)
        if self.given_stiffness is None and self.given_mass is None:
            return built
        mass, stiffness = self._at_rest
        length, speed = built.parts[3:], built.part_rates[3:]
        if self.given_mass is not None:
            more = ca.DM(_matrix("mass", self.given_mass) - mass)
            built = built._replace(kinetic=built.kinetic + speed.T @ more @ speed / 2)
        if self.given_stiffness is not None:
            more = ca.DM(_matrix("stiffness", self.given_stiffness) - stiffness)
            built = built._replace(springs=length.T @ more @ length / 2)
        return built

    @cached_property
    def rest_stiffness(self) -> np.ndarray:
        """K0 = d2P/dl2 at rest, the same at both dynamic levels, shape (3, 3) [N/m]."""
        return self._at_rest[1] if self.given_stiffness is None else _matrix("stiffness", self.given_stiffness)

    def _of_links(self, level: str, coordinates: ca.SX, rates: ca.SX) -> Mechanism:
        """Return the mechanism of links, hinges and masses."""
        arguments = (self.links, coordinates, rates, self.hinge, self.masses)
        if level != "exact":
            return dynamics.constant_jacobian(*arguments, self.jacobian)
        if self.given_jacobian is not None:
            raise ModelError(
                "a jacobian is given, but at level exact it follows from the links; take constant_jacobian"
            )
        return dynamics.exact(*arguments)

    @cached_property
    def _at_rest(self) -> tuple[np.ndarray, np.ndarray]:
        """M0 and K0 of links, hinges and masses at rest, on the elongations."""
        p, v = ca.SX.sym("p", 3), ca.SX.sym("v", 3)
        terms = dynamics.terms(self._of_links("constant_jacobian", p, v))
        found = ca.Function("rest", [p], [terms.mass, ca.jacobian(terms.elastic, p)])(0)
        return np.array(found[0]), np.array(found[1])


def _matrix(name: str, values: Matrix) -> np.ndarray:
    """Return nine numbers as a matrix (3, 3); `ModelError` unless they are finite."""
    if len(values) != 9 or not np.all(np.isfinite(values)):
        raise ModelError(f"{name} is {values}, expected nine finite numbers, row by row")
    return np.array(values, dtype=float).reshape(3, 3)


def _check_definite(name: str, matrix: np.ndarray, unit: str) -> None:
    """Raise `ModelError` unless a matrix is symmetric and positive definite."""
    if np.abs(matrix - matrix.T).max() > _SYMMETRIC * np.abs(matrix).max():
        raise ModelError(f"{name} is {matrix.tolist()} {unit}, expected a symmetric matrix")
    lowest = np.linalg.eigvalsh(matrix)[0]
    if not lowest > 0:
        raise ModelError(f"{name} has the eigenvalue {lowest:g} {unit}, expected all above 0")
