"""What a notebook shows: tables that hold the numbers of results, figures as objects, and nothing that raises."""

import math
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from hfsa.cosim import Axis, available_parts, compare, draw, load_scene, open_loop, run, stability, sweep
from hfsa.cosim.results.inertia import Identification
from hfsa.cosim.results.stability_map import StabilityMap
from hfsa.cosim.results.trade import Trade, TradeRow
from hfsa.cosim.systems.notebook import MOST_ROWS, summary

ROWS = [
    TradeRow("jacobi", 1e-3, measured_error=2e-2, measured_cost=1e-3),
    TradeRow("gauss_seidel", 1e-4, measured_error=2e-4, measured_cost=5e-3),
]
TRADE = Trade(Path("trade.h5"), "Robot", "response", 1e-3, ROWS, 1, 0, None, "none", math.nan, ["It is the second."])
MAP = StabilityMap(
    "robot",
    "jacobi",
    1e-3,
    [Axis("bandwidth", np.array([1.0, 2.0, 4.0]))],
    np.array([-1.0, 2.0, np.nan]),
    np.array([True, False, False]),
    np.array([1, -1, -1], dtype=np.int8),
    [],
)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A result of every kind, from one small scene and from one loop."""
    folder = tmp_path_factory.mktemp("results")
    return {
        "sweep": sweep("mass_on_spring", method="linear", points=5, path=folder / "sweep.h5"),
        "run": run("mass_on_spring", frequency=12.0, stop_time=0.1, path=folder / "run.h5"),
        "comparison": compare("mass_on_spring", {"damping": [0.5, 2.0]}, stop_time=0.05, jobs=1, folder=folder),
        "stability": stability("mass_on_spring"),
        "loop": open_loop("sdelta_hfsa", "controller.axis[1].command", path=folder / "loop.h5"),
        "trade": TRADE,
        "map": MAP,
    }


KINDS = ["sweep", "run", "comparison", "stability", "loop", "trade", "map"]


@pytest.mark.parametrize("kind", KINDS)
def test_a_result_has_a_figure_of_its_own(results, kind):
    figure = results[kind].plot()
    assert isinstance(figure, Figure)
    assert figure.findobj(lambda artist: hasattr(artist, "get_xlim"))


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        pytest.param("sweep", ["mass.position", "mass.base.position", "5 of 5"], id="sweep"),
        pytest.param("run", ["mass.position", "0 to 0.1 s", "complete"], id="run"),
        pytest.param("comparison", ["damping=0.5", "damping=2.0"], id="comparison"),
        pytest.param("stability", ["gauss_seidel", "step"], id="stability"),
        pytest.param("loop", ["phase", "deg", "closed loop stable"], id="loop"),
        pytest.param("trade", ["answer", "gauss_seidel at a step of 0.0001 s", "0.02 %", "5 ms"], id="trade"),
        pytest.param("map", ["bandwidth", "1 of 2 points", "1 of 1"], id="map"),
    ],
)
def test_a_summary_has_the_numbers_of_the_result(results, kind, words):
    page = results[kind]._repr_html_()
    assert "without a summary" not in page
    for word in words:
        assert word in page


def test_the_summary_of_a_sweep_names_its_largest_response(results):
    bode = results["sweep"]
    size = abs(bode.entry("mass.position", "mass.base.position"))
    assert f"{size.max():.4g}" in bode._repr_html_()


@pytest.mark.parametrize("kind", KINDS)
def test_a_result_that_is_broken_or_empty_is_shown_all_the_same(results, kind):
    whole = results[kind]
    for name in (field.name for field in fields(whole)):
        for nonsense in (None, "", (), {}, math.nan):
            assert replace(whole, **{name: nonsense})._repr_html_().startswith("<")
    assert object.__new__(type(whole))._repr_html_().startswith("<p>")
    assert object.__new__(Identification)._repr_html_().startswith("<p>Identification without a summary")


def test_an_empty_sweep_and_an_empty_run_have_summaries(results):
    bode, made = results["sweep"], results["run"]
    nothing = replace(bode, response=np.full_like(bode.response, np.nan))._repr_html_()
    assert "0 of 5" in nothing
    empty = replace(made, time=made.time[:0], values={name: v[:0] for name, v in made.values.items()}, status="failed")
    assert "rows none" in empty._repr_html_()
    assert "status failed" in empty._repr_html_()


def test_scenes_and_models_have_tables():
    scene = load_scene("mass_on_spring")._repr_html_()
    assert "mass_on_spring" in scene
    model = available_parts()["mass_on_spring"].model(stiffness=2e4)._repr_html_()
    assert "MassOnSpring: Mass on a damped spring" in model
    assert "<td>stiffness</td><td>N/m</td><td>20000</td>" in model


def test_a_table_is_cut_and_its_words_are_no_markup():
    page = summary("<b>", {"a": "<i>", "empty": ""}, ["name"], [(k,) for k in range(MOST_ROWS + 5)])
    assert "<b>" not in page
    assert "<i>" not in page
    assert "empty" not in page
    assert page.count("<td>") == MOST_ROWS
    assert "and 5 more" in page


def test_a_drawing_is_a_figure_of_chosen_panels():
    drawing = available_parts()["sdelta"].drawing()
    figure = draw(drawing, ["posture"], ["top", "side"])
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["posture, top", "posture, side"]
