"""Gains, offsets and units on connections: every way to run or linearise a system applies them alike."""

from dataclasses import replace

import numpy as np
import pytest

from hfsa.cosim.assembly.build import build
from hfsa.cosim.linear.linearize import linear_response
from hfsa.cosim.masters.algorithms import open_master
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.scene_file import read_scene_text, scene_text
from hfsa.cosim.systems.system import Component, Connection, System

STIFFNESS, DAMPING, MASS = 1e4, 20.0, 1.0
FACTOR, OFFSET = -3.0, 2e-3
FREQUENCY = np.array([1.0, 10.0, 15.0, 40.0])


def two_masses(**joined: float) -> System:
    """One mass on the motion of another, transformed on the way."""
    start = {"damping": DAMPING}
    components = [Component(name, "mass_on_spring", start=start) for name in "ab"]
    return System(components, [Connection("a.position", "b.base.position", **joined)])


def gain(frequency: np.ndarray) -> np.ndarray:
    """Return position over base position of one mass: k / (k - m w^2 + i c w)."""
    omega = 2 * np.pi * frequency
    return STIFFNESS / (STIFFNESS - MASS * omega**2 + 1j * DAMPING * omega)


def test_the_linear_response_has_the_factor():
    assembly = build(two_masses(factor=FACTOR, offset=OFFSET))
    with assembly.open() as instances:
        found = linear_response(assembly.system, instances, ["a.base.position"], ["b.position"], FREQUENCY)
    np.testing.assert_allclose(found[:, 0, 0], FACTOR * gain(FREQUENCY) ** 2, rtol=1e-9)


@pytest.mark.parametrize(
    ("algorithm", "error"),
    [
        pytest.param("gauss_seidel", 1e-2, id="gauss_seidel"),
        pytest.param("jacobi", 2e-2, id="jacobi"),
        pytest.param("gauss_seidel_quadratic", 1e-5, id="gauss_seidel_quadratic"),
        pytest.param("quasi_newton", 1e-4, id="quasi_newton"),
        pytest.param("monolithic", 1e-7, id="monolithic"),
    ],
)
def test_a_run_is_that_of_a_source_with_the_factor(algorithm, error, library):
    """The second mass moves as one whose base is held at factor times the first's rest plus the offset."""
    assembly = build(two_masses(factor=FACTOR, offset=OFFSET))
    start = {"a.mass.position": 1e-3}
    master = open_master(assembly, algorithm, 1e-4, library)
    try:
        recording = master.record(["a.position", "b.base.position", "b.position"], rows=2001)
        master.initialize(starts=start)
        master.advance(2000)
        a, base, b = recording.values.T
    finally:
        master.close()
    np.testing.assert_allclose(base, FACTOR * a + OFFSET, atol=1e-12)
    expected = _second(recording.time, 1e-3)
    np.testing.assert_allclose(b, expected, atol=error * np.ptp(expected))


def _second(time: np.ndarray, released: float) -> np.ndarray:
    """Return the position of the second mass where the first is released at rest, by the exact modes of both."""
    from scipy.linalg import expm

    own = np.array([[0, 1], [-STIFFNESS, -DAMPING]]) / MASS
    own[0, 1] = 1.0
    matrix = np.zeros((5, 5))
    matrix[:2, :2] = matrix[2:4, 2:4] = own
    matrix[3, 0], matrix[3, 4] = STIFFNESS * FACTOR / MASS, STIFFNESS * OFFSET / MASS
    step = expm(matrix * (time[1] - time[0]))
    states = [np.array([released, 0, 0, 0, 1.0])]
    for _ in time[1:]:
        states.append(step @ states[-1])
    return np.array(states)[:, 2]


def test_units_of_one_kind_are_converted_on_the_way():
    """A position in mm drives a base in m: the gain of the mass and no more."""
    gauge = Component("gauge", "linear_transformation", None, {"units": ["mm"], "results": ["mm"]}, {"factor[1]": 5.0})
    mass = Component("mass", "mass_on_spring", start={"damping": DAMPING})
    assembly = build(System([gauge, mass], [Connection("gauge.value[1]", "mass.base.position")]))
    with assembly.open() as instances:
        found = linear_response(assembly.system, instances, ["gauge.signal[1]"], ["mass.position"], FREQUENCY)
    np.testing.assert_allclose(found[:, 0, 0], 5e-3 * gain(FREQUENCY), rtol=1e-9)


def test_a_plain_system_gets_no_component_more():
    system = two_masses()
    assert build(system).system is system


def test_connections_of_one_pair_share_a_component():
    system = two_masses(factor=2.0)
    system = replace(system, connections=[*system.connections, Connection("b.position", "a.base.position", offset=1.0)])
    names = [component.name for component in build(system).system.components]
    assert names == ["a", "transformation[1]", "b", "transformation[2]"]


def test_fmus_alone_refuse_what_they_do_not_apply():
    system = two_masses(factor=2.0)
    assembly = build(two_masses())
    with pytest.raises(StructureError, match=r"a\.position -> b\.base\.position has factor 2 and offset 0"):
        open_master(replace(assembly, system=system), "jacobi", 1e-3, None)


def test_a_scene_keeps_factor_and_offset_as_text():
    scene = Scene(two_masses(factor=FACTOR, offset=OFFSET), [], ["b.position"], step_size=1e-3, stop_time=1.0)
    assert read_scene_text(scene_text(scene)) == scene
    assert "factor" not in scene_text(replace(scene, system=two_masses()))
