"""Blocks of a report: sections with tables and interactive figures."""

import base64
import html
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from hfsa.cosim.systems.markup import paragraph, table

__all__ = ["Block", "Machine", "Plot", "Section", "folded", "paragraph", "picture", "table"]


@dataclass(frozen=True)
class Plot:
    """An interactive figure: traces and layout of plotly as plain data, height [px], and what it shows in words."""

    traces: Sequence[dict[str, Any]]
    layout: dict[str, Any]
    words: str
    height: int = 420


@dataclass(frozen=True)
class Machine:
    """A drawing that readers turn: its panel as plain data (`panel_data`), its words, and its height [px]."""

    panel: dict[str, Any]
    words: str
    height: int = 460


Block = str | Plot | Machine
"""HTML, an interactive figure, or a drawing that readers turn."""


@dataclass(frozen=True)
class Section:
    """A section of a report: its heading, and its blocks in their order."""

    heading: str
    blocks: Sequence[Block] = field(default_factory=list)


def picture(content: bytes, kind: str, words: str) -> str:
    """Return a picture of a media type, inlined, with what it shows in words."""
    data = base64.b64encode(content).decode()
    return f'<img class="picture" src="data:{kind};base64,{data}" alt="{html.escape(words)}">'


def folded(summary: str, content: str) -> str:
    """Return preformatted text that a reader unfolds."""
    return f"<details><summary>{html.escape(summary)}</summary><pre>{html.escape(content)}</pre></details>"
