"""Compilation of C to a shared library: compiler, symbols, and messages of failures."""

import ctypes
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest

from hfsa.fmus.c_code import generate
from hfsa.fmus.compile import FLAGS, compile_library, compiler, source_files
from hfsa.fmus.errors import ExportError


def standard_functions() -> set[str]:
    """Every function that the headers of FMI 2 and FMI 3 declare."""
    headers = [Path(fmpy.__file__).parent / "c-code" / f"fmi{version}Functions.h" for version in (2, 3)]
    declared = re.compile(r"^\s*FMI[23]_Export\s+\w+\s+(\w+);", re.MULTILINE)
    return {name for header in headers for name in declared.findall(header.read_text())}


def symbols(library: Path, kind: str) -> set[str]:
    """Dynamic symbols without their versions."""
    listing = subprocess.run(["nm", "-D", kind, library], capture_output=True, text=True, check=True).stdout
    return {line.split()[-1].split("@")[0] for line in listing.splitlines()}


@pytest.mark.skipif(shutil.which("nm") is None, reason="reads the symbols with nm")
def test_the_library_exports_the_standards_and_nothing_else(compiled, models):
    _, library = compiled(models["two_link"]())
    assert len(standard_functions()) > 100
    assert symbols(library, "--defined-only") == standard_functions()


@pytest.mark.skipif(shutil.which("nm") is None, reason="reads the symbols with nm")
def test_the_library_prints_and_ends_nothing(compiled, models):
    """No file, no output, no way out of the host's process."""
    _, library = compiled(models["pendulum"]())
    assert not symbols(library, "--undefined-only") & {"printf", "puts", "fopen", "exit", "abort", "system"}


@pytest.mark.skipif(shutil.which("readelf") is None, reason="reads the needed libraries with readelf")
def test_the_library_brings_what_it_needs(compiled, models):
    """It names the mathematics library, so it loads in a program that has not; Python always has."""
    _, library = compiled(models["pendulum"]())
    listing = subprocess.run(["readelf", "-d", library], capture_output=True, text=True, check=True).stdout
    assert set(re.findall(r"NEEDED.*\[(\w+)", listing)) == {"libm", "libc"}


def test_the_name_is_the_model_identifier(compiled, models):
    sources, library = compiled(models["gain"]())
    assert library.stem == sources.name == "Gain"


def test_denormals_and_contraction_stay_as_they_are():
    """-ffast-math would set flush-to-zero in the whole host process."""
    assert not {"-ffast-math", "-Ofast", "-march=native"} & set(FLAGS)
    assert "-ffp-contract=off" in FLAGS


def test_a_folder_with_a_space_and_a_missing_parent(models, tmp_path):
    library = compile_library(generate(models["gain"]()), tmp_path / "a folder" / "below")
    assert library.exists()
    assert library.parent.name == "below"


def test_the_same_sources_give_the_same_bytes(models, tmp_path):
    sources = generate(models["gain"]())
    first, second = (compile_library(sources, tmp_path / name).read_bytes() for name in "ab")
    assert first == second


# Compilers ------------------------------------------------------------------------------------------------------------


def empty_path(monkeypatch, tmp_path, *programs: str) -> None:
    """A PATH that holds only these, as scripts that do nothing."""
    for program in programs:
        (tmp_path / program).write_text("#!/bin/sh\n")
        (tmp_path / program).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)


def test_cc_of_the_environment_goes_first(monkeypatch, tmp_path):
    empty_path(monkeypatch, tmp_path, "cc", "mine")
    assert compiler() == ["cc"]
    monkeypatch.setenv("CC", "mine -m64")
    assert compiler() == ["mine", "-m64"]


def test_a_cc_that_does_not_exist_is_no_reason_for_another(monkeypatch, tmp_path):
    empty_path(monkeypatch, tmp_path, "cc")
    monkeypatch.setenv("CC", "nowhere -m64")
    with pytest.raises(ExportError, match=r"\$CC is 'nowhere -m64', but there is no such command"):
        compiler()
    monkeypatch.setenv("CC", " ")
    assert compiler() == ["cc"]


def test_the_order_of_compilers(monkeypatch, tmp_path):
    empty_path(monkeypatch, tmp_path, "clang")
    assert compiler() == ["clang"]
    empty_path(monkeypatch, tmp_path, "gcc")
    assert compiler() == ["gcc"]


def test_ziglang_serves_where_there_is_no_compiler(monkeypatch, tmp_path):
    empty_path(monkeypatch, tmp_path)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: object() if name == "ziglang" else None)
    assert compiler() == [sys.executable, "-m", "ziglang", "cc"]


def test_no_compiler_names_what_was_tried(monkeypatch, tmp_path, models):
    empty_path(monkeypatch, tmp_path)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(ExportError) as error:
        compile_library(generate(models["gain"]()), tmp_path)
    for word in ("cc, gcc, clang", "-m ziglang cc", "pip install hfsa[zig]"):
        assert word in str(error.value)


def test_a_compiler_that_fails_is_quoted(monkeypatch, tmp_path, models):
    broken = tmp_path / "broken"
    broken.write_text("#!/bin/sh\necho 'no space left' >&2\nexit 3\n")
    broken.chmod(0o755)
    monkeypatch.setenv("CC", shlex.quote(str(broken)))
    with pytest.raises(ExportError, match=r"(?s)Gain: .*broken.* failed with code 3.*no space left"):
        compile_library(generate(models["gain"]()), tmp_path)


@pytest.mark.slow
def test_ziglang_compiles_the_same_sources(monkeypatch, tmp_path, models):
    """The wheel's compiler gives a library with the same functions."""
    pytest.importorskip("ziglang")
    monkeypatch.setenv("CC", f"{shlex.quote(sys.executable)} -m ziglang cc")
    library = ctypes.CDLL(str(compile_library(generate(models["pendulum"]()), tmp_path)))
    assert all(hasattr(library, name) for name in standard_functions())


# Sources for importers ------------------------------------------------------------------------------------------------


def test_the_sources_compile_by_themselves(models, tmp_path):
    """All that an importer needs lies in one folder: no include path, no definition."""
    files = source_files(generate(models["controller"]()))
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    units = sorted(name for name in files if name.endswith(".c"))
    subprocess.run([*compiler(), "-std=c99", "-fPIC", "-shared", *units, "-o", "x.so", "-lm"], cwd=tmp_path, check=True)
    assert {f"fmi{version}Functions.h" for version in (2, 3)} < set(files)
    assert all("/" not in name for name in files)
