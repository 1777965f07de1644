"""FMI calls in any order with any value, on every part and level, in FMI 2 and 3: sanitizers, valgrind, laws."""

import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from fuzzing import SANITIZERS, fuzz, program, subjects

from hfsa.fmus.c_code import RUNTIME
from hfsa.fmus.compile import compiler
from torture.row import Row

PER_COUNT, PER_COUNT_VALGRIND = 100, 2
"""Sequences of each part and level for each of `count`."""
VALGRIND = ("valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full")


def trials(seed: int, count: int) -> Iterator[Row]:
    """Yield the rows."""
    with tempfile.TemporaryDirectory(prefix="hfsa-fuzz-") as folder:
        words = "random sequences of FMI calls under AddressSanitizer and UndefinedBehaviorSanitizer"
        yield calls(words, Path(folder) / "sanitized", SANITIZERS, (), seed, PER_COUNT * count)
        if shutil.which("valgrind"):
            plain = Path(folder) / "plain"
            yield calls("the same under valgrind", plain, (), VALGRIND, seed, PER_COUNT_VALGRIND * count)
    row = Row("compiler flags that break arithmetic, refused")
    for flag in ("-ffast-math", "-Ofast", "-ffinite-math-only"):
        row.add(*accepted(flag))
    yield row


def calls(words: str, folder: Path, flags: Sequence[str], tool: Sequence[str], seed: int, sequences: int) -> Row:
    """Return the row of a fuzzer on every part and level."""
    row, done, every = Row(words), 0, list(subjects())
    for k, subject in enumerate(every):
        file = program(subject.model(), folder / str(k), flags)
        tally = fuzz([*tool, file], seed + k * sequences, sequences)
        row.count += tally.sequences
        row.faults += [f"{subject}, {fault}" for fault in tally.faults]
        done += tally.calls
        shutil.rmtree(file.parent)
    row.note = f"{len(every)} parts and levels, {done:.2g} calls"
    return row


def accepted(flag: str) -> list[str]:
    """Return a sentence where the runtime compiles with a flag."""
    source = RUNTIME / "step.c"
    command = [*compiler(), "-std=c99", flag, "-fsyntax-only", str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return [] if done.returncode and "NaN" in done.stderr else [f"{flag} compiles"]
