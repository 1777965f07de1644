"""The fuzzer of our FMUs: the sources of a part and `harness/fuzz.c` in one program, with or without sanitizers."""

import re
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from hfsa import components, controllers
from hfsa.components import Model
from hfsa.components._modelling.catalogue import find
from hfsa.fmus.c_code import RUNTIME, generate
from hfsa.fmus.compile import compiler, source_files

HARNESS = Path(__file__).parent / "fmus" / "harness"
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer")
_FLAGS = ("-std=gnu11", "-g", "-O1", "-w")
_PARTS = find([components, controllers])


class Subject(NamedTuple):
    """A part at one of its levels, or a part without levels."""

    part: str
    level: str | None = None

    def __str__(self) -> str:
        return f"{self.part} {self.level}" if self.level else self.part

    def model(self) -> Model:
        """Return its model."""
        return _PARTS[self.part].model(self.level)


def subjects() -> Iterator[Subject]:
    """Yield every part of hfsa that has a model, at every level."""
    for name, part in _PARTS.items():
        if part.build is not None:
            yield from (Subject(name, level) for level in part.levels or (None,))


def program(model: Model, folder: Path, flags: Sequence[str] = SANITIZERS) -> Path:
    """Return the fuzzer of a model, compiled with the flags into a folder; its parent keeps the runtime for others."""
    sources = generate(model)
    folder.mkdir(parents=True)
    files = source_files(sources)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8", errors="surrogateescape")
    command = [*compiler(), *_FLAGS, *flags, f"-I{folder}", f"-I{HARNESS}"]
    runtime = folder.parent / "runtime"
    if not runtime.exists():
        runtime.mkdir()
        units = [str(folder / path.name) for path in RUNTIME.glob("*.c") if path.name in files]
        subprocess.run([*command, "-c", *units], cwd=runtime, check=True)
    units = [name for name in sources.files if name.endswith(".c")] + [
        str(HARNESS / "fuzz.c"),
        *map(str, runtime.glob("*.o")),
    ]
    first = f"-DFIRST_REFERENCE={sources.variables[0].reference}"
    subprocess.run([*command, first, *units, "-o", "fuzz", "-lm"], cwd=folder, check=True)
    return folder / "fuzz"


class Tally(NamedTuple):
    """What a fuzzer did: sequences and calls, and the lines that tell of broken laws or of a fault."""

    sequences: int
    calls: int
    faults: tuple[str, ...]


def fuzz(command: Sequence[str | Path], seed: int, sequences: int, timeout: float | None = None) -> Tally:
    """Run a fuzzer from a seed."""
    words = [*map(str, command), str(seed), str(sequences)]
    done = subprocess.run(words, capture_output=True, text=True, errors="replace", timeout=timeout, check=False)
    lines = (done.stdout + done.stderr).splitlines()
    counted = re.search(r"(\d+) sequences, (\d+) calls", done.stdout)
    faults = [text for text in lines if "BROKEN" in text or "ERROR" in text or "runtime error" in text]
    if done.returncode and not faults:
        faults = [f"exit code {done.returncode}: {' '.join(lines[-3:])}"]
    found = tuple(f"seeds {seed} to {seed + sequences - 1}: {text}" for text in faults)
    return Tally(int(counted[1]) if counted else 0, int(counted[2]) if counted else 0, found)
