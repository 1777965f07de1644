"""Page of a report: one part for each results file, with its origin, its figures and its tables.

write_page(Path("report.html"), report_page("Two laws", [Part("pd.h5", sections), Part("ctc.h5", sections)]))
"""

import html
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hfsa.cosim.pages.blocks import Block, Machine, Section
from hfsa.cosim.pages.page import Page
from hfsa.cosim.pages.panel_data import LOOKS


@dataclass(frozen=True)
class Part:
    """The part of a report on one file: its heading and its sections."""

    heading: str
    sections: Sequence[Section]


def report_page(title: str, parts: Sequence[Part]) -> Page:
    """Return the page of a report."""
    places = _Places()
    body = []
    if len(parts) > 1:
        links = "".join(f'<li><a href="#part{i}">{html.escape(part.heading)}</a></li>' for i, part in enumerate(parts))
        body.append(f"<nav aria-label='Files'><ul>{links}</ul></nav>")
    for i, part in enumerate(parts):
        body.append(f'<section id="part{i}" class="file"><h2>{html.escape(part.heading)}</h2>')
        for section in part.sections:
            body.append(f"<section><h3>{html.escape(section.heading)}</h3>")
            body += [places.block(block) for block in section.blocks]
            body.append("</section>")
        body.append("</section>")
    data = {"plots": places.plots, "machines": places.machines, **LOOKS}
    return Page(title, "\n".join(body), ("panel.js", "report.js"), data)


class _Places:
    """Places that a page leaves for what its script draws, and the data of each."""

    def __init__(self):
        self.plots: list[dict[str, Any]] = []
        self.machines: list[dict[str, Any]] = []

    def block(self, block: Block) -> str:
        """Return a block as HTML."""
        if isinstance(block, str):
            return f'<div class="wide">{block}</div>'
        if isinstance(block, Machine):
            self.machines.append(block.panel)
            return _place(f"machine{len(self.machines) - 1}", block.words, block.height)
        self.plots.append({"traces": list(block.traces), "layout": block.layout})
        return _place(f"plot{len(self.plots) - 1}", block.words, block.height)


def _place(name: str, words: str, height: int) -> str:
    """Return the place of a figure, with what it shows in words."""
    words = html.escape(words)
    place = f'<div class="plot" id="{name}" role="img" aria-label="{words}" style="height:{height}px"></div>'
    return f"<figure>{place}<figcaption>{words}</figcaption></figure>"
