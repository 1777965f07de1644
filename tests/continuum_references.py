"""Reference values of the 3-RRR stage by finite elements, of a program of its own on finer meshes, with its helpers.

Values are per stack in the frame of the measured Jacobian, in which stack 1 pushes along X.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from hfsa.components._continuum.design import Continuum, Solved
from hfsa.components._mechanics.pzt import TOKIN
from hfsa.components._mechanics.rrr_contact import Bolts, Contact
from hfsa.components._mechanics.rrr_design import Dimensions
from hfsa.components._mechanics.rrr_kinematics import NOMINAL
from hfsa.components._mechanics.rrr_outline import THESIS_OUTLINE, Outline, Plate

SIZE = 0.1e-3
"""Size of the meshes of the tests [m]."""
TO_PRINTED = NOMINAL.psi - np.pi / 3
"""Angle from the axes of the measured Jacobian to those of the stage [rad]."""


class Row(NamedTuple):
    """One contact and joint: c [m/m], a [deg], yaw [rad/m], K_a11, K_a12 [N/um], stresses of one, two, all [MPa]."""

    bolts: Bolts
    contact: Contact
    c: float
    angle: float
    yaw: float
    own: float
    other: float
    stresses: tuple[float, float, float]


ROWS = (
    Row("pin", "locked", 1.39370, -0.512, -25.9616, 29.605, 0.058, (186.6, 187.8, 188.5)),
    Row("pin", "slide", 2.65536, -0.621, -49.7836, 9.389, -0.214, (120.7, 179.0, 134.6)),
    Row("pin", "ball", 2.76288, -0.624, -51.8019, 7.513, -0.231, (126.9, 187.5, 141.3)),
    Row("pin", "stack", 2.55711, -0.617, -47.9420, 10.991, -0.197, (138.3, 171.0, 138.7)),
    Row("rigid", "locked", 1.31131, -1.216, -24.3126, 31.483, 0.017, (187.7, 189.7, 190.0)),
    Row("rigid", "slide", 2.27366, -1.652, -41.2225, 16.825, 0.157, (137.6, 226.9, 170.5)),
    Row("rigid", "ball", 2.34944, -1.660, -42.5260, 15.551, 0.179, (143.4, 235.6, 177.2)),
    Row("rigid", "stack", 2.20491, -1.637, -40.0538, 17.886, 0.136, (132.0, 218.9, 164.3)),
)
LABELS = [f"{row.bolts}-{row.contact}" for row in ROWS]

# Hz, translation pair, yaw; stacks free and bonded
FREQUENCIES = {
    ("pin", "locked"): ((877.2, 877.2, 1815.3), (1083.6, 1083.6, 2248.5)),
    ("rigid", "locked"): ((931.0, 931.0, 1934.8), (1128.3, 1128.3, 2366.0)),
    ("pin", "stack"): ((362.3, 362.3, 723.3), (634.0, 634.0, 1299.8)),
    ("rigid", "stack"): ((491.6, 491.6, 1044.2), (718.2, 718.2, 1523.8)),
}
# lowest and highest of the three that follow with stacks free, Hz
NEXT = {
    ("pin", "locked"): (3088, 3119),
    ("rigid", "locked"): (13470, 13470),
    ("pin", "stack"): (3085, 3114),
    ("rigid", "stack"): (11710, 11710),
}
# kxx [N/um] and kgg [N.m/rad] with stacks free, bonded and blocked
PLATFORM = {
    ("pin", "locked"): ((5.432, 7881), (8.253, 11964), (11.700, 16990)),
    ("rigid", "locked"): ((6.176, 9043), (9.023, 13239), (12.508, 18411)),
    ("pin", "stack"): ((0.932, 1273), (2.848, 4087), (5.100, 7427)),
    ("rigid", "stack"): ((1.730, 2666), (3.680, 5602), (5.977, 9094)),
}


def design(
    contact: Contact = "stack",
    bolts: Bolts = "pin",
    size: float = SIZE,
    outline: Outline = THESIS_OUTLINE,
    **dimensions: object,
) -> Continuum:
    """Return the stage of the source with a contact and a joint, or with other dimensions."""
    return Continuum(Dimensions(**dimensions), Plate(contact, bolts, outline), TOKIN, size)  # type: ignore[arg-type]


@cache
def solved(contact: Contact = "stack", bolts: Bolts = "pin") -> Solved:
    """Return the stage of the source on the meshes of the tests, solved."""
    return design(contact, bolts).solved(SIZE)


def printed_axes(jacobian: np.ndarray) -> np.ndarray:
    """Return a Jacobian of the stage in the axes of the measured one."""
    c, s = np.cos(TO_PRINTED), np.sin(TO_PRINTED)
    return np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ jacobian
