"""`hfsa cache`: its size, its limit, its removal, and damaged entries that are built anew."""

import json

import pytest


@pytest.fixture
def used(tmp_path, monkeypatch, hfsa):
    """A cache after one run."""
    monkeypatch.setenv("HFSA_CACHE", str(tmp_path / "cache"))
    assert run(hfsa) == 0
    return tmp_path / "cache"


def run(hfsa):
    return hfsa("run", "mass_on_spring", "--stop", "0.01", "-o", "run.h5", "--force")[0]


def test_what_it_tells(used, hfsa):
    code, out, _ = hfsa("cache")
    assert code == 0
    assert str(used) in out
    assert "limit 5 GB" in out
    assert "fmus: " in out
    data = json.loads(hfsa("cache", "--json")[1])
    assert data["bytes"] == sum(file.stat().st_size for file in used.glob("*/**/*") if file.is_file())
    assert hfsa("cache", "--size")[1] == f"{data['bytes']}\n"


def test_it_is_cleared_and_filled_again(used, hfsa):
    assert "removed" in hfsa("cache", "--clear")[1]
    assert hfsa("cache", "--size")[1] == "0\n"
    assert run(hfsa) == 0
    assert int(hfsa("cache", "--size")[1]) > 0


def test_a_limit_holds_from_now_on(used, hfsa):
    assert hfsa("cache", "--limit", "1 kB")[0] == 0
    assert int(hfsa("cache", "--size")[1]) < 1000
    assert "limit 1 kB" in hfsa("cache")[1]


@pytest.mark.parametrize("words", [["--limit", "much"], ["--limit", "3GiB"], ["--size", "--clear"]], ids="_".join)
def test_wrong_words(used, hfsa, words):
    code, _, err = hfsa("cache", *words)
    assert code == 2
    assert "expected" in err


def test_an_empty_cache_is_no_error(tmp_path, monkeypatch, hfsa):
    monkeypatch.setenv("HFSA_CACHE", str(tmp_path / "nowhere"))
    assert hfsa("cache", "--size")[:2] == (0, "0\n")
    assert hfsa("cache", "--clear")[0] == 0


@pytest.mark.parametrize(
    "cut", [pytest.param(0, marks=pytest.mark.slow), 0.5, pytest.param(0.99, marks=pytest.mark.slow)], ids=str
)
def test_a_cut_fmu_is_built_anew(used, hfsa, cut):
    for file in used.rglob("*.fmu"):
        file.write_bytes(file.read_bytes()[: int(cut * file.stat().st_size)])
    assert run(hfsa) == 0


def test_cut_outlines_and_choices_are_made_anew(used, hfsa):
    every = [
        file for kind in ("outlines", "levels", "listings") for file in used.glob(f"{kind}/**/*") if file.is_file()
    ]
    for file in every:
        file.write_bytes(b"{")
    assert run(hfsa) == 0
