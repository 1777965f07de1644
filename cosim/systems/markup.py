"""Tables and paragraphs in HTML, for pages and notebooks."""

import html
from collections.abc import Iterable, Sequence


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


def _cells(row: Sequence[object], are_numbers: Sequence[bool]) -> str:
    """Return the cells of a row."""
    pairs = zip(row, are_numbers, strict=True)
    return "".join(f"<td{' class=number' if right else ''}>{html.escape(str(cell))}</td>" for cell, right in pairs)
