"""Tasks that another machine can run: its files travel by the hash of their content.

    packed = pack(measure, task)             # FMUs are named by their hashes; their bytes stay here
    missing(packed.files)                    # there: hashes of files that its cache does not hold
    store(name, content)                     # there: once for each of them
    work, task = unpack(packed)              # there: with paths in its own cache, and its own stepping loop

A file in the cache is checked against its hash when a process uses it first.
"""

import hashlib
import io
import os
import pickle
import shutil
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from hfsa.components._modelling.cache import cache_folder, cache_subfolder
from hfsa.cosim.assembly.isolation import isolation_library
from hfsa.cosim.assembly.native_loop import BACKENDS, chosen_loop
from hfsa.cosim.fmi.isolation import sources as isolation
from hfsa.cosim.masters.native.headers import library_name
from hfsa.cosim.systems.errors import StructureError

_FOLDER = "received"
_LOOP, _ISOLATION = "loop", "isolation"


@dataclass(frozen=True)
class FileName:
    """A file by the hash of its content, and the name that messages give it."""

    sha256: str
    name: str


@dataclass(frozen=True)
class Packed:
    """A function and its argument in bytes, and the files that it needs."""

    content: bytes
    files: frozenset[FileName]


class _Packer(pickle.Pickler):
    """Pickler of paths: an FMU by its hash, libraries of ours by a word."""

    def __init__(self, buffer: io.BytesIO):
        super().__init__(buffer, pickle.HIGHEST_PROTOCOL)
        self.files: dict[FileName, Path] = {}

    def persistent_id(self, obj: Any) -> Any:
        """Return what stands for a path; `None` for all else."""
        if not isinstance(obj, Path):
            return None
        for word, name in ((_LOOP, _loop_name()), (_ISOLATION, _isolation_name())):
            if obj.name.startswith(name):
                return word
        if obj.suffix != ".fmu":
            return None
        name = FileName(_hash_of(obj), obj.name)
        self.files[name] = obj
        return name


class _Unpacker(pickle.Unpickler):
    """Unpickler of what `_Packer` writes."""

    def persistent_load(self, pid: Any) -> Any:
        """Return this machine's path for what stands for one."""
        own = {_LOOP: _own_loop, _ISOLATION: isolation_library}
        return own[pid]() if pid in own else _place(pid)


def pack(work: Callable[[Any], Any], task: Any) -> tuple[Packed, dict[FileName, Path]]:
    """Return a function and its argument for another machine, and where the files that it needs are here."""
    buffer = io.BytesIO()
    packer = _Packer(buffer)
    packer.dump((work, task))
    return Packed(buffer.getvalue(), frozenset(packer.files)), packer.files


def unpack(packed: Packed) -> tuple[Callable[[Any], Any], Any]:
    """Return a function and its argument, whose files this machine's cache holds."""
    return _Unpacker(io.BytesIO(packed.content)).load()


def content(name: FileName, file: Path) -> bytes:
    """Return the bytes of a file; `StructureError` where they are no longer those of its hash."""
    found = file.read_bytes()
    if hashlib.sha256(found).hexdigest() != name.sha256:
        raise StructureError(f"{file} has changed since the sweep began; expected the same file until its end")
    return found


def missing(files: Iterable[FileName]) -> list[FileName]:
    """Return the files that the cache of this machine does not hold."""
    return [name for name in files if not _is_held(name)]


def store(name: FileName, found: bytes) -> None:
    """Keep a file in the cache of this machine, complete or not at all; errors as of `cache_subfolder`."""
    if hashlib.sha256(found).hexdigest() != name.sha256:
        raise StructureError(f"{name.name} has arrived with other bytes than it was sent with")
    if _is_held(name):
        return
    place = _place(name)
    unfinished = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=cache_subfolder(_FOLDER)))
    try:
        (unfinished / place.name).write_bytes(found)
        place.parent.mkdir(exist_ok=True)
        os.replace(unfinished / place.name, place)  # a damaged one too
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def _place(name: FileName) -> Path:
    """Return where the cache of this machine holds a file."""
    return cache_folder() / _FOLDER / name.sha256 / Path(name.name).name


def _is_held(name: FileName) -> bool:
    """Whether the cache of this machine holds a file with its content."""
    place = _place(name)
    return place.is_file() and _hash_of(place) == name.sha256


def _hash_of(file: Path) -> str:
    """Return the hash of a file, computed once for each state of it."""
    stat = file.stat()
    return _computed_hash(file, (stat.st_ino, stat.st_mtime_ns, stat.st_size))


@lru_cache(maxsize=1024)
def _computed_hash(file: Path, _version: tuple[int, ...]) -> str:
    """Return the hash of a file; a changed file has another `_version`."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


_loop_name, _isolation_name = cache(library_name), cache(isolation.library_name)


@cache
def _own_loop() -> Path | None:
    """Return this machine's stepping loop in C; `None` where there is none, for the one in Python, of equal bits."""
    return chosen_loop(BACKENDS[0], lambda _: None)
