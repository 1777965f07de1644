"""Picture of a part on the command line: its file, and the answer as data and as text."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hfsa.components._modelling.parts import Part
from hfsa.cosim.figures.drawing import drawing_figure, save
from hfsa.cosim.results.target import check_picture


def picture_answer(part: Part, arguments: Mapping[str, str], file: Path) -> tuple[dict[str, Any], str]:
    """Draw a part into a file; return the answer as data and as text.

    Raises `ModelError` for the part's arguments and `ResultsError` for a file that cannot be written.
    """
    check_picture(file)
    drawing = part.drawing(**arguments)
    save(drawing_figure(drawing), file)
    names = [layer.name for panel in drawing.panels for layer in panel.layers if layer.name]
    data = {"picture": file, "title": drawing.title, "shown": list(dict.fromkeys(names))}
    return data, f"{drawing.title}\n{file}"
