"""Export of a model: contents and bytes of the archive, and files left after a failure."""

import errno
import os
import shutil
import signal
import subprocess
import sys
import zipfile
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from fmpy.model_description import read_build_description, read_model_description
from fmpy.simulation import instantiate_fmu
from fmpy.util import create_cmake_project
from lxml import etree

import hfsa.components
import hfsa.fmus.export as room
from hfsa.components import Model
from hfsa.components._modelling.catalogue import find
from hfsa.components.mass_on_spring import mass_on_spring
from hfsa.fmus._interfaces import binary_path
from hfsa.fmus._platforms import PLATFORMS
from hfsa.fmus.check import examine
from hfsa.fmus.compile import compiler
from hfsa.fmus.errors import ExportError
from hfsa.fmus.export import export

VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])


@VERSIONS
def test_every_part_passes_the_check(part_files, version, monkeypatch):
    """The export has run the binary already, so that the run is left out here."""
    monkeypatch.setattr("hfsa.fmus.check.trial", lambda folder, interfaces: [])
    report = examine(part_files[version])
    assert report.problems == []
    assert report.warnings == []


def test_the_files_are_named_after_model_and_version(mass_on_spring_files):
    assert [f.name for f in mass_on_spring_files.values()] == ["MassOnSpring.fmi2.fmu", "MassOnSpring.fmi3.fmu"]


def test_one_version_alone(tmp_path):
    (file,) = export(mass_on_spring(), tmp_path / "new" / "folder", versions=[3])
    assert file == tmp_path / "new" / "folder" / "MassOnSpring.fmi3.fmu"
    assert read_model_description(file).fmiVersion == "3.0"


@VERSIONS
def test_what_is_in_the_archive(mass_on_spring_files, version):
    with zipfile.ZipFile(mass_on_spring_files[version]) as archive:
        names = archive.namelist()
        page = archive.read("documentation/index.html").decode()
        licence = archive.read("documentation/licenses/license.txt").decode()
    assert names[0] == "modelDescription.xml"
    assert binary_path(Path(), version, "MassOnSpring").as_posix() in names
    assert ("sources/buildDescription.xml" in names) == (version == 3)
    assert not any(name.endswith((".o", ".py", "/")) for name in names)
    assert "base.position" in page
    assert "Spring stiffness" in page
    assert licence.startswith("BSD 3-Clause License")


def test_the_same_model_gives_the_same_bytes(mass_on_spring_files, tmp_path):
    for file in export(find([hfsa.components])["mass_on_spring"].model(), tmp_path):
        first = next(f for f in mass_on_spring_files.values() if f.name == file.name)
        assert file.read_bytes() == first.read_bytes()


def trajectory(folder: Path, version: int) -> list[float]:
    """Position after each of ten steps, the base at 1 mm."""
    description = read_model_description(folder)
    references = {v.name: v.valueReference for v in description.modelVariables}
    fmu = instantiate_fmu(folder, description, "CoSimulation")
    if version == 2:
        fmu.setupExperiment()
    (fmu.setReal if version == 2 else fmu.setFloat64)([references["base.position"]], [1e-3])
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    positions = []
    for k in range(10):
        fmu.doStep(k * 1e-3, 1e-3)
        positions += (fmu.getReal if version == 2 else fmu.getFloat64)([references["position"]])
    fmu.terminate()
    fmu.freeInstance()
    return positions


@VERSIONS
def test_the_sources_inside_compile_to_the_same_behaviour(mass_on_spring_files, tmp_path, version):
    """With nothing but a C compiler, the list of files that the FMU itself gives, and no flag of ours."""
    with zipfile.ZipFile(mass_on_spring_files[version]) as archive:
        archive.extractall(tmp_path)
    before = trajectory(tmp_path, version)
    builds = read_model_description(tmp_path).buildConfigurations if version == 2 else read_build_description(tmp_path)
    files = [
        tmp_path / "sources" / name for build in builds[:1] for s in build.sourceFileSets for name in s.sourceFiles
    ]
    library = binary_path(tmp_path, version, "MassOnSpring")
    library.unlink()
    subprocess.run([*compiler(), "-shared", "-fPIC", *map(str, files), "-o", str(library), "-lm"], check=True)
    np.testing.assert_allclose(trajectory(tmp_path, version), before, rtol=1e-12)
    assert max(np.abs(before)) > 1e-5


@pytest.mark.skipif(shutil.which("cmake") is None, reason="cmake is not installed")
@VERSIONS
def test_the_project_that_fmpy_writes_builds(mass_on_spring_files, tmp_path, version):
    """It defines macros that our sources must leave alone: MODEL_EXCHANGE, CO_SIMULATION."""
    source, build = tmp_path / "source", tmp_path / "build"
    create_cmake_project(str(mass_on_spring_files[version]), str(source))
    before = trajectory(source, version)
    library = binary_path(source, version, "MassOnSpring")
    library.unlink()
    for call in (["cmake", "-S", source, "-B", build], ["cmake", "--build", build]):
        done = subprocess.run(call, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    assert library.is_file() or shutil.copy(next(build.rglob(library.name)), library)
    np.testing.assert_allclose(trajectory(source, version), before, rtol=1e-12)


def test_the_build_description_names_each_platform_once(mass_on_spring_files):
    assert len(read_build_description(mass_on_spring_files[3])) == len(PLATFORMS)
    with zipfile.ZipFile(mass_on_spring_files[3]) as archive:
        root = etree.fromstring(archive.read("sources/buildDescription.xml"))
    assert [build.get("platform") for build in root] == list(PLATFORMS)
    for build in root:
        libraries = [library.get("name") for library in build.iterfind("Library")]
        assert libraries == ([] if "windows" in build.get("platform") else ["m"])


# What is left when something fails -----------------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path) -> Path:
    """A folder with an earlier export in it."""
    (tmp_path / "MassOnSpring.fmi2.fmu").write_bytes(b"an earlier export")
    return tmp_path


def left(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.iterdir()}


def test_a_full_disk_leaves_the_earlier_file(folder, monkeypatch):
    def full(file, files):
        file.write_bytes(b"half an FMU")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(room, "pack", full)
    with pytest.raises(ExportError, match=r"MassOnSpring\.fmi2\.fmu cannot be written: No space left"):
        export(mass_on_spring(), folder)
    assert left(folder) == {"MassOnSpring.fmi2.fmu": b"an earlier export"}


def test_an_interrupt_leaves_the_earlier_file(folder):
    """A process that is sent SIGINT while it writes."""
    code = (
        "import os, signal, sys, hfsa.fmus.export as room\n"
        "from pathlib import Path\n"
        "from hfsa.components.mass_on_spring import mass_on_spring\n"
        "pack = room.pack\n"
        "def interrupted(file, files):\n"
        "    pack(file, files)\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "room.pack = interrupted\n"
        "room.export(mass_on_spring(), Path(sys.argv[1]))\n"
    )
    done = subprocess.run([sys.executable, "-c", code, str(folder)], capture_output=True, text=True, timeout=120)
    assert done.returncode in (1, -signal.SIGINT)
    assert "KeyboardInterrupt" in done.stderr
    assert left(folder) == {"MassOnSpring.fmi2.fmu": b"an earlier export"}


def test_a_folder_that_cannot_be_made_is_an_export_error(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(ExportError, match="cannot be written"):
        export(mass_on_spring(), tmp_path / "file")


def test_an_fmu_that_breaks_a_rule_is_not_written(tmp_path):
    """Its output is infinite at the start values, which an importer would meet at its first step."""
    m = Model("Divides", "Divides by its input")
    u = m.input("u", "1", "Divisor")
    m.output("y", 1 / u, "1", "Quotient")
    with pytest.raises(ExportError, match=r"y .*inf"):
        export(m, tmp_path)
    assert left(tmp_path) == {}


def test_a_model_with_awkward_texts_is_exported(tmp_path):
    m = Model("Awkward", "Quotes \" ' and <brackets> & ampersands, degrees °, 100 % #s")
    x = m.state("x", "m", 'Described with "quotes" & °', start=1.0)
    m.der[x] = -x
    m.output("y", ca.sqrt(x), "1", "Root of x <0?>")
    m.information = {"level": 'a "level" & more °', "factor": 1e300}
    for file in export(m, tmp_path):
        found = {v.name: v for v in read_model_description(file).modelVariables}
        with zipfile.ZipFile(file) as archive:
            root = etree.fromstring(archive.read("modelDescription.xml"))
        texts = [root.find(".//Constant"), root.find(".//String")]
        assert [t.get("value") or t.get("start") for t in texts if t is not None] == ['a "level" & more °']
        assert found["x"].description == 'Described with "quotes" & °'
