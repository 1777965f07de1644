"""The 3-RRR stage of rigid links on necks that give: stiffness and inertia on elongations and pose.

Levers, couplers, end blocks and platform are rigid bodies in the plane. Twelve necks join them (`rrr_neck.py`):

    A  from the base to a lever, its axis across the coupler         B  from the lever to the coupler, along it
    C  from the coupler to the end block, along it                   D  from the lever to the contact pad, along it

A stack pushes on the pad of its neck D, which the contact holds (`rrr_contact.py`). An end block is bolted to the
platform: `pin` lets it turn about the bolt, `rigid` does not. With the elongations l and the pose q, the motion x of
all bodies is that of static balance, because the modes beyond are above 25 kHz,

    x = T [l; q],    K = T^T K_x T,    M = T^T M_x T,    G = T^T M_x r

with r a translation of all bodies. A condensation on the elongations alone would put the lowest frequency of the free
stage a third too high, as the inertia of the platform acts at the platform.

Source of the arrangement: appendix of the thesis of 2000 on the 3-RRR stage, the input of its finite elements.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hfsa.components._mechanics.pzt import Stack
from hfsa.components._mechanics.rrr_bodies import PLATFORM, SIZE, Leg
from hfsa.components._mechanics.rrr_contact import held, sideways_stiffness
from hfsa.components._mechanics.rrr_design import Design, matrix
from hfsa.components._mechanics.rrr_neck import Neck
from hfsa.components._mechanics.rrr_outline import Outline, Plate
from hfsa.components._modelling.model import ModelError

NECKS = tuple(f"{name}{leg}" for leg in (1, 2, 3) for name in "ABCD")
"""The twelve necks, in the order of their deformations."""

_L, _Q = slice(0, 3), slice(3, 6)


@dataclass(frozen=True)
class Hinged:
    """The stage on elongations and pose, [l; q] in [m; m, m, rad].

    Attributes:
        stiffness: K, shape (6, 6) [N/m, N, N.m].
        mass: M, shape (6, 6) [kg, kg.m, kg.m2].
        base: G, shape (6, 2) [kg, kg.m].
        deformations: of each neck along, across and in bending, shape (12, 3, 6) [1, m; 1/m, 1].
        neck: dimensions and stiffnesses of a neck.
    """

    stiffness: np.ndarray
    mass: np.ndarray
    base: np.ndarray
    deformations: np.ndarray
    neck: Neck

    @cached_property
    def jacobian(self) -> np.ndarray:
        """J = -K_qq^-1 K_ql, pose per elongation of a free platform, shape (3, 3) [m/m; m/m; rad/m]."""
        return -np.linalg.solve(self.stiffness[_Q, _Q], self.stiffness[_Q, _L])

    @cached_property
    def stiffness_on_stacks(self) -> np.ndarray:
        """K_ll + K_lq J, stiffness on the elongations with a free platform, shape (3, 3) [N/m]."""
        return self.stiffness[_L, _L] + self.stiffness[_L, _Q] @ self.jacobian

    @cached_property
    def mass_on_stacks(self) -> np.ndarray:
        """Inertia on the elongations with the platform at J l, shape (3, 3) [kg]."""
        shape = np.vstack([np.eye(3), self.jacobian])
        return shape.T @ self.mass @ shape

    def stiffness_of_platform(self, stack: float) -> np.ndarray:
        """Return the stiffness on the pose, shape (3, 3) [N/m, N, N.m], with stacks of a stiffness [N/m]."""
        coupled, held_by = self.stiffness[_Q, _L], self.stiffness[_L, _L] + stack * np.eye(3)
        return self.stiffness[_Q, _Q] - coupled @ np.linalg.solve(held_by, coupled.T)

    def on_stacks(self, stiffness: float, mass: float) -> tuple[np.ndarray, np.ndarray]:
        """Return K and M, shape (6, 6), with a stiffness [N/m] and a mass [kg] on every elongation."""
        added = np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
        return self.stiffness + stiffness * added, self.mass + mass * added

    def with_matrices(self, design: Design) -> "Hinged":
        """Return the stage with the stiffness and the inertia on the elongations that a design gives, if it does."""
        found = self
        if design.stiffness is not None:
            K = self.stiffness.copy()
            K[_L, _L] += matrix("stiffness", design.stiffness) - self.stiffness_on_stacks
            found = replace(found, stiffness=K)
        if design.mass is not None:
            M = self.mass.copy()
            M[_L, _L] += matrix("mass", design.mass) - self.mass_on_stacks
            found = replace(found, mass=M)
        return found


def hinged(design: Design, plate: Plate, stack: Stack) -> Hinged:
    """Return the stage of a design and a plate, on stacks of a data sheet.

    Raises:
        ModelError: a given Jacobian, which follows from the necks here; masses that no bodies can have; necks that
            touch.
    """
    if design.jacobian is not None:
        raise ModelError(
            "a jacobian is given, but at level flexible_hinges it follows from links and necks; take constant_jacobian"
        )
    _check_necks(design, plate.outline)
    legs = [Leg(number, design, plate.outline, plate.bolts) for number in range(3)]
    necks = np.array([joint.deformation for leg in legs for joint in leg.joints])
    neck = Neck(design.hinge, plate.outline.poisson)
    K = np.einsum("nia,i,nib->ab", necks, neck.stiffness, necks)
    M, r = np.zeros((SIZE, SIZE)), np.zeros((SIZE, 2))
    masses, r[3:5] = design.masses, np.eye(2)
    M[PLATFORM, PLATFORM] = np.diag([masses.platform, masses.platform, masses.platform_inertia])
    for leg in legs:
        K[np.ix_(leg.sideways, leg.sideways)] += sideways_stiffness(plate.contact, stack)
        for link in (leg.lever, leg.coupler):
            M[link.coordinates, link.coordinates] = np.diag([link.mass, link.mass, link.inertia])
            r[link.coordinates][:2] = np.eye(2)
    T = np.zeros((SIZE, 6))
    T[:6], inner = np.eye(6), _inner(legs, plate)
    try:
        T[inner] = -np.linalg.solve(K[np.ix_(inner, inner)], K[inner, :6])
    except np.linalg.LinAlgError:
        along, across, bending = neck.stiffness
        raise ModelError(
            f"the necks have stiffnesses of {along:g} N/m, {across:g} N/m and {bending:g} N.m/rad, beyond all digits "
            "of a balance of forces; expected a hinge of metal"
        ) from None
    found = Hinged(_symmetric(T.T @ K @ T), _symmetric(T.T @ M @ T), T.T @ M @ r, necks @ T, neck)
    found = found.with_matrices(design)
    for name, values in (("mass", found.mass), ("stiffness", found.stiffness)):
        if not np.linalg.eigvalsh(values)[0] > 0:
            raise ModelError(
                f"the {name} of the stage on elongations and pose is not positive definite; expected a larger "
                f"{'masses.crank_inertia' if name == 'mass' else name}"
            )
    return found


def _inner(legs: list[Leg], plate: Plate) -> list[int]:
    """Return the coordinates that follow from elongations and pose."""
    holds_slide, holds_turn = held(plate.contact)
    inner = [*range(6, legs[0].turn_of_block)]
    for leg in legs:
        slide, turn = leg.sideways
        inner += [leg.turn_of_block] * (plate.bolts == "pin") + [slide] * (not holds_slide) + [turn] * (not holds_turn)
    return inner


def _check_necks(design: Design, outline: Outline) -> None:
    """Raise `ModelError` where the necks of one link touch, or are wider than it."""
    links, radius = design.links_at_rest, design.hinge.radius
    needed = design.hinge.thickness + 2 * radius
    if not needed <= outline.coupler_width:
        raise ModelError(
            f"hinge.thickness + 2 hinge.radius is {needed:g} m, wider than a coupler; expected at most "
            f"{outline.coupler_width:g} m, outline.coupler_width"
        )
    for name, length in (("crank", links.crank), ("coupler", links.coupler)):
        if not length > 2 * radius:
            raise ModelError(
                f"links.{name} is {length:g} m, but the necks at its ends touch: each is {radius:g} m long on its side "
                f"of the hinge (hinge.radius); expected more than {2 * radius:g} m"
            )


def _symmetric(values: np.ndarray) -> np.ndarray:
    """Return a matrix that is symmetric but for rounding as one that is."""
    return (values + values.T) / 2
