"""Compilers that fail, hang or make nothing, and flags that the sources refuse."""

import subprocess
import time

import pytest

from hfsa.fmus import compile as compiling
from hfsa.fmus.c_code import RUNTIME
from hfsa.fmus.compile import compile_files, compiler
from hfsa.fmus.errors import ExportError

FILES = {"one.c": "int one(void) { return 1; }\n"}


def script(folder, text):
    """A command that stands for a compiler."""
    file = folder / "cc"
    file.write_text(f"#!/bin/sh\n{text}\n")
    file.chmod(0o700)
    return [str(file)]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("echo out of order >&2; exit 7", "failed with code 7:\nout of order"),
        ("echo odd; exit 0", "ended without an error, but made no file one.so; expected a C compiler in [$]CC\nodd"),
        ("kill -SEGV $$", "failed with code -11"),
    ],
    ids=["fails", "makes nothing", "crashes"],
)
def test_a_bad_compiler_is_told(tmp_path, text, words):
    with pytest.raises(ExportError, match=words):
        compile_files(FILES, tmp_path / "one.so", command=script(tmp_path, text))


def test_a_compiler_that_hangs_is_ended_with_what_it_started(tmp_path, monkeypatch):
    monkeypatch.setattr(compiling, "TIME_LIMIT", 1.0)
    alive = tmp_path / "alive"
    command = script(tmp_path, f"(while true; do date > {alive}; sleep 0.1; done) &\nwait")
    with pytest.raises(ExportError, match=r"has not ended after 1 s; set \$CC"):
        compile_files(FILES, tmp_path / "one.so", command=command)
    last = alive.stat().st_mtime_ns
    time.sleep(0.5)
    assert alive.stat().st_mtime_ns == last


@pytest.mark.parametrize("flag", ["-ffast-math", "-Ofast", "-ffinite-math-only"])
def test_flags_that_break_arithmetic_are_refused(flag):
    """NaN and infinity are looked for, which these flags assume away."""
    command = [*compiler(), "-std=c99", "-fsyntax-only", str(RUNTIME / "step.c")]
    assert subprocess.run(command, capture_output=True, check=False).returncode == 0
    refused = subprocess.run([*command, flag], capture_output=True, text=True, check=False)
    assert refused.returncode != 0
    assert "compile it without -ffast-math" in refused.stderr
