"""XML of somebody else, of any length: elements are handed on one by one, and none is kept.

    read_elements(stream, "Box.fmu: modelDescription.xml", handle)

    def handle(path, attributes, line): ...     # path: names of the elements from the root to this one

A document type is refused where it begins, so that no entity is ever declared, expanded or fetched.
"""

from collections.abc import Callable
from typing import IO, Any, NoReturn
from xml.parsers import expat

from hfsa.cosim.systems.errors import StructureError

Handle = Callable[[list[str], dict[str, str], int], None]

DEEPEST = 256
"""Most elements within each other."""

_PIECE = 1 << 16


def read_elements(stream: IO[bytes], where: str, handle: Handle) -> None:
    """Call `handle` at the beginning of every element of a document, in their order.

    `StructureError`, which begins with `where`, for a document that is not well-formed, too deep, or has a type.
    """
    parser = expat.ParserCreate()
    parser.buffer_text = True
    path: list[str] = []

    def refuse(sentence: str) -> NoReturn:
        raise StructureError(f"{where}, line {parser.CurrentLineNumber}: {sentence}")

    def begin(name: str, attributes: dict[str, str]) -> None:
        if len(path) == DEEPEST:
            refuse(f"there are more than {DEEPEST} elements within each other, expected fewer")
        path.append(name)
        handle(path, attributes, parser.CurrentLineNumber)

    def document_type(*_: Any) -> None:
        refuse("a document type may declare entities; expected XML without one")

    parser.StartElementHandler, parser.EndElementHandler = begin, lambda _: path.pop()
    parser.StartDoctypeDeclHandler = document_type
    try:
        while piece := stream.read(_PIECE):
            parser.Parse(piece, False)
        parser.Parse(b"", True)
    except (expat.ExpatError, LookupError, UnicodeError, ValueError) as error:
        if isinstance(error, StructureError):
            raise
        raise StructureError(f"{where} is not well-formed XML: {error}") from None
