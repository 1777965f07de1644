"""Appendix D.2 of the stage's source: its numbers come out of our model once its two mistakes are put in.

`published_sources/stage.toml` has the 24 + 42 + 48 numbers of K, C and H, each compared with that of our model. Here is
what those numbers make together.
"""

import casadi as ca
import numpy as np
import pytest
from appendix_d2 import MASSES, bases, length, our_model, rate, values, with_its_masses
from published import entry, half_units, numbers

from hfsa.components._mechanics import rrr_dynamics as dynamics
from hfsa.components._mechanics.rrr_hinge import THESIS_HINGE
from hfsa.components._mechanics.rrr_masses import THESIS_MASSES

CLOSE = 3e-9
"""Of the largest number: D.2 prints ten digits and was made with masses that are told from them."""


@pytest.fixture(scope="module")
def printed(printed_stage):
    return printed_stage(length, rate)


def test_all_numbers_are_there():
    sizes = {name: basis.numel() for name, basis in bases(length, rate).items()}
    assert {matrix: sum(n for name, n in sizes.items() if name[0] == matrix) for matrix in "KCH"} == {
        "K": 24,
        "C": 42,
        "H": 48,
    }


def test_the_masses_round_to_those_of_the_tables():
    for name, value in MASSES.items():
        assert float(f"{value:.4g}") == getattr(THESIS_MASSES, name)


def test_the_velocity_matrix_follows_from_the_inertia(printed):
    """C_ij = sum_k dK_ij/dl_k l_k' - 1/2 sum_k dK_kj/dl_i l_k'."""
    K = printed.K
    C = ca.jtimes(K, length, rate) - ca.jacobian(K @ rate, length).T / 2
    np.testing.assert_allclose(values(printed.C), values(C), rtol=0, atol=CLOSE * np.abs(values(C)).max())


def test_the_velocity_matrix_makes_our_velocity_force(printed):
    """C is one of many matrices with this product."""
    ours, theirs = values(dynamics.terms(with_its_masses()).velocity), values(printed.C @ rate)
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=CLOSE * np.abs(theirs).max())


def test_the_force_is_that_of_the_opposite_elongations(printed):
    """D.2's mistakes together: H(l) = -dP/dl(-l) without the yaw."""
    opposite = ca.substitute(our_model().H, length, -length)
    wanted = values(-opposite)
    np.testing.assert_allclose(values(printed.H), wanted, rtol=0, atol=CLOSE * np.abs(wanted).max())


def follows(values: np.ndarray, quantity: str) -> None:
    """Assert that values are those published as what follows from D.2."""
    text = entry("rrr_stage", quantity, "app. D.2, evaluated").printed
    np.testing.assert_array_less(np.abs(values - numbers(text)), half_units(text))


def test_what_follows_from_the_printed_numbers(printed):
    """A yaw that is too soft."""
    # The source rounds K_b to 40.8963 first.
    stiffness = (
        40.8963 / THESIS_HINGE.stiffness * np.array(ca.Function("S", [length], [ca.jacobian(printed.H, length)])(0))
    )
    K = np.array(ca.Function("K", [length], [printed.K])(0))
    frequencies = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(K, stiffness)).real)) / (2 * np.pi)
    force = np.array(ca.Function("H", [length], [printed.H])([12e-6] * 3)).ravel()
    follows(stiffness[0, :2], "stiffness at rest, K_b rounded as printed, diagonal and beside it")
    follows(frequencies[:2], "natural frequencies of the translations")
    follows(frequencies[2], "natural frequency of the yaw")
    follows(force, "force of each stack to hold 12 um on all")
