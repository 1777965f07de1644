"""Layout of a block diagram by Graphviz: boxes, arrows and places of labels, in points.

    placed = layout(diagram)
    placed.boxes["robot"], placed.links[0].path

Sizes of texts are those of the fonts of matplotlib, which are the same on every machine; Graphviz gets boxes alone.
Needs the extra `diagram` (pygraphviz, whose wheels hold Graphviz).
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Any

import numpy as np
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path
from numpy.typing import NDArray

from hfsa.cosim.figures.diagram_source import source, terminal_name
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.systems.diagram import Diagram, Terminal

NAME, WORDS, SIGNAL = 10.0, 8.0, 7.0
"""Font sizes of names, of the lines below them, and of signals [points]."""
LINE = 1.3
"""Height of a line, relative to its font."""
_MARGIN = 9.0
_BESIDE = 4.0
"""Space between text and border of a block, and around the text of a link [points]."""
_EMPTY = (
    '<<TABLE BORDER="0" CELLBORDER="0" CELLPADDING="0" CELLSPACING="0" FIXEDSIZE="TRUE" WIDTH="{width}" '
    'HEIGHT="{height}"><TR><TD></TD></TR></TABLE>>'
)
"""Label of a given size [points], without text."""
_ROUNDING = 0.01
"""Error of coordinates that Graphviz gives [points]."""
_FAR = 6
"""How far a label is moved at most, in halves of its size."""
_WIDE = 2.2
"""Ratio of width to height above which a diagram is tried from above to below."""


Line = tuple[str, float, str]
"""Line of text with its font size [points] and weight."""


@dataclass(frozen=True)
class Box:
    """A rectangle [points]: center and size."""

    x: float
    y: float
    width: float
    height: float

    @property
    def corners(self) -> tuple[float, float, float, float]:
        """Left, lower, right and upper end."""
        half, high = self.width / 2, self.height / 2
        return self.x - half, self.y - high, self.x + half, self.y + high

    def overlaps(self, other: "Box") -> bool:
        """Return whether it has points in common with another one, by more than the rounding of Graphviz."""
        across, along = (self.width + other.width) / 2, (self.height + other.height) / 2
        return across - abs(self.x - other.x) > _ROUNDING and along - abs(self.y - other.y) > _ROUNDING


@dataclass(frozen=True)
class Arrow:
    """An arrow: control points of its cubic Bezier curves (3 n + 1, 2) with its tip at the end, and its label's box."""

    path: NDArray[np.float64]
    tip: NDArray[np.float64]
    label: Box | None = None


@dataclass(frozen=True)
class Layout:
    """Places of a diagram [points], from the lower left corner.

    Attributes:
        size: width and height.
        boxes: boxes of blocks by name, (blocks,).
        terminals: boxes of terminals, in their order.
        groups: boxes around groups.
        links, ends: arrows of links and of terminals, in their order.
    """

    size: tuple[float, float]
    boxes: Mapping[str, Box]
    terminals: Sequence[Box]
    groups: Sequence[Box]
    links: Sequence[Arrow]
    ends: Sequence[Arrow]


def is_available() -> bool:
    """Whether there is the library that `layout` needs."""
    return find_spec("pygraphviz") is not None


def layout(diagram: Diagram) -> Layout:
    """Return the layout of a diagram, from left to right, or from above to below where that is less wide.

    `ResultsError` without the extra `diagram`.
    """
    first = _placed(diagram, "LR")
    if first.size[0] <= _WIDE * first.size[1]:
        return first
    second = _placed(diagram, "TB")
    return min(first, second, key=lambda one: abs(np.log(one.size[0] / one.size[1] / _WIDE**0.5)))


def text_size(lines: Sequence[Line]) -> tuple[float, float]:
    """Return width and height [points] of lines of text, each with font size and weight."""
    widths = [_width(*line) for line in lines]
    return max(widths, default=0.0), sum(LINE * size for _, size, _ in lines)


def block_lines(name: str, words: Sequence[str]) -> list[Line]:
    """Return the lines of a block or terminal with font size and weight."""
    return [(name, NAME, "bold"), *((line, WORDS, "normal") for line in words)]


def link_lines(words: Sequence[str]) -> list[Line]:
    """Return the lines of a link with font size and weight."""
    return [(line, SIGNAL, "normal") for line in words]


def _width(text: str, size: float, weight: str) -> float:
    """Return the width of a line of text [points]."""
    return float(text_to_path.get_text_width_height_descent(text, FontProperties(size=size, weight=weight), False)[0])


def _placed(diagram: Diagram, direction: str) -> Layout:
    """Return the layout of a diagram in one direction."""
    graph = _graph(source(diagram, direction))
    for block in diagram.blocks:
        _set_size(graph.get_node(block.name), block_lines(block.name, block.words))
    for number, terminal in enumerate(diagram.terminals):
        _set_size(graph.get_node(terminal_name(number)), block_lines(terminal.side, terminal.words))
    links = [graph.get_edge(link.start, link.end, key=f"link {i}") for i, link in enumerate(diagram.links)]
    for edge, link in zip(links, diagram.links, strict=True):
        width, height = text_size(link_lines(link.words))
        edge.attr["label"] = _EMPTY.format(width=int(width + 2 * _BESIDE), height=int(height + _BESIDE))
    graph.layout(prog="dot")
    left, low, right, high = map(float, graph.graph_attr["bb"].split(","))
    size = right - left, high - low
    boxes = {block.name: _box(graph.get_node(block.name)) for block in diagram.blocks}
    terminals = [_box(graph.get_node(terminal_name(i))) for i in range(len(diagram.terminals))]
    arrows = [_arrow(edge, link_lines(link.words)) for edge, link in zip(links, diagram.links, strict=True)]
    return Layout(
        size,
        boxes,
        terminals,
        [_group(one.graph_attr["bb"]) for one in graph.subgraphs()],
        _apart(arrows, [*boxes.values(), *terminals], size),
        [_arrow(_end(graph, diagram.terminals[i], i)) for i in range(len(diagram.terminals))],
    )


def _apart(arrows: Sequence[Arrow], boxes: Sequence[Box], size: tuple[float, float]) -> list[Arrow]:
    """Return arrows with their labels moved where Graphviz puts one on another, as it does beside loops."""
    taken, found = list(boxes), []
    for arrow in arrows:
        label = arrow.label
        if label is not None:
            label = next((place for place in _places(label, size) if not any(map(place.overlaps, taken))), label)
            taken.append(label)
        found.append(replace(arrow, label=label))
    return found


def _places(label: Box, size: tuple[float, float]) -> Iterator[Box]:
    """Yield a label at its place, and at others inside a figure of a size, the nearest first."""
    yield label
    steps = np.arange(-_FAR, _FAR + 1)
    shifts = [(0.5 * label.width * i, 0.5 * label.height * k) for i in steps for k in steps]
    for x, y in sorted(shifts, key=lambda shift: math.hypot(*shift)):
        moved = replace(label, x=label.x + x, y=label.y + y)
        left, low, right, high = moved.corners
        if min(left, low) >= 0 and right <= size[0] and high <= size[1]:
            yield moved


def _graph(text: str) -> Any:
    """Return the graph of a text in DOT, without labels; `ResultsError` without pygraphviz."""
    try:
        from pygraphviz import AGraph
    except ImportError as error:
        raise ResultsError(
            f"a block diagram as a picture needs Graphviz ({error}): pip install 'hfsa[diagram]'; the ending .dot "
            "needs nothing"
        ) from error
    graph = AGraph(string=text)
    graph.graph_attr.update(label="", nodesep="0.35", ranksep="0.45", splines="true")
    for group in graph.subgraphs():
        group.graph_attr.update(label="", margin="14")
    return graph


def _set_size(node: Any, lines: Sequence[Line]) -> None:
    """Give a node the size of its lines, and no text."""
    width, height = text_size(lines)
    sizes = {"width": f"{(width + 2 * _MARGIN) / 72:.4f}", "height": f"{(height + 1.4 * _MARGIN) / 72:.4f}"}
    node.attr.update(label="", shape="box", fixedsize="true", peripheries="1", **sizes)


def _end(graph: Any, terminal: Terminal, number: int) -> Any:
    """Return the edge of a terminal."""
    name = terminal_name(number)
    pair = (name, terminal.block) if terminal.side == "input" else (terminal.block, name)
    return graph.get_edge(*pair, key=name)


def _box(node: Any) -> Box:
    """Return the box of a node."""
    x, y = map(float, node.attr["pos"].split(","))
    return Box(x, y, 72 * float(node.attr["width"]), 72 * float(node.attr["height"]))


def _group(bounds: str) -> Box:
    """Return the box of a subgraph."""
    left, low, right, high = map(float, bounds.split(","))
    return Box((left + right) / 2, (low + high) / 2, right - left, high - low)


def _arrow(edge: Any, lines: Sequence[Line] = ()) -> Arrow:
    """Return the arrow of an edge, with the box of its lines."""
    ends, *points = edge.attr["pos"].replace("\\\n", "").split(" ")
    tip = np.array(list(map(float, ends.removeprefix("e,").split(","))))
    path = np.array([list(map(float, point.split(","))) for point in points])
    if not lines:
        return Arrow(path, tip)
    x, y = map(float, edge.attr["lp"].split(","))
    return Arrow(path, tip, Box(x, y, *text_size(lines)))
