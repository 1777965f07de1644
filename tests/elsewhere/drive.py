"""Runs one tool on one task, in the tool's environment: `python drive.py ADAPTER TASK.json RESULT.npy`.

The result is a trajectory of the outputs after each step, (steps, outputs). Exit code 1 with the error in the last
line of stderr where the tool refuses or fails.
"""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from task import read_task


def adapter(file: Path) -> ModuleType:
    """Return the module of a tool."""
    spec = importlib.util.spec_from_file_location(f"adapter_{file.stem}", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def main(tool: str, task_file: str, result: str) -> None:
    task = read_task(Path(task_file))
    found = np.asarray(adapter(Path(tool)).run(task), dtype=float)
    if found.shape != (task.steps, len(task.outputs)):
        raise ValueError(f"a trajectory of shape {found.shape}, expected {(task.steps, len(task.outputs))}")
    np.save(result, found)


if __name__ == "__main__":
    main(*sys.argv[1:])
