"""Page of a report: one part for each results file, with its origin, its figures and its tables.

write_page(Path("report.html"), report_page("Two laws", [Part("pd.h5", sections), Part("ctc.h5", sections)]))
"""

import html
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hfsa.cosim.pages.blocks import Plot, Section
from hfsa.cosim.pages.page import Page


@dataclass(frozen=True)
class Part:
    """The part of a report on one file: its heading and its sections."""

    heading: str
    sections: Sequence[Section]


def report_page(title: str, parts: Sequence[Part]) -> Page:
    """Return the page of a report."""
    plots: list[Plot] = []
    body = []
    if len(parts) > 1:
        links = "".join(f'<li><a href="#part{i}">{html.escape(part.heading)}</a></li>' for i, part in enumerate(parts))
        body.append(f"<nav aria-label='Files'><ul>{links}</ul></nav>")
    for i, part in enumerate(parts):
        body.append(f'<section id="part{i}" class="file"><h2>{html.escape(part.heading)}</h2>')
        for section in part.sections:
            body.append(f"<section><h3>{html.escape(section.heading)}</h3>")
            body += [_block(block, plots) for block in section.blocks]
            body.append("</section>")
        body.append("</section>")
    data = {"plots": [_plot(plot) for plot in plots]}
    return Page(title, "\n".join(body), ("report.js",), data)


def _block(block: str | Plot, plots: list[Plot]) -> str:
    """Return a block as HTML; a figure is drawn by the page's script in the place that is left for it."""
    if isinstance(block, str):
        return f'<div class="wide">{block}</div>'
    plots.append(block)
    words, name, height = html.escape(block.words), f"plot{len(plots) - 1}", f"height:{block.height}px"
    place = f'<div class="plot" id="{name}" role="img" aria-label="{words}" style="{height}"></div>'
    return f"<figure>{place}<figcaption>{words}</figcaption></figure>"


def _plot(plot: Plot) -> dict[str, Any]:
    """Return a figure as plain data."""
    return {"traces": list(plot.traces), "layout": plot.layout}
