"""Stability maps: known borders, agreement with simulations, and refusals."""

import json

import numpy as np
import pytest
import xarray

from hfsa.cosim.experiments.stability_map import Axis, parse_axis, stability_map
from hfsa.cosim.systems.errors import StructureError


def test_the_massless_suspension_is_stable_up_to_its_step():
    found = stability_map("beam_payload", {"suspension": "massless"}, [parse_axis("step_size=6.8e-6:7.2e-6:5")])
    step = found.axes[0].values
    np.testing.assert_array_equal(found.growth > 0, step > 7.0109e-6)
    assert found.agreement[0] == found.agreement[1] > 0


def test_fused_with_its_payload_it_is_stable_at_every_step():
    axes = [parse_axis("step_size=5e-6:1e-3:3")]
    found = stability_map("beam_payload", {"suspension": "massless"}, axes, fuse=["suspension,payload"])
    assert (found.growth < 0).all()
    assert found.agreement[0] == found.agreement[1] > 0


@pytest.mark.slow
def test_the_border_of_sampled_control_with_a_delay():
    """13.3 Hz at 1 ms and 1.58 Hz at 2 ms, with a communication step that adds next to nothing."""
    axes = [parse_axis("bandwidth=1.56:13.4:9"), parse_axis("sample_time=1e-3:2e-3:2")]
    found = stability_map("sdelta_hfsa", {"delay": "true"}, axes, step_size=50e-6, algorithm="jacobi_quadratic")
    bandwidth = axes[0].values
    np.testing.assert_array_equal(found.growth[:, 0] > 0, bandwidth > 13.35)
    np.testing.assert_array_equal(found.growth[:, 1] > 0, bandwidth > 1.58)
    assert found.agreement[0] == found.agreement[1] > 0


def test_the_verb_writes_a_file_and_a_picture(hfsa, tmp_path):
    path = tmp_path / "map.h5"
    words = ("-p", "suspension=massless", "--vary", "step_size=5e-6:1e-5:3", "-o", path, "--json")
    code, out, _ = hfsa("stability", "beam_payload", *words)
    assert code == 0
    data = json.loads(out)
    assert data["agree"] == data["simulated"] > 0
    assert path.with_suffix(".png").stat().st_size > 10_000
    with xarray.open_dataset(path, group="map", engine="h5netcdf") as found:
        assert found.growth.dims == ("step_size",)
        assert found.attrs["algorithm"] == "gauss_seidel"
        np.testing.assert_array_equal(found.stable, found.step_size < 7.0109e-6)
        assert found.stable.dtype == bool


def test_a_posture_is_mapped_by_one_of_its_angles():
    """In steps of 1.25 ms the robot is stable level, and at 40 degrees of yaw it is not."""
    found = stability_map("sdelta_hfsa", {}, [parse_axis("posture.rotation[3]=0:40:2")], step_size=1.25e-3)
    assert found.stable.tolist() == [True, False]
    assert found.verified.tolist() == [1, 1]
    for name in ("posture.rotation[4]", "robot.posture.rotation[0]"):
        with pytest.raises(ValueError, match=r"posture.rotation has elements 1 to 3"):
            stability_map("sdelta_hfsa", {}, [parse_axis(f"{name}=0:40:2")])


def test_passes_that_lead_nowhere_are_unstable():
    """Beyond 2.807 ms the iteration diverges, while the converged step is stable up to 4.109 ms."""
    axes = [Axis("step_size", np.array([2e-3, 3e-3, 4e-3, 4.5e-3]))]
    found = stability_map("sdelta_hfsa", {"execution": "continuous"}, axes, algorithm="fixed_point")
    assert found.stable.tolist() == [True, False, False, False]
    assert (found.growth > 0).tolist() == [False, False, False, True]
    assert found.verified.tolist() == [1, 1, 1, 1]


def test_a_window_where_a_mode_meets_half_the_frequency_of_the_steps():
    """Linearised feedback under continuous control is unstable from 3.09 to 3.11 ms, and beyond 4.13 ms."""
    axes = [Axis("step_size", np.array([3.0e-3, 3.1e-3, 3.2e-3, 4.1e-3, 4.2e-3]))]
    found = stability_map("sdelta_hfsa", {"execution": "continuous"}, axes, algorithm="linearized_feedback")
    assert found.stable.tolist() == [True, False, True, True, False]
    assert found.verified.tolist() == [1, 1, 1, 1, 1]


def test_what_is_undamped_is_stable_whatever_the_sign_of_rounding():
    """Modes neither grow nor decay, so that no simulation can decide."""
    found = stability_map("mass_on_spring", {"damping": "0"}, [parse_axis("step_size=1e-4:1e-2:8")])
    assert found.stable.all()
    assert np.abs(found.growth).max() < 1e-9
    assert found.agreement == (0, 0)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("bandwidth=1:100", "expected NAME=FROM:TO:N"),
        ("bandwidth=100:1:5", "FROM below TO"),
        ("bandwidth=1:100:1", "2 points or more"),
        ("bandwidth=a:b:3", "expected NAME=FROM:TO:N"),
    ],
)
def test_wrong_words(words, expected):
    with pytest.raises(StructureError, match=expected):
        parse_axis(words)


def test_what_cannot_be_mapped():
    with pytest.raises(StructureError, match="did you mean bandwidth"):
        stability_map("sdelta_hfsa", {}, [parse_axis("bandwith=1:2:2")])
    with pytest.raises(StructureError, match="no stability map for monolithic"):
        stability_map("mass_on_spring", {}, [parse_axis("step_size=1e-4:1e-3:2")], algorithm="monolithic")
    with pytest.raises(StructureError, match="one or two --vary; found 0"):
        stability_map("mass_on_spring", {}, [])
    axis = parse_axis("damping=0:1:2")
    with pytest.raises(StructureError, match="--vary damping is given twice"):
        stability_map("mass_on_spring", {}, [axis, axis])
    with pytest.raises(StructureError, match=r"--vary damping and -p damping=0.5: leave one out"):
        stability_map("mass_on_spring", {"damping": "0.5"}, [axis])
    with pytest.raises(StructureError, match=r"--vary step_size and --step 0.001: leave one out"):
        stability_map("mass_on_spring", {}, [parse_axis("step_size=1e-4:1e-3:2")], step_size=1e-3)
