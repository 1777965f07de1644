"""Linear transformation of connections: units of one kind are converted, others refused, factors taken as given."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, Connection, System
from hfsa.cosim.systems.transformations import transformation
from hfsa.cosim.systems.units import conversion

JOINED = Connection("a.y", "b.u")
KELVIN = (0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def between(start: str | None, end: str | None, joined: Connection = JOINED, **more):
    """Return the transformation between an output and an input of two units."""
    return transformation(joined, Connector("y", 0, "output", unit=start, **more), Connector("u", 0, "input", unit=end))


@pytest.mark.parametrize(
    ("start", "end", "value", "expected"),
    [
        pytest.param("mm", "m", 25.4, 0.0254, id="inch"),
        pytest.param("m", "mm", 0.0254, 25.4, id="back"),
        pytest.param("degC", "K", 100.0, 373.15, id="boiling"),
        pytest.param("K", "degC", 0.0, -273.15, id="absolute-zero"),
        pytest.param("deg", "rad", 180.0, 3.141592653589793, id="half-turn"),
        pytest.param("rpm", "rad/s", 60.0, 6.283185307179586, id="one-turn-a-second"),
        pytest.param("bar", "Pa", 1.01325, 101325.0, id="atmosphere"),
        pytest.param("Nm", "N.m", 3.0, 3.0, id="spelling"),
        pytest.param("%", "1", 50.0, 0.5, id="half"),
        pytest.param("km/h", "m/s", 36.0, 10.0, id="speed"),
    ],
)
def test_known_units_are_converted(start, end, value, expected):
    found = between(start, end)
    factor, offset = (1.0, 0.0) if found is None else (found.factor, found.offset)
    assert factor * value + offset == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("units", [("furlong", "furlong"), (None, "furlong"), ("degC", None), ("m", "m")], ids=str)
def test_a_text_that_no_one_knows_passes_to_its_like_and_to_none(units):
    assert between(*units) is None


@pytest.mark.parametrize("units", [("furlong", "m"), ("mm", "N"), ("rpm", "1/s"), ("m", "M")], ids=str)
def test_units_of_different_kinds_are_refused(units):
    with pytest.raises(StructureError, match=f"a.y is in {units[0]}, but b.u in {units[1]}; expected units with"):
        between(*units)


def test_the_definition_in_an_fmu_counts_before_the_table():
    """A file whose `mm` is a thousand metres converts as it says."""
    found = between("mm", "m", base_unit=(0.0, 1.0, *[0.0] * 6, 1000.0, 0.0))
    assert found is not None
    assert found.factor == 1000.0


def test_a_difference_of_temperatures_has_no_offset():
    found = between("degC", "K", is_relative=True)
    assert found is None


@pytest.mark.parametrize("units", [("mm", "m"), ("V", "N"), ("furlong", "m"), (None, None)], ids=str)
def test_a_factor_of_the_connection_is_all_that_it_does(units):
    found = between(*units, joined=Connection("a.y", "b.u", factor=-2.0, offset=3.0))
    assert found is not None
    assert (found.factor, found.offset) == (-2.0, 3.0)


@given(*[st.floats(1e-6, 1e6)] * 2, *[st.floats(-1e3, 1e3)] * 2, st.floats(-1e6, 1e6))
def test_there_and_back_is_nothing(one, other, offset, second, value):
    """Exact fractions: base = factor value + offset on both sides gives what the conversion gives."""
    a, b = (*KELVIN, one, offset), (*KELVIN, other, second)
    (factor, shift), (back, again) = conversion(a, b), conversion(b, a)
    exact = (Fraction(one) * Fraction(value) + Fraction(offset) - Fraction(second)) / Fraction(other)
    scale = max(abs(float(exact)), abs(shift), abs(factor * value), 1e-300)
    assert factor * value + shift == pytest.approx(float(exact), abs=1e-13 * scale)
    there = factor * value + shift
    size = max(abs(value), abs(back * there), abs(again), abs(back * shift), 1e-300)
    assert back * there + again == pytest.approx(value, abs=1e-12 * size)


@pytest.mark.parametrize("factor", ["2", True, float("inf"), None], ids=str)
def test_a_factor_is_a_number(factor):
    with pytest.raises(StructureError, match=r"the factor of connection a\.y -> b\.u is .*, expected a finite number"):
        Connection("a.y", "b.u", factor=factor)


def test_members_of_a_range_share_factor_and_offset():
    system = System(
        [Component("a", "x"), Component("b", "x")], [Connection("a.y[1..2]", "b.u[1..2]", factor=0.5, offset=1.0)]
    )
    assert [(c.end, c.factor, c.offset) for c in system.connections] == [("b.u[1]", 0.5, 1.0), ("b.u[2]", 0.5, 1.0)]
