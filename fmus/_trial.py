"""Short run of an FMU's binary in a child process, which isolates crashes and hangs.

    problems = trial(folder, ["CoSimulation"])      # starts `python -m hfsa.fmus._trial folder report CoSimulation`

For each interface the child loads the library, checks its exported functions, instantiates with the token of the model
description, initializes, and takes one communication step (Co-Simulation) or evaluates the derivatives (Model
Exchange). It writes each stage to a report before it begins, so the parent can name the stage of a crash.
"""

import contextlib
import ctypes
import json
import math
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, Any, TextIO

import numpy as np
from fmpy.model_description import ModelDescription, ModelVariable, read_model_description
from fmpy.simulation import instantiate_fmu

from hfsa.fmus._interfaces import binary_path, functions

LABELS = {"ModelExchange": "Model Exchange", "CoSimulation": "Co-Simulation"}
TIMEOUT = 60.0
"""Time limit of a child process [s]."""
LEAST_MEMORY, LARGEST_FILE = 1 << 32, 1 << 28
"""Address space that every child process has, and size of a file that it writes, its messages among them [byte]."""
_LAST = 1 << 16
"""Size of the messages of a child process that are looked at [byte]."""
_PARENT_DEATH_SIGNAL = 1
"""What Linux calls PR_SET_PDEATHSIG."""


def trial(folder: Path, interfaces: Sequence[str], timeout: float = TIMEOUT) -> list[str]:
    """Return the problems of a short run of the unpacked FMU in `folder`; `interfaces` are names of XML elements.

    If an interface ends the child, a new child runs the next one.
    """
    problems = []
    remaining = list(interfaces)
    while remaining:
        found, ending, finished = _one_child(folder, remaining, timeout)
        problems += [*found, ending] if ending else found
        remaining = remaining[max(finished, 1) :]
    return problems


def death(folder: Path, timeout: float = TIMEOUT) -> str | None:
    """Return how an unpacked FMU ends or blocks the process that co-simulates it; `None` if it does neither."""
    return _one_child(folder, ["CoSimulation"], timeout)[1]


def _one_child(folder: Path, interfaces: Sequence[str], timeout: float) -> tuple[list[str], str | None, int]:
    """Return the problems that one child found, its abnormal ending if any, and the number of interfaces it began."""
    with tempfile.TemporaryDirectory(prefix="hfsa-") as scratch:
        report = Path(scratch) / "report"
        command = [sys.executable, "-m", "hfsa.fmus._trial", str(folder), str(report), *interfaces]
        with Path(scratch, "messages").open("w+b") as messages:
            code = _return_code(command, messages, Path(scratch), timeout)
            messages.seek(max(messages.seek(0, os.SEEK_END) - _LAST, 0))
            cause = f"did not return within {timeout:g} s" if code is None else _abnormal_exit(code, messages.read())
        entries = _entries(report)
    if cause is None and sum("done" in entry for entry in entries) < len(interfaces):
        cause = "ended the process"
    problems = [f"{entry['interface']}: {entry['problem']}" for entry in entries if "problem" in entry]
    ending = None
    if cause is not None:
        last = entries[-1] if entries else {"interface": LABELS[interfaces[0]], "doing": "start"}
        ending = f"{last['interface']}: {last.get('doing', 'end')}: the binary {cause}"
    return problems, ending, len({entry["interface"] for entry in entries})


def _return_code(command: Sequence[str], messages: IO[bytes], folder: Path, timeout: float) -> int | None:
    """Return the return code of a child in a session of its own, `None` where it took too long.

    All that it has started in its session ends with it.
    """
    child = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=messages,
        cwd=folder,
        env=_environment(),
        start_new_session=True,
    )
    try:
        return child.wait(timeout)
    except subprocess.TimeoutExpired:
        return None
    finally:
        if os.name == "posix":
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(child.pid, signal.SIGKILL)
        child.kill()
        child.wait()


def _entries(report: Path) -> list[dict[str, str]]:
    """Return the entries of a report up to the first damaged one: an FMU can write into any file of its process."""
    entries: list[dict[str, str]] = []
    with contextlib.suppress(OSError, ValueError):
        for line in report.read_text(encoding="utf-8", errors="replace").splitlines():
            entry = json.loads(line)
            if not isinstance(entry, dict) or "interface" not in entry:
                break
            entries.append(entry)
    return entries


def _environment() -> dict[str, str]:
    """Return the environment of the child, with the module search path of this process."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}


def identifier(description: ModelDescription, interface: str) -> str:
    """Return the model identifier of an interface, empty if the FMU does not have the interface."""
    element = description.coSimulation if interface == "CoSimulation" else description.modelExchange
    return "" if element is None else element.modelIdentifier or ""


def _abnormal_exit(code: int, stderr: bytes) -> str | None:
    """Return the abnormal exit of the child in words; `None` for a normal one."""
    if code == 0:
        return None
    if code < 0:
        names = {known.value: known.name for known in signal.Signals}  # without most of the real-time signals
        return f"crashed with {names.get(-code, f'signal {-code}')}"
    last = stderr.decode("utf-8", "replace").strip().splitlines()[-1:]
    return f"ended the process with exit code {code}" + (f" ({last[0]})" if last else "")


class _StageError(Exception):
    """A stage of the run of one interface failed; its problem is in the report."""


class _Run:
    """The report of the child on one interface: stages and problems; `logged` is the last message of the FMU."""

    def __init__(self, report: TextIO, interface: str):
        self._report = report
        self._interface = LABELS[interface]
        self.logged = ""

    def _write(self, **entry: str) -> None:
        """Write one entry and flush it, because the next call of the FMU may end the process."""
        self._report.write(json.dumps({"interface": self._interface, **entry}) + "\n")
        self._report.flush()

    def problem(self, text: str) -> None:
        """Report a problem."""
        self._write(problem=text)

    def done(self) -> None:
        """Report the end of the run of this interface, with or without problems."""
        self._write(done="yes")

    @contextlib.contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Report a stage before it begins; an exception in it is reported as a problem and ends the run."""
        self._write(doing=name)
        self.logged = ""
        try:
            yield
        except MemoryError:
            self.problem(f"{name}: takes more memory than half of this machine's")
            raise _StageError from None
        except Exception as error:
            self.problem(f"{name}: {error}" + (f" Message of the FMU: {self.logged}" if self.logged else ""))
            raise _StageError from None

    def log(self, *arguments) -> None:
        """Store the last warning or error; the last arguments in FMI 2 and FMI 3 are status, category and text."""
        status, _, text = arguments[-3:]
        if status:
            self.logged = (text or b"").decode("utf-8", "replace").strip()


def _run_instance(run: _Run, folder: Path, description: ModelDescription, interface: str) -> None:
    """Run one instance from instantiation to termination."""
    version = description.fmiMajorVersion
    library = binary_path(folder, version, identifier(description, interface))
    with run.stage("loading"):
        binary = ctypes.CDLL(str(library))
    missing = sorted(name for name in functions(version)[interface] if not hasattr(binary, name))
    if missing:
        run.problem(f"{library.name} does not export {', '.join(missing)}")
        return
    with run.stage("instantiation"):
        fmu: Any = instantiate_fmu(folder, description, interface, debug_logging=True, logger=run.log)
    experiment = description.defaultExperiment
    start = float(experiment.startTime or 0.0) if experiment else 0.0
    with run.stage("initialization"):
        if version == 2:
            fmu.setupExperiment(startTime=start)
            fmu.enterInitializationMode()
        else:
            fmu.enterInitializationMode(startTime=start)
        fmu.exitInitializationMode()
    (_step if interface == "CoSimulation" else _derivatives)(run, fmu, description, start)
    with run.stage("termination"):
        fmu.terminate()
        fmu.freeInstance()


def _main(folder: Path, report: Path, interfaces: Sequence[str]) -> None:
    """Run all interfaces in the child process and write the report."""
    _limit()
    description = read_model_description(folder, validate=False)
    with report.open("w", encoding="utf-8") as file:
        for interface in interfaces:
            run = _Run(file, interface)
            with contextlib.suppress(_StageError):
                _run_instance(run, folder, description, interface)
            run.done()


def _limit() -> None:
    """Limit memory and files of this process, and let it end with its parent, where the system can."""
    if os.name != "posix":
        return
    import resource

    memory = max(LEAST_MEMORY, os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2)
    for kind, most in ((resource.RLIMIT_AS, memory), (resource.RLIMIT_FSIZE, LARGEST_FILE), (resource.RLIMIT_CORE, 0)):
        _, hard = resource.getrlimit(kind)
        resource.setrlimit(kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
    signal.signal(signal.SIGXFSZ, signal.SIG_DFL)  # Python ignores it, and the FMU would go on
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PARENT_DEATH_SIGNAL, signal.SIGKILL)


def _step(run: _Run, fmu: Any, description: ModelDescription, start: float) -> None:
    """Take one communication step and check that outputs and states are finite."""
    step = _step_size(description)
    with run.stage(f"step of {step:g} s"):
        fmu.doStep(start, step)
    states = {id(v.derivative) for v in description.modelVariables if v.derivative is not None}
    watched = [v for v in description.modelVariables if v.causality == "output" or id(v) in states]
    for variable, values in _values(run, fmu, watched):
        if not np.isfinite(values).all():
            run.problem(f"after one step of {step:g} s {variable.name} is {_plain(values)}, expected finite")


def _derivatives(run: _Run, fmu: Any, description: ModelDescription, start: float) -> None:
    """Complete the event iteration at the start and check derivatives and nominal values of the states."""
    version = description.fmiMajorVersion
    with run.stage("event iteration at the start"):
        update = fmu.newDiscreteStates if version == 2 else fmu.updateDiscreteStates
        for _ in range(100):
            needed, *_ = update()
            if not needed:
                break
        else:
            run.problem("the event iteration at the start does not converge within 100 iterations")
        fmu.enterContinuousTimeMode()
        fmu.setTime(start)
    n = description.numberOfContinuousStates
    if version == 3:
        with run.stage("number of states"):
            found = fmu.getNumberOfContinuousStates()
        if found != n:
            run.problem(f"the binary has {found} continuous states, modelDescription.xml has {n}")
            return
    if n == 0:
        return
    slopes, nominals = (ctypes.c_double * n)(), (ctypes.c_double * n)()
    with run.stage("evaluation of the derivatives"):
        (fmu.getDerivatives if version == 2 else fmu.getContinuousStateDerivatives)(slopes, n)
        fmu.getNominalsOfContinuousStates(nominals, n)
    if not np.isfinite(slopes).all():
        run.problem(f"the derivatives at the start are {_plain(list(slopes))}, expected finite")
    if not all(math.isfinite(v) and v > 0 for v in nominals):
        run.problem(f"the nominal values of the continuous states are {_plain(list(nominals))}, expected above 0")


def _step_size(description: ModelDescription) -> float:
    """Return the step size of the description, else a 500th of its default experiment, else 1 ms."""
    experiment, cosimulation = description.defaultExperiment, description.coSimulation
    fixed = getattr(cosimulation, "fixedInternalStepSize", None)
    if experiment and experiment.stepSize:
        return float(experiment.stepSize)
    if fixed:
        return float(fixed)
    if experiment and experiment.stopTime:
        return (float(experiment.stopTime) - float(experiment.startTime or 0.0)) / 500
    return 1e-3


def _values(run: _Run, fmu: Any, variables: list[ModelVariable]):
    """Yield each floating-point variable with the list of its values, arrays flattened."""
    readers = {"Real": "getReal", "Float64": "getFloat64", "Float32": "getFloat32"}
    for variable in variables:
        if variable.type not in readers:
            continue
        size = int(np.prod(variable.shape)) if variable.shape else 1
        more = {} if variable.type == "Real" else {"nValues": size}
        with run.stage(f"reading {variable.name}"):
            yield variable, getattr(fmu, readers[variable.type])([variable.valueReference], **more)


def _plain(values: list[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)


if __name__ == "__main__":
    _main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:])
