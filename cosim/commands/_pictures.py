"""Drawing of a part on the command line, as picture or page: its file, and the answer as data and as text."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self, get_args

from hfsa.components._modelling.drawing import Drawing, View
from hfsa.components._modelling.errors import ModelError, one_of
from hfsa.components._modelling.parts import Part
from hfsa.cosim.figures.drawing import drawing_figure, save
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.results.target import check_model, check_page, check_picture, picture_format

PAGE, MODEL = ".html", ".glb"
"""Endings of a page and of a 3D model."""


@dataclass(frozen=True)
class Selection:
    """What is shown of a drawing: panels of these kinds, all where there is none, and these views of each."""

    kinds: Sequence[str] = ()
    views: Sequence[View] = ()

    @classmethod
    def read(cls, kinds: str | None, views: str | None) -> Self:
        """Return the selection of kinds and views as typed, separated by commas; `ModelError` for another view."""
        seen = [] if views is None else [one_of(word.strip(), get_args(View), "a view") for word in views.split(",")]
        return cls([] if kinds is None else [word.strip() for word in kinds.split(",")], seen)  # type: ignore[arg-type]

    def of(self, drawing: Drawing) -> Drawing:
        """Return what is shown of a drawing; `ModelError` for a kind that it has not, or a view of a flat panel."""
        chosen = drawing.showing(self.kinds) if self.kinds else drawing
        return chosen.seen_from(self.views) if self.views else chosen


EVERYTHING = Selection()


def picture_answer(
    part: Part, arguments: Mapping[str, str], file: Path, chosen: Selection = EVERYTHING
) -> tuple[dict[str, Any], str]:
    """Draw a part into a file; return the answer as data and as text.

    Raises `ModelError` for the part's arguments and `ResultsError` for a file that cannot be written.
    """
    check_picture(file)
    drawing = chosen.of(part.drawing(**arguments))
    save(drawing_figure(drawing), file)
    return _answer(drawing, "picture", file)


def view_answer(
    part: Part, arguments: Mapping[str, str], file: Path, chosen: Selection = EVERYTHING
) -> tuple[dict[str, Any], str]:
    """Draw a part as a page, 3D model or picture by the ending of the file; return the answer as `picture_answer`."""
    if file.suffix == MODEL:
        return _model_answer(part, arguments, file, chosen)
    if file.suffix != PAGE:
        refuse_ending(file)
        return picture_answer(part, arguments, file, chosen)
    from hfsa.cosim.pages.drawing_page import drawing_page
    from hfsa.cosim.pages.page import write_page

    check_page(file)
    drawing = chosen.of(part.drawing(**arguments))
    write_page(file, drawing_page(drawing))
    return _answer(drawing, "page", file)


def refuse_ending(file: Path) -> None:
    """Raise `ResultsError` for a file that is no picture by its ending, with all endings that `view` knows."""
    try:
        picture_format(file)
    except ResultsError as error:
        raise ResultsError(f"{error}; {PAGE} is a page, {MODEL} a 3D model") from None


def _model_answer(
    part: Part, arguments: Mapping[str, str], file: Path, chosen: Selection
) -> tuple[dict[str, Any], str]:
    """Write the 3D model of a part; return the answer as `picture_answer`, with its animations."""
    from hfsa.cosim.gltf.file import write_model
    from hfsa.cosim.gltf.of_drawing import model_of_drawing

    check_model(file)
    if chosen.views:
        raise ModelError(f"--views are those of a page or picture; a viewer turns the 3D model {file}")
    drawing = chosen.of(part.drawing(**arguments))
    model = model_of_drawing(drawing)
    write_model(file, model)
    data, text = _answer(drawing, "model", file)
    return {**data, "animations": [animation.name for animation in model.animations]}, text


def _answer(drawing: Drawing, kind: str, file: Path) -> tuple[dict[str, Any], str]:
    """Return what was drawn, as data and as text."""
    names = [layer.name for panel in drawing.panels for layer in panel.layers if layer.name]
    data = {kind: file, "title": drawing.title, "shown": list(dict.fromkeys(names)), "kinds": drawing.kinds}
    return data, f"{drawing.title}\n{file}"
