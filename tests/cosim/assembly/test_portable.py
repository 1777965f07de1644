"""Files travel by the hash of their content, and a cache that holds one is believed only where the hash is right."""

from pathlib import Path

import pytest

from hfsa.components._modelling.cache import cache_folder
from hfsa.cosim.assembly import portable
from hfsa.cosim.assembly.portable import content, missing, pack, store, unpack
from hfsa.cosim.systems.errors import StructureError


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    """Change to the cache of another machine."""
    return lambda: monkeypatch.setenv("HFSA_CACHE", str(tmp_path / "elsewhere"))


@pytest.fixture
def spring(tmp_path):
    """A file that is called an FMU."""
    file = tmp_path / "Spring.fmu"
    file.write_bytes(b"bytes of a spring")
    return file


def test_a_file_arrives_with_its_content(spring, elsewhere):
    packed, files = pack(len, [{"spring": spring}, "text", 1.0])
    assert list(files.values()) == [spring]
    elsewhere()
    (name,) = missing(packed.files)
    store(name, content(name, spring))
    spring.unlink()
    assert missing(packed.files) == []
    work, ([found], text, number) = unpack(packed)[0], (unpack(packed)[1][:1], *unpack(packed)[1][1:])
    assert (work, text, number) == (len, "text", 1.0)
    assert found["spring"].read_bytes() == b"bytes of a spring"
    assert found["spring"].name == "Spring.fmu"
    assert found["spring"].is_relative_to(cache_folder())


def test_equal_content_is_one_file_and_other_content_another(spring, tmp_path):
    same, other = tmp_path / "b" / "Spring.fmu", tmp_path / "c" / "Spring.fmu"
    for file, text in ((same, spring.read_bytes()), (other, b"another spring")):
        file.parent.mkdir()
        file.write_bytes(text)
    assert len(pack(len, [spring, same])[0].files) == 1
    assert len(pack(len, [spring, other])[0].files) == 2


def test_a_damaged_file_is_asked_for_and_replaced(spring, elsewhere):
    packed, _ = pack(len, [spring])
    elsewhere()
    (name,) = packed.files
    store(name, spring.read_bytes())
    (kept,) = cache_folder().rglob("Spring.fmu")
    kept.write_bytes(b"bytes of a sprinG")
    assert missing(packed.files) == [name]
    store(name, spring.read_bytes())
    assert missing(packed.files) == []
    assert kept.read_bytes() == spring.read_bytes()


def test_a_file_that_changed_on_the_way_is_refused(spring, elsewhere):
    packed, _ = pack(len, [spring])
    (name,) = packed.files
    with pytest.raises(StructureError, match="other bytes"):
        store(name, b"else")
    spring.write_bytes(b"else")
    with pytest.raises(StructureError, match="has changed since the sweep began"):
        content(name, spring)


def test_results_files_stay_what_they_are():
    packed, files = pack(len, [Path("results/x.h5")])
    assert not files
    assert unpack(packed)[1] == [Path("results/x.h5")]


def test_the_stepping_loop_is_that_of_the_other_machine(library, monkeypatch):
    packed, files = pack(len, [library])
    assert not files
    assert unpack(packed)[1] == [library]
    for there in (Path("/elsewhere/loop.so"), None):
        monkeypatch.setattr(portable, "_own_loop", lambda there=there: there)
        assert unpack(packed)[1] == [there]
