"""Scene files with values of the wrong type, size, shape and encoding, given to `run` and to a linear sweep."""

import random
import tempfile
from collections.abc import Iterator
from pathlib import Path

from torture._commands import run
from torture.row import Row

LINES = {
    "inputs": '["mass.base.position"]',
    "outputs": '["mass.position"]',
    "band": "[1.0, 100.0]",
    "amplitude": "{ m = 1e-3 }",
    "step_size": "1e-3",
    "stop_time": "0.05",
}
COMPONENT = {"name": '"mass"', "part": '"mass_on_spring"'}
KEYS = (*LINES, "algorithm", "tolerance", "source", "marks", "fuse", "scale", "recorded", "quiet_inputs", "connections")
KEYS_OF_COMPONENT = (*COMPONENT, "level", "arguments", "start", "conventions", "calls", "members")
VALUES = (
    *("0", "-1", "3", "1e-320", "1.7e308", "nan", "-inf", "0x10", "true", "1979-05-27", "99999999999999999999999999"),
    *('""', '"x"', '"mass"', '"mass.position"', '"größe"', '"../../x.fmu"', '"/etc/passwd"', '"{0.__class__}"'),
    *('"\\u0000"', '"%s%n"', '"./x.py"', '"auto"', '"hfsa"', '"strict"'),
    *("[]", "[[]]", "[1, 2]", "[nan, nan]", '["x"]', "[{}]", '["mass.position[1..99999999999]"]', "[['mass']]"),
    *("{}", "{ m = nan }", "{ m = [] }", '{ damping = "x" }', "{ damping = inf }", "{ nope = 1 }", '{ "" = 1 }'),
    *(
        '{ "stiffness[1..1000000000]" = 1 }',
        '{ name = "s", part = "sine_source" }',
        '{ a = { part = "x", key = "y" } }',
    ),
)
ENCODINGS = ("utf-8", "utf-8", "utf-8", "utf-8-sig", "utf-16", "latin-1")
VERBS = {
    "run": ["run", "scene.toml", "-o", "o.h5"],
    "sweep": ["sweep", "scene.toml", "--method", "linear", "--points", "3", "-o", "o.h5"],
}


def trials(seed: int, count: int) -> Iterator[Row]:
    """Yield a row per verb."""
    rng = random.Random(seed)
    for verb, words in VERBS.items():
        row = Row(f"scene file of nonsense, `{verb}`")
        for _ in range(count):
            changes, text = _scene(rng)
            with tempfile.TemporaryDirectory() as scratch:
                folder = Path(scratch)
                (folder / "scene.toml").write_bytes(text.encode(rng.choice(ENCODINGS), errors="replace"))
                row.add(*(f"{changes}: {fault}" for fault in run(words, folder).faults((0, 2, 4))))
        yield row


def _scene(rng: random.Random) -> tuple[str, str]:
    """Return a scene with one or two wrong values, and which."""
    lines, component, changes = dict(LINES), dict(COMPONENT), []
    for _ in range(rng.choice([1, 1, 2])):
        table, keys = rng.choice([(lines, KEYS), (component, KEYS_OF_COMPONENT)])
        key, value = rng.choice(keys), rng.choice(VALUES)
        table[key] = value
        changes.append(f"{key} = {value}")
    text = "\n".join(f"{key} = {value}" for key, value in lines.items())
    return ", ".join(changes), f"{text}\n\n[[components]]\n" + "\n".join(f"{k} = {v}" for k, v in component.items())
