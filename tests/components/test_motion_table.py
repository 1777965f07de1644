"""Motions in tables: splines against closed forms, the rows themselves, the ends, and files that are wrong."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from hfsa.components import ModelError
from hfsa.components._modelling import motion_table
from hfsa.components._modelling.arguments import read_value
from hfsa.components._modelling.motion_table import MotionTable, splined

END, FOURTH = 2.0, 8 * np.pi**4
"""End [s] of sin^4(pi t / END), and a bound of its fourth derivative: (pi/2)^4 (4^4 / 8 + 2^4 / 2) < 8 pi^4."""


def table(time, **columns) -> MotionTable:
    return MotionTable({name: tuple(np.asarray(v).tolist()) for name, v in {"time": time, **columns}.items()})


def function(found: MotionTable, names=("x",)):
    """Time -> values, rates, accelerations, (3, names), also where the expression is differentiated by CasADi."""
    t = ca.SX.sym("t")
    moved = splined(found, names, t)
    return ca.Function("motion", [t], [ca.horzcat(*moved).T]), ca.Function(
        "slopes", [t], [ca.horzcat(ca.jacobian(moved.value, t), ca.jacobian(moved.rate, t)).T]
    )


def smooth(t):
    """sin^4(pi t / END), at rest with three derivatives at both ends, and its first two derivatives."""
    w, s, c = np.pi / END, np.sin(np.pi * t / END), np.cos(np.pi * t / END)
    return np.array([s**4, 4 * w * s**3 * c, 4 * w**2 * (3 * s**2 * c**2 - s**4)])


@pytest.mark.parametrize("rows", [21, 41, 81, 161])
def test_the_errors_are_within_the_bounds_of_the_theory(rows):
    """Hall and Meyer: 5/384 h^4, h^3/24 and 3/8 h^2 times the fourth derivative; of fourth order under refinement."""
    at = np.linspace(0, END, rows)
    motion, _ = function(table(at, x=smooth(at)[0]))
    times = np.linspace(0, END, 997, endpoint=False)
    errors = np.abs(np.array([np.array(motion(t)).ravel() for t in times]).T - smooth(times)).max(axis=1)
    h = END / (rows - 1)
    assert np.all(errors <= np.array([5 / 384 * h**4, h**3 / 24, 3 / 8 * h**2]) * FOURTH + 1e-13)
    assert errors[0] > 1e-4 * h**4 * FOURTH  # the bound is near, not vacuous


@settings(max_examples=40)
@given(
    st.lists(st.floats(1e-3, 10.0), min_size=1, max_size=30),
    st.floats(-5.0, 5.0),
    st.integers(0, 2**32 - 1),
    st.lists(st.floats(-0.2, 1.2), min_size=1, max_size=8),
)
def test_a_spline_is_that_of_scipy_and_constant_outside(gaps, begin, seed, places):
    at = begin + np.concatenate([[0.0], np.cumsum(gaps)])
    values = np.random.default_rng(seed).normal(size=(len(at), 2))
    motion, slopes = function(table(at, x=values[:, 0], yaw=values[:, 1]), ("x", "yaw"))
    expected = CubicSpline(at, values, bc_type="clamped")
    size = np.abs(expected(at, 2)).max() + 1
    for place in places:
        t = at[0] + place * (at[-1] - at[0])
        found, slope = np.array(motion(t)), np.array(slopes(t))
        inside = at[0] <= t < at[-1]
        wanted = np.array([expected(np.clip(t, at[0], at[-1]), k) * (inside or k == 0) for k in range(3)])
        assert found == pytest.approx(wanted, abs=1e-11 * size * max(1.0, (at[-1] - at[0]) ** 2))
        if inside and np.abs(at - t).min() > 1e-9:
            assert slope == pytest.approx(found[1:], abs=1e-9 * size)  # derivatives of the expressions, by CasADi


def test_every_row_is_met_and_both_derivatives_are_continuous():
    at = np.cumsum(np.random.default_rng(1).uniform(0.1, 2.0, 50))
    x = np.random.default_rng(2).normal(size=50)
    motion, _ = function(table(at, x=x))
    assert [float(motion(t)[0]) for t in at] == pytest.approx(x, rel=1e-13)
    for t in at[1:-1]:
        before, after = np.array(motion(t - 1e-10)), np.array(motion(t + 1e-10))
        assert after == pytest.approx(before, abs=1e-7)
    for t in (at[0], at[-1]):
        assert float(motion(t)[1]) == pytest.approx(0, abs=1e-12)


def test_columns_that_a_table_has_not_are_zero():
    motion, _ = function(table([0, 1], y=[0, 1]), ("x", "y"))
    assert np.array(motion(0.5))[:, 0].tolist() == [0, 0, 0]
    assert float(motion(0.5)[0, 1]) == pytest.approx(0.5)


WRONG = {
    "no time": ("x,y\n0,0\n1,1\n", "expected time and a motion"),
    "time alone": ("time\n0\n1\n", "it has the columns time, expected time and a motion"),
    "unknown": ("time,xx\n0,0\n1,1\n", "line 1: no column 'xx'; did you mean x"),
    "unit": ("time [s],x [um]\n0,0\n1,1\n", "line 1: x is in um, expected m"),
    "unit of time": ("time [ms],x\n0,0\n1,1\n", "line 1: time is in ms, expected s"),
    "twice": ("time,x,x\n0,0,0\n", "line 1: the column x is given twice"),
    "no header": ("0,0\n1,1\n", "line 1: numbers, expected a header that names the columns: time, x"),
    "word": ("time,x\n0,0\n1,left\n", "line 3: x is 'left', expected a finite number"),
    "infinite": ("time,x\n0,0\n1,inf\n", "line 3: x is 'inf', expected a finite number"),
    "short": ("time,x\n0,0\n1\n", "line 3: 1 values, expected 2"),
    "one row": ("time,x\n0,0\n", "it has 1 rows, expected 2 to 100000"),
    "stays": ("time,x\n0,0\n1,1\n1,2\n", "row 3: time is 1 s after 1 s, expected a later one"),
    "falls": ("time,x\n0,0\n1,1\n0.5,2\n", "row 3: time is 0.5 s after 1 s, expected a later one"),
    "empty": ("", "is empty, expected a header with some of time, x"),
}


@pytest.mark.parametrize(("text", "message"), WRONG.values(), ids=WRONG.keys())
def test_a_wrong_file_is_named_with_its_place(tmp_path, text, message):
    file = tmp_path / "it.csv"
    file.write_text(text)
    with pytest.raises(ModelError) as caught:
        read_value("part: motion", MotionTable, str(file))
    assert str(caught.value).startswith(f"{file}")
    assert message in str(caught.value)


def test_too_many_rows_are_refused_with_what_would_do(monkeypatch):
    monkeypatch.setattr(motion_table, "MOST_ROWS", 10)
    with pytest.raises(ModelError, match=r"it has 11 rows, expected 2 to 10; .* some 20 rows per period"):
        table(np.arange(11), x=np.zeros(11))
    with pytest.raises(ModelError, match="different lengths"):
        table([0, 1], x=[0, 1, 2])
    with pytest.raises(ModelError, match="row 2: x is nan"):
        table([0, 1], x=[0, np.nan])


def test_the_largest_table_is_as_good_as_a_short_one():
    """10^5 rows: found by bisection, to the rounding of the rows."""
    at = np.linspace(0, END, motion_table.MOST_ROWS)
    motion, _ = function(table(at, x=smooth(at)[0]))
    for t in np.linspace(0.01, END - 0.01, 20):
        found = np.array(motion(t)).ravel()
        assert found[:2] == pytest.approx(smooth(t)[:2], abs=1e-10)
        assert found[2] == pytest.approx(smooth(t)[2], abs=1e-5)  # rounding over h^2 = 4e-10 s2
