"""Results files with flipped bits, lost ends, blocks of zeros and noise, given to every verb that reads one."""

import random
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from torture._commands import run
from torture.row import Row

RUN = ["run", "mass_on_spring", "--stop", "0.05"]
READERS = {
    "sweep": [["bode"], ["convert", "-o", "t.csv"], ["resume"]],
    "run": [["plot"], ["view", "-o", "v.html"], ["convert", "-o", "t.mat"]],
}


def trials(seed: int, count: int) -> Iterator[Row]:
    """Yield a row per verb that reads results."""
    rng = random.Random(seed)
    with tempfile.TemporaryDirectory() as scratch:
        whole = {kind: Path(scratch, f"{kind}.h5") for kind in READERS}
        stepped = ["sweep", "mass_on_spring", "-p", "damping=5", "--points", "4", "--jobs", "1"]
        for kind, words in (("run", RUN), ("sweep", stepped)):
            assert run([*words, "-o", str(whole[kind])], Path(scratch)).code == 0
        for kind, readers in READERS.items():
            for reader in readers:
                row = Row(f"damaged file, `{'sweep --resume' if reader == ['resume'] else reader[0]}`")
                for number in range(count):
                    folder = Path(scratch, f"{kind}{number}")
                    folder.mkdir()
                    name, damage = rng.choice(list(DAMAGES.items()))
                    (folder / "d.h5").write_bytes(damage(bytearray(whole[kind].read_bytes()), rng))
                    words = [*stepped, "--resume", "-o", "d.h5"] if reader == ["resume"] else _words(reader)
                    row.add(*(f"{name}: {fault}" for fault in run(words, folder).faults()))
                    shutil.rmtree(folder)
                yield row


def _words(reader: list[str]) -> list[str]:
    """Return the command of a verb on the damaged file."""
    return [reader[0], "d.h5", *reader[1:]]


def _flip(data: bytearray, rng: random.Random, times: int = 1) -> bytearray:
    """Flip bits."""
    for _ in range(times):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return data


def _block(data: bytearray, rng: random.Random, make: Callable[[int], bytes] = bytes) -> bytearray:
    """Replace a block."""
    at, size = rng.randrange(len(data)), rng.choice([8, 64, 512, 4096])
    data[at : at + size] = make(len(data[at : at + size]))
    return data


def _head(data: bytearray, rng: random.Random) -> bytearray:
    """Replace a byte among the first."""
    data[rng.randrange(2048)] = rng.randrange(256)
    return data


def _swap(data: bytearray, rng: random.Random) -> bytearray:
    """Exchange two blocks."""
    a, b = sorted(rng.sample(range(0, len(data) - 512, 512), 2))
    data[a : a + 512], data[b : b + 512] = data[b : b + 512], data[a : a + 512]
    return data


DAMAGES: dict[str, Callable[[bytearray, random.Random], bytearray]] = {
    "a bit": _flip,
    "twenty bits": lambda data, rng: _flip(data, rng, 20),
    "two thousand bits": lambda data, rng: _flip(data, rng, 2000),
    "lost end": lambda data, rng: data[: rng.randrange(len(data))],
    "block of zeros": _block,
    "block of noise": lambda data, rng: _block(data, rng, rng.randbytes),
    "byte of the head": _head,
    "blocks exchanged": _swap,
}
