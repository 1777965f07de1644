"""Nonsense on the command line: odd numbers, names, formats and output paths for verbs that take them."""

import os
import random
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from torture._commands import run
from torture.row import Row

SCENE = "mass_on_spring"
NUMBERS = [
    *("nan", "inf", "-inf", "1e400", "", " ", "0", "-0.0", "-1", "1e-320", "1e308", "1e300", "1e-300", "0x10"),
    *("1_000", "1,5", "1e"),
    *("--", "None", "[]", "9" * 5000, "\u202e1", "1\n2", "1 m", "1j", "10000000000", "1e10", "9" * 30),
]  # fmt: skip
TEXTS = [
    *("$(touch PWNED)", "%s%n%x", "{0.__class__}", "../../x", "[bold red]x[/]", "\x1b[31mred", "a" * 100000, "a=b=c"),
    *("=", ".", ".."),
    *("[1..3]", "x[1..100000000]", "x[0]", "*", "__class__", "\udcff", "name\nline", "/", '"; x', "\\x00"),
]  # fmt: skip
RUN, LINEAR = ["run", SCENE, "--stop", "0.01"], ["sweep", SCENE, "--method", "linear", "--points", "3"]
NUMBERED = [
    *([*RUN, option] for option in ("--step", "--frequency", "--amplitude", "--tolerance", "--every", "--interval")),
    ["run", SCENE, "--stop"],
    ["run", SCENE, "--stop", "1e300", "--step"],
    *([*LINEAR, option] for option in ("--from", "--to", "--amplitude", "--step")),
    ["sweep", SCENE, "--method", "linear", "--points"],
    *(
        ["sweep", SCENE, "--points", "2", "--jobs", "1", option]
        for option in ("--settling-tolerance", "--settling-time")
    ),
    ["stability", SCENE, "--step"],
    ["bode", "s.h5", "--from"],
    ["plot", "r.h5", "--to"],
]
NAMED = [
    *([verb] for verb in ("run", "sweep", "list", "analyze", "export", "check", "stability")),
    *([verb] for verb in ("bode", "plot", "convert", "view")),
    *([*RUN, option] for option in ("--input", "-p", "--signal", "--algorithm", "--order", "--drive")),
    *([*LINEAR, "--signal"], [*LINEAR, "--open-loop"], ["stability", SCENE, "--vary"], ["plot", "r.h5", "--signal"]),
]  # fmt: skip
WRITING = [
    RUN,
    LINEAR,
    ["export", SCENE, "--fmi", "2"],
    ["compare", SCENE, "--over", "damping=1,2", "--stop", "0.01"],
    ["stability", SCENE, "--vary", "damping=0.1:1:3"],
    ["analyze", "tba_accelerometer", "--map", "tm,l"],
    ["analyze", "tba_accelerometer", "--over", "tm=2e-6,3e-6"],
    ["bode", "s.h5"],
    ["plot", "r.h5"],
    ["convert", "r.h5"],
    ["view", "r.h5"],
]
OUTPUTS = [
    *("text.txt", "device", "fifo", "link", ".", "..", "/", "/dev/null", "/proc/x.h5", "a" * 300 + ".h5", "..x"),
    *("a/" * 3000 + "x.h5", "t.csv", "x.png", "x.html", ""),
    *("new\nline.h5", "-x.h5", "~/x.h5", "\udcff.h5", "x.h5/", "text.txt/x.h5", "s.h5", "r.h5"),
]  # fmt: skip
KEPT = ("text.txt", "device", "fifo", "link", "s.h5", "r.h5")


def trials(seed: int, count: int) -> Iterator[Row]:
    """Yield a row per kind of word."""
    rng = random.Random(seed)
    with tempfile.TemporaryDirectory() as scratch:
        results = Path(scratch)
        for words in ([*RUN, "-o", "r.h5"], [*LINEAR, "-o", "s.h5"]):
            assert run(words, results).code == 0
        for what, begins, ends in (
            ("odd numbers", NUMBERED, NUMBERS),
            ("odd words", NAMED, TEXTS),
            ("odd output paths", [[*words, "-o"] for words in WRITING], OUTPUTS),
        ):
            row = Row(f"command lines with {what}")
            all_lines = [[*begin, end] for begin in begins for end in ends]
            for number, words in enumerate(rng.sample(all_lines, min(count, len(all_lines)))):
                folder = results / f"{what} {number}"
                _prepare(folder, results)
                row.add(*_faults(words, folder))
                shutil.rmtree(folder)
            yield row


def _prepare(folder: Path, results: Path) -> None:
    """Make a folder with results, and with files that nothing may replace."""
    folder.mkdir()
    for name in ("r.h5", "s.h5"):
        shutil.copy(results / name, folder / name)
    (folder / "text.txt").write_text("years of work\n")
    (folder / "link").symlink_to("text.txt")
    os.mkfifo(folder / "fifo")
    if os.geteuid() == 0:
        os.mknod(folder / "device", 0o20666, os.makedev(1, 3))


def _faults(words: list[str], folder: Path) -> list[str]:
    """Run a command line; return what is wrong with its end, and with the files after it."""
    before = {name: _state(folder / name) for name in KEPT}
    faults = run(words, folder, 90).faults()
    faults += [f"{name} has changed" for name in KEPT if _state(folder / name) != before[name]]
    faults += ["a word was executed"] if list(folder.rglob("PWNED*")) else []
    faults += [f"left {left}"] if (left := [entry.name for entry in (folder / "tmp").iterdir()]) else []
    faults += [f"left {left}"] if (left := [entry.name for entry in folder.glob(".*.part")]) else []
    line = " ".join(word if len(word) < 40 else f"{word[:20]}..." for word in words).encode(errors="replace").decode()
    return [f"`{line!r}`: {fault}" for fault in faults]


def _state(path: Path) -> object:
    """Return what must not change of a file."""
    if not os.path.lexists(path):
        return None
    info = os.lstat(path)
    return info.st_mode, info.st_rdev, info.st_ino, path.read_bytes() if path.is_file() else None
