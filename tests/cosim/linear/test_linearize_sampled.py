"""Linear response of systems with sampled FMUs, against sampled-data formulas and explicit recursions."""

from typing import Literal

import numpy as np
import pytest
import scipy.linalg

from hfsa.components import Model, sdelta
from hfsa.components._mechanics.sdelta_robot import Machine
from hfsa.controllers import sdelta_tuning
from hfsa.cosim.assembly.build import build
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.linear.linearize import linear_response, linearize
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, Connection, System

NODES, WEIGHTS = np.polynomial.legendre.leggauss(20)


# The robot under control ----------------------------------------------------------------------------------------------


class MotorPlant:
    """Motors and platform [theta; x at C] with torques, M q'' + D q' + K q = [torque; 0]: spec sections 8, 10, 13."""

    def __init__(self, damping=0.01):
        numbers = sdelta.analyze()
        K, M = numbers["stiffness_C"], numbers["mass_C"]
        omega2, H = scipy.linalg.eigh(K, M)
        D = M @ H @ np.diag(2 * damping * np.sqrt(omega2)) @ H.T @ M
        lever = np.array([0, 0, 0.12675 / 4.4857])
        self.to_S = np.eye(6)
        self.to_S[3:, :3] = [[0, -lever[2], lever[1]], [lever[2], 0, -lever[0]], [-lever[1], lever[0], 0]]
        T_S = numbers["jacobian"]
        T = np.linalg.solve(self.to_S, T_S)
        mass = scipy.linalg.block_diag(Machine().drive_inertia, M)
        join = np.hstack([-T, np.eye(6)])
        inverse = np.linalg.inv(np.asarray(mass))
        self.A = np.block(
            [[np.zeros((12, 12)), np.eye(12)], [-inverse @ join.T @ K @ join, -inverse @ join.T @ D @ join]]
        )
        self.B = np.vstack([np.zeros((12, 6)), inverse[:, :6]])
        self.C = np.hstack([np.zeros((6, 6)), self.to_S, np.zeros((6, 12))])
        tuning = sdelta_tuning.analyze()
        gains = np.diag(tuning["proportional_gain"]), np.diag(tuning["derivative_gain"])
        self.F = np.hstack([gains[0], np.zeros((6, 6)), gains[1], np.zeros((6, 6))])
        self.command = np.linalg.inv(T_S)
        self.gains = gains

    def held(self, time):
        """Return the matrices of motion over `time` with held torque."""
        generator = np.zeros((30, 30))
        generator[:24] = np.hstack([self.A, self.B])
        moved = scipy.linalg.expm(generator * time)
        return moved[:24, :24], moved[:24, 24:]

    def sampled(self, frequency, sample_time, delay=False):
        """Return pose commands to the fundamental of the pose, and the pose at the ticks, (frequencies, 6, 6)."""
        P, Q = self.held(sample_time)
        between = [self.held(t) for t in (NODES + 1) * sample_time / 2]
        found = []
        for s in 2j * np.pi * np.asarray(frequency):
            turn = np.exp(s * sample_time)
            wanted = (self.gains[0] + s * self.gains[1]) @ self.command
            late = 1 / turn if delay else 1.0
            z = np.linalg.solve(turn * np.eye(24) - P + late * Q @ self.F, late * Q @ wanted)
            torque = late * (wanted - self.F @ z)
            y = 0.5 * sum(
                w * np.exp(-s * t) * self.C @ (Pt @ z + Qt @ torque)
                for w, t, (Pt, Qt) in zip(WEIGHTS, (NODES + 1) * sample_time / 2, between, strict=True)
            )
            found.append((y, self.C @ z))
        return np.moveaxis(np.array(found), 1, 0)

    def continuous(self, frequency):
        """Return the same with a continuous controller."""
        return np.array(
            [
                self.C
                @ np.linalg.solve(
                    s * np.eye(24) - self.A + self.B @ self.F,
                    self.B @ (self.gains[0] + s * self.gains[1]) @ self.command,
                )
                for s in 2j * np.pi * np.asarray(frequency)
            ]
        )


def response(opened, frequency, version: Literal[2, 3] = 2, **arguments):
    scene = load_scene("sdelta_hfsa", arguments)
    instances = opened(build(scene.system, version).files)
    return linear_response(scene.system, instances, scene.inputs, scene.outputs, np.asarray(frequency))


def assert_close(found, expected, tolerance):
    """Within `tolerance` of each entry's largest, or of its row's where symmetry makes the entry zero."""
    largest, error = np.abs(expected).max(axis=0), np.abs(found - expected).max(axis=0)
    row = np.broadcast_to(largest.max(axis=1, keepdims=True), largest.shape)
    scale = np.where(largest < 1e-9 * row, row, largest)
    assert np.all(error <= tolerance * scale)


FREQUENCIES = np.concatenate([np.geomspace(1, 50, 25), [23.59, 24.55]])


@pytest.mark.parametrize(("version", "delay"), [(2, False), (2, True), (3, False)])
def test_the_controlled_robot_is_its_sampled_data_formula(opened, version, delay):
    found = response(opened, FREQUENCIES, version, delay=str(delay))
    expected, at_ticks = MotorPlant().sampled(FREQUENCIES, 0.25e-3, delay)
    assert_close(found, expected, 1e-9)
    # what is between the ticks is seen: a part in 1e8 of the response
    assert_close(at_ticks, expected, 1e-6)


def test_printed_amplitude_ratios_of_the_controlled_robot(opened):
    vertical = np.abs(response(opened, [2.0, 5.0, 10.0])[:, 5, 5])
    np.testing.assert_allclose(vertical, [1.36865, 0.97434, 0.33193], atol=1e-5)


def test_a_short_sample_time_tends_to_continuous_control_at_order_one(opened):
    frequency = [2.0, 5.0, 10.0]
    continuous = MotorPlant().continuous(frequency)
    np.testing.assert_allclose(np.abs(continuous[:, 5, 5]), [1.36814, 0.97084, 0.33123], atol=1e-5)
    assert np.degrees(np.angle(continuous[1, 5, 5])) == pytest.approx(-85.6, abs=0.05)
    sample_times = 0.25e-3 / 2 ** np.arange(5)
    error = [np.abs(response(opened, frequency, sample_time=str(T)) - continuous).max() for T in sample_times]
    orders = np.log2(np.divide(error[:-1], error[1:]))
    np.testing.assert_allclose(orders, 1, atol=0.05)
    assert np.all(np.abs(orders - 1)[1:] < np.abs(orders - 1)[:-1])


def test_gravity_is_held_by_the_fed_forward_torque(opened):
    scene = load_scene("sdelta_hfsa", {"gravity": "9.81"})
    point = linearize(scene.system, opened(build(scene.system).files), scene.inputs, scene.outputs).operating_point
    torque = [point[f"controller.axis[{i}].command"] for i in range(1, 7)]
    np.testing.assert_allclose(torque, 0.458382, atol=1e-6)
    assert point["robot.center.position[3]"] == pytest.approx(-0.412e-3, abs=1e-6)
    assert max(abs(value) for name, value in point.items() if "shaft" in name) < 1e-9


def test_without_feed_forward_the_platform_sags_by_the_weight_on_the_gains(opened):
    scene = load_scene("sdelta_hfsa", {"gravity": "9.81"})
    starts = {f"controller.axis[{i}].feed_forward": 0.0 for i in range(1, 7)}
    instances = opened(build(scene.system).files)
    point = linearize(scene.system, instances, scene.inputs, scene.outputs, starts).operating_point
    # holding torque over Kp, 0.458382 / 1.48196 rad on every motor, and 2 iota of them turn the tube by one
    sag = 0.458382 / 1.48196 * sdelta.analyze()["jacobian"][5].sum()
    assert point["robot.center.position[3]"] == pytest.approx(-abs(sag) - 0.412e-3, rel=1e-3)
    assert point["robot.center.position[3]"] == pytest.approx(-0.0196, abs=0.0005)


def test_a_limit_below_the_holding_torque_leaves_no_equilibrium(opened):
    scene = load_scene("sdelta_hfsa", {"gravity": "9.81"})
    starts = {f"controller.axis[{i}].limit": 0.4 for i in range(1, 7)}
    with pytest.raises(StructureError, match="no equilibrium found"):
        linearize(scene.system, opened(build(scene.system).files), [], scene.outputs, starts)


# Small systems --------------------------------------------------------------------------------------------------------

T = 0.02


def plant() -> Model:
    """A mass on a spring with two inputs, one of them with direct feedthrough."""
    m = Model("TwoInputs", "Mass on a spring")
    force = m.input("force", "1", "Held by a controller")
    load = m.input("load", "1", "Disturbance")
    x = m.state("x", "1", "Position")
    v = m.state("v", "1/s", "Velocity")
    m.der[x] = v
    m.der[v] = force + load - 8 * v - 100 * x
    m.output("position", x + 0.02 * load + 0.01 * force, "1", "Position, with direct parts")
    return m


def filter_() -> Model:
    """A sampled low-pass filter."""
    m = Model("Filter", "Sampled low-pass filter")
    m.sample_time(T)
    u = m.input("u", "1", "In")
    z = m.sampled_state("z", "1", "State")
    m.next[z] = 0.6 * z + 0.4 * u
    m.sampled_output("y", 0.6 * z + 0.4 * u, "1", "Out")
    return m


def law() -> Model:
    """A sampled gain with a state."""
    m = Model("Law", "Sampled control")
    m.sample_time(T)
    u, wanted = m.input("u", "1", "In"), m.input("wanted", "1", "Reference")
    z = m.sampled_state("z", "1", "Last")
    m.next[z] = u
    m.sampled_output("y", 20 * wanted - 30 * u - 4 * (u - z), "1", "Out")
    return m


def robot_in_one() -> Model:
    """The plant and its controller in one FMU, with ticks and continuous outputs."""
    m = Model("InOne", "Mass on a spring under sampled control")
    m.sample_time(T)
    load, wanted = m.input("load", "1", "Disturbance"), m.input("wanted", "1", "Reference")
    x, v = m.state("x", "1", "Position"), m.state("v", "1/s", "Velocity")
    z = m.sampled_state("z", "1", "Last position")
    held = m.sampled_state("held", "1", "Force")
    position = x + 0.02 * load + 0.01 * held
    m.next[z] = position
    m.next[held] = 20 * wanted - 30 * position - 4 * (position - z)
    m.der[x] = v
    m.der[v] = held + load - 8 * v - 100 * x
    m.output("position", position, "1", "Position")
    return m


@pytest.fixture(scope="module")
def small(exported):
    return {model.name: exported(model)[2] for model in (plant(), filter_(), law(), robot_in_one())}


def recursion(frequency, *, load, wanted, ratio=1, with_filter=False, filter_first=True):
    """Step plant, filter (sample time `ratio` T) and law (T) from tick to tick until steady; fundamental of position.

    With a filter, the law sees it instead of the position, and what it has put out at the same tick where it is first.
    """
    A = np.array([[0, 1], [-100, -8]])
    times = (NODES + 1) * T / 2
    moves = {t: scipy.linalg.expm(A * t) for t in (*times, T)}
    found = []
    for s in 2j * np.pi * np.asarray(frequency):
        particular = np.linalg.solve(s * np.eye(2) - A, [0, load])  # the load alone, never held

        def between(t, x, force, now, s=s, particular=particular):
            rest = np.linalg.solve(A, [0, force])
            return moves[t] @ (x - particular * now + rest) - rest + particular * now * np.exp(s * t)

        x, force, z_law, z_filter, seen = np.zeros(2, complex), 0j, 0j, 0j, 0j
        ticks, fundamental = 600, []
        for n in range(ticks):
            now = np.exp(s * n * T)
            for who in ("filter", "law") if filter_first else ("law", "filter"):
                position = x[0] + 0.02 * load * now + 0.01 * force  # follows the law's force at once
                if who == "filter" and n % ratio == 0:
                    z_filter = seen = 0.6 * z_filter + 0.4 * position
                if who == "law":
                    u = seen if with_filter else position
                    z_law, force = u, 20 * wanted * now - 30 * u - 4 * (u - z_law)
            if n >= ticks - ratio:
                values = [
                    between(t, x, force, now)[0] + 0.02 * load * now * np.exp(s * t) + 0.01 * force for t in times
                ]
                fundamental.append(0.5 * np.sum(WEIGHTS * np.array(values) * np.exp(-s * (n * T + times))))
            x = between(T, x, force, now)
        found.append(np.mean(fundamental))
    return np.array(found)


SOME = [0.7, 1.8, 2.2]


def loop(names, *, start=()):
    chain = ["plant.position", *names, "plant.force"]
    parts = dict(start)
    components = [Component(name, "x", start=parts.get(name, {})) for name in ("plant", *parts)]
    ends = list(zip(chain[::2], chain[1::2], strict=True))
    return System(components, [Connection(*pair) for pair in ends])


@pytest.mark.parametrize("excited", ["load", "wanted"])
def test_what_enters_a_continuous_part_is_not_held(small, opened, excited):
    """A disturbance is integrated exactly, and passes directly; a reference is sampled."""
    found = opened({"plant": small["TwoInputs"], "law": small["Law"]})
    system = loop(["law.u", "law.y"], start={"law": {}})
    name = {"load": "plant.load", "wanted": "law.wanted"}[excited]
    response = linear_response(system, found, [name], ["plant.position"], np.array(SOME))[:, 0, 0]
    expected = recursion(SOME, load=float(excited == "load"), wanted=float(excited == "wanted"))
    np.testing.assert_allclose(response, expected, rtol=1e-9)


@pytest.mark.parametrize("excited", ["load", "wanted"])
def test_an_fmu_with_states_and_ticks_of_its_own(small, opened, excited):
    found = opened({"it": small["InOne"]})
    system = System([Component("it", "x")])
    response = linear_response(system, found, [f"it.{excited}"], ["it.position"], np.array(SOME))[:, 0, 0]
    expected = recursion(SOME, load=float(excited == "load"), wanted=float(excited == "wanted"))
    np.testing.assert_allclose(response, expected, rtol=1e-9)


@pytest.mark.parametrize("ratio", [1, 3])
@pytest.mark.parametrize("filter_first", [True, False], ids=["filter-first", "law-first"])
def test_several_sample_times_and_the_order_of_ticks(small, opened, ratio, filter_first):
    """The slow filter's tick reaches the law at the same instant only where the filter stands before it."""
    found = opened({"plant": small["TwoInputs"], "filter": small["Filter"], "law": small["Law"]})
    parts = {"filter": {"sample_time": ratio * T}, "law": {}}
    if not filter_first:
        parts = dict(reversed(parts.items()))
    system = loop(["filter.u", "filter.y", "law.u", "law.y"], start=parts)
    response = linear_response(system, found, ["law.wanted"], ["plant.position"], np.array(SOME))[:, 0, 0]
    arguments = {"ratio": ratio, "with_filter": True, "filter_first": filter_first}
    expected = recursion(SOME, load=0.0, wanted=1.0, **arguments)
    np.testing.assert_allclose(response, expected, rtol=1e-9)


def test_a_held_output_has_the_hold_s_sinc_and_half_sample_delay(small, opened):
    found = opened({"law": small["Law"]})
    f = np.array([1.0, 10.0, 24.0])
    response = linear_response(System([Component("law", "x")]), found, ["law.wanted"], ["law.y"], f)[:, 0, 0]
    np.testing.assert_allclose(response, 20 * np.sinc(f * T) * np.exp(-1j * np.pi * f * T), rtol=1e-12)


def test_sample_times_without_a_common_grid(small, opened):
    found = opened({"plant": small["TwoInputs"], "filter": small["Filter"], "law": small["Law"]})
    system = loop(["filter.u", "filter.y", "law.u", "law.y"], start={"filter": {"sample_time": 0.033}, "law": {}})
    with pytest.raises(StructureError, match=r"0\.02 s and 0\.033 s have no common grid.*nearest is 0\.04 s"):
        linear_response(system, found, ["law.wanted"], ["plant.position"], np.array(SOME))


def test_a_sampled_system_is_no_state_space(small, opened):
    found = opened({"plant": small["TwoInputs"], "law": small["Law"]})
    linear = linearize(loop(["law.u", "law.y"], start={"law": {}}), found, ["law.wanted"], ["plant.position"])
    assert linear.is_sampled
    assert np.all(linear.poles.real < 0)
    with pytest.raises(StructureError, match=r"sampled parts \(law\) is no StateSpace"):
        _ = linear.state_space
