"""The Bode sentence: 0 dB, a resonance at sqrt(k/m) that stands sqrt(k m)/c high, then -40 dB per decade."""

import numpy as np
import pytest

from hfsa.components._modelling.linearize import linearize
from hfsa.components.mass_on_spring import mass_on_spring


def gain_db(values: dict[str, float], omega: float) -> float:
    return 20 * np.log10(abs(linearize(mass_on_spring(), values)(1j * omega).item()))


@pytest.mark.parametrize("values", [{}, {"stiffness": 400.0, "damping": 1.0, "mass": 4.0}])
def test_bode_sentence(values):
    k, c, m = ({"stiffness": 1e4, "damping": 0.5, "mass": 1.0} | values).values()
    omega = np.sqrt(k / m)
    assert gain_db(values, omega * 1e-4) == pytest.approx(0, abs=1e-6)
    assert gain_db(values, omega) == pytest.approx(20 * np.log10(np.sqrt(k * m) / c), abs=1e-9)
    assert gain_db(values, omega * 1000) - gain_db(values, omega * 100) == pytest.approx(-40, abs=1e-2)


def test_numbers_of_the_bode_sentence():
    assert gain_db({}, 100.0) == pytest.approx(46, abs=0.1)
    assert 100.0 / (2 * np.pi) == pytest.approx(15.9, abs=0.05)
