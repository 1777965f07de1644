"""Parts: functions named as their files, of the packages `components` and `controllers`, installed, or of one's own.

    parts = find([hfsa.components, hfsa.controllers], "hfsa.parts")
    model = parts["sdelta"].model(level="cartesian", **{"posture.rotation": "10,5,8", "damping_ratio": 0.02})
    model = part_named("./machine/spring.py", parts).model(stiffness="2e4")

The names come from files and from the entry points of installed packages; a module is imported when its part is first
used, so that a mistake in one breaks no other. A path always means the file. Two bare names that are the same are an
error when the part is used.

Arguments are the keyword-only arguments of the part's function (`arguments`). The name of a parameter of the built
model is accepted too and sets its start value; `solver` names the solver of any part's FMU.

Beside its function a part's file may have `analyze`, which returns its engineering numbers, and `study`, which returns
a design study (`study.Study`): its dimensions as symbols, and what follows from them. Each takes arguments of its own.
`FACTS` there are facts that other parts of a system know as well (`facts`), `JOINS` the parts that alone may feed it
(`joins`), `UNITS` the units of the numbers that `analyze` returns, by key: SI, `1` for a number without unit. Where the
entries of a vector or matrix differ, `;` stands between its rows or equal blocks of rows, `,` between columns:
`N/m, N; N, N.m`.
"""

import importlib
import importlib.util
import inspect
import pkgutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from importlib.machinery import PathFinder
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

from hfsa.components._modelling.arguments import (
    Argument,
    argument_values,
    arguments_of,
    read_arguments,
    read_value,
    takes,
)
from hfsa.components._modelling.facts import Fact, Known
from hfsa.components._modelling.joins import Join
from hfsa.components._modelling.loading import (
    Folder,
    Installed,
    files_of,
    folder_of,
    guarded,
    in_words,
    is_path,
    location,
    refusing,
    returned,
    shown,
)
from hfsa.components._modelling.model import SOLVERS, Kind, Model, ModelError, nearest, one_of
from hfsa.components._modelling.study import Study

SOLVER = "solver"
"""The argument of every part that names the Co-Simulation solver of its FMU, one of `SOLVERS`."""

_KINDS: Mapping[str, str] = {"part": "Model", "scene": "Scene"}
"""What the function of a file returns."""


@dataclass(frozen=True)
class Part:
    """A part: `build` returns its `Model`, `analyze` its engineering numbers, `study` its design study; or has none.

    `is_own` means that it does not come with hfsa.
    """

    name: str
    module: ModuleType
    build: Callable[..., Model] | None
    analyze: Callable[..., dict[str, Any]] | None
    study: Callable[..., Study] | None = None
    is_own: bool = False

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
        return arguments_of(self.build or self.analyze)

    @property
    def facts(self) -> Mapping[Fact, Known]:
        """Facts on which the parts of a system must agree, as far as the part knows them."""
        return getattr(self.module, "FACTS", {})

    @property
    def joins(self) -> Sequence[Join]:
        """Parts that alone may feed it."""
        return getattr(self.module, "JOINS", ())

    @cached_property
    def analysis_arguments(self) -> Mapping[str, Argument]:
        """Arguments of `analyze` by full name."""
        return arguments_of(self.analyze)

    @property
    def units(self) -> Mapping[str, str]:
        """Units of the numbers that `analyze` returns, by key."""
        return getattr(self.module, "UNITS", {})

    def has_argument(self, name: str) -> bool:
        """Whether a name is that of a structural argument, or of an element of one."""
        return takes(self.arguments, name)

    def model(self, level: str | None = None, /, **arguments: Any) -> Model:
        """Build the model; unknown names and inadmissible values are a `ModelError` that names them."""
        if self.build is None:
            raise ModelError(f"{self.name} is an analysis and has no model; use its analysis instead")
        arguments = _with_level(level, arguments)
        structural = {name: value for name, value in arguments.items() if self.has_argument(name)}
        model = returned(self.build, Model, self.build(**read_arguments(self.name, self.build, structural)))
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
            model.set_start(name, read_value(f"{self.name}: {name}", float, value))
        model.information = _information(self, structural, taken=set(parameters))
        return model

    def analysis(self, level: str | None = None, /, **arguments: Any) -> dict[str, Any]:
        """Return the part's engineering numbers in SI (`units`); errors as in `model`.

        An analysis that knows no level holds at all of the part's.
        """
        if self.analyze is None:
            raise ModelError(f"{self.name} has no analysis of its own; it is a model to export")
        arguments = _with_level(level, arguments)
        if self.build is not None and "level" in self.arguments and "level" not in self.analysis_arguments:
            read_arguments(
                self.name, self.build, {name: arguments.pop(name) for name in ("level",) if name in arguments}
            )
        self._refuse_arguments_of_the_model(arguments)
        return returned(self.analyze, dict, self.analyze(**read_arguments(self.name, self.analyze, arguments)))

    def _refuse_arguments_of_the_model(self, names: Iterable[str]) -> None:
        """Raise `ModelError` for names that the model has, but not the analysis, with those that the analysis has."""
        strange = [name for name in names if not takes(self.analysis_arguments, name)]
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
        arguments = _with_level(level, arguments)
        found = self.study(**read_arguments(f"{self.name}: a design study", self.study, arguments))
        return returned(self.study, Study, found)


# By name --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Home:
    """Where a part comes from: words for it, its file, and a function that loads it."""

    words: str
    file: Path | None
    load: Callable[[], Part]


class Catalogue(Mapping[str, Part]):
    """Parts by name; the module of a part is imported when the part is first used.

    `ModelError` for a part whose module cannot be imported, and for a name that two parts have.
    """

    def __init__(self, homes: Mapping[str, Sequence[_Home]], kind: str = "part"):
        self._homes, self._kind = homes, kind
        self._parts: dict[str, Part] = {}

    def __contains__(self, name: object) -> bool:
        return name in self._homes

    def __iter__(self) -> Iterator[str]:
        return iter(self._homes)

    def __len__(self) -> int:
        return len(self._homes)

    def __getitem__(self, name: str) -> Part:
        if name not in self._parts:
            homes = self._homes[name]
            if len(homes) > 1:
                both = " and ".join(home.words for home in homes)
                raise ModelError(f"{name} is the name of {len(homes)} {self._kind}s, {both}; rename one")
            self._parts[name] = homes[0].load()
        return self._parts[name]

    def file_of(self, name: str) -> Path | None:
        """Return the file of the part of a name."""
        return self._homes[name][0].file

    def package_of(self, name: str) -> str:
        """Return the last name of the package of a part."""
        return self._homes[name][0].words.split(".")[-2]

    def is_own(self, name: str) -> bool:
        """Whether a part comes from an installed package other than hfsa; so do those of a name that two have."""
        return any(not home.words.startswith("hfsa.") for home in self._homes[name])


def find(packages: Iterable[ModuleType], group: str = "", kind: Literal["part", "scene"] = "part") -> Catalogue:
    """Return the parts of packages by name, in alphabetical order within each, then those of a group of entry points.

    An entry point is a module, or a package whose modules define parts. With kind `scene` the functions return scenes.
    """
    homes: dict[str, list[_Home]] = {}
    for package in packages:
        place = Installed(Path(package.__path__[0]))
        for info in sorted(pkgutil.iter_modules(package.__path__), key=lambda info: info.name):
            if not info.name.startswith("_"):
                name = f"{package.__name__}.{info.name}"
                load = partial(_installed, name, place, kind, is_own=False)
                homes.setdefault(info.name, []).append(_Home(name, place.root / f"{info.name}.py", load))
    for point in sorted(entry_points(group=group), key=lambda point: point.value) if group else ():
        for home in _homes_of(point, kind):
            same = homes.setdefault(home.words.rpartition(".")[2], [])
            if home.words not in (other.words for other in same):
                same.append(home)
    return Catalogue(homes, kind)


def _homes_of(point: EntryPoint, kind: Literal["part", "scene"]) -> list[_Home]:
    """Return where the parts of an entry point come from; nothing is imported."""
    try:
        found = _located(point.value)
    except (ImportError, ValueError):
        found = None
    if found is None:
        distribution = point.dist.name if point.dist else "a package"

        def refuse() -> Part:
            raise ModelError(f"the entry point {point.name} of {distribution}: there is no module {point.value}")

        return [_Home(point.value, None, refuse)]
    folders = found.submodule_search_locations
    if folders is None:
        files, name = [Path(found.origin or "")], point.value.rpartition(".")[0]
    else:
        files, name = [file for folder in folders for file in files_of(Path(folder), kind)], point.value
    homes = []
    for file in files:
        module = f"{name}.{file.stem}" if name else file.stem
        homes.append(_Home(module, file, partial(_installed, module, Installed(file.parent), kind, is_own=True)))
    return homes


def _located(name: str) -> Any:
    """Return where Python finds a module, whose packages are not imported; `None` where it does not."""
    top, *rest = name.split(".")
    found = importlib.util.find_spec(top)
    for i, _ in enumerate(rest, 1):
        if found is None or found.submodule_search_locations is None:
            return None
        found = PathFinder.find_spec(".".join([top, *rest[:i]]), list(found.submodule_search_locations))
    return found


def _installed(name: str, place: Installed, kind: Literal["part", "scene"], is_own: bool) -> Part:
    """Return the part of an installed module."""
    stem = name.rpartition(".")[2]
    with refusing(place, _definition(stem, kind)):
        module = importlib.import_module(name)
    return part_of(module, stem, place, kind, is_own=is_own)


def _definition(name: str, kind: Literal["part", "scene"]) -> str:
    """Return in words what a file defines."""
    return f"a module that defines {name}() -> {_KINDS[kind]}"


def part_of(
    module: ModuleType,
    name: str,
    place: Folder | Installed,
    kind: Literal["part", "scene"] = "part",
    is_own: bool = True,
) -> Part:
    """Return the part that a module defines; `ModelError` where it defines none, or a function cannot be called."""
    _check_declarations(module)
    functions: list[Callable[..., Any] | None] = []
    for word, answer in ((name, f"a {_KINDS[kind]}"), ("analyze", "a dict of numbers"), ("study", "a Study")):
        function = getattr(module, word, None) if kind == "part" or word == name else None
        if function is not None and is_own:
            if not inspect.isfunction(function):
                raise ModelError(
                    f"{shown(Path(module.__file__ or name))}: {word} is {in_words(function)}, expected a function"
                )
            with refusing(place, "annotations that name types", otherwise=location(function)), place.within():
                arguments_of(function)
            function = guarded(function, place, f"{word}() to return {answer}")
        functions.append(function)
    if functions[0] is None and functions[1] is None:
        file = shown(Path(module.__file__ or name))
        needs = "neither a function {} nor analyze; a part" if kind == "part" else "no function {}; a scene"
        raise ModelError(f"{file} defines {needs.format(name)} is a function named as its file")
    return Part(name, module, *functions, is_own=is_own)  # type: ignore[arg-type]


def _check_declarations(module: ModuleType) -> None:
    """Raise `ModelError` for a declaration beside a part's function that is of another kind."""
    facts, units, joins = (getattr(module, word, None) for word in ("FACTS", "UNITS", "JOINS"))
    expected = {
        "FACTS a dict of Known by Fact": facts is None
        or (isinstance(facts, dict) and all(isinstance(f, Fact) and isinstance(k, Known) for f, k in facts.items())),
        "UNITS a dict of texts": units is None
        or (isinstance(units, dict) and all(isinstance(text, str) for item in units.items() for text in item)),
        "JOINS a tuple of Join": joins is None
        or (isinstance(joins, tuple | list) and all(isinstance(join, Join) for join in joins)),
    }
    for words, is_right in expected.items():
        if not is_right:
            name, _, kind = words.partition(" ")
            raise ModelError(
                f"{shown(Path(module.__file__ or ''))}: {name} is {getattr(module, name)!r}, expected {kind}"
            )


def own_part(path: str | Path, kind: Literal["part", "scene"] = "part") -> Part:
    """Return the part of a file or folder of one's own, anew where a file has changed.

    A folder stands for its file of the same name, or for the one that defines a part.
    """
    file = _file(Path(path), kind).resolve()
    place = folder_of(file.parent)
    place.refresh()
    if (file, kind) not in place.parts:
        with refusing(place, _definition(file.stem, kind)):
            module = place.load(file)
        place.parts[file, kind] = part_of(module, file.stem, place, kind)
    return place.parts[file, kind]


def _file(path: Path, kind: Literal["part", "scene"]) -> Path:
    """Return the file of a path that may be a folder's; `ModelError` where there is none."""
    if path.is_dir():
        folder = path.resolve()
        found = [file for file in files_of(folder, kind) if file.stem == folder.name] or files_of(folder, kind)
        if len(found) != 1:
            names = ", ".join(str(path / file.name) for file in found) or "none"
            raise ModelError(f"{path} is a folder; name one of its files that define a {kind}: {names}")
        return found[0]
    if not path.is_file():
        raise ModelError(f"there is no file {path}")
    if path.suffix != ".py":
        raise ModelError(f"{path} is no {kind}; expected a .py file, or a folder of them")
    return path


def part_named(name: str, parts: Mapping[str, Part]) -> Part:
    """Return the part of a name or path; `ModelError` with the nearest names if there is none."""
    if is_path(name):
        return own_part(name)
    if name not in parts:
        raise ModelError(f"no part is called {name!r}{hint(name, parts)}")
    return parts[name]


def hint(name: str, names: Iterable[str]) -> str:
    """Return the end of a sentence on a name that is not there: a file of that name, or the names most like it."""
    for file in (f"{name}.py", name):
        if Path(file).exists():
            return f"; the path is written ./{file}"
    return nearest(name, names)


def studied(name: str, parts: Mapping[str, Part]) -> Part:
    """Return the part of a name or path that offers a design study; `ModelError` names those that do otherwise."""
    part = part_named(name, parts)
    if part.study is None:
        offering = ", ".join(other.name for other in usable(parts) if other.study is not None)
        raise ModelError(f"{name} offers no design study; these do: {offering or 'none'}")
    return part


def usable(parts: Mapping[str, Part]) -> Iterator[Part]:
    """Yield the parts whose modules can be imported."""
    for name in parts:
        try:
            yield parts[name]
        except ModelError:
            continue


def _with_level(level: str | None, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments with the level, given by place or by name, where there is one."""
    named = {"level": level, **arguments}
    return {name: value for name, value in named.items() if name != "level" or value is not None}


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
