"""Hash of the sources of packages; it changes whenever what is made from them may change."""

import hashlib
import importlib.util
from functools import cache
from pathlib import Path

_LEFT_WING = ("hfsa.components", "hfsa.controllers", "hfsa.fmus")


@cache
def sources() -> str:
    """Return a hash of the sources of the left wing."""
    return _hash(_LEFT_WING)


@cache
def all_sources() -> str:
    """Return a hash of the sources of both wings."""
    return _hash((*_LEFT_WING, "hfsa.cosim"))


def _hash(packages: tuple[str, ...]) -> str:
    """Return a hash of the sources of packages, which are not imported."""
    digest = hashlib.sha256()
    for package in packages:
        for file in sorted(_files(package)):
            digest.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()


def _files(package: str) -> list[Path]:
    """Return the sources of a package, of both languages."""
    spec = importlib.util.find_spec(package)
    assert spec is not None
    folders = [Path(folder) for folder in spec.submodule_search_locations or ()]
    return [f for folder in folders for f in folder.rglob("*") if f.suffix in (".py", ".c", ".h")]
