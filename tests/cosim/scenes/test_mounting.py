"""Mounting of a sensor that turns with the posture of the robot."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hfsa.cosim import load_scene
from hfsa.cosim.scenes._accelerometer import Mounting
from hfsa.cosim.scenes._posture import Posture

TILTED = {"posture.rotation": "30,5,-8"}
Q = Rotation.from_euler("ZXY", [30, 5, -8], degrees=True).as_matrix()


@pytest.mark.parametrize("name", ["sensor", "ideal"])
def test_a_bolted_sensor_turns_with_the_platform(name):
    bolted = load_scene("sdelta_accelerometer", {**TILTED, "mounting.frame": "platform"}).system[name].arguments
    np.testing.assert_allclose(np.reshape(bolted["mounting.rotation"], (3, 3)), Q, atol=1e-14)
    np.testing.assert_allclose(bolted["mounting.lever"], Q @ [0.03, 0.0, 0.0], atol=1e-16)
    fixed = load_scene("sdelta_accelerometer", TILTED).system[name].arguments
    assert fixed["mounting.lever"] == (0.03, 0.0, 0.0)


def test_a_mounting_along_other_axes_is_turned_as_well():
    own = Rotation.from_euler("xyz", [10, 20, 30], degrees=True).as_matrix()
    mounting = Mounting(tuple(own.ravel()), (0.01, -0.02, 0.03), "platform").at(Posture((30, 5, -8)))
    np.testing.assert_allclose(np.reshape(mounting.rotation, (3, 3)), Q @ own, atol=1e-14)
    np.testing.assert_allclose(mounting.lever, Q @ [0.01, -0.02, 0.03], atol=1e-16)
    assert mounting.frame == "world"
