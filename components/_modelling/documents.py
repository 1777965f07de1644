"""Arguments that are files: tables of a TOML document or a CSV file, read into frozen dataclasses.

    @dataclass(frozen=True)
    class Beams(Document):
        beam: tuple[Beam, ...]                        # tables written [[beam]]; `Beam` is a frozen dataclass too
        material: Mapping[str, Material] = ...        # tables written [material.NAME]

    def beam_stage(*, beams: Beams | None = None) -> Model: ...

The value of such an argument is the path of a `.toml` file, the table that the file holds, or the object itself; a
class of another `ENDING` reads its files itself, into the same kind of table. The object has no path: two files of the
same content are equal, and a file that has changed is another value. A scene holds the table in place of the path
(`with_contents`), so that FMUs, results files and other machines do not need the file.

A class checks its values in `__post_init__`; the message of its `ModelError` continues `FILE: beam[2]: `.
"""

import dataclasses
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from types import UnionType
from typing import Any, ClassVar, Protocol, TypeVar, Union, get_args, get_origin, get_type_hints

from hfsa.components._modelling.errors import ModelError, nearest
from hfsa.components._modelling.regular_file import check_regular

ENDINGS = (".toml", ".csv")
"""Endings of the names of documents."""


class Document:
    """Base of the frozen dataclasses that an argument may read from a file with the name ending `ENDING`."""

    ENDING: ClassVar[str] = ".toml"

    @classmethod
    def table_of(cls, file: Path) -> Mapping[str, Any]:
        """Return the table of a file; `ModelError` for a file that cannot be read."""
        return _table_of(file)

    @property
    def information(self) -> dict[str, Any]:
        """What an FMU tells of a document in its constants."""
        return plain(self)


class Annotated(Protocol):
    """An argument with its annotation."""

    @property
    def annotation(self) -> Any: ...


D = TypeVar("D", bound=Document)
Read = Callable[[str, Any, Any], Any]
"""Reader of a single value by its annotation, `arguments.read_value`."""


def is_document(annotation: Any) -> bool:
    """Whether values of an annotation are documents."""
    return isinstance(annotation, type) and issubclass(annotation, Document)


def is_content(value: Any) -> bool:
    """Whether a value is a document, a table, or the path of a file that holds one."""
    return isinstance(value, Document | Mapping) or _is_path(value)


def read_document(where: str, kind: type[D], value: Any, read: Read) -> D:
    """Return a document from a path, a table or an object.

    Args:
        where: words for the argument in messages, which name a file by its path instead.
        kind: class of the document.
        value: path, table or object.
        read: reader of single values.

    Raises:
        ModelError: a file that cannot be read; an unknown or missing key; a value of another kind.
    """
    if isinstance(value, kind):
        return value
    if isinstance(value, str | Path) and str(value).endswith(kind.ENDING):
        return _record(str(value), "", kind, kind.table_of(Path(value)), read)
    if not isinstance(value, Mapping):
        raise ModelError(f"{where} is {value!r}, expected the path of a {kind.ENDING} file or its table")
    return _record(where, "", kind, value, read)


def plain(document: Document) -> dict[str, Any]:
    """Return the table of a document: numbers, texts, lists and tables, with defaults, without fields that are `None`.

    Documents that are equal have equal tables, and the table is a value for the argument in place of the file.
    """
    return _plain(dataclasses.asdict(document))  # type: ignore[call-overload]


def with_contents(
    where: str, known: Mapping[str, Annotated], arguments: Mapping[str, Any], read: Read, folder: Path | None = None
) -> dict[str, Any]:
    """Return arguments with the tables of documents in place of the paths of their files.

    Args:
        where: name of the part in messages.
        known: arguments of the part by name.
        arguments: values by name.
        read: reader of single values.
        folder: folder from which relative paths count, by default the working folder.

    Raises:
        ModelError: as `read_document`.
    """
    found = dict(arguments)
    for name, value in arguments.items():
        if name in known and _is_path(value):
            for kind in filter(is_document, _members(known[name].annotation)):
                path = str((folder or Path()) / value)
                found[name] = plain(read_document(f"{where}: {name}", kind, path, read))
    return found


def names_file(arguments: Mapping[str, Any]) -> bool:
    """Whether a value among arguments may be the path of a document."""
    return any(map(_is_path, arguments.values()))


def _is_path(value: Any) -> bool:
    """Whether a value is the path of a document."""
    return isinstance(value, str | Path) and str(value).endswith(ENDINGS)


def _table_of(file: Path) -> Mapping[str, Any]:
    """Return the table of a file; `ModelError` for a file that cannot be read or is no TOML document."""
    check_regular(file, str(file))
    try:
        return tomllib.loads(file.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        raise ModelError(f"{file} cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        byte = error.object[error.start]
        raise ModelError(
            f"{file}: not a TOML document: byte {error.start} is {byte:#04x}, expected text in UTF-8"
        ) from None
    except (ValueError, RecursionError) as error:  # also a number of too many digits, and arrays within arrays
        raise ModelError(f"{file}: not a TOML document: {error}") from None


def _record(where: str, place: str, kind: type[Any], table: Any, read: Read) -> Any:
    """Return an instance of a dataclass from a table at a place of a document, `beam[2]`; empty for the whole."""
    label = f"{where}: {place}" if place else where
    if isinstance(table, kind):
        return table
    if not isinstance(table, Mapping):
        raise ModelError(f"{label} is {table!r}, expected a table")
    fields, hints = {field.name: field for field in dataclasses.fields(kind)}, get_type_hints(kind)
    for key in table:
        if key not in fields:
            raise ModelError(f"{label} has no key {key!r}{nearest(str(key), fields)}")
    for name, field in fields.items():
        has_default = field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING
        if name not in table and not has_default:
            raise ModelError(f"{label} lacks the key {name!r}; it has {', '.join(table) or 'none'}")
    values = {
        key: _value(where, f"{place}.{key}" if place else key, hints[key], value, read) for key, value in table.items()
    }
    try:
        return kind(**values)
    except ModelError as error:
        raise ModelError(f"{label}: {error}") from None


def _value(where: str, place: str, annotation: Any, value: Any, read: Read) -> Any:
    """Return the value of a field: a table, several tables, or a value that `read` reads."""
    label, origin, members = f"{where}: {place}", get_origin(annotation), get_args(annotation)
    if _is_record(annotation):
        return _record(where, place, annotation, value, read)
    if origin is tuple and _is_record(members[0]):
        if not isinstance(value, list | tuple):
            raise ModelError(f"{label} is {value!r}, expected tables, written [[{place}]]")
        return tuple(_record(where, f"{place}[{i}]", members[0], item, read) for i, item in enumerate(value, 1))
    if origin is not None and isinstance(origin, type) and issubclass(origin, Mapping):
        if not isinstance(value, Mapping):
            raise ModelError(f"{label} is {value!r}, expected tables by name, written [{place}.NAME]")
        for name in value:
            if not str(name).isidentifier():
                raise ModelError(f"{label} has the name {name!r}, expected letters, digits and _, a letter first")
        return {name: _value(where, f"{place}.{name}", members[1], item, read) for name, item in value.items()}
    return read(label, annotation, value)


def _is_record(annotation: Any) -> bool:
    """Whether values of an annotation are tables of the fields of a dataclass."""
    return isinstance(annotation, type) and dataclasses.is_dataclass(annotation)


def _members(annotation: Any) -> tuple[Any, ...]:
    """Return the types of a union, or the one type."""
    return get_args(annotation) if get_origin(annotation) in (Union, UnionType) else (annotation,)


def _plain(value: Any) -> Any:
    """Return a value with lists for tuples and without keys whose value is `None`."""
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items() if item is not None}
    return [_plain(item) for item in value] if isinstance(value, tuple | list) else value
