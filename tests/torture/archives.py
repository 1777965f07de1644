"""Archives and descriptions that try to do harm, or have damage, given to `check` and `run`."""

import random
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

from hostile_archives import DESCRIPTION, REFUSED, zipped

from torture._commands import run
from torture.row import Row

SCENE = """inputs = []
outputs = ["it.y"]
step_size = 0.1
stop_time = 1.0

[[components]]
name = "it"
part = "x.fmu"
"""
VERBS = {"check": ["check", "x.fmu"], "run": ["run", "scene.toml", "-o", "out.h5"]}
FLIPS = {"bytes of the archive": 0, "bytes of the description": 1}


def trials(seed: int, count: int) -> Iterator[Row]:
    """Yield a row per verb for harmful archives, for damaged ones, and for a million variables."""
    rng = random.Random(seed)
    for verb, words in VERBS.items():
        row = Row(f"harmful archive, `{verb}`")
        for name, (content, _) in REFUSED.items():
            row.add(*_faults(name, words, content, refused=1 if verb == "check" else 2))
        yield row
        for what in FLIPS:
            row = Row(f"damaged {what}, `{verb}`")
            for _ in range(count):
                row.add(*_faults(what, words, _damaged(what, rng)))
            yield row
    yield from _million()


def _million() -> Iterator[Row]:
    """Yield a row per verb for a description of a million variables."""
    more = "".join(f'<ScalarVariable name="x{k}" valueReference="{k}"><Real/></ScalarVariable>' for k in range(10**6))
    content = zipped(description=DESCRIPTION.replace("</ModelVariables>", f"{more}</ModelVariables>"))
    for verb, words in VERBS.items():
        row = Row(f"a million variables, `{verb}`")
        row.add(*_faults("a million variables", words, content))
        yield row


def _damaged(what: str, rng: random.Random) -> bytes:
    """Return an FMU with one to forty changed bytes, or without its end."""
    text = DESCRIPTION.encode()
    data = bytearray(text if FLIPS[what] else zipped([("resources/a", b"text" * 50)]))
    for _ in range(rng.choice([1, 2, 40])):
        data[rng.randrange(len(data))] = rng.randrange(256)
    if rng.random() < 0.3:
        data = data[: rng.randrange(len(data))]
    return zipped(description=bytes(data)) if FLIPS[what] else bytes(data)


def _faults(name: str, words: list[str], content: bytes, refused: int | None = None) -> list[str]:
    """Return what is wrong with how a verb ends: also another exit code than `refused`, and files elsewhere."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch, "in")
        folder.mkdir()
        (folder / "x.fmu").write_bytes(content)
        (folder / "scene.toml").write_text(SCENE)
        ended = run(words, folder)
        faults = ended.faults() if refused is None else ended.faults((refused,))
        evil = [str(path) for path in Path(scratch).rglob("*") if re.search("evil", path.name)]
        return [f"{name}: {fault}" for fault in (*faults, *(f"made {path}" for path in evil))]
