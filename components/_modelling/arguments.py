"""Arguments of a part: the keyword-only arguments of its function, values read by annotation.

A dotted name is a field of an argument that is a dataclass; `posture.rotation[3]` is one element of it, and leaves the
others as they are. A value may be text, as typed on a command line; the annotation gives its type. The value of a
`documents.Document` is the path of its file, or its table.

    @dataclass(frozen=True)
    class Machine(ArgumentGroup):
        rods: Rods = Rods()
        gear: float = 5.0

    def robot(*, machine: Machine = Machine()) -> Model: ...            # arguments rods.length, rods.diameter, gear

Parts that know the same machine share its arguments by such a group.
"""

import dataclasses
import difflib
import inspect
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, reduce
from types import NoneType, UnionType
from typing import Any, ClassVar, Literal, Union, get_args, get_origin, get_type_hints

from hfsa.components._modelling.documents import is_content, is_document, read_document
from hfsa.components._modelling.follows import changed
from hfsa.components._modelling.model import ModelError, nearest

_ELEMENT = re.compile(r"^(.+)\[(\d+)\]$")


class ArgumentGroup:
    """Base of a dataclass whose fields are arguments by their own names, without that of the keyword.

    The attribute `is_argument_group` says so, also of a dataclass that has it without this base.
    """

    is_argument_group: ClassVar[bool] = True


@dataclass(frozen=True)
class Argument:
    """One structural argument by its full name, `posture.rotation`.

    Attributes:
        name: full name.
        annotation: type.
        default: value where none is given.
        path: keyword of the function, then the field of each dataclass, down to the value.
        owner: function or dataclass whose docstring describes it.
    """

    name: str
    annotation: Any
    default: Any
    path: tuple[str, ...]
    owner: Any

    @property
    def values(self) -> tuple[str, ...]:
        """Admissible names of a `Literal` argument, or of one that may be a file instead; otherwise empty."""
        return next((get_args(kind) for kind in self._kinds if get_origin(kind) is Literal), ())

    @property
    def file(self) -> str:
        """Ending of the name of a file that the argument may be, empty if it is none."""
        return next((kind.ENDING for kind in self._kinds if hasattr(kind, "ENDING")), "")

    @property
    def _kinds(self) -> tuple[Any, ...]:
        """The types of a union, or the one type."""
        return get_args(self.annotation) if get_origin(self.annotation) in (Union, UnionType) else (self.annotation,)


@cache
def _hints(function: Callable[..., Any]) -> Mapping[str, Any]:
    """Return the annotations of a function's arguments."""
    origin = inspect.unwrap(function)
    annotations = {name: kind for name, kind in origin.__annotations__.items() if name != "return"}
    return get_type_hints(type("", (), {"__annotations__": annotations}), origin.__globals__)


@cache
def arguments_of(function: Callable[..., Any] | None) -> Mapping[str, Argument]:
    """Return the arguments of a function by name, dataclasses field by field."""
    if function is None:
        return {}
    hints = _hints(function)
    arguments: dict[str, Argument] = {}
    for name, parameter in inspect.signature(function).parameters.items():
        if name not in hints:
            raise ModelError(
                f"the argument {name} of {function.__name__}() has no annotation to read its value by; expected "
                f"{name}: float, or another type"
            )
        for argument in _leaves((name,), hints[name], parameter.default, function):
            if argument.name in arguments:
                raise ModelError(f"{function.__name__}() has two arguments {argument.name}; expected different names")
            arguments[argument.name] = argument
    return arguments


def _leaves(path: tuple[str, ...], annotation: Any, default: Any, owner: Any) -> Iterator[Argument]:
    """Yield the arguments that a keyword, or a field of a group, stands for; `owner` has the keyword or field."""
    if not dataclasses.is_dataclass(annotation) or is_document(annotation):
        yield Argument(path[-1], annotation, default, path, owner)
        return
    is_group, kinds = getattr(annotation, "is_argument_group", False), get_type_hints(annotation)
    for field in dataclasses.fields(annotation):
        kind, value, inner = kinds[field.name], getattr(default, field.name, None), (*path, field.name)
        if is_group:
            yield from _leaves(inner, kind, value, annotation)
        else:
            yield Argument(f"{path[-1]}.{field.name}", kind, value, inner, annotation)


def read_arguments(part: str, function: Callable[..., Any], arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keyword arguments of `function`: values read by annotation, dotted names gathered into dataclasses."""
    known = arguments_of(function)
    whole = {name: value for name, value in arguments.items() if _element(name, known) is None}
    values = _read_whole(part, function, known, whole)
    if len(whole) == len(arguments):
        return values
    elements = {name: value for name, value in arguments.items() if name not in whole}
    return _read_whole(part, function, known, whole | _with_elements(part, known, values, elements))


def argument_values(part: str, function: Callable[..., Any] | None, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of all arguments of `function` by full name, the defaults of those that are not given."""
    if function is None:
        return {}
    values = read_arguments(part, function, arguments)
    return {name: _value(values, argument) for name, argument in arguments_of(function).items()}


def _value(values: Mapping[str, Any], argument: Argument) -> Any:
    """Return the value of an argument, or of a field of one, among keyword arguments; else its default."""
    keyword, *fields = argument.path
    return reduce(getattr, fields, values[keyword]) if keyword in values else argument.default


def _read_whole(
    part: str, function: Callable[..., Any], known: Mapping[str, Argument], arguments: Mapping[str, Any]
) -> dict[str, Any]:
    """Return keyword arguments as `read_arguments`; none of the given ones is an element of a vector."""
    structures = _structures(known)
    given: dict[tuple[str, ...], Any] = {}
    for name, value in arguments.items():
        if dataclasses.is_dataclass(value) and name not in known and name in structures:
            given[structures[name]] = value
        elif name not in known:
            raise ModelError(f"{part} has no argument {name!r}{nearest(name, known)}")
        elif name == "level" and value == "auto":
            raise ModelError(
                f"{part}: level auto is for an instance in a scene (-p INSTANCE.level=auto), which has outputs, a band "
                f"and a tolerance to choose by; name one of {', '.join(known[name].values)}"
            )
        else:
            given[known[name].path] = read_value(f"{part}: {name}", known[name].annotation, value)
    defaults = inspect.signature(function).parameters
    keywords = {path[0] for path in given}
    return {name: _placed((name,), defaults[name].default, given) for name in keywords}


def _placed(path: tuple[str, ...], value: Any, given: Mapping[tuple[str, ...], Any]) -> Any:
    """Return the value at a path where one is given, else `value`, with what is given of its fields."""
    value = given.get(path, value)
    inner = {known[len(path)] for known in given if len(known) > len(path) and known[: len(path)] == path}
    return (
        changed(value, {name: _placed((*path, name), getattr(value, name), given) for name in inner})
        if inner
        else value
    )


def _structures(known: Mapping[str, Argument]) -> dict[str, tuple[str, ...]]:
    """Return the paths of all dataclasses that contain arguments, by the last name of the path."""
    paths = [argument.path[:length] for argument in known.values() for length in range(1, len(argument.path))]
    return {path[-1]: path for path in paths}


def takes(known: Mapping[str, Argument], name: str) -> bool:
    """Whether a name is that of an argument, of an element of one, or of a dataclass that contains some."""
    return name in known or _element(name, known) is not None or name in _structures(known)


def _element(name: str, known: Mapping[str, Argument]) -> tuple[str, int] | None:
    """Return the argument and the place, from 1, that the name of an element means; `None` where it is no such name."""
    match = _ELEMENT.match(name)
    if match is None or name in known or match[1] not in known:
        return None
    annotation = known[match[1]].annotation
    kinds = get_args(annotation) if get_origin(annotation) in (Union, UnionType) else (annotation,)
    return (match[1], int(match[2])) if any(get_origin(kind) in (tuple, list) for kind in kinds) else None


def _with_elements(
    part: str, known: Mapping[str, Argument], values: Mapping[str, Any], elements: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the vectors of keyword arguments, with elements in their places; `ModelError` where one is too short."""
    found: dict[str, Any] = {}
    for name, value in elements.items():
        base, place = _element(name, known) or (name, 0)
        vector = found.setdefault(base, list(_value(values, known[base]) or ()))
        if not 1 <= place <= len(vector):
            has = f"elements 1 to {len(vector)}" if vector else "no elements until it is given whole"
            raise ModelError(f"{part} has no argument {name!r}: {base} has {has}")
        vector[place - 1] = value
    return found


def read_value(where: str, annotation: Any, value: Any) -> Any:
    """Return `value` as the annotation says; text is parsed, numbers and sequences are checked."""
    origin, members = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        if value not in members:
            near = difflib.get_close_matches(str(value), members, n=1, cutoff=0.5)
            hint = f" (did you mean {near[0]}?)" if near else ""
            raise ModelError(f"{where} is {value!r}, expected one of {', '.join(map(str, members))}{hint}")
        return value
    if origin in (Union, UnionType):
        return _read_union(where, members, value)
    if is_document(annotation):
        return read_document(where, annotation, value, read_value)
    if origin in (tuple, list):
        if not isinstance(value, Iterable) or isinstance(value, Mapping):
            raise ModelError(f"{where} is {value!r}, expected a list of values")
        items = value.split(",") if isinstance(value, str) else list(value)
        fixed = origin is tuple and Ellipsis not in members
        if fixed and len(items) != len(members):
            raise ModelError(f"{where} has {len(items)} values, expected {len(members)}")
        kinds = members if fixed else [members[0]] * len(items)
        return origin(read_value(where, kind, item) for kind, item in zip(kinds, items, strict=True))
    if annotation is bool:
        words = {"true": True, "false": False, "1": True, "0": False, "yes": True, "no": False}
        if str(value).lower() not in words:
            raise ModelError(f"{where} is {value!r}, expected true or false")
        return words[str(value).lower()]
    if annotation in (int, float, str):
        kind = {int: "a whole number", float: "a number", str: "a text"}[annotation]
        if isinstance(value, bool) and annotation is not str:
            raise ModelError(f"{where} is {value!r}, expected {kind}")
        try:
            return annotation(value.strip() if isinstance(value, str) else value)
        except (TypeError, ValueError, OverflowError):
            raise ModelError(f"{where} is {value!r}, expected {kind}") from None
    return value


def _read_union(where: str, members: tuple[Any, ...], value: Any) -> Any:
    """Return a value as the first of the types that takes it; the error is that of the first.

    Documents come before others for what may be the content of one.
    """
    if value is None and NoneType in members:
        return None
    if is_content(value):
        members = tuple(sorted(members, key=lambda member: not is_document(member)))
    errors = []
    for member in members:
        if member is NoneType:
            continue
        try:
            return read_value(where, member, value)
        except ModelError as error:
            errors.append(error)
    raise errors[0]
