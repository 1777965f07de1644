"""Parts are found by file, arguments read by annotation, mistakes answered with the nearest right name."""

import sys
from dataclasses import dataclass
from types import ModuleType
from typing import Literal

import numpy as np
import pytest

import hfsa.components
import hfsa.controllers
from hfsa.components import Model, ModelError
from hfsa.components._modelling.catalogue import find, part_named
from hfsa.components._modelling.parts import Part, read_arguments
from hfsa.components._modelling.units import BASE, unit

PARTS = find([hfsa.components, hfsa.controllers])


@dataclass(frozen=True)
class Mount:
    """Where it sits."""

    lever: tuple[float, float, float] = (0.0, 0.0, 0.1)
    side: Literal["left", "right"] = "left"


def gadget(*, level: Literal["static", "planar"] = "static", mount: Mount = Mount(), count: int = 2) -> Model:
    """A part of the test."""
    m = Model("Gadget", f"{level} {count}")
    m.parameter("gain", mount.lever[2], "1", "Gain", min=0)
    m.output("y", m.time, "s", "Time")
    return m


@pytest.fixture
def part() -> Part:
    module = ModuleType("gadget", "A gadget.\n\nIts law.")
    module.gadget = gadget
    sys.modules["gadget"] = module
    return Part("gadget", module, gadget, None)


def test_text_is_read_as_the_annotation_says(part):
    model = part.model("planar", **{"mount.lever": "1,2,3.5", "mount.side": "right", "count": "4"})
    assert model["gain"].start == 3.5
    assert model.information == {
        "level": "planar",
        "mount.lever[1]": 1.0,
        "mount.lever[2]": 2.0,
        "mount.lever[3]": 3.5,
        "mount.side": "right",
        "count": 4.0,
    }


@pytest.mark.parametrize(
    ("whole", "expected"),
    [({}, (0, 0, 9)), ({"mount.lever": "1,2,3"}, (1, 2, 9)), ({"mount": Mount((4.0, 5.0, 6.0))}, (4, 5, 9))],
)
def test_one_element_of_a_vector_leaves_the_others(whole, expected):
    assert read_arguments("gadget", gadget, {"mount.lever[3]": "9", **whole})["mount"].lever == expected


def test_an_element_is_an_argument_of_a_model(part):
    model = part.model(**{"mount.lever[3]": "9"})
    assert model["gain"].start == model.information["mount.lever[3]"] == 9.0


def test_a_parameter_of_the_model_takes_a_start_value(part):
    assert part.model(gain="7")["gain"].start == 7.0


def test_every_part_takes_a_solver(part):
    assert part.model().solver is None
    assert part.model(solver="rk4").solver == "rk4"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"solver": "cvod"}, "gadget: solver is 'cvod'; did you mean cvode"),
        ({"level": "plannar"}, "gadget: level is 'plannar', expected one of static, planar .did you mean planar"),
        ({"mount.levr": "1,2,3"}, "no argument 'mount.levr'; did you mean mount.lever"),
        ({"mount.lever": "1,2"}, "mount.lever has 2 values, expected 3"),
        ({"mount.lever": "1,2,x"}, "mount.lever is 'x', expected a number"),
        ({"mount.lever[4]": "1"}, r"no argument 'mount.lever\[4\]': mount.lever has elements 1 to 3"),
        ({"mount.lever[0]": "1"}, r"no argument 'mount.lever\[0\]': mount.lever has elements 1 to 3"),
        ({"mount.lever[1]": "x"}, "mount.lever is 'x', expected a number"),
        ({"count[1]": "1"}, r"no argument 'count\[1\]'; did you mean count"),
        ({"count": "2.5"}, "count is '2.5', expected a whole number"),
        ({"gian": 1.0}, "no argument 'gian'; did you mean gain"),
        ({"gain": -1.0}, "gain is -1 1, expected 0 to inf"),
    ],
)
def test_mistakes_are_named(part, arguments, message):
    with pytest.raises(ModelError, match=message):
        part.model(**arguments)


def test_a_misspelt_part_is_answered_with_the_nearest():
    with pytest.raises(ModelError, match="no part is called 'mass_on_sprng'; did you mean mass_on_spring"):
        part_named("mass_on_sprng", PARTS)


@pytest.mark.parametrize("name", sorted(PARTS))
def test_every_part_says_what_it_is_and_builds_with_its_defaults(name):
    part = PARTS[name]
    assert part.doc.endswith("."), "the first line of the module is one sentence"
    if part.build:
        model = part.model()
        model.check()
        assert model.name == "".join(word.capitalize() for word in name.split("_")).replace("Sdelta", "SDelta")
        assert all(q.description for q in model)


# Units of what an analysis answers ------------------------------------------------------------------------------------

ANALYSES = [(name, level) for name, part in PARTS.items() if part.analyze for level in part.levels or (None,)]
MORE = {
    "beam_module": {"dimensions.length": "0.05", "dimensions.diameter": "2e-3"},
    "sdelta": {"point": "0.1,0,0"},
}
"""Arguments that bring further numbers."""


@pytest.mark.parametrize(("name", "level"), ANALYSES, ids=lambda value: str(value))
def test_every_number_of_an_analysis_has_a_unit_at_every_level_that_is_listed(name, level):
    part = PARTS[name]
    numbers = part.analysis(level, **MORE.get(name, {}))
    assert set(numbers) <= set(part.units)
    for key, value in numbers.items():
        rows = [row.split(",") for row in part.units[key].split(";")]
        for text in (text.strip() for row in rows for text in row):
            assert unit(text).name == text
        if len(rows) > 1 or len(rows[0]) > 1:
            shape = np.shape(value)
            assert shape[0] % len(rows) == 0
            assert {len(row) for row in rows} == {len(rows[0])}
            assert len(rows[0]) == 1 or shape[1] % len(rows[0]) == 0


@pytest.mark.parametrize("name", [name for name, part in PARTS.items() if part.units])
def test_no_unit_is_of_a_number_that_never_comes(name):
    part = PARTS[name]
    more = MORE.get(name, {})
    found = set().union(*(part.analysis(level, **more) for level in part.levels or (None,)))
    assert found == set(part.units)


@pytest.mark.parametrize(
    ("name", "key", "kinetic"),
    [("sdelta", "stiffness_C", "mass_C"), ("beam_stage", "stiffness", "mass")],
)
def test_units_of_a_stiffness_and_a_mass_make_those_of_a_squared_frequency(name, key, kinetic):
    """In every block the stiffness is the mass by s2, angles having no dimension."""

    def exponents(key):
        texts = [text.strip() for row in PARTS[name].units[key].split(";") for text in row.split(",")]
        return [dict(zip(BASE, unit(text).exponents, strict=True)) | {"rad": 0} for text in texts]

    for stiffness, mass in zip(exponents(key), exponents(kinetic), strict=True):
        assert stiffness == mass | {"s": mass["s"] - 2}


def answer(*, force: float = 1.0) -> dict[str, float]:
    """What the gadget's analysis returns."""
    return {"force": force}


def test_an_analysis_without_a_level_holds_at_all_of_them(part):
    """And says what it takes where it is asked for what its model takes."""
    part = Part("gadget", part.module, gadget, answer)
    assert part.analysis("planar") == part.analysis(level="static") == {"force": 1.0}
    with pytest.raises(ModelError, match=r"gadget: level is 'planer', expected one of static, planar"):
        part.analysis("planer")
    for name in ("count", "mount.lever[2]", "gain", "solver"):
        with pytest.raises(ModelError) as error:
            part.analysis(**{name: "2"})
        assert f"gadget: {name} is an argument of its FMU, which its analysis does not take; that takes force" in str(
            error.value
        )
    with pytest.raises(ModelError, match=r"gadget has no argument 'fource'; did you mean force\?"):
        part.analysis(fource=1)
