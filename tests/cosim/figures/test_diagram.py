"""Pictures of block diagrams: boxes apart, labels inside and on no box, arrows from block to block, words for all."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from lxml import etree
from matplotlib.backends.backend_agg import FigureCanvasAgg

from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.figures.diagram import diagram_figure, write_diagram
from hfsa.cosim.figures.diagram_layout import layout
from hfsa.cosim.figures.diagram_source import source
from hfsa.cosim.systems.diagram import Block, Diagram, Link, Terminal, diagram
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System

AGraph = pytest.importorskip("pygraphviz").AGraph

CHAIN = Diagram(
    "Chain",
    [Block(f"m{i}", ("spring.py",)) for i in range(60)],
    [Link(f"m{i}", f"m{i + 1}", (("position", "base"),)) for i in range(59)]
    + [Link(f"m{i + 1}", f"m{i}", (("force", "force"),)) for i in range(59)],
    [Terminal("output", "m59", ("position",))],
)
"""Sixty masses that are no numbered components, each pulled by the next."""

ODD = Diagram(
    'A "title" with \\n and $x$',
    [Block('a "b"', ("c\\n", "$x$"), True, True), Block("<b>", ("&amp;",), False, True), Block("c", ())],
    [Link('a "b"', "<b>", (('y "1"', "$u$"),), ("x 2 (mm to m)",), 1), Link("c", "c", (("y", "u"),), (), 0, True)],
    [Terminal("input", "<b>", ("\\u",)), Terminal("recorded", "c", ("%y",))],
    [["<b>", "c"]],
)
"""Names and texts that mean something to DOT, XML and mathematics."""


DENSE = Diagram(
    "Dense",
    [Block(name, ()) for name in "abc"],
    [Link(a, b, ((f"signal_{k}", "u"),), (), k) for a in "abc" for b in "abc" for k in range(3)],
    [],
)
"""Three arrows from each of three blocks to each of them, itself too."""


def drawn(name: str) -> Diagram:
    """Return a diagram by name: of a scene, or of the above."""
    return {"chain": CHAIN, "odd": ODD, "dense": DENSE}.get(name) or diagram(load_scene(name), name)


@pytest.mark.parametrize("name", ["sdelta_hfsa", "stage_tracking", "stage_accelerometer", "chain", "odd", "dense"])
def test_boxes_are_apart_and_labels_are_inside_on_no_box(name):
    made = drawn(name)
    placed = layout(made)
    boxes = [*placed.boxes.values(), *placed.terminals]
    labels = [arrow.label for arrow in placed.links]
    assert len(boxes) == len(made.blocks) + len(made.terminals)
    assert not [pair for pair in itertools.combinations(boxes, 2) if overlap(*pair)]
    assert not [(box, label) for box in boxes for label in labels if overlap(box, label)]
    assert not [pair for pair in itertools.combinations(labels, 2) if overlap(*pair)]
    for box in [*boxes, *labels]:
        left, low, right, high = box.corners
        assert min(left, low) > -1
        assert right < placed.size[0] + 1
        assert high < placed.size[1] + 1


@pytest.mark.parametrize("name", ["sdelta_hfsa", "odd"])
def test_arrows_lead_from_block_to_block(name):
    made = drawn(name)
    placed = layout(made)
    for link, arrow in zip(made.links, placed.links, strict=True):
        assert distance(placed.boxes[link.start], arrow.path[0]) < 2
        assert distance(placed.boxes[link.end], arrow.tip) < 2
    for terminal, box, arrow in zip(made.terminals, placed.terminals, placed.ends, strict=True):
        ends = [box, placed.boxes[terminal.block]]
        start, end = ends if terminal.side == "input" else ends[::-1]
        assert distance(start, arrow.path[0]) < 2
        assert distance(end, arrow.tip) < 2


@pytest.mark.parametrize("name", ["stage_tracking", "odd"])
def test_texts_fit_into_their_boxes(name):
    made = drawn(name)
    placed = layout(made)
    figure = diagram_figure(made, placed)
    renderer = FigureCanvasAgg(figure).get_renderer()
    (axes,) = figure.axes
    found = {}
    for text in axes.texts:
        bounds = text.get_window_extent(renderer).transformed(axes.transData.inverted())
        found.setdefault(text.get_text(), []).append(bounds)
    for block in made.blocks:
        left, low, right, high = placed.boxes[block.name].corners
        for words in (block.name, *block.words):
            assert any(
                left < text.x0 and text.x1 < right and low < text.y0 and text.y1 < high for text in found[words]
            ), words


@pytest.mark.parametrize("name", ["odd", "mass_on_spring"])
def test_title_and_key_are_inside_the_figure(name):
    made = replace(drawn(name), title="A title that is much longer than one block is wide, and longer than three")
    figure = diagram_figure(made, layout(made))
    renderer = FigureCanvasAgg(figure).get_renderer()
    (title,) = [text for text in figure.axes[0].texts if text.get_text() == made.title]
    for item in (title, *figure.legends):
        bounds = item.get_window_extent(renderer)
        assert min(bounds.x0, bounds.y0) > 0
        assert bounds.x1 < figure.bbox.x1
        assert bounds.y1 < figure.bbox.y1
    assert len(figure.legends) == (name == "odd")


def test_the_text_is_read_by_graphviz_as_it_was_meant():
    graph = AGraph(string=source(ODD))
    assert graph.get_node('a "b"').attr["label"] == 'a "b"\\nc\\\\n\\n$x$'
    assert graph.get_node("<b>").attr["class"] == "block foreign"
    assert {(start, end) for start, end in graph.edges()} == {
        ('a "b"', "<b>"),
        ("c", "c"),
        ("terminal 0", "<b>"),
        ("c", "terminal 1"),
    }
    (group,) = graph.subgraphs()
    assert set(group.nodes()) == {"<b>", "c"}


def test_a_picture_says_in_words_what_it_shows(tmp_path):
    file = tmp_path / "odd.svg"
    write_diagram(file, ODD)
    root = etree.parse(file).getroot()
    title, description = (root.find(f"{{*}}{tag}").text for tag in ("title", "desc"))
    assert title == ODD.title
    assert 'From a "b" to <b>: y "1" to $u$ (x 2 (mm to m)), on algebraic loop 1.' in description
    assert "Inputs: <b>.\\u." in description
    assert root.get("role") == "img"
    assert [root.find(f".//*[@id='{name}']") is not None for name in root.get("aria-labelledby").split()] == [True] * 2


def test_names_that_cannot_be_printed_are_drawn(tmp_path):
    """A file from elsewhere may have any character in the names of its signals."""
    system = System([Component("a", "a"), Component("b", "b")], [Connection("a.y\u0000\n", "b.\u0007u")])
    made = diagram(Scene(system, (), ["b.\u0001"], step_size=1e-3, stop_time=1.0), "\u0002")
    write_diagram(tmp_path / "odd.svg", made)
    assert "From a to b: y?? to ?u." in etree.parse(tmp_path / "odd.svg").getroot().find("{*}desc").text
    AGraph(string=source(made))
    with pytest.raises(StructureError, match="is not an identifier"):
        Component("a\n", "a")


def overlap(a, b) -> bool:
    """Whether two boxes overlap by more than a hundredth of a point."""
    (left, low, right, high), (left_b, low_b, right_b, high_b) = a.corners, b.corners
    return min(right, right_b) - max(left, left_b) > 0.01 and min(high, high_b) - max(low, low_b) > 0.01


def distance(box, point: np.ndarray) -> float:
    """Return the distance of a point from the rim of a box [points]."""
    beside = np.abs(point - [box.x, box.y]) - [box.width / 2, box.height / 2]
    return abs(float(np.max(beside)))
