"""Blocks of a report: sections with tables and interactive figures."""

import base64
import html
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Plot:
    """An interactive figure: traces and layout of plotly as plain data, height [px], and what it shows in words."""

    traces: Sequence[dict[str, Any]]
    layout: dict[str, Any]
    words: str
    height: int = 420


@dataclass(frozen=True)
class Section:
    """A section of a report: its heading, and blocks of HTML and figures in their order."""

    heading: str
    blocks: Sequence[str | Plot] = field(default_factory=list)


def table(headings: Sequence[str], rows: Iterable[Sequence[object]], caption: str = "") -> str:
    """Return a table in HTML; a heading that begins with `>` is that of numbers, which stand to the right."""
    are_numbers = [heading.startswith(">") for heading in headings]
    head = "".join(f'<th scope="col">{html.escape(heading.removeprefix(">"))}</th>' for heading in headings)
    body = "".join(f"<tr>{_cells(row, are_numbers)}</tr>\n" for row in rows)
    title = f"<caption>{html.escape(caption)}</caption>" if caption else ""
    return f"<table>{title}<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody></table>"


def paragraph(words: str) -> str:
    """Return a paragraph."""
    return f"<p>{html.escape(words)}</p>"


def picture(content: bytes, kind: str, words: str) -> str:
    """Return a picture of a media type, inlined, with what it shows in words."""
    data = base64.b64encode(content).decode()
    return f'<img class="picture" src="data:{kind};base64,{data}" alt="{html.escape(words)}">'


def folded(summary: str, content: str) -> str:
    """Return preformatted text that a reader unfolds."""
    return f"<details><summary>{html.escape(summary)}</summary><pre>{html.escape(content)}</pre></details>"


def _cells(row: Sequence[object], are_numbers: Sequence[bool]) -> str:
    """Return the cells of a row."""
    pairs = zip(row, are_numbers, strict=True)
    return "".join(f"<td{' class=number' if right else ''}>{html.escape(str(cell))}</td>" for cell, right in pairs)
