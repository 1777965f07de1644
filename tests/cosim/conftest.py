"""Fixtures of the right wing's tests: FMUs of three small models, a foreign FMU, and a cache of built scenes."""

import shutil
import textwrap
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from foreign_fmu import foreign_fmu
from spring_loop import controller, plant, sampled_controller

from hfsa.cosim.assembly.native_loop import stepping_library
from hfsa.cosim.cli import main
from hfsa.cosim.fmi.co_simulation import Fmu, Instance, Instances, StepError, open_instances
from hfsa.cosim.masters.algorithms import make_master

Open = Callable[..., Instance]


@pytest.fixture(scope="session")
def files(exported) -> dict[tuple[str, int], Path]:
    """The three models' FMUs by (name, FMI version)."""
    models = plant(), controller(), sampled_controller()
    return {(model.name, version): file for model in models for version, file in exported(model).items()}


@pytest.fixture
def open_fmu() -> Iterator[Open]:
    """Make instances that are closed after the test."""
    opened: list[Instance] = []

    def make(file: Path, name: str = "it") -> Instance:
        opened.append(Instance(Fmu.load(file), name))
        return opened[-1]

    yield make
    for instance in opened:
        instance.close()


@pytest.fixture
def opened() -> Iterator[Callable[[dict[str, Path]], dict[str, Instance]]]:
    """Open instances by component, closed after the test."""
    made: list[Instances[Instance]] = []

    def make(files: dict[str, Path]) -> dict[str, Instance]:
        made.append(open_instances(files))
        return made[-1]

    yield make
    for instances in made:
        instances.close()


@pytest.fixture(scope="session")
def foreign(tmp_path_factory) -> dict[int, Path]:
    """Foreign FMU by FMI version: see foreign.c."""
    return {version: _foreign(tmp_path_factory.mktemp(f"foreign{version}"), version) for version in (2, 3)}


@pytest.fixture(scope="session")
def library(scene_cache) -> Path:
    """The stepping loop in C."""
    return stepping_library()


@pytest.fixture
def both(opened, library):
    """Return the outcomes of a run with the loop in Python and with the one in C."""

    def outcomes(system, files, run, algorithm="gauss_seidel", step_size=0.01):
        ways = (None, library)
        return [_outcome(make_master(opened(files), system, algorithm, step_size, way), run) for way in ways]

    return outcomes


def _outcome(master, run):
    """Return all observable results of a run, numbers as bytes."""
    failure = None
    try:
        recording = run(master)
    except StepError as error:
        recording, failure = master._recording, (str(error), error.status, error.time)
    assert recording.rows > 0
    numbers = recording.time.tobytes(), recording.values.tobytes(), master.wiring.bus.tobytes()
    return failure, recording.rows, master.time, master.warnings, numbers


@pytest.fixture
def rewritten(tmp_path) -> Callable[[Path, str, str], Path]:
    """Copy an FMU with some text of its description replaced."""

    def copy(file: Path, old: str, new: str) -> Path:
        other = tmp_path / f"{file.parent.name}_{file.name}"
        with zipfile.ZipFile(file) as archive, zipfile.ZipFile(other, "w") as changed:
            for name in archive.namelist():
                changed.writestr(name, archive.read(name).replace(old.encode(), new.encode()))
        return other

    return copy


@pytest.fixture(scope="session")
def deadly(tmp_path_factory) -> dict[str, Path]:
    """Foreign FMUs that end any process that loads them, by the way of the end."""
    return {
        how: _foreign(tmp_path_factory.mktemp(how), 2, f"-DDEADLY={i}") for i, how in enumerate(("crash", "exit"), 1)
    }


@pytest.fixture
def hfsa(capsys, tmp_path, monkeypatch):
    """Run the command in an empty folder; returns exit code, stdout, stderr."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")

    def run(*tokens):
        code = main([str(token) for token in tokens])
        answer = capsys.readouterr()
        return code, answer.out, answer.err

    return run


@pytest.fixture
def box(tmp_path):
    """A user's scene: one foreign FMU with start values, in the folder of the scene."""

    def write(file: Path, stop_time: float = 0.5, **start: float) -> Path:
        path = tmp_path / "box.toml"
        if not (tmp_path / file.name).exists():
            shutil.copy(file, tmp_path)
        values = ", ".join(f"{name} = {value}" for name, value in start.items())
        path.write_text(
            textwrap.dedent(f"""
            inputs = ["box.u"]
            outputs = ["box.y"]
            band = [1.0, 50.0]
            amplitude = {{ "1" = 1.0 }}
            step_size = 1e-3
            stop_time = {stop_time}

            [[components]]
            name = "box"
            part = "{file.name}"
            start = {{ {values} }}
            """)
        )
        return path

    return write


@pytest.fixture
def failing_scene(box, foreign) -> Path:
    """A user's scene with an FMU whose output is NaN after 1.5 s."""
    return box(foreign[2], stop_time=2.0, behaviour=6, at=1.5)


def _foreign(folder: Path, version: int, *more: str) -> Path:
    return foreign_fmu(folder, version, "Foreign", Path(__file__).with_name("foreign.c"), DESCRIPTIONS[version], *more)


DESCRIPTIONS = {
    2: """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Foreign" guid="{8c4e}">
  <CoSimulation modelIdentifier="Foreign" canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables>
    <ScalarVariable name="time" valueReference="0" causality="independent"><Real/></ScalarVariable>
    <ScalarVariable name="u" valueReference="1" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="2" causality="output"><Real max="1000"/></ScalarVariable>
    <ScalarVariable name="behaviour" valueReference="3" causality="parameter" variability="tunable">
      <Real start="0"/></ScalarVariable>
    <ScalarVariable name="at" valueReference="4" causality="parameter" variability="tunable">
      <Real start="0"/></ScalarVariable>
    <ScalarVariable name="count" valueReference="5" causality="output" variability="discrete">
      <Integer/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="3" dependencies=""/><Unknown index="6"/></Outputs></ModelStructure>
</fmiModelDescription>
""",
    3: """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Foreign" instantiationToken="{8c4e}">
  <CoSimulation modelIdentifier="Foreign" canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent"/>
    <Float64 name="u" valueReference="1" causality="input" start="0"/>
    <Float64 name="y" valueReference="2" causality="output" max="1000"/>
    <Float64 name="behaviour" valueReference="3" causality="parameter" variability="tunable" start="0"/>
    <Float64 name="at" valueReference="4" causality="parameter" variability="tunable" start="0"/>
    <Int32 name="count" valueReference="5" causality="output"/>
  </ModelVariables>
  <ModelStructure><Output valueReference="2" dependencies=""/><Output valueReference="5"/></ModelStructure>
</fmiModelDescription>
""",
}
