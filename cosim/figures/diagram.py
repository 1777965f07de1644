"""Figure of a block diagram: blocks, links with their signals, loops that stand out, terminals, and a key.

    write_diagram(Path("scene.svg"), diagram(scene, title))

A picture in SVG has the title and a description in words for those who cannot see it. One point of the layout is one
point of the figure, so that texts fill their boxes in every format.
"""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyBboxPatch, Patch, PathPatch, Polygon
from matplotlib.path import Path as Curve

from hfsa.cosim.figures.diagram_layout import (
    LINE,
    WORDS,
    Arrow,
    Box,
    Layout,
    Line,
    block_lines,
    layout,
    link_lines,
    text_size,
)
from hfsa.cosim.figures.diagram_source import source
from hfsa.cosim.figures.diagram_style import (
    ALGEBRAIC_LOOP,
    FOREIGN,
    GROUP,
    SAMPLED,
    SAMPLED_LOOP,
    TERMINAL,
    Look,
    block_look,
    link_look,
)
from hfsa.cosim.figures.style import INK, STYLE, drawn
from hfsa.cosim.results.placement import write_file, write_picture
from hfsa.cosim.results.target import check_diagram, picture_format
from hfsa.cosim.systems.diagram import Diagram

_EDGE, _TITLE, _KEY = 14.0, 30.0, 30.0
"""Space around the diagram, above for the title and below for the key [points]."""
_TITLE_SIZE = 12.5
_ENTRY = 6.0 * WORDS
"""Width of an entry of the key without its words [points]."""
_PIXELS = 16_000
"""Most pixels of a side of a picture in pixels."""
_SVG = "http://www.w3.org/2000/svg"
_HALO = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85}


TEXT = ".dot"
"""Ending of a diagram as text."""


def write_diagram(path: Path, diagram: Diagram) -> None:
    """Write a block diagram as text or as a picture by the ending of its file, completely or not at all.

    A diagram of hfsa, or a picture, is replaced; `ResultsError` for any other existing file, for an ending of another
    kind, and without the extra `diagram` for a picture.
    """
    if path.suffix == TEXT:
        write_file(path, source(diagram).encode(), lambda: check_diagram(path))
        return
    ending = picture_format(path)
    figure = diagram_figure(diagram, layout(diagram))
    write_picture(path, svg(diagram, figure) if ending == "svg" else drawn(figure, ending))


def svg(diagram: Diagram, figure: Figure) -> bytes:
    """Return the figure of a diagram as SVG with its title and description."""
    from lxml import etree  # loaded where a picture is written

    root = etree.fromstring(drawn(figure, "svg"), etree.XMLParser(resolve_entities=False, no_network=True))
    names = {"title": diagram.title, "desc": diagram.description}
    for place, (tag, words) in enumerate(names.items()):
        element = etree.Element(f"{{{_SVG}}}{tag}", id=f"diagram-{tag}")
        element.text = words
        root.insert(place, element)
    root.set("role", "img")
    root.set("aria-labelledby", " ".join(f"diagram-{tag}" for tag in names))
    return etree.tostring(root.getroottree(), xml_declaration=True, encoding="utf-8")


def diagram_figure(diagram: Diagram, placed: Layout) -> Figure:
    """Return the figure of a diagram at the places of a layout."""
    width, height = placed.size
    entries = _key(diagram)
    title, _ = text_size([(diagram.title, _TITLE_SIZE, "bold")])
    key = sum(text_size([(str(entry.get_label()), WORDS, "normal")])[0] + _ENTRY for entry in entries)
    whole = max(width, title, key) + 2 * _EDGE, height + 2 * _EDGE + _TITLE + _KEY
    with mpl.rc_context(STYLE):
        dpi = min(160.0, 72 * _PIXELS / max(whole))
        figure = Figure(figsize=(whole[0] / 72, whole[1] / 72), dpi=dpi)
        axes = figure.add_axes((0, 0, 1, 1))
        left = -(whole[0] - width) / 2
        axes.set(xlim=(left, left + whole[0]), ylim=(-_EDGE - _KEY, height + _EDGE + _TITLE))
        axes.axis("off")
        for box in placed.groups:
            _draw_box(axes, box, GROUP, [])
        for terminal, box, arrow in zip(diagram.terminals, placed.terminals, placed.ends, strict=True):
            _draw_arrow(axes, arrow, TERMINAL)
            _draw_box(axes, box, TERMINAL, block_lines(terminal.side, terminal.words), rounding=8.0)
        for link, arrow in zip(diagram.links, placed.links, strict=True):
            _draw_arrow(axes, arrow, link_look(link))
        for block in diagram.blocks:
            box, look = placed.boxes[block.name], block_look(block)
            _draw_box(axes, box, look, block_lines(block.name, block.words))
            if block.is_foreign:
                _draw_box(axes, Box(box.x, box.y, box.width + 6, box.height + 6), Look(look.line), [])
        # labels are above all lines
        for link, arrow in zip(diagram.links, placed.links, strict=True):
            if arrow.label is not None:
                _draw_halo(axes, arrow.label)
                _write(axes, arrow.label, link_lines(link.words))
        axes.text(
            left + whole[0] / 2,
            height + _EDGE + _TITLE / 2,
            diagram.title,
            fontsize=_TITLE_SIZE,
            fontweight="bold",
            ha="center",
            va="center",
            parse_math=False,
        )
        if entries:
            look = {"fontsize": WORDS, "handlelength": 3.0, "columnspacing": 1.5}
            figure.legend(handles=entries, loc="lower center", ncols=len(entries), **look)
    return figure


def _draw_box(axes: Axes, box: Box, look: Look, lines: Sequence[Line], rounding: float = 0.0) -> None:
    """Draw a box with its lines of text."""
    left, low, _, _ = box.corners
    style = f"round,pad=0,rounding_size={rounding}" if rounding else "square,pad=0"
    dashes = "--" if look.is_dashed else "-"
    patch = FancyBboxPatch((left, low), box.width, box.height, boxstyle=style, facecolor=look.fill, edgecolor=look.line)
    patch.set(linewidth=look.width, linestyle=dashes, zorder=3)
    axes.add_patch(patch)
    _write(axes, box, lines)


def _draw_halo(axes: Axes, box: Box) -> None:
    """Lighten what lies behind a box."""
    left, low, right, high = box.corners
    axes.add_patch(Polygon([(left, low), (right, low), (right, high), (left, high)], zorder=4, **_HALO))


def _write(axes: Axes, box: Box, lines: Sequence[Line]) -> None:
    """Write lines of text into the middle of a box."""
    y = box.y + sum(LINE * size for _, size, _ in lines) / 2
    for line, size, weight in lines:
        y -= LINE * size / 2
        look = {"fontsize": size, "fontweight": weight, "color": INK}
        axes.text(box.x, y, line, ha="center", va="center_baseline", parse_math=False, zorder=5, **look)
        y -= LINE * size / 2


def _draw_arrow(axes: Axes, arrow: Arrow, look: Look) -> None:
    """Draw an arrow along its curves."""
    codes = [Curve.MOVETO, *[Curve.CURVE4] * (len(arrow.path) - 1)]
    line = PathPatch(Curve(arrow.path, codes), facecolor="none", edgecolor=look.line, linewidth=look.width, zorder=2)
    line.set(linestyle=(0, (4, 2)) if look.is_dashed else "-", capstyle="butt")
    axes.add_patch(line)
    last = arrow.path[-1]
    along = arrow.tip - last
    across = 0.42 * np.array([-along[1], along[0]])
    axes.add_patch(Polygon([arrow.tip, last + across, last - across], color=look.line, linewidth=0, zorder=2))


def _key(diagram: Diagram) -> list[Artist]:
    """Return the entries of the key: what the diagram has and its words do not say."""
    entries = {
        _key_of_box("sampled part", SAMPLED): any(block.is_sampled for block in diagram.blocks),
        _key_of_box("given as an FMU file", FOREIGN): any(block.is_foreign for block in diagram.blocks),
        _key_of_line("loop through a sampled part", SAMPLED_LOOP): any(link.is_sampled_loop for link in diagram.links),
        _key_of_line("algebraic loop", ALGEBRAIC_LOOP): any(link.loop for link in diagram.links),
        _key_of_line("compiled into one FMU", GROUP): bool(diagram.groups),
    }
    return [entry for entry, is_there in entries.items() if is_there]


def _key_of_box(words: str, look: Look) -> Artist:
    """Return the entry of a kind of block."""
    return Patch(facecolor=look.fill, edgecolor=look.line, linewidth=look.width, label=words)


def _key_of_line(words: str, look: Look) -> Artist:
    """Return the entry of a kind of line."""
    dashes = (0, (4, 2)) if look.is_dashed else "-"
    return Line2D([], [], color=look.line, linewidth=look.width, linestyle=dashes, label=words)
