"""Pages made from the code: tables of algorithms, verbs, parts and scenes, the public face, and the rooms of cosim.

`write` fills two folders that git ignores: `_generated` has pieces that pages include, `reference` has pages. A page
that has not changed is not written, so that a second build is short.
"""

import ast
import importlib
import pkgutil
import re
from collections.abc import Iterator, Sequence
from inspect import cleandoc
from pathlib import Path
from types import ModuleType

from docstrings import first_sentence, markdown

import hfsa.components
import hfsa.controllers
import hfsa.cosim
import hfsa.cosim.scenes
from hfsa.components._modelling.catalogue import find
from hfsa.components._modelling.parts import Part
from hfsa.cosim.masters.algorithms import ALGORITHMS

_CHOICES = re.compile(r"`--algorithm CHOICE`(.*?) \*\[choices: auto, [^\]]*\]\*")


def write(folder: Path) -> None:
    """Write all pieces and pages below a folder; pages of rooms that are gone are removed."""
    pages = {
        "_generated/algorithms.md": algorithms(),
        "_generated/verbs.md": verbs(),
        "reference/index.md": index(),
        "reference/components.md": face(hfsa.components, "Parts are made of a `Model`: [](../component.md)."),
        "reference/cosim.md": face(hfsa.cosim, "Scenes in, measurements out: the verbs, in Python."),
        "reference/parts.md": parts(),
        "reference/scenes.md": scenes(),
    }
    pages |= {f"reference/room-{name}.md": room(name) for name in rooms()}
    for stale in (folder / "reference").glob("*.md"):
        if stale.relative_to(folder).as_posix() not in pages:
            stale.unlink()
    for name, text in pages.items():
        file = folder / name
        file.parent.mkdir(exist_ok=True)
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")


def algorithms() -> str:
    """Return the table of algorithms, cheaper steps first."""
    head = ["`--algorithm`", "a communication step", "inputs within it", "order", "longest stable step"]
    rows = [
        [
            f"`{row.name}`",
            row.summary,
            row.inputs,
            "its own steps" if row.order is None else str(row.order),
            "known beforehand" if row.is_limited else "no limit",
        ]
        for row in ALGORITHMS.values()
    ]
    return _table(head, rows)


def verbs() -> str:
    """Return the help of every verb."""
    from hfsa.cosim.cli import parser

    text = parser().generate_docs(output_format="markdown", include_hidden=False)
    text = text[text.index("\n## ") :]
    text = text[text.index("\n## hfsa ") :].strip()
    text = _CHOICES.sub(r"`--algorithm NAME`\1 See [](algorithms.md).", text)
    # a section of options is no paragraph that begins bold
    return re.sub(r"^\*\*(Arguments|Parameters)\*\*:$", r"*\1*", text, flags=re.MULTILINE) + "\n"


def index() -> str:
    """Return the page that leads to the reference."""
    names = ["components", "cosim", "parts", "scenes"]
    return f"""# Reference

These pages are made from docstrings when the site is built.

```{{toctree}}
:maxdepth: 1

{chr(10).join(names)}
```

## Rooms of `hfsa.cosim`

A room imports only from the rooms below it; `CONTRIBUTING.md` draws the floors.

```{{toctree}}
:maxdepth: 1

{chr(10).join(f"room-{name}" for name in rooms())}
```
"""


def face(package: ModuleType, sentence: str) -> str:
    """Return the page of a package's public names, `__all__`, or what it says of itself where it has none yet."""
    name = package.__name__
    text = [f"# `{name}`", sentence, markdown(package.__doc__ or "")]
    for public in getattr(package, "__all__", ()):
        thing = getattr(package, public)
        if isinstance(thing, ModuleType):
            continue
        kind = "class" if isinstance(thing, type) else "function" if callable(thing) else "data"
        members = "\n   :members:" if kind == "class" and not issubclass(thing, Exception) else ""
        text += [f"## `{public}`", f"```{{eval-rst}}\n.. auto{kind}:: {name}.{public}{members}\n```"]
    return "\n\n".join(text) + "\n"


def parts() -> str:
    """Return a page of all parts: what each says of itself, and its levels."""
    text = [
        "# Parts",
        "One file, one part; the text is the module's docstring: equations, ports, and the Bode plot that a test "
        "proves. `hfsa list NAME` shows arguments, parameters and ports with their units.",
    ]
    for package in (hfsa.components, hfsa.controllers):
        text.append(f"## {package.__name__.split('.')[-1].capitalize()}")
        for name, part in sorted(find([package]).items()):
            text += [f"### `{name}`", _about(part), markdown(part.module.__doc__ or "")]
    return "\n\n".join(text) + "\n"


def _about(part: Part) -> str:
    """Return what kind of part it is, in one line."""
    kind = "A model" if part.build else "An analysis, without an FMU"
    levels = f"; levels {', '.join(f'`{level}`' for level in part.levels)}, cheapest first" if part.levels else ""
    numbers = "; `hfsa analyze` prints its engineering numbers" if part.build and part.analyze else ""
    return f"*{kind}{levels}{numbers}.*"


def scenes() -> str:
    """Return a page of all scenes: what each says of itself and of its arguments."""
    text = ["# Scenes", "The systems that come with hfsa; each name is a SCENE of the command line."]
    package = hfsa.cosim.scenes
    for info in pkgutil.iter_modules(package.__path__):
        if not info.name.startswith("_"):
            module = importlib.import_module(f"{package.__name__}.{info.name}")
            function = getattr(module, info.name)
            text += [f"## `{info.name}`", markdown(module.__doc__ or "")]
            if "Args:" in (function.__doc__ or ""):
                arguments = cleandoc(function.__doc__ or "").split("Args:\n")[1]
                text.append(f"```text\n{cleandoc(arguments)}\n```")
    return "\n\n".join(text) + "\n"


def rooms() -> list[str]:
    """Return the rooms of cosim, and rooms within rooms, by dotted name."""
    folder = Path(hfsa.cosim.__file__).parent
    found = {file.parent.relative_to(folder) for file in folder.rglob("__init__.py")} - {Path()}
    return sorted(".".join(room.parts) for room in found)


def room(name: str) -> str:
    """Return the page of a room: its paragraph, its modules, and the public names of each."""
    folder = Path(hfsa.cosim.__file__).parent.joinpath(*name.split("."))
    text = [f"# `hfsa.cosim.{name}`", markdown(_docstring(folder / "__init__.py"))]
    files = [file for file in sorted(folder.glob("*.py")) if file.name != "__init__.py"]
    if files:
        rows = [[f"`{file.stem}`", first_sentence(_docstring(file))] for file in files]
        text += [_table(["module", "what it is"], rows)]
    for file in files:
        if not file.stem.startswith("_"):
            text += [f"## `{file.stem}`", markdown(_docstring(file))]
            if public := list(_public(file)):
                text.append(_table(["name", "what it is"], public))
    return "\n\n".join(text) + "\n"


def _docstring(file: Path) -> str:
    """Return the docstring of a module, which is not imported."""
    return ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""


def _public(file: Path) -> Iterator[list[str]]:
    """Yield name and first sentence of the public functions and classes that a module defines."""
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            arguments = "(...)" if isinstance(node, ast.FunctionDef) else ""
            yield [f"`{node.name}{arguments}`", first_sentence(ast.get_docstring(node) or "")]


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", r"\|") for cell in line) + " |" for line in lines).replace(
        r"\\|", r"\|"
    )
