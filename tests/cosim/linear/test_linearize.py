"""The exact response from the FMUs' directional derivatives, against closed forms."""

import math

import numpy as np
import pytest
from spring_loop import KD, KP, LOOP, TF

from hfsa.components import Model
from hfsa.cosim.assembly.build import build
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.linear.linearize import linear_response, linearize
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, System
from hfsa.fmus.export import export

VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])


def system(names, connections=(), **starts) -> System:
    return System([Component(name, "x", start=starts.get(name, {})) for name in names], connections)


@VERSIONS
def test_mass_on_spring(opened, version):
    scene = load_scene("mass_on_spring")
    f = np.geomspace(*scene.band, 100)
    s = 2j * np.pi * f
    found = linear_response(scene.system, opened(build(scene.system, version).files), scene.inputs, scene.outputs, f)
    expected = 1e4 / (s * s + 0.5 * s + 1e4)
    assert found.shape == (100, 1, 1)
    np.testing.assert_allclose(found[:, 0, 0], expected, rtol=1e-12)


@VERSIONS
def test_a_closed_loop(files, opened, version):
    """Plant and controller with feedthrough: side by side in matrices, and closed by its poles."""
    found = opened({"plant": files["Plant", version], "pd": files["Pd", version]})
    wiring = system(found, LOOP[:1])
    linear = linearize(wiring, found, ["plant.force"], ["pd.force", "plant.acceleration"])
    A = np.array([[0, 1, 0], [-100, -0.5, 0], [1 / TF, 0, -1 / TF]])
    C = np.array([[-KP - KD / TF, 0, KD / TF], [-100, -0.5, 0]])
    np.testing.assert_allclose(linear.A, A, rtol=1e-14)
    np.testing.assert_allclose(linear.C, C, rtol=1e-14)
    np.testing.assert_array_equal(linear.B, [[0], [1], [0]])
    np.testing.assert_array_equal(linear.D, [[0], [1]])
    model = linear.state_space
    assert model.input_labels == ["plant/force"]
    assert model.output_labels == ["pd/force", "plant/acceleration"]
    assert model.state_labels == ["plant/x", "plant/v", "pd/filtered"]
    f = np.array([0.5, 2.0, 7.0])
    response = linear_response(wiring, found, ["plant.force"], ["pd.force", "plant.acceleration"], f)
    np.testing.assert_allclose(response[:, :, 0].T, model(2j * np.pi * f)[:, 0, :], rtol=1e-12)

    closed = linearize(system(found, LOOP), found, [], ["plant.position"])
    poles = np.linalg.eigvals(closed.A)
    expected = np.roots(np.polyadd(np.polymul([TF, 1], [1, 0.5, 100]), [KP * TF + KD, KP]))
    np.testing.assert_allclose(np.sort_complex(poles), np.sort_complex(expected), rtol=1e-12)


def hardening_spring() -> Model:
    """A mass on a spring that hardens, pressed by a load."""
    m = Model("HardeningSpring", "Mass on a hardening spring")
    force = m.input("force", "N", "Force")
    load = m.parameter("load", 5.0, "N", "Constant load")
    x = m.state("x", "m", "Position")
    v = m.state("v", "m/s", "Velocity")
    m.der[x] = v
    m.der[v] = force + load - 2 * v - 10 * x - 40 * x**3
    m.output("position", x, "m", "Position")
    return m


def test_the_operating_point_is_an_equilibrium(opened, tmp_path):
    (file,) = export(hardening_spring(), tmp_path, (2,))
    found = opened({"spring": file})
    linear = linearize(system(found), found, ["spring.force"], ["spring.position"], {"spring.load": 7.0})
    (x,) = [r.real for r in np.roots([40, 0, 10, -7.0]) if abs(r.imag) < 1e-9]
    assert linear.operating_point["spring.x"] == pytest.approx(x, rel=1e-12)
    assert linear.operating_point["spring.v"] == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(linear.A, [[0, 1], [-10 - 120 * x**2, -2]], rtol=1e-12)


def test_a_sampled_fmu_that_only_listens_takes_no_part(files, opened):
    found = opened({"plant": files["Plant", 2], "pd": files["SampledPd", 2]})
    listening = linearize(system(found, LOOP[:1]), found, ["plant.force"], ["plant.position"])
    assert listening.states == ("plant.x", "plant.v")
    assert not listening.is_sampled


def test_what_cannot_be_linearized(files, opened, foreign):
    found = opened({"plant": files["Plant", 2], "pd": files["Pd", 2], "spring": foreign[2]})
    with pytest.raises(StructureError, match=r"spring: Foreign\.fmu does not offer directional derivatives"):
        linearize(system(found), found, ["spring.u"], ["spring.y"])
    with pytest.raises(StructureError, match=r"plant\.force is fed by pd\.force"):
        linearize(system(found, LOOP), found, ["plant.force"], ["plant.position"])
    with pytest.raises(StructureError, match=r"plant\.position is an FMU's output, expected an input"):
        linearize(system(found, LOOP), found, ["plant.position"], ["plant.position"])
    with pytest.raises(StructureError, match="has no variable 'positon'; did you mean position"):
        linearize(system(found, LOOP), found, [], ["plant.positon"])


# The robot ------------------------------------------------------------------------------------------------------------


def rotation(axis: int, degrees: float) -> np.ndarray:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    Q = np.eye(3)
    i, j = [k for k in range(3) if k != axis]
    Q[i, i] = Q[j, j] = c
    Q[i, j], Q[j, i] = (s, -s) if axis == 1 else (-s, s)
    return Q


def skew(a: np.ndarray) -> np.ndarray:
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def pose_response(frequency: np.ndarray, Q: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Commanded to actual pose of S with rods of 1.7781905e5 N/m and 1 % damping: spec sections 3 to 5, 8 and 10."""
    R, r, k_r = 0.450, 0.150, 3 * 105e9 * math.pi * 0.0115**4 / 64 / 0.115**3
    m, delta, inertia = 4.4857, 0.12675 / 4.4857, np.diag([0.0089432, 0.0089432, 0.0117172])
    angles = np.radians([210, 330, 90])
    B = R * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(3)])
    C = Q @ [0, 0, delta]
    N = []
    for j in range(3):
        middle = (B[j] + B[(j + 1) % 3]) / 2
        e_c = (B[(j + 1) % 3] - B[j]) / np.linalg.norm(B[(j + 1) % 3] - B[j])
        p = Q @ (r * middle / np.linalg.norm(middle))
        S = a + p
        foot = middle + e_c * (e_c @ (S - middle))
        e_l = (S - foot) / np.linalg.norm(S - foot)
        N += [np.concatenate([np.cross(p - C, e), e]) for e in (e_c, np.cross(e_c, e_l))]
    K = k_r * np.array(N).T @ np.array(N)
    M = np.block([[Q @ inertia @ Q.T, np.zeros((3, 3))], [np.zeros((3, 3)), m * np.eye(3)]])
    root = np.linalg.inv(np.linalg.cholesky(M))
    values, vectors = np.linalg.eigh(root @ K @ root.T)
    H = root.T @ vectors
    D = M @ H @ np.diag(2 * 0.01 * np.sqrt(values)) @ H.T @ M
    X = np.block([[np.eye(3), np.zeros((3, 3))], [skew(C), np.eye(3)]])
    found = []
    for s in 2j * np.pi * np.asarray(frequency):
        found.append(X @ np.linalg.solve(M * s * s + D * s + K, D * s + K) @ np.linalg.inv(X))
    return np.array(found)


POSTURES = {
    "symmetric": ({}, np.eye(3), np.array([0, 0, 0.150])),
    "A": (
        {"posture.rotation": "10,5,8", "posture.position": "0.005,0.003,0.155"},
        rotation(2, 10) @ rotation(0, 5) @ rotation(1, 8),
        np.array([0.005, 0.003, 0.155]),
    ),
}


@pytest.mark.parametrize("posture", POSTURES)
def test_sdelta_shaker(opened, posture):
    """All 36 entries within 1e-9 of the entry's maximum, or of the row's where symmetry makes it zero."""
    arguments, Q, a = POSTURES[posture]
    scene = load_scene("sdelta_shaker", arguments)
    f = np.concatenate([np.geomspace(*scene.band, 60), [23.58966, 24.54538]])
    found = linear_response(scene.system, opened(build(scene.system).files), scene.inputs, scene.outputs, f)
    expected = pose_response(f, Q, a)
    largest, error = np.abs(expected).max(axis=0), np.abs(found - expected).max(axis=0)
    is_zero = largest < 1e-9 * largest.max(axis=1, keepdims=True)
    assert np.count_nonzero(is_zero) == (26 if posture == "symmetric" else 0)
    assert np.all(error[~is_zero] < 1e-9 * largest[~is_zero])
    assert np.all(error[is_zero] < 1e-9 * np.broadcast_to(largest.max(axis=1, keepdims=True), (6, 6))[is_zero])


def test_printed_amplitude_ratios(opened):
    """A row of the specification's table: ratios at 24.55 Hz, symmetric posture."""
    scene = load_scene("sdelta_shaker")
    found = linear_response(
        scene.system, opened(build(scene.system).files), scene.inputs, scene.outputs, np.array([24.55])
    )
    row = np.abs(found[0])
    printed = {(0, 0): 5.6168, (2, 2): 1.02378, (3, 3): 5.0333, (5, 5): 49.992, (1, 3): 123.17, (3, 1): 0.32740}
    for entry, value in printed.items():
        assert row[entry] == pytest.approx(value, rel=1e-4)
