"""Verb `plot`: signals of runs and paths over time, or over each other."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json
from hfsa.cosim.commands._options import Output, Signals


def plot(
    files: Annotated[list[Path], Parameter(negative=())],
    /,
    *,
    x: Annotated[str | None, Parameter("--x")] = None,
    signal: Signals = None,
    colour: str | None = None,
    points: Annotated[bool | None, Parameter(show_default=False)] = None,
    low: Annotated[float | None, Parameter("--from")] = None,
    high: Annotated[float | None, Parameter("--to")] = None,
    output: Output = None,
    json: Json = False,
) -> int:
    """Draw recorded signals over time, or over each other: loops, paths, clouds of a workspace, numbers of a table.

    Parameters
    ----------
    files
        Results files of `hfsa run`, `hfsa compare`, `hfsa analyze --path` or `hfsa analyze --over`.
    x
        Signal on the horizontal axis (default: the time, or the row). With a range, `stage.stack[1..3].elongation`,
        there is one for each of the signals.
    signal
        Signal to draw, repeatable (default: all that are no limit flags). `stage.stack[1..3].force` is a range.
    colour
        Signal that colours the points of one file.
    points
        Draw points instead of lines (default: where rows have no time, and with `--colour`).
    low
        Time [s], or row, from which on to draw (default: the first).
    high
        Time [s], or row, up to which to draw (default: the last).
    output
        Picture file; its ending gives the format (default: the first results file with the ending `.png`). An existing
        picture is replaced.
    """
    from hfsa.cosim.figures.signals import save, signals_figure
    from hfsa.cosim.results.recorded import read_recorded
    from hfsa.cosim.results.target import check_picture
    from hfsa.cosim.systems.errors import StructureError
    from hfsa.cosim.systems.names import refuse_signal

    repeated = [file for k, file in enumerate(files) if file.resolve() in {other.resolve() for other in files[:k]}]
    if repeated:
        raise StructureError(f"{repeated[0]} is given twice; expected each results file once")
    recorded = [read_recorded(file).between(low, high) for file in files]
    if output is not None:
        refuse_signal(output, [name for found in recorded for name in found.values])
    path = output or files[0].with_suffix(_shell.PICTURE)
    check_picture(path)
    save(signals_figure(recorded, signal or (), x, colour, points), path)
    _shell.answer({"file": path}, str(path), json)
    return _shell.DONE
