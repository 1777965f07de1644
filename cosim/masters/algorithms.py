"""The ways to run one system, by name: which master steps it, and as what its FMUs are loaded.

    with closing(open_master(files, system, "gauss_seidel", 50e-6, library)) as master:
        recording = master.record(["robot.platform.position[3]"], rows=1001)
        master.initialize()
        master.advance(1000)

Whatever the name, the master answers to the same words (`master.Master`), and what it records is the same.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

from hfsa.cosim.fmi.co_simulation import Instance, Instances, Kind, open_instances
from hfsa.cosim.fmi.model_exchange import ModelExchangeInstance
from hfsa.cosim.masters.error_controlled import ErrorControlled
from hfsa.cosim.masters.master import Master
from hfsa.cosim.masters.monolithic.master import INTEGRATORS, Monolithic
from hfsa.cosim.masters.native.stepping import make_master
from hfsa.cosim.systems.system import ERROR_CONTROLLED, System

COUPLING = 1e-2
"""Part of the tolerance of a response that communication steps may err by."""


def open_master(
    files: Mapping[str, Path],
    system: System,
    algorithm: str,
    step_size: float,
    library: Path | None,
    tolerance: float = 1e-3,
) -> Master:
    """Return a master of a system whose FMUs it has loaded; `close` frees them.

    `files` are the FMUs by component, `algorithm` is one of `ALGORITHMS`, `step_size` [s] lies between two points at
    which values are recorded, `library` is the stepping loop in C, `None` for Python's; `tolerance` is that of a
    response, relative, for algorithms that choose their steps. Raises `StructureError` where the wiring is wrong or an
    FMU does not offer what the algorithm takes; nothing is left loaded then.
    """
    if algorithm in INTEGRATORS:
        return _opened(
            files, ModelExchangeInstance, lambda instances: Monolithic(instances, system, step_size, algorithm)
        )

    def make(instances: Mapping[str, Instance]) -> Master:
        """Make the master of an algorithm that steps instances."""
        if algorithm == ERROR_CONTROLLED:
            return ErrorControlled(instances, system, step_size, COUPLING * tolerance, library)
        return make_master(instances, system, algorithm, step_size, library)

    return _opened(files, Instance, make)


def _opened(files: Mapping[str, Path], kind: type[Kind], make: Callable[[Instances[Kind]], Master]) -> Master:
    """Return the master that is made of instances of a kind; where that fails, nothing is left loaded."""
    instances = open_instances(files, kind)
    try:
        return make(instances)
    except BaseException:
        instances.close()
        raise
