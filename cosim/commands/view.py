"""Verb `view`: a part in a page that turns and moves, or as a picture."""

from pathlib import Path

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json
from hfsa.cosim.commands._options import Arguments, Level, Output


def view(
    name: str, /, *, level: Level = None, parameter: Arguments = None, output: Output = None, json: Json = False
) -> int:
    """Draw a part: its bodies, modes and axes, in a page that needs nothing but a browser, or as a picture.

    Parameters
    ----------
    name
        A component, controller or analysis, as in `hfsa list`, or the path of a .py file.
    output
        FILE.html: a page, in which modes are animated; FILE.png, .pdf or .svg: a picture (default: `NAME.html`). An
        existing page of hfsa, or picture, is replaced.
    """
    from hfsa.components._modelling.catalogue import drawn
    from hfsa.cosim.assembly.models import available_parts
    from hfsa.cosim.commands._pictures import view_answer
    from hfsa.cosim.commands._scenes import refuse_scene

    refuse_scene(name, "`view` draws parts")
    values = _shell.part_arguments(level, parameter)
    part = drawn(name, available_parts())
    _shell.answer(*view_answer(part, values, output or Path(f"{part.name}.html")), json)
    return _shell.DONE
