"""The trial of an FMU that kills, floods or writes into its process: the report and the ending stay words."""

import pytest

from hfsa.fmus._trial import _abnormal_exit, _entries


@pytest.mark.parametrize("junk", [b"\xff\xfe\n", b"{\n", b"[1]\n", b"7\n", b'{"doing": "x"}\n'], ids=repr)
def test_a_report_counts_up_to_the_first_line_that_is_junk(tmp_path, junk):
    whole = b'{"interface": "Co-Simulation", "doing": "loading"}\n'
    (tmp_path / "report").write_bytes(whole + junk + whole)
    assert _entries(tmp_path / "report") == [{"interface": "Co-Simulation", "doing": "loading"}]


@pytest.mark.parametrize(
    ("code", "words"),
    [
        pytest.param(-11, "crashed with SIGSEGV", id="a signal with a name"),
        pytest.param(-40, "crashed with signal 40", id="a signal without"),
    ],
)
def test_every_signal_has_words(code, words):
    assert _abnormal_exit(code, b"") == words
