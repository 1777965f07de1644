"""The table of algorithms: any file of the folder adds rows, and no row replaces another."""

import sys

import pytest

import hfsa.cosim.masters
from hfsa.cosim.masters import algorithms, jacobi, jacobi_plain
from hfsa.cosim.systems.errors import StructureError

ADDED = """
from dataclasses import replace
from hfsa.cosim.masters.jacobi_plain import ALGORITHMS as OTHERS

ALGORITHMS = (replace(OTHERS[0], name={name!r}, rank={rank}),)
"""


@pytest.fixture
def added(tmp_path, monkeypatch):
    """Add a file with one row to the folder of masters; the function returns the table that is then found."""
    module = "hfsa.cosim.masters.added"

    def add(name: str, rank: int):
        (tmp_path / "added.py").write_text(ADDED.format(name=name, rank=rank))
        return algorithms._found()

    monkeypatch.setattr(hfsa.cosim.masters, "__path__", [*hfsa.cosim.masters.__path__, str(tmp_path)])
    yield add
    sys.modules.pop(module, None)
    if hasattr(hfsa.cosim.masters, "added"):
        delattr(hfsa.cosim.masters, "added")


def test_a_new_algorithm_takes_its_place_by_rank_and_no_other_moves(added):
    before = list(algorithms.ALGORITHMS)
    between = algorithms.ALGORITHMS["jacobi"].rank + 1
    place = before.index("jacobi") + 1
    assert list(added("own", between)) == [*before[:place], "own", *before[place:]]


def test_a_second_row_of_a_name_is_refused_with_both_files(added, tmp_path):
    with pytest.raises(StructureError, match="two algorithms are called 'jacobi'") as error:
        added("jacobi", 10_000)
    assert f"{jacobi.__file__} and {tmp_path / 'added.py'}" in str(error.value)


def test_a_second_row_of_a_rank_is_refused_with_both_files(added, tmp_path):
    rank = algorithms.ALGORITHMS["jacobi_plain"].rank
    with pytest.raises(StructureError, match=f"rank {rank}") as error:
        added("own", rank)
    for words in ("own", "jacobi_plain", str(jacobi_plain.__file__), str(tmp_path / "added.py")):
        assert words in str(error.value)
