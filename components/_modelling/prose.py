"""Docstrings of parts as blocks: prose in plain text with code in single backticks; equations and tables indented."""

import inspect
from collections.abc import Iterator


def blocks(text: str) -> Iterator[tuple[bool, list[str]]]:
    """Yield (is_code, lines) of a docstring; blank lines between indented lines are part of the code."""
    block: list[str] = []
    is_code = False
    for line in [*inspect.cleandoc(text).splitlines(), None]:
        indented = line is not None and line.startswith("    ")
        ends = line is None or (line.strip() == "" and not is_code) or (line.strip() and indented != is_code)
        if ends and any(map(str.strip, block)):
            yield is_code, _stripped(block)
            block = []
        if line is None:
            return
        if line.strip():
            is_code = indented
        block.append(line)


def _stripped(lines: list[str]) -> list[str]:
    """Return lines without blank ones at either end."""
    while not lines[0].strip():
        lines = lines[1:]
    while not lines[-1].strip():
        lines = lines[:-1]
    return lines
