"""The table of extremes: each row has an expectation that can fail, and the page lists the rows that there are."""

import math

import extremes
import pytest
from extreme_rows.row import Accuracy, Found, Message, Row

from hfsa.cosim.systems.errors import StructureError

ROWS = list(extremes.rows())
CHEAP = [row for row in ROWS if row.is_cheap]
PAGE = extremes.PAGE.read_text(encoding="utf-8")


def ids(row: Row) -> str:
    return f"{row.extreme}: {row.tried}"


def test_the_page_lists_the_rows():
    tried = [extremes.listed(PAGE), *([row.tried for row in extremes.rows(is_long)] for is_long in (False, True))]
    plain = [[text.replace("\\", "") for text in one] for one in tried]
    assert plain[0] in plain[1:]
    assert "NOT" not in PAGE


def test_rows_differ():
    names = [(row.tried, str(row.expected)) for row in ROWS]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("row", ROWS, ids=ids)
def test_every_row_has_an_expectation(row):
    assert row.tried
    if isinstance(row.expected, Accuracy):
        assert row.expected.against
        assert 0 < row.expected.bound <= (1.0 if row.extreme == "duration" else 0.1)
    else:
        assert row.expected.pattern


def test_every_extreme_is_there():
    assert {row.extreme for row in ROWS} == {
        "gain",
        "damping",
        "amplitude",
        "stiffness",
        "step",
        "duration",
        "posture",
        "time scale",
        "value",
    }


@pytest.mark.parametrize("row", CHEAP, ids=ids)
def test_cheap_rows_are_as_expected(row):
    outcome = row.run()
    assert outcome.is_expected, outcome.came


@pytest.mark.slow
@pytest.mark.parametrize("row", [row for row in ROWS if not row.is_cheap], ids=ids)
def test_all_others_are_as_expected(row):
    outcome = row.run()
    assert outcome.is_expected, outcome.came


# Rows that are not as expected ----------------------------------------------------------------------------------------


def fails(error: Exception):
    raise error


@pytest.mark.parametrize("error", [2e-3, math.inf, math.nan])
def test_an_error_above_its_bound_is_not_as_expected(error):
    expected = Accuracy("x", "y", 1e-3)
    assert not Row("gain", "x", expected, lambda: Found(error)).run().is_expected
    assert Row("gain", "x", expected, lambda: Found(1e-4)).run().is_expected


def test_a_row_that_raises_is_not_as_expected():
    outcome = Row("gain", "x", Accuracy("x", "y", 1e-3), lambda: fails(ZeroDivisionError("oh"))).run()
    assert outcome == ("ZeroDivisionError: oh", False)


@pytest.mark.parametrize(
    ("measure", "is_expected"),
    [
        (lambda: fails(StructureError("x is 1, expected 2")), True),
        (lambda: fails(StructureError("y")), False),
        (lambda: fails(KeyError("x is 1")), False),
        (lambda: "x is 1", False),
    ],
    ids=["raised", "another", "not ours", "not raised"],
)
def test_a_message_is_raised_by_an_error_of_ours(measure, is_expected):
    assert Row("value", "x", Message("x is 1"), measure).run().is_expected == is_expected


@pytest.mark.parametrize("is_expected", [True, False], ids=["ok", "not"])
def test_the_exit_code_and_the_page_say_it(monkeypatch, tmp_path, capsys, is_expected):
    row = Row("gain", "`x_y` of a|b", Accuracy("x", "y", 1.0), lambda: Found(0.5 if is_expected else 2.0))
    monkeypatch.setattr(extremes, "rows", lambda is_long: [row])
    monkeypatch.setattr(extremes, "PAGE", tmp_path / "page.md")
    assert extremes.main([]) == (0 if is_expected else 1)
    text = (tmp_path / "page.md").read_text()
    assert extremes.listed(text) == ["`x_y` of a|b"]
    assert ("**NOT**" in text) != is_expected
    assert extremes.main(["nothing"]) == 2
