"""Parts: the functions named as their files, found in the packages `components` and `controllers`.

    parts = find([hfsa.components, hfsa.controllers])
    model = parts["sdelta"].model(level="cartesian", **{"posture.rotation": "10,5,8", "damping_ratio": 0.02})

Arguments are the keyword-only arguments of the part's function. A dotted name is a field of an argument that is a
dataclass; `posture.rotation[3]` is one element of it, and leaves the others as they are. A value may be text, as typed
on a command line; the annotation says how it is read. The name of a parameter of the built model is accepted too and
sets its start value, and `solver` names the solver of any part's FMU.

Beside its function a part's file may have `analyze`, which returns its engineering numbers, and `study`, which returns
a design study (`_study.Study`): its dimensions as symbols, and what follows from them. Each takes arguments of its own.
`FACTS` there is what the part knows of facts that other parts of a system know as well (`_facts`).
Beside `analyze` stands `UNITS`, the unit of each of its numbers by key: SI, `1` for what has none. Where the entries of
a vector or matrix differ, `;` stands between its rows or equal blocks of rows, `,` between columns: `N/m, N; N, N.m`.
"""

import dataclasses
import difflib
import importlib
import inspect
import pkgutil
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from types import ModuleType, NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from hfsa.components._modelling.facts import Fact, Known
from hfsa.components._modelling.follows import changed
from hfsa.components._modelling.model import SOLVERS, Kind, Model, ModelError, nearest, one_of
from hfsa.components._modelling.study import Study

_ELEMENT = re.compile(r"^(.+)\[(\d+)\]$")

SOLVER = "solver"
"""The argument of every part that names the Co-Simulation solver of its FMU, one of `SOLVERS`."""


@dataclass(frozen=True)
class Argument:
    """One structural argument by its full name, `posture.rotation`; `values` are the admissible ones of a `Literal`."""

    name: str
    annotation: Any
    default: Any

    @property
    def values(self) -> tuple[str, ...]:
        """Admissible values of a `Literal` argument, otherwise empty."""
        return get_args(self.annotation) if get_origin(self.annotation) is Literal else ()


@dataclass(frozen=True)
class Part:
    """A part: `build` returns its `Model`, `analyze` its engineering numbers, `study` its design study; or has none."""

    name: str
    module: ModuleType
    build: Callable[..., Model] | None
    analyze: Callable[..., dict[str, Any]] | None
    study: Callable[..., Study] | None = None

    @property
    def doc(self) -> str:
        """First sentence of the module's docstring."""
        return inspect.cleandoc(self.module.__doc__ or "").split("\n")[0]

    @property
    def levels(self) -> tuple[str, ...]:
        """Levels of fidelity, cheapest first; empty where the part has none."""
        level = self.arguments.get("level")
        return level.values if level else ()

    @cached_property
    def arguments(self) -> Mapping[str, Argument]:
        """Structural arguments of `build` (of `analyze` for an analysis) by full name."""
        return _arguments(self.build or self.analyze)

    @property
    def facts(self) -> Mapping[Fact, Known]:
        """What the part knows of facts on which the parts of a system must agree."""
        return getattr(self.module, "FACTS", {})

    @cached_property
    def analysis_arguments(self) -> Mapping[str, Argument]:
        """Arguments of `analyze` by full name."""
        return _arguments(self.analyze)

    @property
    def units(self) -> Mapping[str, str]:
        """Units of what `analyze` returns, by key."""
        return getattr(self.module, "UNITS", {})

    def has_argument(self, name: str) -> bool:
        """Whether a name is that of a structural argument, or of an element of one."""
        return _takes(self.arguments, name)

    def model(self, level: str | None = None, **arguments: Any) -> Model:
        """Build the model; unknown names and inadmissible values are a `ModelError` that names them."""
        if self.build is None:
            raise ModelError(f"{self.name} is an analysis and has no model; use its analysis instead")
        if level is not None:
            arguments = {"level": level, **arguments}
        structural = {name: value for name, value in arguments.items() if self.has_argument(name)}
        model = self.build(**read_arguments(self.name, self.build, structural))
        parameters = {q.name: q for q in model.of(Kind.PARAMETER)}
        for name, value in arguments.items():
            if name in structural:
                continue
            if name == SOLVER:
                model.solver = one_of(value, SOLVERS, f"{self.name}: {SOLVER}")
                continue
            if name not in parameters:
                known = [*self.arguments, *parameters, SOLVER]
                raise ModelError(f"{self.name} has no argument {name!r}{nearest(name, known)}")
            model.set_start(name, _read(f"{self.name}: {name}", float, value))
        model.information = _information(self, structural, taken=set(parameters))
        return model

    def analysis(self, level: str | None = None, **arguments: Any) -> dict[str, Any]:
        """Return the part's engineering numbers in SI (`units`); errors as in `model`.

        An analysis that knows no level holds at all of the part's.
        """
        if self.analyze is None:
            raise ModelError(f"{self.name} has no analysis of its own; it is a model to export")
        if level is not None:
            arguments = {"level": level, **arguments}
        if self.build is not None and "level" in self.arguments and "level" not in self.analysis_arguments:
            read_arguments(
                self.name, self.build, {name: arguments.pop(name) for name in ("level",) if name in arguments}
            )
        self._refuse_arguments_of_the_model(arguments)
        return self.analyze(**read_arguments(self.name, self.analyze, arguments))

    def _refuse_arguments_of_the_model(self, names: Iterable[str]) -> None:
        """Raise `ModelError` for a name that the model has, but not the analysis, and say what that takes."""
        strange = [name for name in names if not _takes(self.analysis_arguments, name)]
        if self.build is None or not strange:
            return
        known = {*(quantity.name for quantity in self.model().of(Kind.PARAMETER)), SOLVER}
        for name in strange:
            if name in known or self.has_argument(name):
                raise ModelError(
                    f"{self.name}: {name} is an argument of its FMU, which its analysis does not take; that takes "
                    f"{', '.join(self.analysis_arguments) or 'none'}"
                )

    def design_study(self, level: str | None = None, **arguments: Any) -> Study:
        """Return the part's design study; errors as in `model`."""
        if self.study is None:
            raise ModelError(f"{self.name} has no design study")
        if level is not None:
            arguments = {"level": level, **arguments}
        return self.study(**read_arguments(f"{self.name}: a design study", self.study, arguments))


def find(packages: Iterable[ModuleType]) -> dict[str, Part]:
    """Return all parts of the packages by name, in alphabetical order within each package."""
    parts = {}
    for package in packages:
        for info in sorted(pkgutil.iter_modules(package.__path__), key=lambda info: info.name):
            if info.name.startswith("_"):
                continue
            module = importlib.import_module(f"{package.__name__}.{info.name}")
            part = Part(info.name, module, *(getattr(module, word, None) for word in (info.name, "analyze", "study")))
            if part.build is None and part.analyze is None:
                raise ModelError(
                    f"{module.__file__} defines neither a function {info.name} nor analyze; a part needs one"
                )
            parts[info.name] = part
    return parts


def part_named(name: str, parts: Mapping[str, Part]) -> Part:
    """Return the part of that name; `ModelError` with the nearest names if there is none."""
    if name not in parts:
        raise ModelError(f"no part is called {name!r}{nearest(name, parts)}")
    return parts[name]


def studied(name: str, parts: Mapping[str, Part]) -> Part:
    """Return the part of that name, which offers a design study; `ModelError` names those that do if it does not."""
    part = part_named(name, parts)
    if part.study is None:
        offering = ", ".join(other.name for other in parts.values() if other.study is not None)
        raise ModelError(f"{name} offers no design study; these do: {offering or 'none'}")
    return part


@lru_cache(maxsize=256)
def _hints(function: Callable[..., Any]) -> Mapping[str, Any]:
    """Return the annotations of a function's arguments."""
    return get_type_hints(function)


@lru_cache(maxsize=256)
def _arguments(function: Callable[..., Any] | None) -> Mapping[str, Argument]:
    """Return the arguments of a function by name, dataclasses field by field."""
    if function is None:
        return {}
    hints = _hints(function)
    arguments = {}
    for name, parameter in inspect.signature(function).parameters.items():
        annotation, default = hints[name], parameter.default
        if dataclasses.is_dataclass(annotation):
            fields = get_type_hints(annotation)
            for field in dataclasses.fields(annotation):  # type: ignore[arg-type]
                full = f"{name}.{field.name}"
                arguments[full] = Argument(full, fields[field.name], getattr(default, field.name))
        else:
            arguments[name] = Argument(name, annotation, default)
    return arguments


def read_arguments(part: str, function: Callable[..., Any], arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keyword arguments of `function`: values read by annotation, dotted names gathered into dataclasses."""
    known = _arguments(function)
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
    return {name: _value(values, argument) for name, argument in _arguments(function).items()}


def _value(values: Mapping[str, Any], argument: Argument) -> Any:
    """Return the value of an argument, or of a field of one, among keyword arguments; else its default."""
    owner, _, field = argument.name.partition(".")
    if owner not in values:
        return argument.default
    return getattr(values[owner], field) if field else values[owner]


def _read_whole(
    part: str, function: Callable[..., Any], known: Mapping[str, Argument], arguments: Mapping[str, Any]
) -> dict[str, Any]:
    """Return keyword arguments as `read_arguments`; none of the given ones is an element of a vector."""
    hints = _hints(function)
    values: dict[str, Any] = {}
    fields: dict[str, dict[str, Any]] = {}
    for name, value in arguments.items():
        if name in hints and dataclasses.is_dataclass(value):
            values[name] = value
        elif name not in known:
            raise ModelError(f"{part} has no argument {name!r}{nearest(name, known)}")
        elif name == "level" and value == "auto":
            raise ModelError(
                f"{part}: level auto is for an instance in a scene (-p INSTANCE.level=auto), which has outputs, a band "
                f"and a tolerance to choose by; name one of {', '.join(known[name].values)}"
            )
        elif name in hints:
            values[name] = _read(f"{part}: {name}", known[name].annotation, value)
        else:
            owner, field = name.split(".", 1)
            fields.setdefault(owner, {})[field] = _read(f"{part}: {name}", known[name].annotation, value)
    defaults = inspect.signature(function).parameters
    for owner, given in fields.items():
        values[owner] = changed(values.get(owner, defaults[owner].default), given)
    return values


def _takes(known: Mapping[str, Argument], name: str) -> bool:
    """Whether a name is that of an argument, or of an element of one."""
    return name in known or _element(name, known) is not None


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


def _read(where: str, annotation: Any, value: Any) -> Any:
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
    if origin in (tuple, list):
        items = value.split(",") if isinstance(value, str) else list(value)
        fixed = origin is tuple and Ellipsis not in members
        if fixed and len(items) != len(members):
            raise ModelError(f"{where} has {len(items)} values, expected {len(members)}")
        kinds = members if fixed else [members[0]] * len(items)
        return origin(_read(where, kind, item) for kind, item in zip(kinds, items, strict=True))
    if annotation is bool:
        words = {"true": True, "false": False, "1": True, "0": False, "yes": True, "no": False}
        if str(value).lower() not in words:
            raise ModelError(f"{where} is {value!r}, expected true or false")
        return words[str(value).lower()]
    if annotation in (int, float, str):
        try:
            return annotation(value.strip() if isinstance(value, str) else value)
        except (TypeError, ValueError):
            kind = {int: "a whole number", float: "a number", str: "a text"}[annotation]
            raise ModelError(f"{where} is {value!r}, expected {kind}") from None
    return value


def _read_union(where: str, members: tuple[Any, ...], value: Any) -> Any:
    """Return a value as the first of the types that takes it; the error is that of the first."""
    if value is None and NoneType in members:
        return None
    errors = []
    for member in members:
        if member is NoneType:
            continue
        try:
            return _read(where, member, value)
        except ModelError as error:
            errors.append(error)
    raise errors[0]


def _information(part: Part, given: Mapping[str, Any], taken: set[str]) -> dict[str, float | str]:
    """Return the structural arguments as flat constants: numbers as numbers, sequences by member, the rest as text."""
    assert part.build is not None
    flat: dict[str, float | str] = {}
    for name, value in argument_values(part.name, part.build, given).items():
        if isinstance(value, tuple | list):
            flat |= {f"{name}[{i}]": _constant(item) for i, item in enumerate(value, 1)}
        elif value is not None:
            flat[name] = _constant(value)
    return {name: value for name, value in flat.items() if name not in taken}


def _constant(value: Any) -> float | str:
    """Return a value as a constant of an FMU."""
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else str(value)
