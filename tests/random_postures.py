"""Postures of the SDelta at random, away from its singularities."""

import numpy as np
from hypothesis import assume, reject
from hypothesis import strategies as st

from hfsa.components import ModelError
from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC, Posture
from hfsa.components._mechanics.sdelta_kinematics import Kinematics


def numbers_in(low: float, high: float, size: int) -> st.SearchStrategy[np.ndarray]:
    """Arrays of numbers, (size,)."""
    return st.tuples(*[st.floats(low, high) for _ in range(size)]).map(np.array)


@st.composite
def postures(draw) -> Posture:
    """Postures within 12 degrees and 20 mm of the symmetric one, away from singularities."""
    rotation, offset = draw(numbers_in(-12, 12, 3)), draw(numbers_in(-0.02, 0.02, 3))
    posture = Posture(tuple(rotation), tuple(np.array(SYMMETRIC.position) + offset))
    try:
        assume(Kinematics.at(posture).condition_number < 50)
    except ModelError:
        reject()
    return posture
