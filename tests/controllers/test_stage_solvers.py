"""The stage's nonlinear loop under PD, integrated: what the analysis says of it, and what solvers make of its gains.

The source integrated gains of 1e17 N/m with a solver of the trapezoidal kind, saw errors that would not settle, and
put it down to PD. Here the same loops are integrated by SUNDIALS, with tolerances of the size of what moves, and by two
rules of one line each.
"""

from collections.abc import Sequence

import casadi as ca
import numpy as np
import pytest
from sksundae.cvode import CVODE

from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.model import Kind
from hfsa.components.rrr_stage import rrr_stage
from hfsa.controllers.stage_closed_loop import analyze

RATE, DURATION = 3e-6, 4.0
MODEL = rrr_stage(level="constant_jacobian", causality="force")
MODEL.set_start("damping_time", 0.0)
STAGE, PARAMETERS = functions(MODEL).rhs, [quantity.start for quantity in MODEL.of(Kind.PARAMETER)]


class Loop:
    """The stage on a ramp under PD, over y = (e, e') of its three stacks, (6,); `size` is what y has in use."""

    def __init__(self, kp: float, kv: float):
        t, y = ca.MX.sym("t"), ca.MX.sym("y", 6)
        e, rate = y[:3], y[3:]
        force = ca.vertcat(kp * e + kv * rate, ca.DM.zeros(5))
        acceleration = STAGE(t, ca.vertcat(RATE * t - e, RATE - rate), [], force, PARAMETERS)[3:]
        slope = ca.vertcat(rate, -acceleration)
        self._slope = ca.Function("slope", [t, y], [slope])
        self._jacobian = ca.Function("jacobian", [t, y], [ca.jacobian(slope, y)])
        self.analysis = analyze(proportional_gain=kp, derivative_gain=kv)
        self.omega = float(np.abs(self.analysis["poles"]).max())
        self.start = np.repeat([0.0, RATE], 3)
        self.size = np.repeat([RATE / self.omega, RATE], 3)

    def slope(self, t: float, y: np.ndarray) -> np.ndarray:
        return np.array(self._slope(t, y)).ravel()

    def jacobian(self, t: float, y: np.ndarray) -> np.ndarray:
        return np.array(self._jacobian(t, y))

    def cvode(self, times: Sequence[float] | np.ndarray, tolerance: float, absolute=None, **options):
        """SUNDIALS' solution at `times`, at its own steps where there are two; absolute tolerances by `size`."""

        def rhs(t, y, slope):
            slope[:] = self.slope(t, y)

        def jacobian(t, y, _, matrix):
            matrix[:, :] = self.jacobian(t, y)

        absolute = tolerance * self.size if absolute is None else absolute
        options = {"rtol": tolerance, "atol": absolute, "jacfn": jacobian, "max_num_steps": 1_000_000, **options}
        return CVODE(rhs, **options).solve(np.asarray(times), self.start)

    def implicit(self, steps: int, share: float) -> np.ndarray:
        """States after equal steps, (steps + 1, 6), with this share of the new slope: 1/2 trapezoidal, 1 Euler's."""
        h, rows = DURATION / steps, [self.start]
        for k in range(steps):
            known = rows[-1] + (1 - share) * h * self.slope(k * h, rows[-1])
            new = rows[-1]
            for _ in range(4):  # Newton's method, in units of `size`
                lacking = (new - known - share * h * self.slope((k + 1) * h, new)) / self.size
                matrix = np.eye(6) - share * h * self.jacobian((k + 1) * h, new) * self.size / self.size[:, None]
                new = new - self.size * np.linalg.solve(matrix, lacking)
            rows.append(new)
        return np.array(rows)


# What the analysis says -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("gains", "error", "digit"), [((1e9, 5e4), 0.339e-6, 0.0005e-6), ((1e12, 2e6), 0.349e-9, 0.0005e-9)]
)
def test_middle_gains_settle_at_once(gains, error, digit):
    """75 to 115 steps for the whole ramp; the ramp itself adds Kv e' / Kp to the balance, 1e-5 of it."""
    loop = Loop(*gains)
    found = loop.cvode([0, DURATION], 1e-4)
    assert found.y[-1, :3] == pytest.approx([error] * 3, abs=digit)
    assert found.y[-1, :3] == pytest.approx(loop.analysis["final_error"], rel=2e-5)
    assert 75 <= len(found.t) - 1 <= 115
    late = found.t > 100 * loop.analysis["time_constant"]
    assert found.y[late, 0] == pytest.approx(found.y[-1, 0] / DURATION * found.t[late], rel=0.02)


def test_without_kv_the_loop_rings_for_ever():
    """1e8 N/m: in the last of 50 cycles the error's rate swings as far as in the first."""
    loop = Loop(1e8, 0.0)
    assert loop.analysis["verdict"] == ["rings_for_ever"]
    period = 2 * np.pi / loop.omega
    cycle = np.linspace(0, period, 201)
    found = loop.cvode(np.concatenate([cycle, cycle + 49 * period]), 1e-9, method="Adams")
    first, last = np.ptp(found.y[:201, 3]), np.ptp(found.y[201:, 3])
    assert first == pytest.approx(2 * RATE * (1 - loop.analysis["final_share"]), rel=1e-3)
    assert last == pytest.approx(first, rel=1e-4)


@pytest.mark.slow
def test_without_kv_the_loop_rings_to_the_end_of_the_ramp():
    """11 000 cycles; the hinges soften by 0.8 % as the stage turns, and the swing with them."""
    loop = Loop(1e8, 0.0)
    found = loop.cvode(np.concatenate([[0], np.linspace(DURATION - 2e-3, DURATION, 2001)]), 1e-10, method="Adams")
    assert np.ptp(found.y[1:, 3]) == pytest.approx(2 * RATE * (1 - loop.analysis["final_share"]), rel=0.02)


def test_softer_than_the_hinges_the_stage_hardly_follows():
    """3e6 N/m, a tenth of the hinges' stiffness: 91 % of the way is never gone, and the rest rings."""
    loop = Loop(3e6, 0.0)
    assert loop.analysis["verdict"] == ["rings_for_ever", "softer_than_hinges"]
    found = loop.cvode(np.linspace(0, 0.1, 4001), 1e-8, method="Adams")
    following = np.polyfit(found.t, found.y[:, 0], 1)[0] / RATE
    assert following == pytest.approx(loop.analysis["final_share"], rel=2e-3)
    assert np.ptp(found.y[-100:, 3]) == pytest.approx(np.ptp(found.y[:100, 3]), rel=5e-3)


def test_an_extreme_pair_converges_as_the_analysis_says():
    """1e17 N/m and 1e7 N.s/m: from 5.88e-15 m at 3 ns down to the balance, at the rate of the yaw's poles.

    The ramp moves the yaw alone, which dies away in 0.083 us; the 0.5 us of the table are the translations'.
    """
    loop = Loop(1e17, 1e7)
    yaw = loop.analysis["poles"][np.argmax(np.abs(loop.analysis["poles"]))]
    found = loop.cvode(np.linspace(0, 5e-7, 5001), 1e-9, method="Adams")
    assert np.abs(found.y[:, 0]).max() == pytest.approx(loop.analysis["peak_error"], rel=1e-3)
    assert found.t[np.argmax(found.y[:, 0])] == pytest.approx(loop.analysis["peak_time"], abs=2e-10)
    swing = np.abs(loop.omega * found.y[:, 0] + 1j * found.y[:, 3])
    decay = -np.polyfit(found.t, np.log(swing), 1)[0]
    assert decay == pytest.approx(-np.real(yaw), rel=0.01)
    assert 1 / decay == pytest.approx(0.083e-6, rel=0.02)


@pytest.mark.parametrize("gains", [(1e17, 1e7), (8.6e17, 1e7)])
def test_an_extreme_pair_runs_to_the_end_of_the_ramp(gains):
    """All 4 s, to the final error H / Kp, in a thousand steps of SUNDIALS' BDF of order 2.

    Orders 3 to 5, its default, are unstable for poles this close to the imaginary axis and would have to follow two
    thousand million of their cycles.
    """
    loop = Loop(*gains)
    found = loop.cvode([0, DURATION], 1e-3, max_order=2)
    assert len(found.t) < 5000
    assert found.y[-1, :3] == pytest.approx(loop.analysis["final_error"], rel=1e-5)
    assert np.abs(found.y[-1, 3:]).max() < 1e-9 * RATE


# What solvers make of it ----------------------------------------------------------------------------------------------


def test_the_trapezoidal_rule_never_lets_an_extreme_pair_settle():
    """The false divergence: 74 steps over the ramp, gains of 8.6e17 N/m and 4e4 N.s/m.

    The true error is gone after 0.12 ms, a 400th of the first step. The rule is stable, but of what it does not resolve
    it keeps all but 2e-12 per step, with the opposite sign: the rate of the error jumps between +3 and -3 um/s, as fast
    as the reference moves, from the first step to the last. Whoever looks at it sees a loop that does not settle.
    """
    loop = Loop(8.6e17, 4e4)
    assert loop.analysis["verdict"] == ["converges"]
    assert loop.analysis["time_constant"] < DURATION / 74 / 400
    seen, settled = loop.implicit(74, 0.5), loop.implicit(74, 1.0)
    sign = (-1.0) ** np.arange(75)
    np.testing.assert_allclose(seen[:, 3], sign * RATE, rtol=1e-8)
    e, rate = (seen - settled)[:, 0], (seen - settled)[:, 3]
    yaw = loop.analysis["poles"][np.argmax(np.abs(loop.analysis["poles"]))]
    swing = np.abs(rate - yaw * e)  # of a mode with pole s, exp(s t) and its conjugate, it is the amplitude
    factor = (swing[-1] / swing[1]) ** (1 / 73)
    assert 1 - factor == pytest.approx(1 - loop.analysis["trapezoidal_factor"], rel=0.03, abs=0)
    assert f"{factor:.13f}" == "0.9999999999983"


@pytest.mark.parametrize("gains", [(8.6e17, 4e4), (1e17, 10.0), (1e17, 1e7)])
def test_an_l_stable_rule_lets_it_settle_in_one_step(gains):
    """Euler's implicit rule on the same 74 steps: the error's rate is the balance's own, 3e-10 of the ramp's."""
    loop = Loop(*gains)
    settled = loop.implicit(74, 1.0)
    assert np.abs(settled[1:, 3:]).max() < 1e-9 * RATE
    assert settled[-1, :3] == pytest.approx(loop.analysis["final_error"], rel=1e-9)


def test_the_trapezoidal_rule_is_right_where_it_resolves_the_loop():
    """Middle gains, of whose poles it keeps 93 % at most in each of 740 steps."""
    loop = Loop(1e9, 5e4)
    found = loop.implicit(740, 0.5)
    assert found[-1, :3] == pytest.approx(loop.analysis["final_error"], rel=2e-5)


def test_an_absolute_tolerance_of_1e_6_decides_by_itself():
    """It is as large as the whole ramp's speed, 3e-6 m/s, and a third of a thousand million extreme errors.

    With it, 1e8 N/m without damping, which rings for ever, is called settled by BDF in twenty steps; with tolerances of
    the size of what moves, BDF sees it ring.
    """
    loop = Loop(1e8, 0.0)
    blind = loop.cvode([0, 0.05], 1e-3, 1e-6)
    seeing = loop.cvode([0, 0.05], 1e-7)
    swing = 2 * RATE * (1 - loop.analysis["final_share"])
    assert len(blind.t) < 50
    assert np.ptp(blind.y[-3:, 3]) < 1e-3 * swing
    last = seeing.t > 0.045
    assert np.ptp(seeing.y[last, 3]) == pytest.approx(swing, rel=0.05)
    assert 1e-6 / analyze(proportional_gain=1e17, derivative_gain=10.0)["final_error"].max() > 2.8e8
