"""Verb `view`: a part in a page that turns and moves, or as a picture."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json
from hfsa.cosim.commands._options import Arguments, Level, Output


def view(
    name: str,
    /,
    *,
    level: Level = None,
    parameter: Arguments = None,
    show: Annotated[str | None, Parameter("--show")] = None,
    views: Annotated[str | None, Parameter("--views")] = None,
    low: Annotated[float | None, Parameter("--from")] = None,
    high: Annotated[float | None, Parameter("--to")] = None,
    output: Output = None,
    diagram: Annotated[bool, Parameter(negative=(), show_default=False)] = False,
    json: Json = False,
) -> int:
    """Draw a part, its modes and axes, or what moved in a run, in a page that needs nothing but a browser.

    With `--diagram`, draw the blocks of a scene: components, connections, sampled parts, loops, inputs and outputs.

    Parameters
    ----------
    name
        A component, controller or analysis, as in `hfsa list`, or the path of a .py file; or the results file of a run;
        with `--diagram` a scene, or the path of a .py, .toml or .ssp file.
    diagram
        Draw the block diagram of a scene.
    show
        KIND,KIND of a part: the kinds of panels to show, such as `posture`, `modes`, `modal_screws` (default: all).
    views
        VIEW,VIEW of a part in three dimensions: each panel in orthographic projection from `top`, `front` or `side`
        (default: one oblique view).
    low
        Of a run: time [s] from which on to show (default: the first).
    high
        Of a run: time [s] up to which to show (default: the last).
    output
        FILE.html: a page, in which modes are animated; FILE.glb: the same as a 3D model for CAD viewers (glTF, needs
        the extra `cad`); of a part FILE.png, .pdf or .svg: a picture (default: `NAME.html`, or the results file with
        the ending `.html`). Of a diagram a picture (needs the extra `diagram`), or FILE.dot: text for Graphviz
        (default: `NAME.svg`). An existing page, model or diagram of hfsa, or picture, is replaced.
    """
    from hfsa.components._modelling.catalogue import drawn
    from hfsa.cosim.assembly.models import available_parts
    from hfsa.cosim.commands._pictures import Selection, view_answer
    from hfsa.cosim.commands._scenes import refuse_other, refuse_scene
    from hfsa.cosim.systems.errors import StructureError

    if diagram:
        from hfsa.cosim.commands._diagram import diagram_answer

        if name.endswith(".h5"):
            raise StructureError(f"{name} is a results file, expected a scene; `report` shows the blocks behind it")
        if level is not None or low is not None or high is not None:
            raise StructureError("--level, --from and --to do not apply to a diagram; -p component.level=LEVEL does")
        if show is not None or views is not None:
            raise StructureError("--show and --views are for the drawing of a part; a diagram shows all blocks")
        refuse_other(name)
        arguments = _shell.named_values(parameter)
        _shell.answer(*diagram_answer(name, arguments, output or Path(f"{Path(name).stem}.svg")), json)
        return _shell.DONE
    if name.endswith(".h5"):
        from hfsa.cosim.commands._run_view import run_view_answer

        if level is not None or parameter:
            raise StructureError("--level and -p are those of a part; the file of a run has its own")
        if show is not None or views is not None:
            raise StructureError("--show and --views are for the drawing of a part; a run shows what moves in it")
        file = Path(name)
        _shell.answer(*run_view_answer(file, output or file.with_suffix(".html"), low, high), json)
        return _shell.DONE
    if low is not None or high is not None:
        raise StructureError("--from and --to choose a stretch of a run; a part has none")
    refuse_scene(name, "--diagram draws the blocks of a scene")
    values = _shell.part_arguments(level, parameter)
    part = drawn(name, available_parts())
    chosen = Selection.read(show, views)
    _shell.answer(*view_answer(part, values, output or Path(f"{part.name}.html"), chosen), json)
    return _shell.DONE
