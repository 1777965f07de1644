"""The choices of options are those of the library's tables, and no option is taken without an effect."""

import inspect
import typing

import pytest

from hfsa.cosim.assembly.native_loop import BACKENDS
from hfsa.cosim.commands import _options, export, sweep
from hfsa.cosim.experiments import run as running
from hfsa.cosim.experiments import sweep as sweeping
from hfsa.cosim.experiments.setup import ALGEBRAIC_LOOPS
from hfsa.cosim.experiments.sweep_request import GRIDS
from hfsa.cosim.masters.algorithms import ALGORITHMS, CANDIDATES, DEFAULT, LIMITED, ORDERED
from hfsa.cosim.measurement.sweep import METHODS
from hfsa.cosim.systems.errors import StructureError
from hfsa.fmus.export import Version


def choices(annotation) -> set:
    """The members of the first Literal in an annotation."""
    if typing.get_origin(annotation) is typing.Literal:
        return set(typing.get_args(annotation))
    return next((found for part in typing.get_args(annotation) if (found := choices(part))), set())


def option(function, name: str) -> set:
    return choices(typing.get_type_hints(function, include_extras=True)[name])


@pytest.mark.parametrize(
    ("found", "table"),
    [
        (option(_options.SteppingOptions, "algorithm"), {"auto", *ALGORITHMS}),
        (option(_options.SteppingOptions, "backend"), set(BACKENDS)),
        (option(_options.SteppingOptions, "algebraic_loops"), set(ALGEBRAIC_LOOPS)),
        (option(sweep.sweep, "method"), set(METHODS)),
        (option(sweep.sweep, "grid"), set(GRIDS)),
        (option(sweeping.sweep, "method"), set(METHODS)),
        (option(sweeping.sweep, "grid"), set(GRIDS)),
        (option(sweeping.sweep, "backend"), set(BACKENDS)),
        (option(running.run, "algebraic_loops"), set(ALGEBRAIC_LOOPS)),
        (option(export.export, "fmi"), set(typing.get_args(Version))),
    ],
)
def test_choices_are_those_of_the_tables(found, table):
    assert found == table


def test_the_table_of_algorithms_is_whole():
    assert DEFAULT == "gauss_seidel"
    ranks = [row.rank for row in ALGORITHMS.values()]
    assert ranks == sorted(set(ranks))
    assert all(row.name == name and row.summary for name, row in ALGORITHMS.items())
    assert set(CANDIDATES) | set(ORDERED) <= set(LIMITED)
    assert all(row.order is None for row in ALGORITHMS.values() if row.is_model_exchange)


def test_the_defaults_of_the_command_line_are_those_of_the_functions():
    """What the command line does not give is left to the function; what it gives by itself is the same."""
    own, theirs = (inspect.signature(function).parameters for function in (sweep.sweep, sweeping.sweep))
    for name in ("method", "grid", "resume", "force"):
        assert own[name].default == theirs[name].default


LINEAR = ["sweep", "sdelta_hfsa", "--method", "linear", "--points", "3", "-o", "it.h5"]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--jobs", "1"], "--jobs would have no effect: the linear method takes no steps"),
        (["--step", "1e-5"], "--step would have no effect"),
        (["--algorithm", "jacobi", "--settling-time", "3"], "--algorithm, --settling-time would have no effect"),
        (
            ["--tolerance", "1e-9"],
            "--tolerance would have no effect: the linear method takes no steps, and no level is",
        ),
        (["--open-loop", "controller.axis[1].command", "--tolerance", "1e-9"], "--tolerance would have no effect"),
        (["--backend", "python"], "--backend would have no effect"),
        (["--open-loop", "controller.axis[1].command", "--fuse", "robot,drives"], "--fuse would have no effect"),
        (["--open-loop", "controller.axis[1].command", "--amplitude", "1"], "--amplitude would have no effect"),
        (["--open-loop", "controller.axis[1].command", "-j", "2", "--resume"], "--jobs, --resume would have no effect"),
    ],
)
def test_an_option_without_effect_is_refused(hfsa, tmp_path, more, words):
    code, out, err = hfsa(*LINEAR, *more)
    assert (code, out) == (2, "")
    assert words in err
    assert not (tmp_path / "it.h5").exists()


NO_POINT_ALONE = "--scheduler takes --method stepped, and no --start previous"
ELSEWHERE = ["--scheduler", "tcp://127.0.0.1:1"]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--method", "multisine", "--start", "previous"], "multisine measures no point after another"),
        (["--method", "linear", "--start", "previous"], "--start would have no effect"),
        (["--method", "multisine", *ELSEWHERE], NO_POINT_ALONE),
        (["--start", "previous", *ELSEWHERE], NO_POINT_ALONE),
    ],
    ids=["multisine previous", "linear previous", "multisine scheduler", "previous scheduler"],
)
def test_what_one_method_alone_can_do_is_refused_for_others(hfsa, tmp_path, more, words):
    code, out, err = hfsa("sweep", "mass_on_spring", *more, "-o", "it.h5")
    assert (code, out) == (2, "")
    assert words in err
    assert not (tmp_path / "it.h5").exists()


def test_a_linear_sweep_follows_no_branch_in_python(tmp_path):
    with pytest.raises(StructureError, match="linear measures no point after another"):
        sweeping.sweep("mass_on_spring", method="linear", start="previous", path=tmp_path / "it.h5")


def test_a_stepping_loop_of_what_takes_no_steps_is_refused(hfsa):
    code, _, err = hfsa("run", "mass_on_spring", "--algorithm", "monolithic", "--backend", "python")
    assert code == 2
    assert "monolithic takes no steps" in err
