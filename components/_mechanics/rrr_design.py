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
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._mechanics import rrr_dynamics as dynamics
from hfsa.components._mechanics.rrr_dynamics import Mechanism
from hfsa.components._mechanics.rrr_hinge import THESIS_HINGE, Hinge
from hfsa.components._mechanics.rrr_kinematics import AS_NAMED, KinematicsSet, LinkChanges, Links, jacobian, links
from hfsa.components._mechanics.rrr_masses import THESIS_MASSES, Masses
from hfsa.components._modelling.arguments import ArgumentGroup
from hfsa.components._modelling.model import ModelError

Matrix = tuple[float, float, float, float, float, float, float, float, float]
"""A matrix of shape (3, 3), row by row."""

_SYMMETRIC = 1e-9
"""Largest difference of a matrix and its transpose, relative to its largest element."""


class Tuned(NamedTuple):
    """Hinges and masses, numbers or expressions: stiffness of each hinge [N.m/rad], and the attributes of `Masses`."""

    hinge_stiffness: Any
    masses: Any


@dataclass(frozen=True)
class Dimensions(ArgumentGroup):
    """Links, hinges and masses of a stage; by default those of the source.

    Attributes:
        kinematics: parameter set of the links, or the .toml file of one; `measured` is a Jacobian without links.
        links: lengths [m] and angles [rad] in place of those of the set.
        hinge: dimensions [m] and material [Pa] of the hinges.
        masses: masses [kg] and moments of inertia [kg.m2] of the links.
    """

    kinematics: KinematicsSet = "nominal"
    links: LinkChanges = AS_NAMED
    hinge: Hinge = THESIS_HINGE
    masses: Masses = THESIS_MASSES

    @cached_property
    def links_at_rest(self) -> Links:
        """Links at rest; `ModelError` for a set without, or links that do not close."""
        return links(self.kinematics, self.links)


@dataclass(frozen=True)
class Design(Dimensions):
    """Dimensions of a stage, and matrices in place of those that follow from them.

    Attributes:
        jacobian: Jacobian from elongations to pose, nine numbers row by row [m/m; m/m; rad/m].
        stiffness: stiffness on the elongations at rest, nine numbers row by row [N/m].
        mass: inertia on the elongations at rest, nine numbers row by row [kg]. What an acceleration of the base acts on
            is not changed.

    Raises:
        ModelError: a Jacobian that is singular; a stiffness or mass that is not symmetric and positive definite.
    """

    jacobian: Matrix | None = None
    stiffness: Matrix | None = None
    mass: Matrix | None = None

    def __post_init__(self):
        if self.jacobian is not None:
            J = matrix("jacobian", self.jacobian)
            if np.linalg.matrix_rank(J / np.linalg.norm(J, axis=1, keepdims=True).clip(1e-300)) < 3:
                raise ModelError(f"jacobian is {J.tolist()}, which is singular; expected three independent rows")
        for name, given, unit in (("stiffness", self.stiffness, "N/m"), ("mass", self.mass, "kg")):
            if given is not None:
                _check_definite(name, matrix(name, given), unit)

    @cached_property
    def jacobian_at_rest(self) -> np.ndarray:
        """J from elongations to pose, shape (3, 3) [m/m; m/m; rad/m]."""
        if self.jacobian is not None:
            return matrix("jacobian", self.jacobian)
        return jacobian(self.kinematics, self.links)

    def mechanism(self, level: str, coordinates: ca.SX, rates: ca.SX, tuned: "Tuned | None" = None) -> Mechanism:
        """Return the mechanism at level `constant_jacobian` or `exact` over symbols (3, 1) of coordinates and rates.

        `tuned` are hinges and masses in place of those of the design. What given matrices add remains that to the
        design's own.

        Raises:
            ModelError: a given Jacobian at level `exact`, as that is a function of the links.
        """
        built = self._of_links(level, coordinates, rates, tuned or Tuned(self.hinge.stiffness, self.masses))
        if self.stiffness is None and self.mass is None:
            return built
        mass, stiffness = self._at_rest
        length, speed = built.parts[3:], built.part_rates[3:]
        if self.mass is not None:
            more = ca.DM(matrix("mass", self.mass) - mass)
            built = built._replace(kinetic=built.kinetic + speed.T @ more @ speed / 2)
        if self.stiffness is not None:
            more = ca.DM(matrix("stiffness", self.stiffness) - stiffness)
            built = built._replace(springs=length.T @ more @ length / 2)
        return built

    @cached_property
    def stiffness_at_rest(self) -> np.ndarray:
        """K0 = d2P/dl2 at rest, the same at both dynamic levels, shape (3, 3) [N/m]."""
        return self._at_rest[1] if self.stiffness is None else matrix("stiffness", self.stiffness)

    def tuned_stiffness(self, hinge: ca.SX) -> ca.SX:
        """Return K0 at rest, shape (3, 3) [N/m], with another stiffness of the hinges [N.m/rad]."""
        links = self._at_rest[1]
        return ca.DM(self.stiffness_at_rest - links) + hinge / self.hinge.stiffness * ca.DM(links)

    def _of_links(self, level: str, coordinates: ca.SX, rates: ca.SX, parts: "Tuned") -> Mechanism:
        """Return the mechanism of links, hinges and masses."""
        arguments = (self.links_at_rest, coordinates, rates, parts.hinge_stiffness, parts.masses)
        if level != "exact":
            return dynamics.constant_jacobian(*arguments, self.jacobian_at_rest)
        if self.jacobian is not None:
            raise ModelError(
                "a jacobian is given, but at level exact it follows from the links; take constant_jacobian"
            )
        return dynamics.exact(*arguments)

    @cached_property
    def _at_rest(self) -> tuple[np.ndarray, np.ndarray]:
        """M0 and K0 of links, hinges and masses at rest, on the elongations."""
        p, v = ca.SX.sym("p", 3), ca.SX.sym("v", 3)
        terms = dynamics.terms(self._of_links("constant_jacobian", p, v, Tuned(self.hinge.stiffness, self.masses)))
        found = ca.Function("rest", [p], [terms.mass, ca.jacobian(terms.elastic, p)])(0)
        return np.array(found[0]), np.array(found[1])


THESIS_DIMENSIONS, THESIS_DESIGN = Dimensions(), Design()
"""Those of the source."""


def matrix(name: str, values: Matrix) -> np.ndarray:
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
