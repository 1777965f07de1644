"""Appendix D.2 of the 3-RRR stage's source: its functions of the elongations, and our model in the same functions.

    K_ii  1, c_i, s_i                                           K_ij  1, c_i, s_i, c_j, s_j
    C_ii  c_i l_i', s_i l_i', c_i l_j', s_i l_j', c_i l_k', s_i l_k'
    C_ij  c_i l_i', s_i l_i', c_j l_j', s_j l_j'
    H_i   s_i, s_i c_i, s_j, s_k, l_i, l_j, l_k, c_i l_j, c_i l_k, odd in l, and then those even in l,
          1, c_i, c_i^2, c_j, c_k, s_i l_j, s_i l_k

with s = sin(l / R0), c = cos(l / R0) and i, j, k the three stacks, i first, j and k in ascending order. The numbers of
these functions are in `published_sources/stage.toml`, entry by entry. D.2 leaves the yaw out of the hinges' energy and
has the sign of H's even terms reversed, so it is no level of the part.
"""

from collections.abc import Mapping
from typing import NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._mechanics import rrr_dynamics as dynamics
from hfsa.components._mechanics.rrr_kinematics import NOMINAL
from hfsa.components._mechanics.rrr_masses import Masses

MASSES = {
    "platform": 0.13227224996,
    "platform_inertia": 9.622432692e-6,
    "crank_inertia": 1.4825356067e-6,
    "coupler": 7.627785e-3,
}
"""What D.2 was made with, told from its numbers with I_e = M_e R^2 / 12; the source's tables round them."""

length, rate = ca.SX.sym("l", 3), ca.SX.sym("l_rate", 3)

_STACKS = (0, 1, 2)
_RNG = np.random.default_rng(1)
_POINTS = np.vstack([NOMINAL.arm * _RNG.uniform(-np.pi, np.pi, (3, 200)), _RNG.standard_normal((3, 200))])
"""l all around the circle, where the functions differ most, and l'."""


class PrintedStage(NamedTuple):
    """The stage as printed: forces = K(l) l'' + C(l, l') l' + H(l)."""

    K: ca.SX
    C: ca.SX
    H: ca.SX


def bases(elongation: ca.SX, rates: ca.SX) -> dict[str, ca.SX]:
    """Return the functions of D.2 by entry, `K11`, `C12`, `H1` and so on, of K the upper triangle, each (n, 1).

    Elongations and their rates are (3, 1).
    """
    c, s = ca.cos(elongation / NOMINAL.arm), ca.sin(elongation / NOMINAL.arm)
    found = {}
    for i in _STACKS:
        j, k = (other for other in _STACKS if other != i)
        found[f"K{i + 1}{i + 1}"] = ca.vertcat(1, c[i], s[i])
        found[f"C{i + 1}{i + 1}"] = ca.vertcat(*[wave[i] * rates[n] for n in (i, j, k) for wave in (c, s)])
        for n in (j, k):
            found[f"C{i + 1}{n + 1}"] = ca.vertcat(c[i] * rates[i], s[i] * rates[i], c[n] * rates[n], s[n] * rates[n])
            if n > i:
                found[f"K{i + 1}{n + 1}"] = ca.vertcat(1, c[i], s[i], c[n], s[n])
        own, others = elongation[i], ca.vertcat(elongation[j], elongation[k])
        odd = ca.vertcat(s[i], s[i] * c[i], s[j], s[k], own, others, c[i] * others)
        found[f"H{i + 1}"] = ca.vertcat(odd, 1, c[i], c[i] ** 2, c[j], c[k], s[i] * others)
    return found


def assembled(printed: Mapping[str, np.ndarray], elongation: ca.SX, rates: ca.SX) -> PrintedStage:
    """Return D.2 with these numbers of its functions over elongations and their rates, each (3, 1)."""
    entries = {name: ca.dot(ca.DM(printed[name]), basis) for name, basis in bases(elongation, rates).items()}
    K = [[entries[f"K{min(i, j)}{max(i, j)}"] for j in (1, 2, 3)] for i in (1, 2, 3)]
    C = [[entries[f"C{i}{j}"] for j in (1, 2, 3)] for i in (1, 2, 3)]
    H = [entries[f"H{i}"] for i in (1, 2, 3)]
    return PrintedStage(*[ca.vertcat(*[ca.horzcat(*row) for row in matrix]) for matrix in (K, C)], ca.vertcat(*H))


def values(expression: ca.SX) -> np.ndarray:
    """Return the values of an expression of `length` and `rate` at 200 points, shape (200, entries)."""
    found = ca.Function("f", [length, rate], [ca.vec(ca.densify(expression))]).map(_POINTS.shape[1])
    return np.array(found(_POINTS[:3], _POINTS[3:])).T


def with_its_masses() -> dynamics.Mechanism:
    """Return our mechanism over `length` and `rate` with the masses of D.2."""
    return dynamics.constant_jacobian(NOMINAL, length, rate, masses=Masses(**MASSES))


def without_yaw(mechanism: dynamics.Mechanism) -> dynamics.Mechanism:
    """Leave the yaw out of the corners and of the hinges, in the potential energy."""
    return mechanism._replace(bends=ca.substitute(mechanism.bends, mechanism.parts[2], 0))


def our_model() -> PrintedStage:
    """Return our model with D.2's masses, without the yaw in the potential energy, and C in D.2's form.

    C_ij = sum_k dK_ij/dl_k l_k' - 1/2 sum_k dK_kj/dl_i l_k', one of many matrices with the same product C l'.
    """
    found = dynamics.terms(without_yaw(with_its_masses()))
    K = found.mass
    C = ca.horzcat(*[ca.jtimes(K[:, j], length, rate) - ca.gradient(K[:, j].T @ rate, length) / 2 for j in _STACKS])
    return PrintedStage(K, C, found.elastic)


def our_numbers() -> dict[str, np.ndarray]:
    """Return the numbers that D.2's functions have in our model, by entry."""
    ours = our_model()
    expressions = {f"H{i + 1}": ours.H[i] for i in _STACKS}
    for name, matrix in (("K", ours.K), ("C", ours.C)):
        expressions |= {f"{name}{i + 1}{j + 1}": matrix[i, j] for i in _STACKS for j in _STACKS}
    return {name: _projected(expressions[name], basis) for name, basis in bases(length, rate).items()}


def _projected(expression: ca.SX, basis: ca.SX) -> np.ndarray:
    """Return the coefficients of an expression, shape (functions,); the basis leaves nothing out."""
    functions, wanted = values(basis), values(expression).ravel()
    size = np.abs(functions).max(axis=0)
    found = np.linalg.lstsq(functions / size, wanted)[0]
    np.testing.assert_allclose(functions / size @ found, wanted, rtol=0, atol=1e-13 * np.abs(wanted).max())
    return found / size
