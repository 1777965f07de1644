"""Reader of results files of either kind: a sweep as `Bode`, a run as `Run`."""

from pathlib import Path

from hfsa.cosim.results.files import Bode, read_sweep
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.results.run import Run
from hfsa.cosim.results.store import reading


def read(path: str | Path) -> Bode | Run:
    """Read a results file, finished or not; `ResultsError` where it holds neither a sweep nor a run."""
    if not isinstance(path, str | Path):
        raise ResultsError(f"a results file is {path!r}, expected a path")
    with reading(Path(path)) as file:
        is_run = "time" in file
    return Run.read(path) if is_run else read_sweep(path)
