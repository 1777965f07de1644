"""Rigid bodies of the 3-RRR stage and the necks between them, in its plane, on coordinates of all bodies.

The motion of a body at a point is linear in the coordinates: x, y, and the rotation, rows of a matrix. A lever and a
coupler move freely, about their centres; a platform about O; a contact pad by l, s, phi of its stack; an end block with
the platform, or about its bolt in addition.

    coordinates   l_1..3 | x, y, yaw | levers (9) | couplers (9) | end blocks (3) | s, phi of the pads (6)
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hfsa.components._mechanics.rrr_contact import Bolts
from hfsa.components._mechanics.rrr_design import Dimensions
from hfsa.components._mechanics.rrr_outline import Outline

Motion = Callable[[np.ndarray], np.ndarray]
"""From a point (2,) of a body [m] to the rows of its motion there, shape (3, SIZE)."""

SIZE = 33
PLATFORM = slice(3, 6)
_LEVERS, _COUPLERS, _BLOCKS, _PADS = 6, 15, 24, 27


class Joint(NamedTuple):
    """A neck between two bodies.

    Attributes:
        name: A, B, C or D.
        deformation: along, across and in bending, rows of shape (3, SIZE).
    """

    name: str
    deformation: np.ndarray


class Link(NamedTuple):
    """A rigid link with mass: its three coordinates, mass [kg] and moment of inertia about its centre [kg.m2]."""

    coordinates: slice
    mass: float
    inertia: float


@dataclass(frozen=True)
class Leg:
    """One leg of the stage.

    Attributes:
        number: 0, 1 or 2.
        dimensions: links, hinges and masses of the stage.
        outline: dimensions of the plate.
        bolts: joint of end block and platform.
    """

    number: int
    dimensions: Dimensions
    outline: Outline
    bolts: Bolts

    @property
    def joints(self) -> Iterator[Joint]:
        """The four necks."""
        links, radius = self.dimensions.links_at_rest, self.dimensions.hinge.radius
        A, B, C = (points[self.number] for points in (links.base_hinges, links.crank_ends, links.corners))
        up = (C - B) / links.coupler
        side = np.array([up[1], -up[0]])
        D = A + links.arm * side + (self.outline.drive_height + radius) * up
        lever, coupler = _free(self.lever.coordinates, (A + B) / 2), _free(self.coupler.coordinates, (B + C) / 2)
        block = self._block(C + (radius + self.outline.bolt_distance) * up)
        pad = self._pad(D + (radius + self.outline.pad_height) * up, side, up)
        yield Joint("A", _deformation(_base, lever, A, side))
        yield Joint("B", _deformation(lever, coupler, B, up))
        yield Joint("C", _deformation(coupler, block, C, up))
        yield Joint("D", _deformation(lever, pad, D, up))

    @property
    def lever(self) -> Link:
        """The crank, with its centre halfway between A and B."""
        masses, length = self.dimensions.masses, self.dimensions.links_at_rest.crank
        first = _LEVERS + 3 * self.number
        return Link(slice(first, first + 3), masses.crank, masses.crank_inertia - masses.crank * length**2 / 4)

    @property
    def coupler(self) -> Link:
        """The coupler, a uniform rod."""
        mass, length = self.dimensions.masses.coupler, self.dimensions.links_at_rest.coupler
        first = _COUPLERS + 3 * self.number
        return Link(slice(first, first + 3), mass, mass * length**2 / 12)

    @property
    def turn_of_block(self) -> int:
        """Coordinate of the rotation of the end block."""
        return _BLOCKS + self.number

    @property
    def sideways(self) -> tuple[int, int]:
        """Coordinates s and phi of the contact pad."""
        return _PADS + 2 * self.number, _PADS + 2 * self.number + 1

    def _block(self, bolt: np.ndarray) -> Motion:
        """Return the motion of the end block."""
        platform = _free(PLATFORM, np.zeros(2))
        if self.bolts == "rigid":
            return platform

        def motion(point: np.ndarray) -> np.ndarray:
            rows = platform(bolt)
            rows[2] = 0
            rows[:, self.turn_of_block] = _rigid(point - bolt)[:, 2]
            return rows

        return motion

    def _pad(self, at: np.ndarray, side: np.ndarray, up: np.ndarray) -> Motion:
        """Return the motion of the contact pad, which the stack pushes down."""
        axes = np.array([[-up[0], side[0], 0.0], [-up[1], side[1], 0.0], [0.0, 0.0, 1.0]])

        def motion(point: np.ndarray) -> np.ndarray:
            rows = np.zeros((3, SIZE))
            rows[:, [self.number, *self.sideways]] = _rigid(point - at) @ axes
            return rows

        return motion


def _free(coordinates: slice, at: np.ndarray) -> Motion:
    """Return the motion of a body with three coordinates about a point."""

    def motion(point: np.ndarray) -> np.ndarray:
        rows = np.zeros((3, SIZE))
        rows[:, coordinates] = _rigid(point - at)
        return rows

    return motion


def _base(_point: np.ndarray) -> np.ndarray:
    """Return the motion of the base: none."""
    return np.zeros((3, SIZE))


def _rigid(offset: np.ndarray) -> np.ndarray:
    """Return the motion at an offset from the point that the coordinates of a body are about, shape (3, 3)."""
    return np.array([[1.0, 0.0, -offset[1]], [0.0, 1.0, offset[0]], [0.0, 0.0, 1.0]])


def _deformation(one: Motion, other: Motion, at: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the motion of the other body against the first at a neck, along its axis, across it and the rotation."""
    turned = np.array([[axis[0], axis[1], 0.0], [-axis[1], axis[0], 0.0], [0.0, 0.0, 1.0]])
    return turned @ (other(at) - one(at))
