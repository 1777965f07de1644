"""Loop gain and margins of a loop opened at a connection, against hand calculation."""

import numpy as np
import pytest
import scipy.linalg
from numpy.polynomial import polynomial
from spring_loop import KD, KP, LOOP, TF

from hfsa.components import Model
from hfsa.cosim.analysis.margins import find_connection, open_loop
from hfsa.cosim.assembly.build import build
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.linear.linearize import linearize
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, Connection, System
from hfsa.fmus.export import export

T = 0.01
SYSTEM = System([Component("plant", "x"), Component("pd", "x")], LOOP)


def hand_gain(f):
    """(Kp + Kd s / (Tf s + 1)) / (s^2 + 0.5 s + 100)."""
    s = 2j * np.pi * np.asarray(f)
    return (KP + KD * s / (TF * s + 1)) / (s * s + 0.5 * s + 100)


@pytest.mark.parametrize("cut", LOOP, ids=str)
def test_a_passive_collocated_loop(files, opened, cut):
    """|L| = 1 by the roots of a polynomial; passive and collocated, it never reaches -1 whatever the gain."""
    loop = open_loop(SYSTEM, opened({"plant": files["Plant", 2], "pd": files["Pd", 2]}), cut)
    f = np.geomspace(0.1, 100, 50)
    np.testing.assert_allclose(loop.gain(f), hand_gain(f), rtol=1e-10)
    np.testing.assert_allclose(loop.sensitivity(f), 1 / (1 + hand_gain(f)), rtol=1e-10)

    def squared(p):
        """Coefficients of |p(j w)|^2 in powers of w^2, of p in powers of s."""
        even, odd = (
            np.array(p[::2]) * (-1) ** np.arange(len(p[::2])),
            np.array(p[1::2]) * (-1) ** np.arange(len(p[1::2])),
        )
        return polynomial.polyadd(
            polynomial.polymul(even, even), polynomial.polymul([0, 1], polynomial.polymul(odd, odd))
        )

    numerator, denominator = [KP, KP * TF + KD], polynomial.polymul([100, 0.5, 1], [1, TF])
    roots = polynomial.polyroots(polynomial.polysub(squared(denominator), squared(numerator)))
    crossings = np.sqrt(sorted(r.real for r in roots if abs(r.imag) < 1e-9 * abs(r) and r.real > 0)) / (2 * np.pi)
    margins = loop.margins()
    assert margins.is_stable
    assert margins.gain == ()
    assert [m.frequency for m in margins.phase] == pytest.approx(crossings, rel=1e-9)
    phase = np.angle(-hand_gain(crossings))
    assert [m.value for m in margins.phase] == pytest.approx(phase, rel=1e-8)
    assert margins.delay == pytest.approx(np.min((phase % (2 * np.pi)) / (2 * np.pi * crossings)), rel=1e-8)
    fine = np.geomspace(0.5, 10, 200_001)
    assert margins.sensitivity_peak == pytest.approx(np.abs(1 / (1 + hand_gain(fine))).max(), rel=1e-6)
    assert abs(1 / (1 + hand_gain(margins.sensitivity_frequency))) == pytest.approx(margins.sensitivity_peak, rel=1e-9)


def sampled_loop():
    """Return P, Q of the plant over a sample time with held force, and the controller as force = -g1 u + g2 last."""
    generator = np.zeros((3, 3))
    generator[:2] = [[0, 1, 0], [-100, -0.5, 1]]
    moved = scipy.linalg.expm(generator * T)
    return moved[:2, :2], moved[:2, 2], KP + KD / T, KD / T


def sampled_poles(gain):
    """Eigenvalues of [x; last] over a sample time, the controller's output multiplied by `gain`."""
    P, Q, g1, g2 = sampled_loop()
    return np.linalg.eigvals(np.block([[P - gain * g1 * np.outer(Q, [1, 0]), gain * g2 * Q[:, None]], [1, 0, 0]]))


@pytest.mark.parametrize("cut", LOOP, ids=str)
@pytest.mark.parametrize("version", [2, 3])
def test_a_sampled_loop_from_sequence_to_sequence(files, opened, cut, version):
    """The loop gain is that of the z-transforms, and a gain margin is where a pole meets the unit circle."""
    loop = open_loop(SYSTEM, opened({"plant": files["Plant", version], "pd": files["SampledPd", version]}), cut)
    assert loop.highest == pytest.approx(50)
    P, Q, g1, g2 = sampled_loop()
    f = np.geomspace(0.1, 50, 40)
    z = np.exp(2j * np.pi * f * T)
    position = [np.linalg.solve(zi * np.eye(2) - P, Q)[0] for zi in z]
    np.testing.assert_allclose(loop.gain(f), (g1 - g2 / z) * position, rtol=1e-9)
    margins = loop.margins()
    assert margins.is_stable
    for margin in margins.gain:
        angle = np.angle(on := sampled_poles(margin.value))
        met = np.abs(np.abs(angle) / (2 * np.pi * T) - margin.frequency) < 1e-6
        assert np.abs(np.abs(on[met]) - 1).min() < 1e-6
    first = min(margin.value for margin in margins.gain)
    assert np.abs(sampled_poles(0.999 * first)).max() < 1
    assert np.abs(sampled_poles(1.001 * first)).max() > 1


def delayed(samples: int) -> Model:
    """A line that delays a force by whole samples."""
    m = Model("DelayLine", "Delay of whole samples")
    m.sample_time(T)
    late = [m.sampled_state(f"late[{i}]", "N", "Force on its way") for i in range(1, samples + 1)]
    force = m.input("force", "N", "Force")
    for before, after in zip([force, *late], late, strict=False):
        m.next[after] = before
    m.sampled_output("late", late[-1], "N", "Force, late")
    return m


def test_a_delay_beyond_its_margin_makes_the_loop_unstable(files, opened, tmp_path):
    loop = open_loop(SYSTEM, opened({"plant": files["Plant", 2], "pd": files["SampledPd", 2]}), LOOP[0])
    most = int(loop.margins().delay / T)
    for samples in (most, most + 1):
        found = opened(
            {
                "plant": files["Plant", 2],
                "pd": files["SampledPd", 2],
                "line": export(delayed(samples), tmp_path, (2,))[0],
            }
        )
        wiring = System(
            [Component(name, "x") for name in ("plant", "pd", "line")],
            [LOOP[0], Connection("pd.force", "line.force"), Connection("line.late", "plant.force")],
        )
        poles = linearize(wiring, found, [], ["plant.position"]).poles
        assert (poles.real.max() > 0) == (samples > most)


def test_the_robot_s_first_motor(opened):
    """The gain margin scales one axis' gains up to where the whole loop becomes unstable, the other five closed."""
    scene = load_scene("sdelta_hfsa", {"gravity": "9.81"})
    found = opened(build(scene.system).files)
    loop = open_loop(scene.system, found, find_connection(scene.system, "controller.axis[1].command"))
    margins = loop.margins()
    assert margins.is_stable
    assert loop.highest == pytest.approx(2000)
    assert margins.sensitivity_peak < 1.1
    (margin,) = margins.gain
    start = scene.system["controller"].start
    for factor, is_stable in ((0.999, True), (1.001, False)):
        gains = ("axis[1].proportional_gain", "axis[1].derivative_gain")
        starts = {f"controller.{name}": start[name] * margin.value * factor for name in gains}
        poles = linearize(scene.system, found, [], scene.outputs, starts).poles
        assert np.all(poles.real < 0) == is_stable


def test_an_unstable_loop_says_so(files, opened):
    loop = open_loop(
        System([Component("plant", "x"), Component("pd", "x", start={"sample_time": 0.1})], LOOP),
        opened({"plant": files["Plant", 2], "pd": files["SampledPd", 2]}),
        LOOP[1],
    )
    assert not loop.margins().is_stable


def test_naming_a_connection(files, opened):
    for name in ("pd.force", "plant.force", "pd.force -> plant.force", "pd.force->plant.force"):
        assert find_connection(SYSTEM, name) == LOOP[1]
    with pytest.raises(StructureError, match=r"no connection is called 'pd\.forze'; did you mean pd\.force"):
        find_connection(SYSTEM, "pd.forze")
    with pytest.raises(StructureError, match=r"no connection is called 'plant\.position -> plant\.force'"):
        find_connection(SYSTEM, "plant.position -> plant.force")
    twice = System(
        [Component(name, "x") for name in ("plant", "pd", "other")],
        [*LOOP, Connection("plant.position", "other.position")],
    )
    with pytest.raises(StructureError, match=r"plant\.position fits several connections: .*; say which"):
        find_connection(twice, "plant.position")
    found = opened({"plant": files["Plant", 2], "pd": files["Pd", 2]})
    with pytest.raises(StructureError, match=r"plant\.position -> pd\.position closes no loop"):
        open_loop(System(SYSTEM.components, LOOP[:1]), found, LOOP[0]).margins()
