"""Check of the arguments of a public function against its own annotations.

    @checked()
    def sweep(scene: str | Path | Scene, *, points: int | None = None, method: Literal["stepped", "linear"] = ...): ...

    sweep("sdelta_shaker", points=0)      # StructureError: points is 0, expected a positive whole number

A number of a public function is a size, a time, a count or a tolerance, and positive, unless the function states that
it may be zero.
"""

import functools
import inspect
import typing
from collections.abc import Callable, Collection, Mapping, Sequence
from numbers import Integral, Real
from types import NoneType, UnionType
from typing import Any, Literal, ParamSpec, TypeVar

import numpy as np

from hfsa.cosim.systems.kinds import is_number, is_positive, refuse

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

_WORDS = {
    bool: "True or False",
    str: "a text",
    int: "a positive whole number",
    float: "a positive number",
    Mapping: "names with values",
    Sequence: "a list",
    NoneType: "None",
}


def checked(zero: Collection[str] = ()) -> Callable[[Callable[Arguments, Result]], Callable[Arguments, Result]]:
    """Return the decorator of a function; numbers named in `zero` may be zero.

    The function then raises `StructureError`, with the argument and what is expected, before anything else happens.
    """

    def decorate(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
        signature, hints = inspect.signature(function), typing.get_type_hints(function)

        @functools.wraps(function)
        def checking(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
            for name, value in signature.bind(*args, **kwargs).arguments.items():
                if not _fits(value, hints[name], name in zero):
                    refuse(name, value, _expected(hints[name], name in zero))
            return function(*args, **kwargs)

        return checking

    return decorate


def _fits(value: Any, hint: Any, may_be_zero: bool) -> bool:
    """Whether a value fits an annotation."""
    origin, members = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, UnionType):
        return any(_fits(value, member, may_be_zero) for member in members)
    if origin is Literal:
        return isinstance(value, str) and value in members
    if origin is Sequence:
        is_list = isinstance(value, Sequence | np.ndarray) and not isinstance(value, str | bytes)
        return is_list and all(_fits(member, members[0], False) for member in value)
    if origin is Mapping:
        return isinstance(value, Mapping) and all(_fits(member, members[1], False) for member in value.values())
    if hint is int:
        return isinstance(value, Integral) and _is_in_range(value, may_be_zero)
    if hint is float:
        return isinstance(value, Real) and _is_in_range(value, may_be_zero)
    return hint is Any or origin is not None or isinstance(value, hint)


def _is_in_range(value: Any, may_be_zero: bool) -> bool:
    """Whether a number is finite and positive, or zero where it may be."""
    return is_positive(value) or (may_be_zero and is_number(value) and value == 0)


def _expected(hint: Any, may_be_zero: bool) -> str:
    """Return what an annotation allows, in words."""
    origin, members = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, UnionType):
        return " or ".join(_expected(member, may_be_zero) for member in members)
    if origin is Literal:
        return "one of " + ", ".join(members)
    if hint in (int, float) and may_be_zero:
        return f"{_WORDS[hint]} or zero"
    if origin is Sequence and members[0] is str:
        return "a list of texts"
    return _WORDS.get(origin or hint, getattr(hint, "__name__", str(hint)))
