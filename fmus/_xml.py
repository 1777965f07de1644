"""XML of an FMU that is checked: read once from its beginning to its end, before anything else reads it."""

from pathlib import Path
from typing import Any
from xml.parsers import expat

DEEPEST = 256
"""Most elements within each other."""


class _RefusedError(Exception):
    """What a document must not have."""


def xml_problem(file: Path) -> str:
    """Return why a document cannot be read without danger; empty where it can, and where there is none.

    A dangerous one is not well-formed, has a document type, which may declare entities, or is too deep.
    """
    if not file.exists():
        return ""
    parser = expat.ParserCreate()
    depth = 0

    def begin(*_: Any) -> None:
        nonlocal depth
        depth += 1
        if depth > DEEPEST:
            raise _RefusedError(f"has more than {DEEPEST} elements within each other")

    def end(_: str) -> None:
        nonlocal depth
        depth -= 1

    def document_type(*_: Any) -> None:
        raise _RefusedError("has a document type, which may declare entities; expected XML without one")

    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.StartDoctypeDeclHandler = document_type
    try:
        with file.open("rb") as stream:
            parser.ParseFile(stream)
    except _RefusedError as error:
        return f"line {parser.CurrentLineNumber}: {error}"
    except OSError as error:
        return f"cannot be read: {error.strerror or error}"
    except (expat.ExpatError, LookupError, ValueError) as error:
        return f"is not well-formed XML: {error}"
    return ""
