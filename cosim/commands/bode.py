"""Verb `bode`: Bode plot of results files."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json
from hfsa.cosim.commands._options import Names, Output, Signals


def bode(
    files: Annotated[list[Path], Parameter(negative=())],
    /,
    *,
    input: Names = None,  # noqa: A002 (name of the option)
    signal: Signals = None,
    output: Output = None,
    json: Json = False,
) -> int:
    """Draw the Bode plot of one or more sweeps in one figure: `linear` sweeps as lines, measured ones as points.

    Parameters
    ----------
    files
        Results files of `hfsa sweep`.
    input
        Input to draw, repeatable (default: all). `command.position[1..3]` is a range.
    signal
        Output to draw, repeatable (default: all that are not zero by symmetry).
    output
        Picture file; its ending gives the format (default: the first results file with the ending `.png`). An existing
        picture is replaced.
    """
    from hfsa.cosim.figures.bode import bode_figure, save
    from hfsa.cosim.results.files import read_sweep
    from hfsa.cosim.results.target import check_picture
    from hfsa.cosim.systems.errors import StructureError
    from hfsa.cosim.systems.names import refuse_signal

    known: set[Path] = set()
    for path in files:
        if path.resolve() in known:
            raise StructureError(f"{path} is given twice; expected each results file once")
        known.add(path.resolve())
    sweeps = [read_sweep(path) for path in files]
    if output is not None:
        refuse_signal(output, [s.name for bode in sweeps for s in (*bode.outputs, *bode.inputs)])
    path = output or files[0].with_suffix(".png")
    check_picture(path)
    save(bode_figure(sweeps, signal or (), input or ()), path)
    _shell.answer({"file": path}, str(path), json)
    return _shell.DONE
