"""Every published number, judged; and `docs/published.md`, which shows them, up to date and plain."""

from collections import Counter
from dataclasses import replace

import numpy as np
import published
import pytest
from published import Entry, Evaluation, Number, entries

EXAMPLE = Entry(Evaluation("pzt_stack", None, (), None), "stage", "printed", "force", "eq 5.9", "N", "834")
EXAMPLE = replace(EXAMPLE, key="available_force")
"""Of which 833 comes out."""


def judge(entry: Entry) -> None:
    """Assert that it agrees as printed, or not as printed but as corrected, or not and says why."""
    found = f"computed {entry.computed.tolist()} {entry.unit}, printed {entry.printed}"
    assert entry.agrees_with(entry.printed) == (entry.verdict == "agrees"), found
    if entry.verdict == "misprint":
        assert entry.corrected is not None, f"{found}: a misprint has a corrected value"
        assert entry.agrees_with(entry.corrected), f"{found}, corrected {entry.corrected}"
    else:
        assert entry.corrected is None, f"{found}: only a misprint has a corrected value"
        assert entry.reason or entry.verdict == "agrees", f"{found}: what is not reproducible has a reason"


@pytest.mark.parametrize("entry", entries(), ids=lambda entry: entry.title)
def test_the_verdict_is_right(entry):
    assert entry.verdict in published.VERDICTS
    assert entry.kind in published.KINDS
    assert entry.source in published.sources()
    judge(entry)


@pytest.mark.parametrize(
    "wrong",
    [
        replace(EXAMPLE, verdict="agrees"),
        replace(EXAMPLE, verdict="misprint"),
        replace(EXAMPLE, verdict="misprint", corrected="832"),
        replace(EXAMPLE, printed="833", verdict="misprint", corrected="833"),
        replace(EXAMPLE, verdict="not reproducible"),
        replace(EXAMPLE, printed="833", verdict="not reproducible", reason="none"),
    ],
)
def test_a_wrong_verdict_fails(wrong):
    judge(replace(EXAMPLE, verdict="misprint", corrected="833"))
    with pytest.raises(AssertionError):
        judge(wrong)


@pytest.mark.parametrize("verdict", ["misprint", "not reproducible"])
def test_what_is_derived_is_ours_to_correct(verdict):
    with pytest.raises(ValueError, match=r"force .*correct them until they agree"):
        replace(EXAMPLE, kind="derived", verdict=verdict, corrected="833", reason="ours")


def test_a_number_counts_to_half_a_unit_of_its_last_digit():
    assert published.half_units(["1.50", "-3e-3", "2.5e4", "7"]) == pytest.approx([5e-3, 5e-4, 500, 0.5])
    for text, agrees in (("833.0", True), ("832.9", False), ("8.3e2", True), ("8.2e2", False)):
        assert replace(EXAMPLE, printed=text).agrees_with(text) == agrees
    assert replace(EXAMPLE, tolerance=1.5).agrees_with("834")
    for tolerance, agrees in ((2e-3, True), (1e-3, False)):
        assert replace(EXAMPLE, relative_tolerance=tolerance).agrees_with("834") == agrees


def test_a_bare_zero_means_nothing_at_all():
    assert published.half_units(["2e4", "0", "0.0"]) == pytest.approx([5e3, 2e-5, 0.05])
    assert published.half_units("0") == pytest.approx(1e-9)
    assert not replace(EXAMPLE, unit="MPa").agrees_with("0")


def test_every_probe_computes_a_published_number():
    assert {entry.evaluation.probe for entry in entries()} - {None} == published.published_probes.PROBES.keys()


def test_a_computed_number_is_shown_like_the_printed_one_with_a_digit_more():
    assert Number.of("1.50").alike(2.0 / 3) == "0.667"
    assert Number.of("-3e-3").alike(-0.00314) == "-3.1e-3"
    assert Number.of("7").alike(-1e-9) == "0.0"


def test_keys_count_from_one():
    found = {"table": np.arange(6.0).reshape(2, 3), "inside": {"value": 3.5}}
    assert published.at_key(found, "table[2,1]") == 3.0
    assert published.at_key(found, "table[1]").tolist() == [0.0, 1.0, 2.0]
    assert published.at_key(found, "table[1,2:3]").tolist() == [1.0, 2.0]
    assert published.at_key(found, "inside.value") == 3.5
    with pytest.raises(ValueError, match="expected real numbers"):
        published.at_key([1j], "")


def test_every_quantity_is_entered_once():
    assert [title for title, times in Counter(e.title for e in entries()).items() if times > 1] == []


def test_published_md_is_up_to_date():
    assert published.REPORT.read_text() == published.report(), "run `make published`"


def test_published_md_begins_with_the_counts():
    beginning = published.REPORT.read_text().split("\n## ")[0]
    last = [cell.strip() for cell in beginning.rstrip().splitlines()[-1].split("|")[1:-1]]
    verdicts = Counter(entry.verdict for entry in entries() if entry.kind == "printed")
    derived = len(entries()) - verdicts.total()
    assert last == ["all", *[str(verdicts[v]) for v in published.VERDICTS], str(derived)]
    assert all(title in beginning for title in published.sources().values())


def test_published_md_is_plain():
    """Headings, sentences, commands, and tables whose rows all have their header's number of cells."""
    text = published.REPORT.read_text()
    assert not set("<>") & set(text.replace("< 1e-09", ""))
    assert text.isascii()
    for block in text.split("\n\n"):
        if block.startswith("|"):
            assert len({line.count("|") for line in block.splitlines()}) == 1, block
