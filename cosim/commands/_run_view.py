"""Page or 3D model of a run: the machines that moved in it, and its signals."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._bodies import moving_bodies
from hfsa.cosim.commands._pictures import MODEL, PAGE
from hfsa.cosim.pages.bodies import Body
from hfsa.cosim.pages.page import write_page
from hfsa.cosim.pages.run_page import run_page
from hfsa.cosim.results.choices import read_scene
from hfsa.cosim.results.recorded import TIME, Recorded, read_recorded
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.results.target import check_model, check_page
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene_file import read_scene_text


def run_view_answer(file: Path, view: Path, low: float | None, high: float | None) -> tuple[dict[str, Any], str]:
    """Write a run as a page, or as a 3D model by the ending of the file; return the answer as data and as text.

    Raises:
        ResultsError: a file without signals over time, a model of nothing that moves, or a file that cannot be written.
    """
    is_model = view.suffix == MODEL
    if view.suffix not in (PAGE, MODEL):
        raise ResultsError(
            f"cannot write {view}: a run is shown as a page or a 3D model, expected the ending {PAGE} or {MODEL}"
        )
    (check_model if is_model else check_page)(view)
    recorded = read_recorded(file).between(low, high)
    if recorded.axis != TIME:
        raise StructureError(f"{file} holds rows without time; `hfsa plot` draws them")
    bodies, still = moving_bodies(recorded, read_scene_text(read_scene(file)).system)
    write, sentences = _model(recorded, bodies, still, view) if is_model else _page(recorded, bodies, view)
    for sentence in [*still, *sentences]:
        _shell.warn(sentence)
    write()
    names = [body.name for body in bodies]
    words = f"{recorded.title}: {', '.join(names) if names else 'signals alone, no part that can be drawn'}"
    return {
        "model" if is_model else "page": view,
        "title": recorded.title,
        "bodies": names,
        "left_out": [*still, *sentences],
    }, f"{words}\n{view}"


def _page(recorded: Recorded, bodies: list[Body], view: Path) -> tuple[Callable[[], None], list[str]]:
    """Return what writes the page of a run, and sentences on what it leaves out."""
    page, sentences = run_page(recorded, bodies)
    return partial(write_page, view, page), sentences


def _model(
    recorded: Recorded, bodies: list[Body], still: list[str], view: Path
) -> tuple[Callable[[], None], list[str]]:
    """Return what writes the 3D model of a run, and sentences on what it leaves out."""
    from hfsa.cosim.gltf.file import write_model
    from hfsa.cosim.gltf.of_run import model_of_run

    if not bodies:
        words = "; ".join(still) or "a function `moving` beside a part draws it as it moves"
        raise ResultsError(f"cannot write {view}: nothing moves in the file: {words}")
    model, sentences = model_of_run(recorded, bodies)
    return partial(write_model, view, model), sentences
