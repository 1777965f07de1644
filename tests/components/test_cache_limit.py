"""The cache: its size, what goes first, damage, and many processes at once."""

import os
import subprocess
import sys
import time

import pytest

from hfsa.components._modelling import cache_limit, sealed
from hfsa.components._modelling.cache_limit import entries, limit, remove, set_limit, trim


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A cache with four entries of 1000 bytes, used one, two, three and four days ago."""
    monkeypatch.setenv("HFSA_CACHE", str(tmp_path / "cache"))
    for days, name in enumerate(["fmus/a", "fmus/b", "loop/c", "levels/d"], 1):
        path = tmp_path / "cache" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if name.startswith("fmus"):
            path.mkdir()
            (path / "x.fmu").write_bytes(bytes(1000))
        else:
            path.write_bytes(bytes(1000))
        os.utime(path, (time.time() - days * 86400 - 60,) * 2)
    return tmp_path / "cache"


def names(found):
    return [entry.path.name for entry in found]


def test_entries_by_age(cache):
    assert names(entries()) == ["d", "c", "b", "a"]
    assert {entry.size for entry in entries()} == {1000}


def test_the_least_recently_used_go_first(cache):
    assert names(trim(2500)) == ["d", "c"]
    assert names(entries()) == ["b", "a"]
    assert trim(2500) == []


def test_what_was_used_within_a_day_stays(cache):
    os.utime(cache / "levels" / "d")
    assert names(trim(0)) == ["c", "b", "a"]
    assert names(entries()) == ["d"]
    assert names(trim(0, spared=-1.0)) == ["d"]


def test_the_limit_is_remembered(cache):
    assert limit() == cache_limit.LIMIT
    set_limit(12345)
    assert limit() == 12345
    (cache / "limit").write_text("many")
    assert limit() == cache_limit.LIMIT
    assert len(entries()) == 4


def test_one_of_two_removes(cache):
    assert remove(cache / "fmus" / "a")
    assert not remove(cache / "fmus" / "a")
    assert os.listdir(cache / "fmus") == ["b"]


def filled(folder):
    folder.mkdir(parents=True)
    (folder / "one.fmu").write_bytes(b"whole")
    return folder


@pytest.mark.parametrize(
    "damage",
    [
        lambda folder: (folder / "one.fmu").write_bytes(b"who"),
        lambda folder: (folder / "one.fmu").write_bytes(b"whale"),
        lambda folder: (folder / "one.fmu").unlink(),
        lambda folder: (folder / "two.fmu").write_bytes(b""),
        lambda folder: (folder / "seal").unlink(),
        lambda folder: (folder / "seal").write_bytes(b"\xff"),
    ],
    ids=["cut", "changed", "gone", "more", "no seal", "damaged seal"],
)
def test_a_damaged_folder_is_removed(tmp_path, damage):
    folder = tmp_path / "whole"
    sealed.finish(filled(tmp_path / "unfinished"), folder)
    damage(folder)
    assert not sealed.is_sound(folder)
    assert not folder.exists()
    sealed.finish(filled(tmp_path / "unfinished"), folder)
    assert sealed.is_sound(folder)


def test_use_is_noted(tmp_path):
    folder = tmp_path / "whole"
    sealed.finish(filled(tmp_path / "unfinished"), folder)
    os.utime(folder, (0, 0))
    assert sealed.is_sound(folder)
    assert folder.stat().st_mtime > time.time() - 60


def test_a_file_that_shrinks_later_is_found(tmp_path):
    folder = tmp_path / "whole"
    sealed.finish(filled(tmp_path / "unfinished"), folder)
    assert sealed.is_sound(folder)
    (folder / "one.fmu").write_bytes(b"w")
    assert not sealed.is_sound(folder)


BUILD = """
from hfsa.cosim.assembly.fmu_cache import fmu_file
from hfsa.cosim.systems.system import Component
print(fmu_file(Component("mass", "mass_on_spring")).stat().st_size)
"""


def test_many_processes_from_empty_with_one_that_clears(tmp_path):
    """Each gets a whole FMU of the same size, whatever goes meanwhile; nothing unfinished is left."""
    env = {**os.environ, "HFSA_CACHE": str(tmp_path)}
    children = [
        subprocess.Popen([sys.executable, "-c", BUILD], env=env, stdout=subprocess.PIPE, text=True) for _ in range(4)
    ]
    sizes = {int(child.communicate(timeout=120)[0]) for child in children}
    assert [child.returncode for child in children] == [0] * 4
    assert len(sizes) == 1
    assert len(os.listdir(tmp_path / "fmus")) == 1
