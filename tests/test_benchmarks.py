"""Benchmarks load as the scripts that they are: with their own folder on the path, without that of the tests."""

import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).with_name("benchmarks")


@pytest.mark.parametrize("name", sorted(file.stem for file in FOLDER.glob("*.py")))
def test_a_benchmark_loads_as_a_script(name, tmp_path):
    loading = f"import sys; sys.path.insert(0, {str(FOLDER)!r}); import {name}"
    done = subprocess.run([sys.executable, "-c", loading], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert not done.returncode, done.stderr
