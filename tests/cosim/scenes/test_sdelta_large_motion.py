"""Large motion of the SDelta: what a sweep of level `nonlinear` records, and which parts fit that level."""

import numpy as np
import pytest

from hfsa.cosim import sweep
from hfsa.cosim.assembly.build import build
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.fidelity.levels import at_highest
from hfsa.cosim.systems.errors import StructureError

POSITION, ROTATION = "robot.platform.position[{}]", "robot.platform.rotation[{}]"


def test_the_reference_follows_the_level_of_the_robot():
    for scene in ("sdelta_shaker", "sdelta_accelerometer"):
        for level, expected in (("cartesian", "linear"), ("nonlinear", "exact")):
            for arguments in ({"robot": level}, {"robot.level": level}):
                system = load_scene(scene, arguments).system
                assert (system["robot"].level, system["reference"].level) == (level, expected)
    kept = load_scene("sdelta_shaker", {"robot.level": "nonlinear", "reference.level": "linear"}).system
    assert kept["reference"].level == "linear"


def test_a_linear_reference_is_refused():
    scene = load_scene("sdelta_shaker", {"robot.level": "nonlinear", "reference.level": "linear"})
    with pytest.raises(StructureError, match=r"robot is sdelta at level nonlinear.*sdelta_reference \(exact\)"):
        build(scene.system)


@pytest.mark.slow
def test_sweep_records_mean_harmonics_and_cross_coupling(tmp_path):
    """The printed row of 1 mm along x at 20 Hz, within the error of the steps, 0.002 % of the response."""
    bode = sweep(
        "sdelta_shaker",
        {"robot.level": "nonlinear"},
        inputs=["command.position[1]"],
        low=20.0,
        points=1,
        amplitude=1e-3,
        path=tmp_path / "large.h5",
    )
    names = [signal.name for signal in bode.outputs]
    found = dict(zip(names, bode.harmonics[0, :, :, 0].T, strict=True))
    assert found[POSITION.format(1)][1] == pytest.approx(2.250675, rel=3e-5)
    assert found[ROTATION.format(2)][1] == pytest.approx(24.5185, rel=3e-5)
    assert found[ROTATION.format(1)][0] == pytest.approx(0.813, abs=6e-4)
    assert found[ROTATION.format(1)][2] == pytest.approx(0.277, abs=6e-4)
    np.testing.assert_array_equal(bode.harmonics[:, 1], np.abs(bode.response))


@pytest.mark.parametrize(
    ("scene", "arguments", "expected"),
    [
        ("sdelta_shaker", {}, "nonlinear"),
        ("sdelta_shaker", {"reference.level": "linear"}, "cartesian"),
        ("sdelta_shaker", {"reference.level": "exact"}, "nonlinear"),
        ("sdelta_shaker", {"reference.level": "auto"}, "nonlinear"),
        ("sdelta_hfsa", {}, "nonlinear"),
        ("sdelta_hfsa", {f"drive[{j}].level": "rotor" for j in (1, 2, 3)}, "generalized"),
    ],
    ids=["reference follows", "linear reference", "exact reference", "reference auto", "drives", "rotors"],
)
def test_the_reference_of_auto_is_the_last_level_that_fits(scene, arguments, expected):
    highest = at_highest(load_scene(scene, {"robot.level": "auto", **arguments}))
    assert highest.system["robot"].level == expected
