"""Drawing of a part on the command line, as picture or page: its file, and the answer as data and as text."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self, get_args

from hfsa.components._modelling.drawing import Drawing, View
from hfsa.components._modelling.errors import one_of
from hfsa.components._modelling.parts import Part
from hfsa.cosim.figures.drawing import drawing_figure, save
from hfsa.cosim.results.target import check_page, check_picture


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
    """Draw a part into a page, or into a picture by the ending of the file; return the answer as `picture_answer`."""
    if file.suffix != ".html":
        return picture_answer(part, arguments, file, chosen)
    from hfsa.cosim.pages.drawing_page import drawing_page
    from hfsa.cosim.pages.page import write_page

    check_page(file)
    drawing = chosen.of(part.drawing(**arguments))
    write_page(file, drawing_page(drawing))
    return _answer(drawing, "page", file)


def _answer(drawing: Drawing, kind: str, file: Path) -> tuple[dict[str, Any], str]:
    """Return what was drawn, as data and as text."""
    names = [layer.name for panel in drawing.panels for layer in panel.layers if layer.name]
    data = {kind: file, "title": drawing.title, "shown": list(dict.fromkeys(names)), "kinds": drawing.kinds}
    return data, f"{drawing.title}\n{file}"
