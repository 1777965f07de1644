"""Arguments of a part: groups whose fields are arguments by their own names."""

from dataclasses import dataclass, replace

import pytest

from hfsa.components import ModelError
from hfsa.components._modelling.arguments import ArgumentGroup, argument_values, arguments_of, read_arguments
from hfsa.components._modelling.follows import follows

# Groups of arguments --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Rods:
    length: float = 2.0
    area: float = follows("length")

    def __post_init__(self):
        if self.area is None:
            object.__setattr__(self, "area", self.length**2)


@dataclass(frozen=True)
class _Drive(ArgumentGroup):
    gear: float = 5.0


@dataclass(frozen=True)
class _Machine(ArgumentGroup):
    rods: _Rods = _Rods()
    drive: _Drive = _Drive()
    axis: tuple[float, float] = (1.0, 2.0)


def _built(*, machine: _Machine = _Machine(), mass: float = 1.0) -> _Machine:
    return replace(machine, axis=(*machine.axis, mass))


def test_fields_of_a_group_are_arguments_by_their_own_names():
    assert list(arguments_of(_built)) == ["rods.length", "rods.area", "gear", "axis", "mass"]
    assert argument_values("it", _built, {"gear": "7"}) == {
        "rods.length": 2.0, "rods.area": 4.0, "gear": 7.0, "axis": (1.0, 2.0), "mass": 1.0
    }  # fmt: skip


def test_what_is_given_of_a_group_is_changed_and_what_follows_from_it():
    read = read_arguments("it", _built, {"rods.length": "3", "gear": 4, "axis[2]": 9.0})
    assert read == {"machine": _Machine(_Rods(3.0, 9.0), _Drive(4.0), (1.0, 9.0))}
    whole = read_arguments("it", _built, {"rods": _Rods(5.0, 1.0), "rods.length": 6.0})
    assert whole == {"machine": _Machine(_Rods(6.0, 36.0))}
    assert read_arguments("it", _built, {"machine": _Machine(axis=(0.0, 0.0)), "gear": 2.0}) == {
        "machine": _Machine(drive=_Drive(2.0), axis=(0.0, 0.0))
    }


def test_a_name_within_a_group_is_not_dotted():
    with pytest.raises(ModelError, match=r"it has no argument 'drive\.gear'; did you mean gear"):
        read_arguments("it", _built, {"drive.gear": 1.0})


def test_two_arguments_of_one_name_are_refused():
    def twice(*, machine: _Machine = _Machine(), gear: float = 1.0) -> None: ...

    with pytest.raises(ModelError, match=r"twice\(\) has two arguments gear"):
        arguments_of(twice)
