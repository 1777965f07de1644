"""Drawing of a part on the command line, as picture or page: its file, and the answer as data and as text."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hfsa.components._modelling.parts import Part
from hfsa.cosim.figures.drawing import Drawing, drawing_figure, save
from hfsa.cosim.results.target import check_page, check_picture


def picture_answer(part: Part, arguments: Mapping[str, str], file: Path) -> tuple[dict[str, Any], str]:
    """Draw a part into a file; return the answer as data and as text.

    Raises `ModelError` for the part's arguments and `ResultsError` for a file that cannot be written.
    """
    check_picture(file)
    drawing = part.drawing(**arguments)
    save(drawing_figure(drawing), file)
    return _answer(drawing, "picture", file)


def view_answer(part: Part, arguments: Mapping[str, str], file: Path) -> tuple[dict[str, Any], str]:
    """Draw a part into a page, or into a picture by the ending of the file; return the answer as `picture_answer`."""
    if file.suffix != ".html":
        return picture_answer(part, arguments, file)
    from hfsa.cosim.pages.drawing_page import drawing_page
    from hfsa.cosim.pages.page import write_page

    check_page(file)
    drawing = part.drawing(**arguments)
    write_page(file, drawing_page(drawing))
    return _answer(drawing, "page", file)


def _answer(drawing: Drawing, kind: str, file: Path) -> tuple[dict[str, Any], str]:
    """Return what was drawn, as data and as text."""
    names = [layer.name for panel in drawing.panels for layer in panel.layers if layer.name]
    data = {kind: file, "title": drawing.title, "shown": list(dict.fromkeys(names))}
    return data, f"{drawing.title}\n{file}"
