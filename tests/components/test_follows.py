"""What is left out of a payload or a stack follows from what is given: one density, one ceramic, one quality."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hfsa.components import ModelError, pzt_stack, sdelta
from hfsa.components._mechanics.pzt import TOKIN, Stack
from hfsa.components._mechanics.sdelta_inertia import CUBE, Payload
from hfsa.components._modelling.parts import Part, read_arguments

SDELTA = Part("sdelta", sdelta, sdelta.sdelta, sdelta.analyze)
PZT = Part("pzt_stack", pzt_stack, pzt_stack.pzt_stack, pzt_stack.analyze)


def edge(payload: Payload) -> float:
    """Edge of the cube of this inertia [m]."""
    return math.sqrt(6 * payload.inertia[0] / payload.mass)


def typed(**words: str) -> Payload:
    """The payload of the robot's analysis by words as typed, with dots in the place of two underscores."""
    arguments = {name.replace("__", "."): value for name, value in words.items()}
    return read_arguments("sdelta", sdelta.analyze, arguments)["payload"]


# Payload --------------------------------------------------------------------------------------------------------------


@given(st.floats(1e-3, 100.0))
def test_a_payload_of_a_mass_alone_is_a_steel_cube_of_that_mass(mass):
    """It has the density of the thesis' specimen and stands on the same plate, 6.25 mm above S."""
    payload = typed(payload__mass=repr(mass))
    assert mass / edge(payload) ** 3 == pytest.approx(3.0 / 0.072**3, rel=1e-12)
    assert payload.center == (0, 0, pytest.approx(edge(payload) / 2 + 0.00625, rel=1e-12))
    assert payload.inertia[0] == payload.inertia[1] == payload.inertia[2]


def test_the_default_is_the_specimen_to_the_last_bit():
    assert Payload(3.0, (0.0, 0.0, 0.04225), (3.0 * 0.072**2 / 6,) * 3) == CUBE


def test_without_a_mass_the_platform_is_alone():
    assert typed(payload__mass="0").inertia == (0, 0, 0)
    alone = SDELTA.analysis(**{"payload.mass": "0"})["mass_C"]
    assert alone[3, 3] == pytest.approx(4.4857 - 3.0, abs=1e-12)
    with pytest.raises(ModelError, match="with no mass, expected 0,0,0"):
        typed(payload__mass="0", payload__inertia="1e-3,1e-3,1e-3")


def test_what_is_given_beside_the_mass_is_kept():
    payload = typed(payload__mass="1", payload__inertia="1e-3,2e-3,1.5e-3")
    assert payload.inertia == (1e-3, 2e-3, 1.5e-3)
    assert payload.center == typed(payload__mass="1").center
    assert typed(payload__inertia="1e-3,2e-3,1.5e-3").center == CUBE.center


def test_an_element_counts_from_what_follows():
    """`payload.inertia[1]` changes one moment of the 1 kg cube, not of the default's 3 kg."""
    payload = typed(payload__mass="1", **{"payload__inertia[1]": "5e-4"})
    assert payload.inertia == (5e-4, *typed(payload__mass="1").inertia[1:])


def test_the_fmu_says_what_followed():
    information = SDELTA.model(**{"payload.mass": "1"}).information
    assert information["payload.inertia[1]"] == typed(payload__mass="1").inertia[0]
    assert information["payload.center[3]"] == pytest.approx(0.0312111, abs=1e-6)


# Stack ----------------------------------------------------------------------------------------------------------------


@given(st.floats(1.0, 1e5), st.floats(1e-7, 1e-3), st.floats(1.0, 1e3))
def test_a_stack_of_another_size_is_of_the_same_ceramic(force, stroke, voltage):
    """Coupling factor, quality factor and density, by volume ~ F0 s0, are those of the Tokin."""
    given = {"stack.blocking_force": force, "stack.stroke": stroke, "stack.full_voltage": voltage}
    found, tokin = PZT.analysis(**given), PZT.analysis()
    assert found["stiffness"] == pytest.approx(force / stroke, rel=1e-12)
    assert found["coupling"] == pytest.approx(force / voltage, rel=1e-12)
    assert found["coupling_factor"] == pytest.approx(tokin["coupling_factor"], rel=1e-12)
    for of in (found, tokin):
        of["quality"] = math.sqrt(of["stiffness"] * of["effective_mass"]) / of["damping"]
    assert found["quality"] == pytest.approx(tokin["quality"], rel=1e-12)
    assert found["mass"] / (force * stroke) == pytest.approx(tokin["mass"] / (833 * 16e-6), rel=1e-12)
    assert found["clamped_capacitance"] / found["capacitance"] == pytest.approx(
        1 - found["coupling_factor"] ** 2, rel=1e-9
    )


@given(st.floats(1e6, 1e9))
def test_stiffness_and_blocking_force_are_two_words_for_one_thing(stiffness):
    by_stiffness = read_arguments("pzt_stack", pzt_stack.analyze, {"stack.stiffness": stiffness})["stack"]
    by_force = read_arguments("pzt_stack", pzt_stack.analyze, {"stack.blocking_force": stiffness * 16e-6})["stack"]
    for field in ("blocking_force", "stroke", "stiffness", "capacitance", "tip_mass", "damping"):
        assert getattr(by_stiffness, field) == pytest.approx(getattr(by_force, field), rel=1e-12)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            {"stiffness": 1e6, "blocking_force": 5.0},
            "blocking_force 5 N is not stiffness 1e.06 N/m times stroke 1.6e-05 m",
        ),
        ({"stroke": -1.0}, "stroke is -1, expected more than 0"),
        ({"blocking_force": math.nan}, "blocking_force is nan, expected more than 0"),
        ({"damping": -1.0}, r"damping is -1 N\.s/m, expected 0 or more"),
        ({"capacitance": 1e-7}, "capacitance is 1e-07 F, expected more than 5.92356e-07 F"),
    ],
)
def test_stacks_that_cannot_be_are_refused(given, message):
    with pytest.raises(ModelError, match=message):
        Stack(**given)


def test_the_model_starts_as_the_tokin():
    model = PZT.model()
    starts = {q.name: q.start for q in model}
    assert starts["maximum.force"] == TOKIN.blocking_force == 833.0
    assert starts["clamped_capacitance"] == 1.4e-6 - (833 / 150) ** 2 / (833 / 16e-6)
