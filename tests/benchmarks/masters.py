"""Speed of several masters on the same FMUs with one algorithm: get all, set all, step all.

    make bench        # or: python tests/benchmarks/masters.py [ROUNDS]

Beside it are other algorithms of ours, in rows that name them. Each way is prepared and timed ROUNDS times, in turn, so
that a busy machine disturbs all alike; the shortest CPU time of all threads counts, without loading and initialization.
All run on one processor: thread pools only slow small FMUs down. Before that, all with the one algorithm must agree on
the value of one output after 1000 steps. Ratios of speed are to the first row: a C program written for that loop alone,
or our loop in C where there is no such program.
"""

import argparse
import ctypes
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import fmpy
import numpy as np
from cases import Case, robot, two_fmus
from fmpy.fmi2 import FMU2Slave

from hfsa.cosim.assembly.native_loop import stepping_library
from hfsa.cosim.fmi.co_simulation import open_instances
from hfsa.cosim.fmi.description import describe
from hfsa.cosim.masters.algorithms import ALGORITHMS, make_master
from hfsa.fmus._interfaces import HEADERS, binary_path
from hfsa.fmus.compile import compiler

CHECKED_STEPS = 1000

Timed = tuple[float, np.ndarray]
"""CPU time of the steps [s], and the watched output after each of `points` equal parts of them."""

Way = Callable[..., Timed]
"""A way to step a case: arguments `case`, `steps` and `points` (default: 1, at the end)."""


# Ours -----------------------------------------------------------------------------------------------------------------


def ours(library: Path | None, record: bool = False, algorithm: str = "jacobi_plain") -> Way:
    """Our master with either loop, recording the watched output at every point or nothing."""

    def run(case: Case, steps: int, points: int = 1) -> Timed:
        with open_instances(case.files) as instances:
            master = make_master(instances, case.system, algorithm, case.step_size, library)
            if record:
                master.record([case.watched], rows=steps + 1)
            master.initialize()
            return _timed(master.advance, lambda: master.read([case.watched])[0], steps, points)

    return run


def _timed(step: Callable[[int], object], read: Callable[[], float], steps: int, points: int) -> Timed:
    """Take the steps in equal parts and read the watched output after each; reading is not timed."""
    seconds, values = 0.0, []
    for _ in range(points):
        begin = time.process_time()
        step(steps // points)
        seconds += time.process_time() - begin
        values.append(read())
    return seconds, np.array(values)


# Others ---------------------------------------------------------------------------------------------------------------


def c_program(case: Case, steps: int) -> Timed:
    """The program of floor.c."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        source = Path(__file__).with_name("floor.c")
        subprocess.run(
            [*compiler(), "-O2", "-std=c99", f"-I{HEADERS}", source, "-o", folder / "floor", "-ldl"], check=True
        )
        words = []
        for component, file in case.files.items():
            fmpy.extract(str(file), str(folder / component))
            description = describe(file)
            words += [folder / component / binary_path(Path(), 2, description.identifier), description.token]
        names = ("plant.position", "plant.force", "plant.x", "pd.position", "pd.force")
        references = [str(_reference(case, full)) for full in names]
        command = [folder / "floor", *words, str(steps), str(case.step_size), *references]
        seconds, value = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
        return float(seconds), np.array([float(value)])


def fmpy_loop(case: Case, steps: int, points: int = 1) -> Timed:
    """What one writes by hand with fmpy's own classes."""
    with tempfile.TemporaryDirectory() as folder:
        slaves = {}
        for component in case.system.components:
            unzipped = fmpy.extract(str(case.files[component.name]), str(Path(folder, component.name)))
            description = describe(case.files[component.name])
            slave = FMU2Slave(guid=description.token, modelIdentifier=description.identifier, unzipDirectory=unzipped)
            slave.instantiate()
            slave.setupExperiment()
            start = {name: float(value) for name, value in component.start.items()}
            slave.setReal([_reference(case, f"{component.name}.{name}") for name in start], list(start.values()))
            slave.enterInitializationMode()
            slaves[component.name] = slave
        gets, sets = _wires(case)
        for _ in range(4):
            _exchange(slaves, gets, sets)
        for slave in slaves.values():
            slave.exitInitializationMode()
        _exchange(slaves, gets, sets)
        component, watched = case.watched.partition(".")[0], [_reference(case, case.watched)]
        done = 0

        def step(count: int) -> None:
            nonlocal done
            for k in range(done, done + count):
                for slave in slaves.values():
                    slave.doStep(k * case.step_size, case.step_size)
                _exchange(slaves, gets, sets)
            done += count

        timed = _timed(step, lambda: slaves[component].getReal(watched)[0], steps, points)
        for slave in slaves.values():
            slave.terminate()
            slave.freeInstance()
        return timed


def _exchange(slaves, gets, sets) -> None:
    bus = {name: slaves[name].getReal(references) for name, references in gets.items()}
    for name, (references, wires) in sets.items():
        slaves[name].setReal(references, [bus[source][i] for source, i in wires])


def _wires(case: Case):
    """Return value references to get, and to set with (source, place among its outputs), by component."""
    gets: dict[str, list[int]] = {}
    sets: dict[str, tuple[list[int], list[tuple[str, int]]]] = {}
    for connection in case.system.connections:
        source, target = (case.system.split(end)[0] for end in (connection.start, connection.end))
        outputs = gets.setdefault(source, [])
        outputs.append(_reference(case, connection.start))
        references, wires = sets.setdefault(target, ([], []))
        references.append(_reference(case, connection.end))
        wires.append((source, len(outputs) - 1))
    return gets, sets


def ecos(case: Case, steps: int, points: int = 1) -> Timed:
    """Ecos: all steps up to a point in one call."""
    ctypes.CDLL(str(Path(sys.prefix) / "lib" / "libtbb.so.12"), ctypes.RTLD_GLOBAL)
    import ecospy

    structure = ecospy.EcosSimulationStructure()
    for name, file in case.files.items():
        structure.add_model(_plain(name), str(file))
    for connection in case.system.connections:
        structure.make_real_connection(_colons(connection.start), _colons(connection.end))
    starts = {f"{c.name}.{name}": float(value) for c in case.system.components for name, value in c.start.items()}
    structure.add_parameter_set("start", {_colons(name): value for name, value in starts.items()})
    simulation = ecospy.EcosSimulation(case.step_size, structure=structure)
    simulation.init(parameter_set="start")
    timed = _timed(simulation.step, lambda: simulation.get_real(_colons(case.watched)), steps, points)
    simulation.terminate()
    return timed


def libcosim(case: Case, steps: int, points: int = 1) -> Timed:
    """The Open Simulation Platform's libcosim: all steps up to a point in one call, observing the last values.

    Its first step, which includes the initialization, is not timed but counts as long as the others.
    """
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.FATAL)
    execution = CosimExecution.from_step_size(round(case.step_size * 1e9))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    slaves = {name: CosimLocalSlave(str(file), _plain(name)) for name, file in case.files.items()}
    index = {name: execution.add_local_slave(slave) for name, slave in slaves.items()}

    def place(full: str) -> tuple[int, int]:
        return index[case.system.split(full)[0]], _reference(case, full)

    for component in case.system.components:
        for name, value in component.start.items():
            execution.real_initial_value(*place(f"{component.name}.{name}"), float(value))
    for connection in case.system.connections:
        execution.connect_real_variables(*place(connection.start), *place(connection.end))
    execution.step()
    component, reference = place(case.watched)
    done = 1

    def step(count: int) -> None:
        nonlocal done
        execution.step(count - done)
        done = 0

    seconds, values = _timed(step, lambda: observer.last_real_values(component, [reference])[0], steps, points)
    return seconds * steps / (steps - 1), values


def _reference(case: Case, full: str) -> int:
    component, variable = case.system.split(full)
    return describe(case.files[component]).variables[variable].reference


def _plain(name: str) -> str:
    return name.replace("[", "_").replace("]", "")


def _colons(full: str) -> str:
    component, _, variable = full.partition(".")
    return f"{_plain(component)}::{variable}"


# The table ------------------------------------------------------------------------------------------------------------


def compare(case: Case, ways: dict[str, tuple[Way, int]], rounds: int) -> Iterator[str]:
    """Yield the rows of the table; each way has its own number of steps, for some are slow."""
    plain = [way for name, (way, _) in ways.items() if not name.endswith(tuple(ALGORITHMS))]
    values = [way(case, CHECKED_STEPS)[1][-1] for way in plain]
    np.testing.assert_allclose(values, values[0], rtol=1e-9)
    times: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(rounds):
        for name, (way, steps) in ways.items():
            times[name].append(way(case, steps)[0] / steps)
    best = {name: min(found) for name, found in times.items()}
    first = next(iter(best.values()))
    for name, seconds in best.items():
        numbers = f"{seconds * 1e6:9.3f} {1 / seconds:12,.0f} {seconds / case.step_size:12.5f} {first / seconds:9.3f}"
        yield f"{name:42} {numbers}"


def main() -> None:
    """Print one table per case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rounds", nargs="?", type=int, default=5)
    rounds = parser.parse_args().rounds
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    library = stepping_library()
    with tempfile.TemporaryDirectory() as folder:
        small = [two_fmus(Path(folder, solver), solver) for solver in ("rk4", "exact")]
        for case in (*small, robot()):
            steps, few = case.steps, case.steps // 5
            ways = {
                "a C program for this loop alone": (c_program, steps),
                "our loop in C": (ours(library), steps),
                "our loop in C, recording every point": (ours(library, record=True), steps),
                "our loop in C, gauss_seidel": (ours(library, algorithm="gauss_seidel"), steps),
                "our loop in C, quasi_newton": (ours(library, algorithm="quasi_newton"), few),
                "our loop in Python": (ours(None), few),
                "our loop in Python, quasi_newton": (ours(None, algorithm="quasi_newton"), few // 5),
                "fmpy, by hand": (fmpy_loop, few),
                "ecos": (ecos, steps),
                "libcosim": (libcosim, few),
            }
            if case not in small:
                del ways["a C program for this loop alone"]
            print(f"\n{case.title}, step {case.step_size * 1e6:g} us")
            print(f"{'':42} {'us/step':>9} {'steps/s':>12} {'s per s':>12} {'ratio':>9}")
            for row in compare(case, ways, rounds):
                print(row, flush=True)


if __name__ == "__main__":
    main()
