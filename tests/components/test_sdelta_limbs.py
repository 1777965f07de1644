"""The wrench of the limbs on the SDelta's platform: from the loads on the tubes, by Newton's law, and under gravity."""

import numpy as np
import pytest
from hypothesis import given, settings
from random_postures import postures

from hfsa.components._mechanics.screws import shift
from hfsa.components._mechanics.sdelta_geometry import Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE, with_payload
from hfsa.components._mechanics.sdelta_kinematics import Kinematics
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind
from hfsa.components.sdelta import analyze, sdelta

A = Posture((10, 5, 8), (0.005, 0.003, 0.155))
AXES = range(1, 4)
LIMBS = [f"limbs/{kind}[{i}]" for kind in ("torque", "force") for i in AXES]
ACCELERATION = [f"platform/{kind}[{i}]" for kind in ("angular_acceleration", "acceleration") for i in AXES]
APPLIED = [f"wrench/{kind}[{i}]" for kind in ("torque", "force") for i in AXES]
LOADS = [f"drive[{j}]/{kind}" for j in AXES for kind in ("force", "torque")]


def response(model, s: complex, outputs: list[str]) -> np.ndarray:
    """Response of some outputs to every input."""
    system = linearize(model)
    rows = [system.output_labels.index(name) for name in outputs]
    inside = np.linalg.solve(s * np.eye(len(system.A)) - system.A, system.B)
    return system.C[rows] @ inside + system.D[rows]


def applied(model) -> np.ndarray:
    """Part of every input in the applied wrench."""
    labels = linearize(model).input_labels
    return np.array([[float(label == name) for label in labels] for name in APPLIED])


@settings(max_examples=5)
@given(posture=postures())
def test_the_limbs_pull_the_platform_with_what_the_tubes_feel(posture):
    """By the rows of the limbs about S, an elastic limb passes on its forces without a loss."""
    model, kinematics = sdelta(posture=posture), Kinematics.at(posture)
    limbs, tubes = (response(model, 2j * np.pi * 14, names) for names in (LIMBS, LOADS))
    expected = -kinematics.rows().T @ (tubes / kinematics.lever[:, None])
    np.testing.assert_allclose(limbs, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("level", ["rigid", "cartesian"])
@pytest.mark.parametrize("point", ["S", "C"])
def test_limbs_and_applied_wrench_accelerate_the_platform(level, point):
    """M xdd about either point; at level rigid the limbs take the inertial reaction as well."""
    model = sdelta(level=level, posture=A, reference_point=point)
    to_C = shift(-A.matrix @ with_payload(CUBE).center) if point == "S" else np.eye(6)
    M = to_C.T @ analyze(posture=A)["mass_C"] @ to_C
    limbs, acceleration = (response(model, 2j * np.pi * 14, names) for names in (LIMBS, ACCELERATION))
    total = M @ acceleration
    np.testing.assert_allclose(limbs + applied(model), total, atol=1e-9 * np.abs(total).max())


def test_the_analysis_tells_attitude_and_inertia_at_any_level():
    numbers = analyze(posture=A)
    about_S = shift(-A.matrix @ with_payload(CUBE).center)
    M = about_S.T @ numbers["mass_C"] @ about_S
    Q, (m, *first, xx, xy, xz, yy, yz, zz) = numbers["attitude"], numbers["inertia_parameters_S"]
    np.testing.assert_allclose(M[:3, :3], Q @ [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]] @ Q.T, atol=1e-15)
    np.testing.assert_allclose(M[3:, 3:], m * np.eye(3))
    np.testing.assert_allclose([M[2, 4], M[0, 5], M[1, 3]], Q @ first, atol=1e-15)
    rigid = analyze(posture=A, level="rigid")
    for key in ("attitude", "inertia_parameters_S"):
        assert np.array_equal(rigid[key], numbers[key])


@pytest.mark.parametrize("level", ["rigid", "cartesian"])
def test_at_rest_the_limbs_carry_the_weight(level):
    """A force m g upwards through the mass centre, off centre by the posture."""
    model, numbers = sdelta(level=level, posture=A), analyze(posture=A)
    f, u, p = functions(model), [q.start for q in model.of(Kind.INPUT)], [0.01, 9.81]
    x = np.zeros(0)
    if level == "cartesian":
        x = np.zeros(12)
        x = -np.linalg.solve(np.array(f.jacobian(0, x, [], u, p)), np.array(f.rhs(0, x, [], u, p))).ravel()
    values = np.array(f.out(0, x, [], u, p)).ravel()
    names = linearize(model).output_labels
    wrench = values[[names.index(name) for name in LIMBS]]
    m, *first = numbers["inertia_parameters_S"][:4]
    np.testing.assert_allclose(wrench[3:], [0, 0, 9.81 * m], atol=1e-9)
    np.testing.assert_allclose(wrench[:3], np.cross(numbers["attitude"] @ first, [0, 0, 9.81]), atol=1e-9)
