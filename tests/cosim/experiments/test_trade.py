"""The trade of a scene: its answer meets the tolerance when used, and what is not known has a sentence."""

import json
import math
import re
import zipfile
from contextlib import ExitStack

import h5py
import numpy as np
import pytest
from command_line import strict_json

from hfsa.components.mass_on_spring import mass_on_spring
from hfsa.cosim import load_scene, run, sweep, trade
from hfsa.cosim.cli import main
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.results.trade import Trade
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.tradeoff.configuration import Composition, Configuration
from hfsa.cosim.tradeoff.responses import Responses

QUIET = {"warn": lambda _: None}


@pytest.fixture(scope="module")
def found(tmp_path_factory) -> Trade:
    """The trade of the example scene at 0.1 %."""
    path = tmp_path_factory.mktemp("trade") / "mass.h5"
    return trade("mass_on_spring", {"damping": 20}, tolerance=1e-3, path=path, **QUIET)


def test_the_answer_is_cheapest_of_those_verified_within_the_tolerance(found):
    best = found.best
    assert best.measured_error <= 1e-3
    assert "the linear response" in found.reference
    assert found.uncertainty <= 1e-4
    within = [row for row in found.rows if row.is_measured and row.measured_error <= 1e-3]
    assert best.measured_cost == min(row.measured_cost for row in within)
    assert found.rows[found.own].algorithm == "gauss_seidel_linear"
    cheaper = found.rows[found.next_cheaper]
    assert cheaper.measured_error > 1e-3
    assert cheaper.measured_cost < best.measured_cost


def test_predicted_errors_are_the_measured_ones(found):
    rows = [row for row in found.rows if row.is_measured and min(row.measured_error, row.predicted_error) > 1e-6]
    assert len(rows) >= 5
    for row in rows:
        assert row.predicted_error == pytest.approx(row.measured_error, rel=0.1)


def test_a_tuned_sweep_has_the_error_of_the_answer(found, tmp_path):
    bode = sweep("mass_on_spring", {"damping": 20}, tuned=found.path, path=tmp_path / "tuned.h5", points=25, **QUIET)
    settings = h5py.File(bode.path)["sweep"].attrs
    assert settings["step_size"] == found.best.step_size
    linear = sweep("mass_on_spring", {"damping": 20}, method="linear", path=tmp_path / "linear.h5", points=2000)
    exact = np.interp(bode.frequency, linear.frequency, np.abs(linear.response[:, 0, 0]))
    # the magnitude is interpolated between 2000 points
    assert np.abs(np.abs(bode.response[:, 0, 0]) / exact - 1).max() < 2e-3


def test_tuned_refuses_another_scene_and_options_that_the_answer_determines(found, tmp_path):
    path = tmp_path / "x.h5"
    with pytest.raises(StructureError, match="another scene"):
        sweep("mass_on_spring", {"damping": 21}, tuned=found.path, path=path)
    with pytest.raises(StructureError, match="--step would change the answer"):
        run("mass_on_spring", {"damping": 20}, tuned=found.path, step_size=1e-4, path=path)
    with pytest.raises(ResultsError, match="holds no trade"):
        sweep(
            "mass_on_spring",
            {"damping": 20},
            tuned=sweep("mass_on_spring", path=tmp_path / "s.h5", points=2, **QUIET).path,
            path=path,
        )
    assert not path.exists()


def test_a_file_holds_all_that_was_found(found):
    again = Trade.read(found.path)
    assert again.sentences == list(found.sentences)
    assert again.rows[again.answer] == found.best
    assert [str(row) for row in again.rows] == [str(row) for row in found.rows]
    with h5py.File(found.path) as file:
        assert file["trade/measured_error"].dims[0][0] == file["trade/configuration"]
        assert file["trade/predicted_cost"].attrs["units"] == "1"


def test_a_motion_has_an_answer_too(tmp_path):
    found = trade(
        "mass_on_spring",
        {"damping": 20},
        purpose="motion",
        stop_time=1.0,
        tolerance=1e-2,
        path=tmp_path / "m.h5",
        **QUIET,
    )
    assert found.best.measured_error <= 1e-2
    assert "monolithic" in found.reference
    for row in found.rows:
        if row.is_measured and min(row.measured_error, row.predicted_error) > 1e-3:
            assert row.predicted_error == pytest.approx(row.measured_error, rel=0.5)
    tuned = run("mass_on_spring", {"damping": 20}, tuned=found.path, stop_time=0.5, path=tmp_path / "r.h5", **QUIET)
    assert np.diff(tuned.time)[0] == pytest.approx(found.best.step_size)


@pytest.mark.slow
def test_a_tolerance_below_the_reference_has_a_sentence(tmp_path):
    found = trade("mass_on_spring", {"damping": 20}, tolerance=1e-13, path=tmp_path / "t.h5", low=5.0, **QUIET)
    assert found.best is None
    assert any(sentence.startswith("reference: no reference is known to 1e-14") for sentence in found.sentences)
    solver = {"mass.solver": "rosenbrock"}
    found = trade("mass_on_spring", solver, tolerance=1e-8, path=tmp_path / "s.h5", budget=1e-9, **QUIET)
    assert "the solver inside mass has a relative tolerance of 1e-08" in " ".join(found.sentences)


def test_a_budget_for_no_run_keeps_the_predictions(tmp_path):
    found = trade("mass_on_spring", {"damping": 20}, path=tmp_path / "b.h5", budget=1e-9, **QUIET)
    assert found.best is None
    assert any("the budget" in sentence for sentence in found.sentences)
    assert not any(row.is_measured for row in found.rows)
    assert any(row.predicted_error < 1e-3 for row in Trade.read(found.path).rows)


@pytest.fixture(scope="session")
def chain(exported, tmp_path_factory):
    """A scene of three FMUs in a row, without states, derivatives or a state to save."""
    folder = tmp_path_factory.mktemp("foreign")
    source = exported(mass_on_spring())[2]
    with zipfile.ZipFile(source) as ours, zipfile.ZipFile(folder / "Foreign.fmu", "w") as theirs:
        for name in ours.namelist():
            data = ours.read(name)
            if name == "modelDescription.xml":
                text = re.sub(r"<ModelExchange(?:[^>]*/>|.*?</ModelExchange>)", "", data.decode(), flags=re.DOTALL)
                text = re.sub(r'(can\w+|provides\w+)="true"', r'\1="false"', text)
                text = re.sub(r'maxOutputDerivativeOrder="\d+"', 'maxOutputDerivativeOrder="0"', text)
                text = re.sub(r"<Derivatives>.*?</Derivatives>", "", text, flags=re.DOTALL)
                data = re.sub(r' derivative="\d+"', "", text).encode()
            if not name.startswith("sources/"):
                theirs.writestr(name, data)
    parts = "".join(
        f'[[components]]\nname = "{name}"\npart = "./Foreign.fmu"\n'
        f"start = {{ damping = 20.0, stiffness = {stiffness} }}\n"
        for name, stiffness in (("a", 1e4), ("b", 2e4), ("c", 4e4))
    )
    wires = "".join(
        f'[[connections]]\nstart = "{start}.position"\nend = "{end}.base.position"\n' for start, end in ("ab", "bc")
    )
    file = folder / "chain.toml"
    file.write_text(
        'inputs = ["a.base.position"]\noutputs = ["c.position"]\nband = [2.0, 20.0]\nstep_size = 5e-4\n'
        f"stop_time = 0.5\namplitude = {{ m = 1e-5 }}\n{parts}{wires}"
    )
    return file


@pytest.mark.slow
def test_foreign_fmus_are_measured_where_nothing_is_predicted(chain, tmp_path):
    found = trade(chain, tolerance=0.02, path=tmp_path / "f.h5", **QUIET)
    assert any(s.startswith("errors were not predicted, only measured: a: Foreign.fmu") for s in found.sentences)
    assert found.best.measured_error <= 0.02
    assert math.isnan(found.best.predicted_error)
    # the same chain of parts with derivatives, whose error is predicted: a false reference would show
    own = chain.with_name("own.toml")
    own.write_text(chain.read_text().replace("./Foreign.fmu", "mass_on_spring"))
    held = [row for row in found.rows if row.is_measured and row.algorithm in ("gauss_seidel", "jacobi")]
    assert found.best in held
    with ExitStack() as stack:
        question = Responses(load_scene(str(own)), None, stack)
        for row in held:
            predicted = question.predicted(Configuration(Composition(), row.algorithm, row.step_size))
            assert row.measured_error == pytest.approx(predicted.error, rel=0.02)


def test_json_has_the_answer_and_no_nan(tmp_path, capsys):
    path = tmp_path / "t.h5"
    assert main(["trade", "mass_on_spring", "-p", "damping=20", "-o", str(path), "--json"]) == 0
    answer = strict_json(capsys.readouterr().out)
    assert answer["answer"]["error"]["measured"] <= answer["tolerance"] == 1e-3
    assert (tmp_path / "t.png").stat().st_size > 10_000
    assert json.dumps(answer["front"])
    assert main(["trade", "mass_on_spring", "-o", str(path)]) == 2
    assert "--force" in capsys.readouterr().err


@pytest.mark.slow
def test_a_default_whose_step_does_not_resolve_the_band_is_not_run(tmp_path):
    found = trade("mass_on_spring", {"damping": 20}, high=2000.0, tolerance=1e-2, path=tmp_path / "h.h5", **QUIET)
    assert found.own is None
    assert "the default of the scene was not run: its step does not resolve 2000 Hz" in found.sentences
    assert found.best.step_size <= 1 / (10 * 2000.0)


def test_options_without_effect_are_refused(tmp_path):
    path = tmp_path / "x.h5"
    with pytest.raises(StructureError, match="--stop would have no effect"):
        trade("mass_on_spring", stop_time=1.0, path=path)
    with pytest.raises(StructureError, match="--to would have no effect"):
        trade("mass_on_spring", purpose="motion", high=10.0, path=path)
    with pytest.raises(StructureError, match="--from would have no effect"):
        trade("stage_tracking", low=10.0, path=path)
    with pytest.raises(StructureError, match="a motion takes one input, found 2"):
        trade("sdelta_shaker", purpose="motion", inputs=["command.position[1..2]", "command.position[3]"], path=path)


def test_wrong_usage_is_refused(tmp_path):
    with pytest.raises(StructureError, match="no input to excite"):
        trade("stage_tracking", purpose="response", path=tmp_path / "x.h5")
    with pytest.raises(StructureError, match="tolerance is -1"):
        trade("mass_on_spring", tolerance=-1.0, path=tmp_path / "x.h5")
    with pytest.raises(StructureError, match="0 < lowest < highest"):
        trade("mass_on_spring", low=50.0, high=5.0, path=tmp_path / "x.h5")
