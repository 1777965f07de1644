"""Catalogue of parts: by name from files and from the entry points of installed packages, or by path.

    parts = find([hfsa.components, hfsa.controllers], "hfsa.parts")
    model = parts["sdelta"].model(level="cartesian", **{"posture.rotation": "10,5,8", "damping_ratio": 0.02})
    model = part_named("./machine/spring.py", parts).model(stiffness="2e4")

A module is imported when its part is first used, so that a mistake in one breaks no other. A path always means the
file. Two bare names that are the same are an error when the part is used.
"""

import importlib
import importlib.util
import pkgutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.machinery import PathFinder
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

from hfsa.components._modelling.loading import Installed, files_of, is_path, refusing
from hfsa.components._modelling.model import ModelError, nearest
from hfsa.components._modelling.parts import Part, definition, own_part, part_of


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
    with refusing(place, definition(stem, kind)):
        module = importlib.import_module(name)
    return part_of(module, stem, place, kind, is_own=is_own)


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
    return _offering(name, parts, "study", "offers no design study")


def calibrated(name: str, parts: Mapping[str, Part]) -> Part:
    """Return the part of a name or path that can be calibrated; `ModelError` names those that can otherwise."""
    part = part_named(name, parts)
    return part if part.calibration is not None else _offering(name, parts, "study", "offers no calibration")


def following(name: str, parts: Mapping[str, Part]) -> Part:
    """Return the part of a name or path that follows a path; `ModelError` names those that do otherwise."""
    return _offering(name, parts, "trajectory", "follows no path")


def drawn(name: str, parts: Mapping[str, Part]) -> Part:
    """Return the part of a name or path that offers a picture; `ModelError` names those that do otherwise."""
    return _offering(name, parts, "picture", "offers no picture")


def _offering(name: str, parts: Mapping[str, Part], function: str, words: str) -> Part:
    """Return the part of a name or path that has a function; `ModelError` in these words, with those that have it."""
    part = part_named(name, parts)
    if getattr(part, function) is None:
        offering = ", ".join(other.name for other in usable(parts) if getattr(other, function) is not None)
        raise ModelError(f"{name} {words}; these do: {offering or 'none'}")
    return part


def usable(parts: Mapping[str, Part]) -> Iterator[Part]:
    """Yield the parts whose modules can be imported."""
    for name in parts:
        try:
            yield parts[name]
        except ModelError:
            continue
