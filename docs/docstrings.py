"""Docstrings as Markdown and as reStructuredText: prose stays prose, indented blocks are code.

A docstring of this project is prose in plain text with code in single backticks; equations, tables and examples are
indented by four spaces.
"""

import inspect
import re

from hfsa.components._modelling.prose import blocks

_SPECIAL = re.compile(r"([\\*_\[\]<>#|$~])")
_MODULE = re.compile(r"~(?:[A-Za-z_]\w*\.)+")
_SECTION = re.compile(r"^(Args|Further arguments|Attributes|Raises|Returns|Yields):$")


def setup(app) -> None:
    """Let autodoc read indented blocks as code, and write signatures with short names of types."""
    app.connect("autodoc-process-docstring", _process, priority=400)  # before napoleon, at 500
    app.connect("autodoc-process-signature", _short)


def markdown(text: str) -> str:
    """Return a docstring as Markdown."""
    written = []
    for is_code, lines in blocks(text):
        if is_code:
            written.append("\n".join(["```text", *inspect.cleandoc("\n".join(["", *lines])).splitlines(), "```"]))
        else:
            written.append("\n".join(map(_plain, lines)))
    return "\n\n".join(written)


def first_sentence(text: str) -> str:
    """Return the first paragraph of a docstring on one line, as Markdown."""
    return _plain(" ".join(inspect.cleandoc(text).split("\n\n")[0].split()))


def _plain(line: str) -> str:
    """Return a line whose special characters mean themselves; code in backticks stays as it is."""
    pieces = line.split("`")
    if len(pieces) % 2 == 0:
        return line.replace("`", r"\`")
    bullet = re.match(r"\s*[*-] ", pieces[0])
    start = bullet.group() if bullet else ""
    pieces[0] = pieces[0].removeprefix(start)
    quoted = [f"`{p}`" if i % 2 else _SPECIAL.sub(r"\\\1", p) for i, p in enumerate(pieces)]
    return start + "".join(quoted)


def _process(*event) -> None:
    """Mark indented blocks of a docstring as code for reStructuredText; sections with indented entries are not."""
    lines: list[str] = event[-1]  # what autodoc passes on: application, kind, name, object, options, lines
    done: list[str] = []
    in_section = False
    for i, line in enumerate(lines):
        if line and not line.startswith(" "):
            in_section = bool(_SECTION.match(line))
        starts = line.startswith("    ") and i > 0 and not lines[i - 1].strip() and not in_section
        if starts and not (done and next((d for d in reversed(done) if d.strip()), "").startswith("    ")):
            done += ["::", ""]
        done.append(line)
    lines[:] = done


def _short(*event) -> tuple[str | None, str | None]:
    """Return a signature whose types have no modules and whose computed defaults are dots."""
    signature, returned = (text and _MODULE.sub("", text).replace("<factory>", "...") for text in event[-2:])
    return signature, returned
