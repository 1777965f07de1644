"""What a command loads before it answers, and the listing that is kept in the cache."""

import json
import subprocess
import sys
from importlib.metadata import EntryPoint, version

import pytest

from hfsa.cosim.commands import _listing, _whole_listing

HEAVY = {"casadi", "control", "cyclopts", "fmpy", "h5py", "matplotlib", "numpy", "rich", "scipy"}


def loaded(*words: str, among: set[str]) -> tuple[str, set[str]]:
    """Return the output of a command and which of some libraries it has loaded."""
    script = (
        "import sys; from hfsa.cosim.cli import main; assert main(sys.argv[1:]) == 0; "
        f"print('\\nloaded:', *sorted({among} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", script, *words], capture_output=True, text=True, check=True)
    output, _, names = done.stdout.rpartition("\nloaded:")
    return output, set(names.split())


def test_the_version_needs_no_parser():
    output, found = loaded("--version", among=HEAVY)
    assert output.strip() == version("hfsa")
    assert found == set()


def test_the_version_beside_a_verb_is_the_same(hfsa):
    assert hfsa("list", "--version")[1].strip() == hfsa("--version")[1].strip() == version("hfsa")


def test_a_linear_sweep_needs_none_of_scipy(tmp_path):
    _, found = loaded("sweep", "sdelta_shaker", "--method", "linear", "-o", str(tmp_path / "x.h5"), among=HEAVY)
    assert found.isdisjoint({"scipy", "control", "matplotlib"})
    assert "h5py" in found


@pytest.fixture
def fresh(tmp_path, monkeypatch):
    """An empty cache, and a count of the listings made."""
    monkeypatch.setenv("HFSA_CACHE", str(tmp_path / "cache"))
    made, listing = [], _listing.listing

    def counted(*names):
        made.append(names)
        return listing(*names)

    monkeypatch.setattr(_listing, "listing", counted)
    return made


def test_the_kept_listing_is_the_one_made(hfsa, fresh):
    first, second = hfsa("list"), hfsa("list")
    assert first == second
    assert json.loads(hfsa("list", "--json")[1])["components"]
    assert len(fresh) == 1
    _, found = loaded("list", among=HEAVY)
    assert found.isdisjoint({"casadi", "numpy", "scipy", "fmpy"})


def test_other_sources_make_another_listing(hfsa, fresh, monkeypatch):
    hfsa("list")
    monkeypatch.setattr(_whole_listing, "all_sources", lambda: "changed")
    hfsa("list")
    assert len(fresh) == 2


def test_other_libraries_make_another_listing(hfsa, fresh, monkeypatch):
    hfsa("list")
    monkeypatch.setattr(_whole_listing, "version", lambda name: "0")
    hfsa("list")
    assert len(fresh) == 2


def test_a_listing_with_parts_of_others_is_not_kept(hfsa, fresh, monkeypatch):
    point = EntryPoint("mine", "nowhere", "hfsa.parts")
    monkeypatch.setattr(_whole_listing, "entry_points", lambda group: [point] if group == "hfsa.parts" else [])
    hfsa("list")
    hfsa("list")
    assert len(fresh) == 2


def test_a_listing_with_an_error_is_not_kept(hfsa, fresh, monkeypatch):
    listing = _listing.listing

    def broken():
        data = listing()
        return {**data, "components": [{"name": "broken", "error": "it cannot be built"}]}

    monkeypatch.setattr(_listing, "listing", broken)
    assert "it cannot be built" in hfsa("list")[1]
    monkeypatch.setattr(_listing, "listing", listing)
    assert "it cannot be built" not in hfsa("list")[1]


def test_a_damaged_kept_listing_is_made_anew(hfsa, fresh, tmp_path):
    whole = hfsa("list")
    (kept,) = (tmp_path / "cache" / "listings").glob("*.json")
    kept.write_text(kept.read_text()[:-100])
    assert hfsa("list") == whole
    assert len(fresh) == 2
    assert json.loads(kept.read_text())[1] == whole[1].rstrip("\n")


def test_a_cache_that_cannot_be_written_is_no_error(hfsa, fresh, tmp_path):
    (tmp_path / "cache").write_text("a file where the folder should be")
    code, out, _ = hfsa("list")
    assert code == 0
    assert "mass_on_spring" in out
