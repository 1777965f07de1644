"""Parts: functions named as their files, of the packages `components` and `controllers`, installed, or of one's own.

    part = own_part("./machine/spring.py")
    model = part.model(level="linear", stiffness="2e4")

Arguments are the keyword-only arguments of the part's function (`arguments`). The name of a parameter of the built
model is accepted too and sets its start value; `solver` names the solver of any part's FMU.

Beside its function a part's file may have `analyze`, which returns its engineering numbers, `study`, which returns a
design study (`study.Study`): its dimensions as symbols, and what follows from them, `trajectory`, which returns the
study whose dimensions are the columns of a path, `picture`, which returns a drawing (`drawing.Drawing`), and
`moving`, which returns what moves in a run (`drawing.Moving`). Each takes arguments of its own.
`FACTS` there are facts that other parts of a system know as well (`facts`), `JOINS` the parts that alone may feed it
(`joins`), `UNITS` the units of the numbers that `analyze` returns, by key: SI, `1` for a number without unit. Where the
entries of a vector or matrix differ, `;` stands between its rows or equal blocks of rows, `,` between columns:
`N/m, N; N, N.m`.
"""

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import Any, Literal, TypeVar

from hfsa.components._modelling.argument_docs import explanations
from hfsa.components._modelling.arguments import (
    Argument,
    argument_values,
    arguments_of,
    read_arguments,
    read_value,
    takes,
)
from hfsa.components._modelling.calibration import Calibration
from hfsa.components._modelling.documents import Document, with_contents
from hfsa.components._modelling.drawing import Drawing, Moving
from hfsa.components._modelling.facts import Fact, Known
from hfsa.components._modelling.joins import Join
from hfsa.components._modelling.loading import (
    Folder,
    Installed,
    files_of,
    folder_of,
    guarded,
    in_words,
    location,
    refusing,
    returned,
    shown,
)
from hfsa.components._modelling.model import SOLVERS, Kind, Model, ModelError, nearest, one_of
from hfsa.components._modelling.origin import Origin, credits_of, house_credits
from hfsa.components._modelling.study import Study
from hfsa.components._modelling.variants import variant

SOLVER = "solver"
"""The argument of every part that names the Co-Simulation solver of its FMU, one of `SOLVERS`."""

T = TypeVar("T")

_KINDS: Mapping[str, str] = {"part": "Model", "scene": "Scene"}
"""What the function of a file returns."""


@dataclass(frozen=True)
class Part:
    """A part: `build` returns its `Model`, `analyze` its engineering numbers, `study` its design study; or has none.

    `trajectory` returns the study of a path, `picture` a drawing, `moving` what moves in a run, `calibration` what
    measurements can tell of it. `is_own` means that it does not come with hfsa.
    """

    name: str
    module: ModuleType
    build: Callable[..., Model] | None
    analyze: Callable[..., dict[str, Any]] | None
    study: Callable[..., Study] | None = None
    trajectory: Callable[..., Study] | None = None
    picture: Callable[..., Drawing] | None = None
    moving: Callable[..., Moving] | None = None
    calibration: Callable[..., Calibration] | None = None
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

    @property
    def ladder(self) -> tuple[str, ...]:
        """Levels that `auto` chooses among, cheapest first; the last is the reference."""
        return tuple(level for level in getattr(self.module, "LADDER", self.levels) if level not in self.unavailable)

    @property
    def unavailable(self) -> Mapping[str, str]:
        """Levels that this machine cannot build, for want of an extra, with the reason."""
        return getattr(self.module, "UNAVAILABLE", {})

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

    def with_contents(self, arguments: Mapping[str, Any], folder: Path | None = None) -> dict[str, Any]:
        """Return arguments of the part's functions with tables in place of the paths of documents.

        Relative paths count from `folder`, by default from the working folder; `ModelError` for a file that is wrong.
        """
        functions = (self.build, self.analyze, self.study, self.trajectory, self.picture, self.moving)
        known = {name: argument for function in functions for name, argument in arguments_of(function).items()}
        return with_contents(self.name, known, arguments, read_value, folder)

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
        usual = {SOLVER: model.solver, **{name: q.start for name, q in parameters.items()}}
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
        model.information = _information(self, structural, taken={quantity.name for quantity in model})
        set_here = {SOLVER: model.solver, **{q.name: q.start for q in model.of(Kind.PARAMETER)}}
        tuned = {name: value for name, value in set_here.items() if value is not None and value != usual[name]}
        model.origin = _origin(self, structural, tuned)
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
        return self._offered(self.study, Study, "a design study", level, arguments)

    def path_study(self, level: str | None = None, **arguments: Any) -> Study:
        """Return the study whose dimensions are the columns of a path; errors as in `model`."""
        if self.trajectory is None:
            raise ModelError(f"{self.name} follows no path")
        return self._offered(self.trajectory, Study, "a path", level, arguments)

    def drawing(self, level: str | None = None, **arguments: Any) -> Drawing:
        """Return the part's drawing; errors as in `model`."""
        if self.picture is None:
            raise ModelError(f"{self.name} has no picture")
        return self._offered(self.picture, Drawing, "a picture", level, arguments)

    def in_motion(self, level: str | None = None, **arguments: Any) -> Moving:
        """Return what moves in a run, of a part in a scene with these arguments.

        Those of its FMU that the drawing does not depend on are left out; other errors as in `model`.
        """
        if self.moving is None:
            raise ModelError(f"{self.name} has no drawing that moves")
        known = arguments_of(self.moving)
        taken = {name: value for name, value in _with_level(level, arguments).items() if takes(known, name)}
        return self._offered(self.moving, Moving, "a drawing that moves", None, taken)

    def calibration_task(self, level: str | None = None, **arguments: Any) -> Calibration:
        """Return what the part offers to be calibrated, by default its design study; errors as in `model`."""
        if self.calibration is None:
            return Calibration(self.design_study(level, **arguments))
        return self._offered(self.calibration, Calibration, "a calibration", level, arguments)

    def _offered(
        self, function: Callable[..., T], kind: type[T], words: str, level: str | None, arguments: dict[str, Any]
    ) -> T:
        """Return what a function of the part offers, in `words`, for arguments as they are given."""
        label = f"{self.name}: {words}"
        taken = _of_study(function, label, _with_level(level, arguments))
        return returned(function, kind, function(**read_arguments(label, function, taken)))


def definition(name: str, kind: Literal["part", "scene"]) -> str:
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
    for word, answer in (
        (name, f"a {_KINDS[kind]}"),
        ("analyze", "a dict of numbers"),
        ("study", "a Study"),
        ("trajectory", "a Study"),
        ("picture", "a Drawing"),
        ("moving", "a Moving"),
        ("calibration", "a Calibration"),
    ):
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
        with refusing(place, definition(file.stem, kind)):
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


def _with_level(level: str | None, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments with the level, given by place or by name, where there is one."""
    named = {"level": level, **arguments}
    return {name: value for name, value in named.items() if name != "level" or value is not None}


def _of_study(function: Callable[..., Any], owner: str, arguments: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments of a study or picture; `ModelError` for a level that it does not take."""
    if "level" in arguments and "level" not in arguments_of(function):
        raise ModelError(f"{owner} is of one level of the part and takes none: leave out level {arguments['level']}")
    return arguments


def _origin(part: Part, structural: Mapping[str, Any], tuned: Mapping[str, float | str]) -> Origin:
    """Return the origin of a model with structural arguments, and with other start values and solver."""
    assert part.build is not None
    usual = _flat(argument_values(part.name, part.build, {}))
    values = _flat(argument_values(part.name, part.build, structural))
    changed = {name: value for name, value in values.items() if value != usual[name]}
    level = "".join(map(str, changed.pop("level", {}).values()))
    if all(name in usual for name in structural):  # what follows from these is left out
        changed = {name: value for name, value in changed.items() if name in structural}
    return Origin(
        variant(level, changed | {name: {name: value} for name, value in tuned.items()}),
        {part.name: inspect.cleandoc(part.module.__doc__ or "")},
        credits_of(part.module) if part.is_own else house_credits(),
        explanations(part.build),
    )


def _flat(values: Mapping[str, Any]) -> dict[str, dict[str, float | str]]:
    """Return the values of arguments as constants, by the names of the arguments."""
    whole = {name: value.information if isinstance(value, Document) else value for name, value in values.items()}
    return {name: _constants(name, value) for name, value in whole.items()}


def _information(part: Part, given: Mapping[str, Any], taken: set[str]) -> dict[str, float | str]:
    """Return the structural arguments as flat constants: numbers, texts, and members of lists and tables."""
    assert part.build is not None
    flat = _flat(argument_values(part.name, part.build, given))
    return {name: value for found in flat.values() for name, value in found.items() if name not in taken}


def _constants(name: str, value: Any) -> dict[str, float | str]:
    """Return a value as constants of an FMU by name."""
    if value is None:
        return {}
    if isinstance(value, Mapping):
        named = [(f"{name}.{key}", item) for key, item in value.items()]
    elif isinstance(value, tuple | list):
        # FMI has no name for a list within a list: its text
        items = [str(item) if isinstance(item, tuple | list) else item for item in value]
        named = [(f"{name}[{i}]", item) for i, item in enumerate(items, 1)]
    else:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return {name: float(value) if is_number else str(value)}
    return {full: constant for inner, item in named for full, constant in _constants(inner, item).items()}
