"""Pictures of parts: what a drawing holds stands in the figure, at its place and in its colour."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection

from hfsa.components import ModelError
from hfsa.components._modelling.drawing import Drawing, Layer, Panel
from hfsa.cosim.cli import main
from hfsa.cosim.figures.drawing import drawing_figure

SQUARE = np.array([[0.0, 0.0], [2e-3, 0.0], [2e-3, 1e-3], [0.0, 1e-3]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def flat(**more) -> Panel:
    """A plate of two triangles with stresses, a line and a point."""
    plate = Layer(SQUARE, HALVES, name="plate", values=np.array([0.0, 3e6, 6e6, 0.0]))
    line = Layer(SQUARE, np.array([[0, 1], [1, 2]]), "rest", "edge")
    point = Layer(SQUARE[:1], np.array([[0]]), "mark", texts=["A"])
    return Panel([plate, line, point], axes=("x", "y"), quantity="stress", quantity_unit="Pa", **more)


def test_a_flat_panel_shows_its_cells_in_a_readable_unit():
    axes, bar = drawing_figure(Drawing("Plate", [flat(title="loaded")])).axes
    faces, lines, points = axes.collections
    assert isinstance(faces, PolyCollection)
    assert isinstance(lines, LineCollection)
    # a face is closed: its first vertex comes again
    np.testing.assert_allclose([path.vertices[:3] for path in faces.get_paths()], 1e3 * SQUARE[HALVES])
    np.testing.assert_allclose(lines.get_segments(), 1e3 * SQUARE[[[0, 1], [1, 2]]])
    np.testing.assert_allclose(points.get_offsets(), [[0.0, 0.0]])
    np.testing.assert_allclose(faces.get_array(), [3.0, 2.0])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x (mm)", "y (mm)")
    assert bar.get_ylabel() == "stress (MPa)"
    assert (faces.norm.vmin, faces.norm.vmax) == (0.0, 6.0)
    assert axes.get_aspect() == 1.0
    assert [text.get_text() for text in axes.texts] == ["A"]
    (legend,) = axes.figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["plate", "edge"]


BOX = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [1.0, 2.0, 4.0]])


def solid(points=BOX, **more) -> Panel:
    """A face in the plane of X and Y, and an axis from one corner to another."""
    faces = Layer(points, np.array([[0, 1, 2]]))
    lines = Layer(points, np.array([[0, 3]]), "axis", texts=["", "", "", "up"])
    return Panel([faces, lines], unit="1", **more)


def test_panels_of_three_dimensions_are_seen_in_parallel_and_at_one_scale():
    first, second = drawing_figure(Drawing("Solid", [solid(), solid(0.5 * BOX)])).axes
    whole, half = [axes.collections[1].get_segments()[0] for axes in (first, second)]
    # halves are drawn half as large within the same limits: nothing is nearer to the eye
    np.testing.assert_allclose(half, 0.5 * np.asarray(whole), atol=1e-12)
    assert (first.get_xlim(), first.get_ylim()) == (second.get_xlim(), second.get_ylim())
    assert first.get_aspect() == 1.0
    assert {"X", "Y", "Z", "up", "0.5"} <= {text.get_text() for text in first.texts}


@pytest.mark.parametrize(
    ("view", "kept", "names"),
    [
        pytest.param("top", (0, 1), ["X", "Y"], id="top"),
        pytest.param("front", (0, 2), ["X", "Z"], id="front"),
        pytest.param("side", (1, 2), ["Y", "Z"], id="side"),
    ],
)
def test_a_view_is_the_orthographic_projection_along_an_axis(view, kept, names):
    drawing = Drawing("Solid", [solid(title="box", kind="box")]).seen_from([view])
    (panel,) = drawing.panels
    np.testing.assert_array_equal(panel.layers[0].points, BOX[:, kept])
    assert (panel.title, list(panel.axes)) == (f"box, {view}", names)
    (axes,) = drawing_figure(drawing).axes
    (face,) = axes.collections[0].get_paths()
    assert axes.get_xlabel() == names[0]
    # a face that is seen from its side is a line of some width, elsewhere it has no edge
    assert (axes.collections[0].get_linewidth()[0] > 0) == (view != "top")
    np.testing.assert_allclose(face.vertices[:3], BOX[:3, kept])


def test_a_drawing_shows_the_kinds_that_are_chosen_in_their_order():
    drawing = Drawing("Two", [flat(kind="plate"), solid(kind="box"), solid(kind="box")])
    assert [panel.kind for panel in drawing.showing(["box", "plate"]).panels] == ["box", "box", "plate"]
    with pytest.raises(ModelError, match="a kind of panel is 'boxes'; did you mean box"):
        drawing.showing(["boxes"])
    with pytest.raises(ModelError, match="'Bare' has no kinds of panels to choose from, found 'box'"):
        Drawing("Bare", [flat()]).showing(["box"])
    with pytest.raises(ModelError, match="the panel 'loaded' is flat"):
        Drawing("Plate", [flat(title="loaded")]).seen_from(["top"])


@pytest.mark.parametrize(
    "command",
    [
        pytest.param("sdelta -p posture.rotation=10,5,8", id="robot"),
        pytest.param("sdelta --show posture,modes --views top,front,side", id="robot-views", marks=pytest.mark.slow),
        pytest.param("sdelta --show modal_screws,compliant_axes,eigenscrews", id="robot-axes"),
        pytest.param("beam_module -p kind=double_tilted", id="beams"),
        pytest.param("rrr_stage", id="stage"),
        pytest.param("beam_stage", id="beam-stage"),
    ],
)
def test_no_text_of_a_part_lies_on_another(command, tmp_path, monkeypatch):
    made = []
    monkeypatch.setattr("hfsa.cosim.commands._pictures.save", lambda figure, _: made.append(figure))
    assert main(["view", *command.split(), "-o", str(tmp_path / "it.png")]) == 0
    for axes in made[0].axes:
        shown = [text for text in (*axes.texts, axes.title) if text.get_text()]
        boxes = [(text.get_text(), text.get_window_extent().padded(-1)) for text in shown]
        for (one, a), (other, b) in combinations(boxes, 2):
            assert not a.overlaps(b), (one, other)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        pytest.param(
            lambda: Layer([1.0, 2.0], [[0]]), r"points are of shape \(2,\), expected \(points, 2\)", id="flat"
        ),
        pytest.param(lambda: Layer(SQUARE, [0, 1]), r"cells are of shape \(2,\)", id="cells"),
        pytest.param(lambda: Layer(SQUARE, [[0, 4]]), r"indices from 0 to 4, expected 0 to 3", id="index"),
        pytest.param(
            lambda: Layer(SQUARE, [[0]], values=[1.0]), r"values are of shape \(1,\), expected \(4,\)", id="values"
        ),
        pytest.param(lambda: Layer(SQUARE * np.nan, [[0]]), r"points have NaN or infinity", id="nan"),
        pytest.param(lambda: Layer(SQUARE, [[0]], texts=["a"]), r"1 texts, expected 4", id="texts"),
        pytest.param(lambda: Layer(SQUARE, [[0]], "bodi"), r"role is 'bodi'; did you mean body", id="role"),
        pytest.param(lambda: Panel([Layer(SQUARE, [[0]])]), r"3 axes and layers of 2 dimensions", id="axes"),
        pytest.param(lambda: Panel([]), r"3 axes and layers of no dimensions", id="empty"),
        pytest.param(lambda: Drawing("It", []), r"the drawing 'It' has no panel", id="no panel"),
    ],
)
def test_a_drawing_that_cannot_be_drawn_is_refused(make, words):
    with pytest.raises(ModelError, match=words):
        make()


OWN = '''
"""A triangle."""

import numpy as np

from hfsa.components._modelling.drawing import Drawing, Layer, Panel


def analyze(*, size: float = 1.0) -> dict:
    """Return its area."""
    return {"area": size**2 / 2}


def picture(*, size: float = 1.0, turned: bool = False) -> Drawing:
    """Return it."""
    if size > 9:
        return "large"
    points = size * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    return Drawing("Triangle", [Panel([Layer(points, [[0, 1, 2]], name="face")], axes=("x", "y"))])
'''


def test_a_part_of_ones_own_has_a_picture(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "triangle.py").write_text(OWN)
    command = ["analyze", "./triangle.py", "--picture"]
    assert main([*command, "it.png", "-p", "size=2"]) == 0
    assert "Triangle\nit.png" in capsys.readouterr().out
    assert (tmp_path / "it.png").read_bytes().startswith(b"\x89PNG")
    for words, more in {
        "has no argument 'sise'; did you mean size": ["it.png", "-p", "sise=2"],
        "expected one of .png": ["it.txt"],
        "--sensitivity and --picture are different studies": ["it.png", "--sensitivity"],
        "returned a str, expected a Drawing": ["it.png", "-p", "size=10"],
        "a picture is of one level of the part and takes none": ["it.png", "--level", "fine"],
    }.items():
        assert main([*command, *more]) == 2
        assert words in capsys.readouterr().err
    assert main(["analyze", "mass_on_spring", "--picture", "it.png"]) == 2
    assert "mass_on_spring offers no picture; these do: " in capsys.readouterr().err
