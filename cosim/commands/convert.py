"""Verb `convert`: a results file as a table for other programs."""

from pathlib import Path

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json
from hfsa.cosim.commands._options import Force, Output


def convert(file: Path, /, *, output: Output = None, force: Force = False, json: Json = False) -> int:
    """Write a results file as a table: CSV, MATLAB's MAT or Parquet.

    Of a run a row is a time, of a sweep a frequency, an output and an input. Units are in the header.

    Parameters
    ----------
    file
        Results file of any verb.
    output
        Table; its ending is `.csv`, `.mat` or `.parquet` (default: the results file with the ending `.csv`). With
        `--force` it replaces a table of the same format.
    """
    from hfsa.cosim.results.flat import read_flat
    from hfsa.cosim.results.flat_files import write_flat

    path = output or file.with_suffix(".csv")
    found = read_flat(file)
    if found.left_out:
        _shell.warn(f"over other coordinates, and not in the table: {', '.join(found.left_out)}")
    write_flat(found, path, force)
    rows = len(next(iter(found.columns.values())))
    data = {"file": path, "rows": rows, "columns": dict(found.units), "left_out": list(found.left_out)}
    _shell.answer(data, f"{path}: {rows} rows, {len(found.columns)} columns", json)
    return _shell.DONE
