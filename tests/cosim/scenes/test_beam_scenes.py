"""Scenes on beam modules: docstrings, swept and linearised responses, and divergence of a massless spring."""

import numpy as np
import pytest
import scipy.linalg
from algorithm_groups import HELD
from parts_by_name import part
from scene_responses import assert_close, errors, linear, one_step, responses, scene, swept

from hfsa.components._mechanics.rigid_body import Body
from hfsa.cosim.analysis.stability import CoupledStep, OneStep
from hfsa.cosim.assembly import build
from hfsa.cosim.assembly.fuse import fused
from hfsa.cosim.linear.linearize import linearize
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.systems.system import Component, Connection, System

RATIO = 0.01
SHAKEN = [f"payload.base.acceleration[{i}]" for i in (1, 2, 3)]
POSITION = [f"payload.platform.position[{i}]" for i in (1, 2, 3)]
ROTATION = [f"payload.platform.rotation[{i}]" for i in (1, 2, 3)]
STATES = [
    f"payload.center.{name}[{i}]"
    for name in ("position", "rotation", "velocity", "angular_velocity")
    for i in (1, 2, 3)
]
AHEAD = part("beam_stage").analysis(kind="double_tilted", platform=Body(center=(0.03, 0.0, 0.0)))


def whole(opened, at, frequency) -> np.ndarray:
    """Return the response of a scene's outputs to its inputs, (frequencies, outputs, inputs)."""
    return linear(opened, at, at.inputs, at.outputs, frequency)


def by_hand(mass: float, inertia: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """M and K of a disc on three round aluminium beams by the source's formulas for them."""
    E, G, L, D, r = 69e9, 26e9, 0.05, 2e-3, 0.6
    d, delta, EI = 16 * (L / D) ** 2, 2 * G / E, E * np.pi * D**4 / 64
    C = np.diag([1 / (3 * d), 0, 0, 1 / (3 * delta + 36 * r**2), 0, 0])
    C[1, 1] = C[2, 2] = (r**2 * d + 8) / (36 * (r**2 * d + 2))
    C[4, 4] = C[5, 5] = 2 / (3 * (r**2 * d + 2))
    C[1, 5] = C[5, 1] = 1 / (3 * (r**2 * d + 2))
    C[2, 4] = C[4, 2] = -C[1, 5]
    scale = np.array([L, L, L, 1, 1, 1])
    return np.diag([mass] * 3 + inertia), np.linalg.inv(L / EI * np.outer(scale, scale) * C)


# A stage by wrench ----------------------------------------------------------------------------------------------------

M, K = by_hand(0.1, [4.5e-5, 2.25e-5, 2.25e-5])
SQUARES, SHAPES = scipy.linalg.eigh(K, M)
NATURAL = np.sqrt(SQUARES) / (2 * np.pi)


def test_the_stage_resonates_where_another_eigenproblem_says(opened):
    at = scene("beam_bode")
    poles = linearize(at.system, opened(build.build(at.system).files), at.inputs, at.outputs).poles
    np.testing.assert_allclose(np.sort(np.abs(poles))[::2] / (2 * np.pi), NATURAL, rtol=1e-6)
    np.testing.assert_allclose(-poles.real / np.abs(poles), RATIO, rtol=1e-5)
    np.testing.assert_allclose(NATURAL, [62.82, 62.82, 96.36, 1815.1, 2569.8, 2569.8], rtol=1e-4)


def test_every_entry_is_a_sum_over_the_modes(opened):
    frequency = np.unique([*np.geomspace(10, 5200, 15), *NATURAL])
    s = 2j * np.pi * frequency[:, None]
    gains = 1 / (s**2 + 2 * RATIO * np.sqrt(SQUARES) * s + SQUARES)
    expected = np.einsum("im,fm,jm->fij", SHAPES, gains, SHAPES)
    found = whole(opened, scene("beam_bode"), frequency)
    assert np.all(np.abs(found - expected) < 1e-6 * np.abs(expected).max(axis=0) + 1e-15)
    coupled = np.abs(found).max(axis=0) > 1e-12
    np.testing.assert_array_equal(np.argwhere(coupled & ~np.eye(6, dtype=bool)), [[1, 5], [2, 4], [4, 2], [5, 1]])


def test_the_bode_plot_of_the_stage_is_as_documented(opened):
    still, *at = np.abs(whole(opened, scene("beam_bode"), [0.1, 1815.1, 96.36, 62.82]))
    assert [still[0, 0], still[3, 3], still[1, 1], still[5, 1], still[5, 5], still[1, 5]] == pytest.approx(
        [7.69e-8, 6.06e-2, 6.42e-5, 4.27e-6, 1.71e-4, 4.27e-6], rel=2e-3
    )
    for peak, (i, j) in zip(at, ((0, 0), (3, 3), (1, 1)), strict=True):
        assert 20 * np.log10(peak[i, j] / still[i, j]) == pytest.approx(34, abs=0.1)


@pytest.mark.parametrize("algorithm", HELD)
def test_the_step_of_the_stage_has_the_documented_error(opened, algorithm):
    at, frequency = scene("beam_bode"), np.array([*NATURAL[[0, 2, 3, 4]], 2 * NATURAL[-1], 5200.0])
    expected = whole(opened, at, frequency)
    for excited, column in ((1, [1, 5]), (3, [3])):
        found = one_step(opened, at, at.inputs[excited], at.outputs, frequency, algorithm)[:, column]
        decibels, degrees = errors(found, expected[:, column, excited])
        assert decibels < 1.1e-4
        assert degrees == pytest.approx(0.47, abs=0.005)
    assert at.band[1] > 2 * NATURAL[-1]


def assert_swept_is_linearized(library, opened, excited: int, frequency) -> None:
    at = scene("beam_bode")
    expected = whole(opened, at, frequency)[:, :, excited]
    amplitude = at.amplitude["N" if excited < 3 else "N.m"]
    found = responses(swept(library, at, at.inputs[excited], at.outputs, frequency, amplitude=amplitude))
    moved = np.abs(expected).max(axis=0) > 1e-12
    assert_close(found[:, moved], expected[:, moved])
    assert np.all(np.abs(found[:, ~moved]) < 1e-12)


@pytest.mark.parametrize(("excited", "frequency"), [(1, [NATURAL[0], 2 * NATURAL[-1]]), (5, [NATURAL[-1]])])
@pytest.mark.slow
def test_a_stepped_sweep_is_the_linearized_response(library, opened, excited, frequency):
    """At the lowest mode, at the highest and at twice that."""
    assert_swept_is_linearized(library, opened, excited, frequency)


@pytest.mark.slow
@pytest.mark.parametrize("excited", range(6))
def test_all_stepped_sweeps_are_the_linearized_response(library, opened, excited):
    frequency = np.unique([10.0, 300.0, 1000.0, *NATURAL[[0, 2, 3, 4]], 0.99 * NATURAL[3], 2 * NATURAL[-1]])
    assert_swept_is_linearized(library, opened, excited, frequency)


# A payload on a base that is shaken -----------------------------------------------------------------------------------


def test_the_bode_plot_of_the_payload_is_as_documented(opened):
    at = scene("beam_payload")
    still, along, across, above = whole(opened, at, [1.0, 908.1, 641.9, 1e5])
    assert np.abs(np.diag(still)[:2]) == pytest.approx([3.07e-8, 6.15e-8], rel=1e-3)
    assert 20 * np.log10(abs(along[0, 0] / still[0, 0])) == pytest.approx(34, abs=0.1)
    assert 20 * np.log10(abs(across[1, 1] / still[1, 1])) == pytest.approx(34, abs=0.1)
    np.testing.assert_allclose(above[:3], np.eye(3) / (2e5 * np.pi) ** 2, rtol=1e-3, atol=1e-16)
    for found in (still, along, across):
        assert np.abs(found[3:]).max() < 1e-9 * np.abs(found[:3]).max()
    f = np.array([1.0, 79.0, 1444.2])
    low, first, second = np.abs(whole(opened, scene("beam_payload", **{"payload.center": "0,0,0"}), f))[:, [1, 5], 1]
    assert low == pytest.approx([3.27e-6, 1.07e-4], rel=3e-3)
    assert low[0] / abs(still[1, 1]) == pytest.approx(53.2, abs=0.1)
    assert 20 * np.log10(first[1] / low[1]) == pytest.approx(34, abs=0.2)
    beside = np.abs(whole(opened, scene("beam_payload", **{"payload.center": "0,0,0"}), [1400.0, 1490.0]))[:, 5, 1]
    assert second[1] > 2 * beside.max()


def test_either_suspension_has_the_same_linear_response(opened):
    frequency = np.geomspace(10, 2000, 7)
    merged, massless = (
        whole(opened, scene("beam_payload", suspension=way, **{"payload.center": "0.01,-0.02,0.005"}), frequency)
        for way in ("merged", "massless")
    )
    assert np.all(np.abs(massless - merged) < 1e-9 * np.abs(merged).max(axis=0) + 1e-15)


@pytest.mark.parametrize(
    ("algorithm", "along", "across"), [*((a, 1.34, 0.92) for a in HELD[:2]), (HELD[2], 4.85, 3.13)]
)
def test_the_step_of_the_payload_has_the_documented_error(opened, algorithm, along, across):
    frequency = np.array([641.9, 908.1, 2000.0])
    merged, massless = (scene("beam_payload", suspension=way) for way in ("merged", "massless"))
    for k, expected in ((0, [along]), (1, [across])):
        exact = whole(opened, merged, frequency)[:, k, k]
        decibels, degrees = errors(
            one_step(opened, merged, SHAKEN[k], merged.outputs, frequency, algorithm)[:, k], exact
        )
        assert decibels < 1e-4
        assert degrees == pytest.approx(0.36, abs=1e-3)
        peak = 1 - k
        found = one_step(opened, massless, SHAKEN[k], massless.outputs, frequency[[peak]], algorithm)[:, k]
        assert errors(found, exact[[peak]])[0] == pytest.approx(expected[0], abs=0.01)


# A stiffness that is exchanged ----------------------------------------------------------------------------------------


def coupled_step(opened, algorithm: str = "gauss_seidel", **arguments) -> CoupledStep:
    system = scene("beam_payload", suspension="massless", **arguments).system
    return CoupledStep(system, opened(build.build(system).files), algorithm)


def growth(step: OneStep, frequency: float) -> float:
    """Return the rate of the mode at a frequency [Hz], the fastest growing of equal ones [1/s]."""
    return max(mode.rate for mode in step.modes if mode.frequency == pytest.approx(frequency, rel=0.02))


def suspended(way: str) -> System:
    """Return the scene's system, or that of the massless suspension with both parts in one FMU."""
    if way == "fused":
        return fused(suspended("massless"), [["suspension", "payload"]])
    return scene("beam_payload", suspension=way).system


def simulated(opened, library, way: str, step_size: float, steps: int, algorithm: str = "gauss_seidel", **starts):
    """Return the payload's states over time, (steps + 1, 12), from starts by full name."""
    system = suspended(way)
    master = make_master(opened(build.build(system).files), system, algorithm, step_size, library)
    recording = master.record(STATES, steps + 1)
    master.initialize(starts=starts)
    master.advance(steps)
    return np.column_stack([recording[name] for name in STATES])


def energy(states: np.ndarray) -> np.ndarray:
    """Return the energy of the payload and of the beams over time [J]."""
    q, rate = states[:, :6], states[:, 6:]
    return (
        np.einsum("ti,ij,tj->t", q, AHEAD["stiffness"], q) / 2 + np.einsum("ti,ij,tj->t", rate, AHEAD["mass"], rate) / 2
    )


@pytest.mark.parametrize("algorithm", HELD)
def test_a_massless_suspension_diverges_above_two_c_over_k(opened, algorithm):
    """Mode by mode, in the shape of each; a third of it where the wrench is a step older (`jacobi_plain`)."""
    found = part("beam_suspension").analysis(kind="double_tilted", platform=Body(center=(0.03, 0.0, 0.0)))
    older = 3 if algorithm == "jacobi_plain" else 1
    made = coupled_step(opened, algorithm)
    for frequency, limit in zip(found["natural_frequencies_hz"], found["step_limits"] / older, strict=True):
        assert growth(made.over(0.98 * limit), frequency) < 0 < growth(made.over(1.02 * limit), frequency)
    least = found["step_limits"].min() / older
    assert least == pytest.approx(7.01e-6 / older, rel=1e-3)
    (limit,) = made.stability_limits(least / 3, 1.05 * least, points=8)
    assert limit == pytest.approx(least, rel=1e-3)


@pytest.mark.parametrize("entry", [1, 2])
@pytest.mark.parametrize("factor", [0.9, 0.98, 1.02, 1.1])
def test_it_diverges_in_simulation_as_the_one_step_matrix_says(opened, library, entry, factor):
    """A payload let go along the module, or across it: either mode has a limit of its own."""
    frequency = AHEAD["natural_frequencies_hz"][-1 if entry == 1 else -2]
    step_size = factor * 4 * RATIO / (2 * np.pi * frequency)
    steps = round(1.0 / step_size)
    starts = {f"payload.center.position[{entry}]": 1e-6}
    found = energy(simulated(opened, library, "massless", step_size, steps, **starts))
    measured = np.log(found[-1] / found[0]) / (2 * steps * step_size)
    assert (measured > 0) == (factor > 1)
    expected = growth(coupled_step(opened).over(step_size), frequency)
    assert measured == pytest.approx(expected, rel=0.02, abs=0.05)


def test_without_damping_it_diverges_at_every_step(opened):
    """A mode then grows by omega^2 H / 4."""
    made = coupled_step(opened, damping_ratio=0.0)
    for step_size in (1e-7, 1e-6, 5e-6):
        for frequency in AHEAD["natural_frequencies_hz"]:
            expected = (2 * np.pi * frequency) ** 2 * step_size / 4
            assert growth(made.over(step_size), frequency) == pytest.approx(expected, rel=0.01)


def test_the_merged_one_diverges_at_no_step(opened, library):
    """Steps far above the limit give what steps far below it give, to rounding."""
    starts = {name: 1e-6 * (i + 1) for i, name in enumerate(STATES[:6])}
    fine = simulated(opened, library, "merged", 1e-6, 20_000, **starts)
    for step_size, every in ((8e-6, 8), (1e-3, 1000), (2e-2, 20_000)):
        coarse = simulated(opened, library, "merged", step_size, 20_000 // every, **starts)
        assert np.all(np.abs(coarse - fine[::every]) < 1e-9 * np.abs(fine).max(axis=0))
    for algorithm in HELD:
        end = simulated(opened, library, "merged", 1e-3, 1000, algorithm, **starts)[-1]
        assert np.abs(end).max() < 1e-3 * np.abs(fine).max()
    end = simulated(opened, library, "massless", 20e-6, 20_000, **starts)[-1]
    assert np.abs(end).max() > 1e6 * np.abs(fine).max()


def test_in_one_fmu_with_the_payload_the_massless_one_is_the_merged_one(opened, library):
    starts = {name: 1e-6 * (i + 1) for i, name in enumerate(STATES[:6])} | {SHAKEN[1]: 0.1}
    merged, one = (simulated(opened, library, way, 1e-3, 100, **starts) for way in ("merged", "fused"))
    assert np.all(np.abs(one - merged) < 1e-9 * np.abs(merged).max(axis=0))


def test_the_massless_one_tends_to_the_merged_one_with_first_order(opened, library):
    """End values 5 ms after the base began to accelerate."""
    starts = {SHAKEN[0]: 1.0, SHAKEN[1]: -2.0, "payload.center.rotation[1]": 1e-5}
    exact = simulated(opened, library, "merged", 1e-6, 5000, **starts)[-1, :6]
    off = []
    for step_size in (1e-6, 0.5e-6, 0.25e-6):
        end = simulated(opened, library, "massless", step_size, round(5e-3 / step_size), **starts)[-1, :6]
        off.append(np.linalg.norm(end - exact))
    assert off[0] > 1e-4 * np.linalg.norm(exact)
    np.testing.assert_allclose(np.divide(off[:-1], off[1:]), 2, rtol=0.1)


def test_two_free_bodies_keep_their_momenta_and_diverge_above_the_same_limit(opened, library):
    """Damping and stiffness belong to the beams: 2 c / k along them is the same whatever the bodies' masses."""
    ends = {"base": (1.0, (1e-3, 8e-4, 8e-4)), "platform": (0.1, (4.5e-5, 2.25e-5, 2.25e-5))}
    bodies = [
        Component(end, "rigid_body", None, {"body.mass": mass, "body.inertia": inertia})
        for end, (mass, inertia) in ends.items()
    ]
    beams = Component("beams", "beam_suspension", None, {"from_base": (0.05, 0.0, 0.0)}, {"damping_ratio": RATIO})
    pose, wrench = ("position", "rotation", "velocity", "angular_velocity"), ("force", "torque")
    system = System(
        [*bodies, beams],
        [
            *(Connection(f"{end}.platform.{name}[1..3]", f"beams.{end}.{name}[1..3]") for end in ends for name in pose),
            *(Connection(f"beams.{end}.{name}[1..3]", f"{end}.wrench.{name}[1..3]") for end in ends for name in wrench),
        ],
    )
    found = part("beam_suspension").analysis()
    stiffness, limit = found["stiffness"][0, 0], 2 * found["damping"][0, 0] / found["stiffness"][0, 0]
    assert limit == pytest.approx(found["step_limits"][3])
    frequency = np.sqrt(stiffness * (1 / 1.0 + 1 / 0.1)) / (2 * np.pi)
    made = CoupledStep(system, opened(build.build(system).files))
    assert growth(made.over(0.98 * limit), frequency) < 0 < growth(made.over(1.02 * limit), frequency)
    names = [f"{end}.center.{name}[{i}]" for end in ends for name in pose[2:] for i in (1, 2, 3)]
    master = make_master(opened(build.build(system).files), system, "gauss_seidel", 1e-6, library)
    recording = master.record(names, 1001)
    starts = {f"platform.center.position[{i}]": 1e-6 * i for i in (1, 2, 3)}
    master.initialize(starts=starts | {f"platform.center.rotation[{i}]": -1e-5 * i for i in (1, 2, 3)})
    master.advance(1000)
    base, base_turn, platform, turn = np.split(np.column_stack([recording[name] for name in names]), 4, axis=1)
    momentum = 0.1 * platform
    assert np.abs(momentum + 1.0 * base).max() < 1e-12 * np.abs(momentum).max()
    spins = [np.array(inertia) * rate for (_, inertia), rate in zip(ends.values(), (base_turn, turn), strict=True)]
    about_base = np.cross([0.05, 0.0, 0.0], momentum)
    assert np.abs(sum(spins) + about_base).max() < 1e-11 * np.abs(spins[0]).max()


# On the command line --------------------------------------------------------------------------------------------------


def test_a_large_shake_is_warned_of(hfsa):
    words = ["--frequency", "641.9", "--amplitude", "2000", "--stop", "0.5", "--step", "1e-5"]
    code, out, err = hfsa("run", "beam_payload", "--input", SHAKEN[1], *words)
    assert code == 0
    assert "payload.displacement_warning: displaced too far" in out
    assert "take a smaller motion" in err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["dimensions.length=0"], "dimensions.length is 0 m, expected above 0"),
        (["slenderness=800"], "slenderness d = A L^2 / I is 800, expected at least 1200"),
        (["kind=tilted", "tilt=0"], "tilt is 0 degrees, expected above 0 and up to 90"),
        (["kind=tiltd"], "kind is 'tiltd', expected one of three_beam, double, tilted"),
    ],
)
def test_modules_that_cannot_be(hfsa, words, message):
    code, out, err = hfsa("analyze", "beam_module", *(word for w in words for word in ("-p", w)))
    assert (code, out) == (2, "")
    assert message in err
