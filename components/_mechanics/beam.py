"""Tip stiffness of a beam and of a sheet that are clamped at the other end, shape (6, 6), normalised.

Order and signs in all modules `beam*`: displacements (x, y, z, thx, thy, thz), loads (p, fy, fz, mx, my, mz), X along
the beam from its clamped end to its tip. With the length L and the bending stiffness EI of one beam, lengths are
normalised by L, forces by EI / L^2, moments by EI / L (eqs 1, 2):

    K = [[d, 0, 0, 0, 0, 0], [0, 12, 0, 0, 0, -6], [0, 0, 12, 0, 6, 0],
         [0, 0, 0, delta, 0, 0], [0, 0, 6, 0, 4, 0], [0, -6, 0, 0, 0, 4]]
    d = A L^2 / I     16 (L/D)^2 of a round section, 12 (L/T)^2 of a square one
    delta = G J / EI  2 G / E of a round section, 1.687 G / E of a square one

The theory holds for displacements below L / 10. The source uses 2 G / E for both sections, in its numbers
0.7536 = 2 (26 GPa) / (69 GPa).

Source: the paper of 2013 on beam modules.
"""

import numpy as np

from hfsa.components._mechanics.beam_section import Section

LENGTH_POWERS = np.array(
    [
        [1, 0, 0, 0, 0, 0],
        [0, 3, 0, 0, 0, 2],
        [0, 0, 3, 0, 2, 0],
        [0, 0, 0, 1, 0, 0],
        [0, 0, 2, 0, 1, 0],
        [0, 2, 0, 0, 0, 1],
    ]
)
"""Powers of the length that divide the entries of the stiffness of a beam or sheet, shape (6, 6)."""


def beam(slenderness: float, torsion: float) -> np.ndarray:
    """Return the stiffness of a beam from its slenderness d and torsion delta (eq 1), shape (6, 6)."""
    return prismatic(Section(slenderness, torsion, 1.0, 1.0))


def sheet(thickness: float, width: float, poisson: float) -> np.ndarray:
    """Return the stiffness of a sheet that is wide along Z (eq A.1), shape (6, 6).

    `thickness` t and `width` u are divided by the length. EI = E u t^3 / 12 / (1 - nu^2) is that of soft plate bending:
    K11 = 12 (1 - nu^2) / t^2, stiff bending along Z (u / t)^2 (1 - nu^2) times the soft one along Y, K44 = 2 (1 - nu).
    """
    plate = 1 - poisson**2
    return prismatic(Section(12 * plate / thickness**2, 2 * (1 - poisson), 1.0, (width / thickness) ** 2 * plate))


def prismatic(section: Section) -> np.ndarray:
    """Return the stiffness from normalised rigidities: the axial one by EI / L^2, the others by EI, shape (6, 6)."""
    along_y, along_z = 12 * section.along_y, 12 * section.along_z
    K = np.diag([section.axial, along_y, along_z, section.torsion, along_z / 3, along_y / 3])
    K[1, 5] = K[5, 1] = -along_y / 2
    K[2, 4] = K[4, 2] = along_z / 2
    return K


def of_length(K: np.ndarray, length: float) -> np.ndarray:
    """Return the stiffness, shape (6, 6), of the beam or sheet of stiffness K with its length multiplied by `length`.

    With lam = 1 / length its entries are d lam, 12 lam^3, 6 lam^2, delta lam and 4 lam.
    """
    return K / length**LENGTH_POWERS
