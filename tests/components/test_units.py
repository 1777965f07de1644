"""Units are read from their Modelica spelling; the SI exponents are those of the definitions."""

import pytest

from hfsa.components._modelling.units import BASE, are_alike, carried, rate_unit, unit


def exponents(name: str) -> dict[str, int]:
    return {base: power for base, power in zip(BASE, unit(name).exponents, strict=True) if power}


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("1", {}),
        ("N.m", {"kg": 1, "m": 2, "s": -2}),
        ("N.m/rad", {"kg": 1, "m": 2, "s": -2, "rad": -1}),
        ("m/s2", {"m": 1, "s": -2}),
        ("kg.m2", {"kg": 1, "m": 2}),
        ("N/(m.s)", {"kg": 1, "s": -3}),
        ("1/s", {"s": -1}),
        ("C/m", {"A": 1, "s": 1, "m": -1}),
        ("N/V", {"m": -1, "A": 1, "s": 1}),
    ],
)
def test_exponents(name, expected):
    assert exponents(name) == expected


@pytest.mark.parametrize("name", ["Nm", "m^2", "N*m", "", "meter", "m//s", "rad / s"])
def test_a_wrong_spelling_is_refused(name):
    with pytest.raises(ValueError, match="unit"):
        unit(name)


@pytest.mark.parametrize("name", ["m", "m/s", "rad", "rad/s", "1", "N.m/rad", "kg", "1/s"])
def test_a_rate_unit_is_the_unit_per_second(name):
    expected = exponents(name)
    expected["s"] = expected.get("s", 0) - 1
    assert exponents(rate_unit(name)) == {base: power for base, power in expected.items() if power}


def test_rate_units_are_spelt_as_declared_units_are():
    assert [rate_unit("m"), rate_unit("m/s"), rate_unit("rad/s")] == ["m/s", "m/s2", "rad/s2"]


@pytest.mark.parametrize("text", ["degC", "rpm", "%", "N·m", "m^2", "-", "m³/h"])
def test_a_text_of_a_foreign_fmu_is_carried(text):
    assert unit(carried(text)).name == text
    assert unit(carried(text)).exponents is None
    assert unit(rate_unit(carried(text))).exponents is None
    with pytest.raises(ValueError, match="unit"):
        unit(text)


def test_a_carried_text_is_like_itself_alone():
    assert are_alike(carried("degC"), carried("degC"))
    assert not are_alike(carried("degC"), "K")
    assert are_alike(carried("N.m"), "kg.m2/s2")
