"""The general body on springs: the robot's own matrices give its own numbers and responses; bad matrices are named."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_postures import numbers_in

from hfsa.components import ModelError
from hfsa.components._mechanics.modes import damping_matrix
from hfsa.components._mechanics.screws import seen_from
from hfsa.components._modelling.linearize import linearize
from hfsa.components.cartesian_spring import MASS, STIFFNESS, analyze, cartesian_spring
from hfsa.components.sdelta import Posture
from hfsa.components.sdelta import analyze as analyze_sdelta

A = Posture((10, 5, 8), (0.005, 0.003, 0.155))


def rows(matrix: np.ndarray) -> tuple[float, ...]:
    return tuple(np.asarray(matrix).ravel().tolist())


@pytest.mark.parametrize("posture", [Posture(), A], ids=["symmetric", "asymmetric"])
def test_the_robots_matrices_have_the_robots_numbers(posture):
    robot = analyze_sdelta(posture=posture)
    found = analyze(stiffness=rows(robot["stiffness_S"]), mass=rows(robot["mass_S"]))
    assert found["body"] == "rigid"
    known = [key for key in found if key in robot and key not in ("modal_kinds",)]
    assert {"stiffness_C", "natural_frequencies_hz", "frequency_matrix_C", "modal_points_C", "kappa"} <= set(known)
    for key in known:
        size = np.abs(np.ma.masked_invalid(robot[key])).max()
        np.testing.assert_allclose(found[key], robot[key], rtol=1e-6, atol=1e-8 * size, err_msg=key)
    assert found["modal_kinds"] == robot["modal_kinds"]
    for key in ("modal_points", "tracking_band_hz", "modal_matrix", "compliance"):
        size = np.abs(robot[f"{key}_S"]).max()
        np.testing.assert_allclose(found[key], robot[f"{key}_S"], rtol=1e-6, atol=1e-8 * size, err_msg=key)


def test_a_body_that_is_not_rigid_has_no_center():
    M = np.array(MASS).reshape(6, 6)
    M[3, 3] = 2.0
    found = analyze(mass=rows(M))
    assert found["body"].startswith("not rigid")
    assert not [key for key in found if key.endswith("_C")]
    assert found["natural_frequencies_hz"][0] == pytest.approx(np.sqrt(5e4) / (2 * np.pi))


@given(numbers_in(-0.1, 0.1, 3), st.floats(0.5, 20))
@settings(max_examples=20, deadline=None)
def test_the_center_of_a_shifted_body_is_found(offset, mass):
    M = mass * np.array(MASS).reshape(6, 6)
    np.testing.assert_allclose(analyze(mass=rows(seen_from(M, -offset)))["center_of_mass"], offset, atol=1e-12)


def test_the_response_is_the_closed_form():
    """From the commanded pose, its rate being its derivative, and from the wrench, at an asymmetric posture."""
    robot = analyze_sdelta(posture=A)
    M, K = robot["mass_S"], robot["stiffness_S"]
    system = linearize(cartesian_spring(stiffness=rows(K), mass=rows(M)))
    D = 0.01 * damping_matrix(M, K)
    names = [f"platform/{name}[{i}]" for name in ("rotation", "position") for i in (1, 2, 3)]
    outputs = [system.output_labels.index(name) for name in names]
    halves = {
        "pose": ["base/rotation", "base/position"],
        "rate": ["base/angular_velocity", "base/velocity"],
        "wrench": ["wrench/torque", "wrench/force"],
    }
    inputs = {
        key: [system.input_labels.index(f"{name}[{i}]") for name in pair for i in (1, 2, 3)]
        for key, pair in halves.items()
    }
    for f in (1.0, 14.0, 60.0):
        s = 2j * np.pi * f
        G = system(s)[outputs]
        dynamic = M * s**2 + D * s + K
        pose = np.linalg.solve(dynamic, D * s + K)
        np.testing.assert_allclose(G[:, inputs["pose"]] + s * G[:, inputs["rate"]], pose, rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(G[:, inputs["wrench"]], np.linalg.inv(dynamic), rtol=1e-7, atol=1e-12)


def test_numbers_of_the_bode_sentence():
    system = linearize(cartesian_spring())
    i = system.output_labels.index("platform/position[3]")
    j, k = (system.input_labels.index(f"base/{name}[3]") for name in ("position", "velocity"))

    def gain(f: float) -> float:
        s = 2j * np.pi * f
        return 20 * np.log10(abs(system(s)[i, j] + s * system(s)[i, k]))

    assert gain(0.5) == pytest.approx(0, abs=1e-3)
    assert gain(np.sqrt(1e5) / (2 * np.pi)) == pytest.approx(34, abs=0.05)
    assert np.sqrt(1e5) / (2 * np.pi) == pytest.approx(50.3, abs=0.05)
    assert gain(5e6) - gain(5e5) == pytest.approx(-20, abs=0.05)


def changed(values: tuple[float, ...], i: int, j: int, value: float) -> tuple[float, ...]:
    A = np.array(values).reshape(6, 6)
    A[i, j] = value
    return rows(A)


@pytest.mark.parametrize("function", [analyze, cartesian_spring], ids=["analysis", "model"])
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"stiffness": STIFFNESS[:35]}, "stiffness has 35 numbers, expected 36"),
        ({"mass": changed(MASS, 0, 1, 1e-3)}, r"mass is not symmetric: \[1,2\] is 0.001, but \[2,1\] is 0"),
        ({"stiffness": changed(STIFFNESS, 5, 5, -1.0)}, r"stiffness\[6,6\] is -1, expected above 0"),
        (
            {"stiffness": changed(changed(STIFFNESS, 0, 1, 2e3), 1, 0, 2e3)},
            "stiffness is not positive definite: scaled to a diagonal of 1 it has the eigenvalue -1",
        ),
        ({"mass": changed(MASS, 2, 2, np.nan)}, "mass has entries that are not finite"),
    ],
    ids=["count", "asymmetric", "negative", "indefinite", "nan"],
)
def test_matrices_that_are_none_are_refused(function, arguments, message):
    with pytest.raises(ModelError, match=message):
        function(**arguments)
