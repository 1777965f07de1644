"""The table of all co-simulation algorithms, by name.

    with closing(open_master(assembly, "gauss_seidel", 50e-6, library)) as master:
        recording = master.record(["robot.platform.position[3]"], rows=1001)
        master.initialize()
        master.advance(1000)

The rows are in the files of this folder (`algorithm.py`). All masters have the same methods (`master.py`) and record
values in the same way.
"""

import importlib
import pkgutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import hfsa.cosim.masters
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.fmi.model_exchange import ModelExchangeInstance
from hfsa.cosim.masters.algorithm import Algorithm
from hfsa.cosim.masters.master import Master
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import nearest
from hfsa.cosim.systems.scene import AUTO
from hfsa.cosim.systems.system import System


def _found() -> dict[str, Algorithm]:
    """Return the rows of all files in this folder by name, cheaper steps first.

    `StructureError` where two rows have one name or one rank.
    """
    room = hfsa.cosim.masters
    names = [info.name for info in pkgutil.walk_packages(room.__path__, f"{room.__name__}.")]
    files = [name for name in names if name != __name__ and "._" not in name]  # the stepping loop is `_step_...`
    modules = [importlib.import_module(name) for name in files]
    rows = [(row, module.__file__) for module in modules for row in getattr(module, "ALGORITHMS", ())]
    rows.sort(key=lambda found: found[0].rank)
    places: dict[str, str | None] = {}
    ranks: dict[int, tuple[str, str | None]] = {}
    for row, file in rows:
        if row.name in places:
            raise StructureError(f"two algorithms are called {row.name!r}, in {places[row.name]} and {file}")
        if row.rank in ranks:
            other, holder = ranks[row.rank]
            raise StructureError(
                f"{row.name} in {file} has rank {row.rank}, as has {other} in {holder}; expected a number of its own"
            )
        places[row.name], ranks[row.rank] = file, (row.name, file)
    return {row.name: row for row, _ in rows}


ALGORITHMS: Mapping[str, Algorithm] = _found()
"""All algorithms by name, cheaper steps first."""

DEFAULT = next(iter(ALGORITHMS))
"""The default algorithm."""

LIMITED = tuple(name for name, row in ALGORITHMS.items() if row.is_limited)
"""Algorithms with a prescribed communication step, whose longest stable step can be computed."""

ORDERED = tuple(name for name, row in ALGORITHMS.items() if row.is_ordered)
"""Algorithms for which the order of the components has an effect."""

CANDIDATES = tuple(name for name, row in ALGORITHMS.items() if row.is_candidate)
"""Algorithms that `auto` may choose, cheaper steps first."""


def check_algorithm(name: str) -> None:
    """Raise `StructureError` for the name of an algorithm that is neither in the table nor `auto`."""
    if name != AUTO and name not in ALGORITHMS:
        raise StructureError(f"no algorithm is called {name!r}{nearest(name, (AUTO, *ALGORITHMS))}")


def algorithm_named(name: str) -> Algorithm:
    """Return the algorithm of a name; `StructureError` with the nearest names if there is none."""
    if name not in ALGORITHMS:
        raise StructureError(f"no algorithm is called {name!r}{nearest(name, ALGORITHMS)}")
    return ALGORITHMS[name]


def make_master(
    instances: Mapping[str, Any],
    system: System,
    algorithm: str = DEFAULT,
    step_size: float = 1e-3,
    library: Path | None = None,
    tolerance: float = 1e-3,
) -> Master:
    """Return the master of a system on instances that the caller owns; arguments and errors as of `open_master`."""
    row = algorithm_named(algorithm)
    return row.make(instances, system, row, step_size, library, tolerance)


def open_master(
    assembly: Assembly, algorithm: str, step_size: float, library: Path | None, tolerance: float = 1e-3
) -> Master:
    """Load the FMUs of an assembly and return its master; `close` frees them.

    `algorithm` is one of `ALGORITHMS`, `step_size` [s] is the time between two recorded points, `library` is the
    stepping loop in C, `None` for Python's, and `tolerance` is the relative tolerance of a response, for algorithms
    that choose their steps. Raises `StructureError` where the wiring is wrong or an FMU lacks a capability that the
    algorithm requires; all FMUs are freed then.
    """
    row = algorithm_named(algorithm)
    instances = assembly.open(ModelExchangeInstance if row.is_model_exchange else Instance)
    try:
        return row.make(instances, assembly.system, row, step_size, library, tolerance)
    except BaseException:
        instances.close()
        raise
