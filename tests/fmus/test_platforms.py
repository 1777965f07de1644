"""Binaries for other platforms: where they lie, what is inside of them, and that they run there as here."""

import importlib.util
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from hfsa.components.mass_on_spring import mass_on_spring
from hfsa.fmus._binary import is_of_the_system, read_binary
from hfsa.fmus._interfaces import HEADERS, all_functions
from hfsa.fmus._platforms import HERE, PLATFORMS, platforms_named, unnamed
from hfsa.fmus.c_code import Sources, generate
from hfsa.fmus.check import examine
from hfsa.fmus.compile import compile_library, compiler
from hfsa.fmus.errors import ExportError
from hfsa.fmus.export import export, pack

HARNESS = Path(__file__).parent / "harness" / "load.c"
STEPS = 40

needs_zig = pytest.mark.skipif(importlib.util.find_spec("ziglang") is None, reason="the extra zig is not installed")

# Names ------------------------------------------------------------------------------------------------------------


def test_words_for_platforms():
    assert platforms_named(["here"]) == [HERE]
    assert platforms_named(["all", "here"]) == [*PLATFORMS.values()]
    assert [p.name for p in platforms_named(["aarch64-linux", "x86_64-windows"])] == ["aarch64-linux", "x86_64-windows"]
    with pytest.raises(ExportError, match=r"'linux64' is not one of here, all, x86_64-linux.*"):
        platforms_named(["linux64"])
    with pytest.raises(ExportError, match=r"did you mean aarch64-darwin\?"):
        platforms_named(["arm64-darwin"])
    with pytest.raises(ExportError, match="no platforms"):
        platforms_named([])


def test_folders_by_version():
    """FMI 2 has names for x86 alone: a binary for ARM in darwin64 would be loaded on the wrong machine."""
    folders = {name: str(p.path(2, "It")) for name, p in PLATFORMS.items() if p.path(2, "It")}
    assert folders == {
        "x86_64-linux": "binaries/linux64/It.so",
        "x86_64-windows": "binaries/win64/It.dll",
        "x86_64-darwin": "binaries/darwin64/It.dylib",
    }
    assert str(PLATFORMS["aarch64-darwin"].path(3, "It")) == "binaries/aarch64-darwin/It.dylib"
    assert unnamed(PLATFORMS.values(), 2) == ["aarch64-linux", "aarch64-darwin"]
    assert unnamed(PLATFORMS.values(), 3) == []


def test_a_platform_without_a_name_in_the_only_version_is_refused(tmp_path):
    with pytest.raises(ExportError, match=r"FMI 2 has no name for aarch64-linux; FMI 3 has"):
        export(mass_on_spring(), tmp_path, [2], ["aarch64-linux"])
    assert list(tmp_path.iterdir()) == []


def test_without_ziglang_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(
        ExportError, match=r"platform x86_64-windows needs the compiler ziglang: pip install hfsa\[zig\]"
    ):
        export(mass_on_spring(), tmp_path, [3], ["x86_64-windows"])


def test_cvode_is_for_this_machine(tmp_path):
    model = mass_on_spring()
    model.solver = "cvode"
    with pytest.raises(ExportError, match=r"SUNDIALS of this machine.*choose another solver for x86_64-windows"):
        export(model, tmp_path, [3], ["x86_64-windows"])


# Inside -----------------------------------------------------------------------------------------------------------


def repacked(file: Path, to: Path, change) -> Path:
    """The FMU with other files, `change` of those inside by path."""
    with zipfile.ZipFile(file) as archive:
        pack(to, change({name: archive.read(name) for name in archive.namelist()}))
    return to


def test_a_library_in_the_folder_of_another_platform_is_found(mass_on_spring_files, tmp_path):
    def misplaced(files):
        library = next(content for name, content in files.items() if name.startswith("binaries/"))
        return files | {"binaries/aarch64-linux/MassOnSpring.so": library}

    report = examine(repacked(mass_on_spring_files[3], tmp_path / "it.fmu", misplaced))
    expected = f"aarch64-linux/MassOnSpring.so is a library for {HERE.name}, expected one for aarch64-linux"
    assert report.problems == [f"binaries: {expected}"]
    assert report.platforms == [*sorted(["aarch64-linux", HERE.name]), "sources"]


def test_a_binary_of_ours_that_is_none_is_found(mass_on_spring_files, tmp_path):
    def broken(files):
        return files | {"binaries/x86_64-windows/MassOnSpring.dll": b"MZ" + bytes(100)}

    (problem,) = examine(repacked(mass_on_spring_files[3], tmp_path / "it.fmu", broken)).problems
    assert problem == "binaries: x86_64-windows/MassOnSpring.dll is no shared library for Linux, Windows or macOS"


def test_this_platforms_library_needs_the_c_library_alone(mass_on_spring_files, tmp_path):
    with zipfile.ZipFile(mass_on_spring_files[3]) as archive:
        (name,) = [name for name in archive.namelist() if name.startswith("binaries/")]
        library = Path(archive.extract(name, tmp_path))
    binary = read_binary(library)
    assert binary
    assert binary.platform == HERE.name
    assert all(is_of_the_system(found) for found in binary.needed)
    assert not is_of_the_system("libgfortran.so.5")


@needs_zig
@pytest.mark.slow
def test_all_platforms(tmp_path):
    """Exported twice: the bytes depend on no path and no time; each library has FMI's functions and nothing else."""
    first, second = (export(mass_on_spring(), tmp_path / name, [2, 3], ["all"]) for name in ("one", "two"))
    assert [file.read_bytes() for file in first] == [file.read_bytes() for file in second]
    for file, version in zip(first, (2, 3), strict=True):
        report = examine(file)
        assert (report.problems, report.warnings) == ([], [])
        named = [p.path(version, "MassOnSpring") for p in PLATFORMS.values()]
        assert report.platforms == [*sorted(path.parent.name for path in named if path), "sources"]
    with zipfile.ZipFile(first[1]) as archive:
        archive.extractall(tmp_path / "inside")
    for name, platform in PLATFORMS.items():
        library = tmp_path / "inside" / str(platform.path(3, "MassOnSpring"))
        binary = read_binary(library)
        assert binary, name
        assert binary.exported == all_functions(), name
        assert binary.platform == name
        assert binary.needed, name
        assert [found for found in binary.needed if not is_of_the_system(found)] == [], name


# There ------------------------------------------------------------------------------------------------------------

LOADERS = ("wine64", "/usr/lib/wine/wine64")


def wine() -> str | None:
    return next((found for name in LOADERS if (found := shutil.which(name))), None)


ARM_ROOT = Path("/usr/aarch64-linux-gnu")


def trajectory(sources: Sources, library: Path, program: list[str], environment=None) -> np.ndarray:
    """Outputs after each step, by the loader `program`, with the first input held in each step."""
    listed = sources.listed(2)
    (first, *_) = [v.reference for v in listed if v.role.value == "input"]
    outputs = [str(v.reference) for v in listed if v.role.value in ("output", "state")]
    call = [*program, str(library), sources.token, str(first), "0.01", str(STEPS), *outputs]
    done = subprocess.run(call, capture_output=True, text=True, env=environment, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    return np.array([[float.fromhex(word) for word in line.split()] for line in done.stdout.splitlines()])


def loader(folder: Path, command: list[str], name: str) -> Path:
    """Compile the program that loads a library."""
    folder.mkdir(parents=True, exist_ok=True)
    more = [] if name.endswith(".exe") else ["-ldl"]
    call = [*command, "-O1", "-I", str(HEADERS), str(HARNESS), "-o", str(folder / name), *more]
    subprocess.run(call, check=True, capture_output=True, timeout=600)
    return folder / name


@needs_zig
@pytest.mark.slow
@pytest.mark.parametrize("model", ["pendulum", "chain", "controller", "van_der_pol"])
@pytest.mark.parametrize("platform", ["x86_64-linux", "aarch64-linux", "x86_64-windows"])
def test_the_trajectory_there_is_the_one_here(models, tmp_path, platform, model):
    """Linux: the same bits, also on ARM by qemu; Windows, by wine, has a library of mathematics of its own."""
    runner, environment = [], dict(os.environ)
    if platform == "aarch64-linux":
        if shutil.which("qemu-aarch64") is None or not (ARM_ROOT / "lib").is_dir():
            pytest.skip("needs qemu-aarch64 and the C library of ARM (Debian: qemu-user, libc6-arm64-cross)")
        runner = ["qemu-aarch64", "-L", str(ARM_ROOT)]
    if platform == "x86_64-windows":
        if wine() is None:
            pytest.skip("needs wine (Debian: wine64)")
        runner = [str(wine())]
        environment |= {"WINEPREFIX": str(tmp_path.parent / "wine"), "WINEDEBUG": "-all", "DISPLAY": ""}
    sources = generate(models[model]())
    there = PLATFORMS[platform]
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", there.target]
    name = "load.exe" if platform == "x86_64-windows" else "load"
    library = compile_library(sources, tmp_path / platform, there)
    found = trajectory(sources, library, [*runner, str(loader(tmp_path / platform, zig, name))], environment)

    native = compile_library(sources, tmp_path / "here")
    expected = trajectory(sources, native, [str(loader(tmp_path / "here", compiler(), "load"))])
    assert np.abs(expected).max() > 1e-3
    scale = np.abs(expected).max(axis=0)
    assert found.shape == expected.shape
    assert (np.abs(found - expected) <= 1e-12 * scale).all(), np.abs(found - expected).max(axis=0)


@needs_zig
@pytest.mark.slow
def test_a_file_for_another_platform_alone(tmp_path):
    """It cannot be run here, which is a warning, as nothing is wrong with it."""
    (file,) = export(
        mass_on_spring(), tmp_path, [3], ["aarch64-darwin" if HERE.name != "aarch64-darwin" else "x86_64-windows"]
    )
    report = examine(file)
    assert report.problems == []
    assert any("is missing; there are binaries for" in warning for warning in report.warnings)
