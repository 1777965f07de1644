"""Names of variants: they tell level and arguments, differ where these do, and are identifiers of C."""

import itertools
import re

import hypothesis.strategies as st
import pytest
from hypothesis import given

import hfsa.components
import hfsa.controllers
from hfsa.components import Model
from hfsa.components._modelling.catalogue import find
from hfsa.components._modelling.compose import compose
from hfsa.components._modelling.variants import variant

PARTS = find([hfsa.components, hfsa.controllers])


@pytest.mark.parametrize(
    ("part", "level", "arguments", "name"),
    [
        ("pd", None, {}, "Pd"),
        ("pd", "sampled", {}, "Pd"),
        ("pd", "continuous", {}, "Pd_continuous"),
        ("pd", None, {"axes": "3", "delay": "yes"}, "Pd_axes_3_delay_True"),
        ("sdelta", "rigid", {"payload.mass": "1"}, "SDelta_rigid_payload_mass_1"),
        ("sdelta", None, {"payload.mass": 3, "stiffness": "ch4"}, "SDelta"),
        ("sdelta", None, {"posture.position[3]": "0.16"}, "SDelta_posture_position_0_0_0p16"),
        ("sdelta", None, {"damping_ratio": 0.02}, "SDelta_damping_ratio_0p02"),
        ("mass_on_spring", None, {"stiffness": 1e-5, "solver": "rk4"}, "MassOnSpring_solver_rk4_stiffness_1em05"),
        ("sine_source", None, {"unit": "m"}, "SineSource_unit_m"),
    ],
    ids=lambda value: str(value) if isinstance(value, str) else None,
)
def test_a_name_tells_what_differs_from_the_default(part, level, arguments, name):
    assert PARTS[part].model(level, **arguments).identifier == name


def test_what_is_long_or_has_other_characters_is_a_hash():
    names = {PARTS["sine_source"].model(unit=unit).identifier for unit in ("N.m", "N/m", "N.m2")}
    assert len(names) == 3
    assert all(re.fullmatch(r"SineSource_[0-9a-f]{8}", name) for name in names)
    postures = [f"0.0123456789123,0,0.15{k}1234567891234" for k in range(5)]
    names = {PARTS["sdelta"].model("rigid", **{"posture.position": text}).identifier for text in postures}
    assert len(names) == 5
    assert all(re.fullmatch(r"SDelta_rigid_[0-9a-f]{8}", name) for name in names)


VALUES = st.one_of(st.floats(allow_nan=False, allow_infinity=False), st.text(max_size=6), st.sampled_from("abAB01"))
CONSTANTS = st.dictionaries(st.sampled_from(["x", "x[1]", "x[2]", "x.y"]), VALUES, max_size=3)
CHANGED = st.dictionaries(st.sampled_from(["gain", "gain_x", "axis.length", "unit"]), CONSTANTS, min_size=1, max_size=3)


@given(CHANGED)
def test_every_name_is_an_identifier_of_bounded_length(changed):
    name = variant("rigid", changed)
    assert re.fullmatch(r"[A-Za-z0-9_]+", name, re.ASCII)
    assert len(name) <= 46


@given(st.lists(st.one_of(st.floats(allow_nan=False, allow_infinity=False), st.text(max_size=4)), unique=True))
def test_different_values_have_different_names_on_any_file_system(values):
    """Also where capitals do not count; 0 and -0 are different numbers of the same value."""
    names = [variant("", {"x": {"x": value}}).lower() for value in values]
    for (one, name), (other, second) in itertools.combinations(zip(values, names, strict=True), 2):
        assert name != second or str(one) == str(other).swapcase(), (one, other)


def test_a_group_is_named_by_its_members_and_what_joins_them():
    def part(name: str) -> Model:
        m = Model(name, "Doubles")
        m.output("y", 2 * m.input("u", "1", "In"), "1", "Out")
        return m

    names = [
        compose("Group", {"a": part("A"), "b": part("A")}, []).identifier,
        compose("Group", {"a": part("A"), "b": part("A")}, [("a.y", "b.u")]).identifier,
        compose("Group", {"a": part("A"), "c": part("A")}, []).identifier,
    ]
    assert len(set(names)) == 3
    assert compose("Group", {"a": part("A"), "b": part("A")}, []).identifier == names[0]
