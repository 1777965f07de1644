"""FMUs and a package of ours in tools of others: installs each tool, drives it, and writes `docs/tools.md`.

    make elsewhere                                # or: python tests/elsewhere/run.py
    python tests/elsewhere/run.py fmpy ecos       # some of the tools; the rows of the others stay as they are

A tool is a file of `tools/`, which imports the tool inside its functions only:

    INSTALL   what pip installs, in an environment of the tool's own
    PACKAGE   the distribution whose version is stated
    OFFERS    by FMI version and interface (CS, ME, SSP), how the tool moves inputs, or passes values in a package
    REMARKS   by the same, why a cell is empty or wrong, and whose fault it is
    MISSING   why the tool may not be had, if that is known
    run(task) the outputs after each step, (steps, outputs)

Environments, FMUs, logs and results lie in `build/elsewhere`.
"""

import json
import shutil
import subprocess
import sys
import venv
from pathlib import Path
from typing import NamedTuple

import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(HERE), str(HERE.parent)]

from asked import Request, of_package, of_parts  # noqa: E402
from drive import adapter  # noqa: E402
from page import write_page  # noqa: E402

WORK = ROOT / "build" / "elsewhere"
INSTALLATION_LIMIT, RUN_LIMIT = 600, 180


class Tool(NamedTuple):
    """A tool, with the interpreter of its environment and its version; both `None` where it cannot be had."""

    name: str
    file: Path
    python: Path | None
    version: str | None


def installed(file: Path) -> Tool:
    """Install a tool, where it is not installed yet."""
    module, folder = adapter(file), WORK / file.stem
    python = folder / "bin" / "python"
    done = folder / "installed"
    if not done.exists():
        venv.create(folder, with_pip=True, clear=True)
        with open(folder / "install.log", "w") as log:
            command = [python, "-m", "pip", "install", "numpy", *module.INSTALL]
            try:
                code = subprocess.run(command, stdout=log, stderr=log, timeout=INSTALLATION_LIMIT).returncode
            except subprocess.TimeoutExpired:
                code = -1
        if code:
            return Tool(file.stem, file, None, None)
        done.touch()
    words = f"from importlib.metadata import version; print(version({module.PACKAGE!r}))"
    version = subprocess.run([python, "-c", words], capture_output=True, text=True, check=True).stdout.strip()
    return Tool(file.stem, file, python, version)


def outcome(tool: Tool, request: Request, kind: str) -> float | str:
    """Return the error of a tool's trajectory, or the words with which it failed."""
    folder = WORK / tool.name / "runs"
    folder.mkdir(exist_ok=True)
    task, result = folder / "task.json", folder / "result.npy"
    request.task.write(task)
    result.unlink(missing_ok=True)
    command = [tool.python, HERE / "drive.py", tool.file, task, result]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=RUN_LIMIT, errors="replace")
    except subprocess.TimeoutExpired:
        return f"no end within {RUN_LIMIT} s"
    if done.returncode or not result.exists():
        lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
        return lines[-1] if lines and done.returncode > 0 else f"ends with code {done.returncode}"
    return request.error(np.load(result), kind)


def main(names: list[str]) -> None:
    """Drive some tools, or all, and write the page."""
    files = sorted((HERE / "tools").glob("*.py"))
    unknown = set(names) - {file.stem for file in files}
    if unknown:
        raise SystemExit(f"no tool {sorted(unknown)}; there are {', '.join(file.stem for file in files)}")
    WORK.mkdir(parents=True, exist_ok=True)
    store = WORK / "results.json"
    results = json.loads(store.read_text()) if store.exists() else {}
    shutil.rmtree(WORK / "fmus", ignore_errors=True)
    requests = [*of_parts(WORK / "fmus"), *of_package(WORK / "fmus")]
    for file in files:
        if names and file.stem not in names:
            continue
        tool, module = installed(file), adapter(file)
        print(f"{tool.name} {tool.version or 'could not be installed: see ' + str(WORK / tool.name / 'install.log')}")
        results[tool.name] = {"version": tool.version, "runs": []}
        for request in requests if tool.python else ():
            kind = module.OFFERS.get((request.task.fmi, request.task.interface))
            if kind is None:
                continue
            found = outcome(tool, request, kind)
            print(f"  FMI {request.task.fmi} {request.task.interface} {request.title}: {found}", flush=True)
            run = {"fmi": request.task.fmi, "interface": request.task.interface, "title": request.title}
            results[tool.name]["runs"].append({**run, "found": found})
        store.write_text(json.dumps(results, indent=1))
    write_page(ROOT / "docs" / "tools.md", {file.stem: adapter(file) for file in files}, results)


if __name__ == "__main__":
    main(sys.argv[1:])
