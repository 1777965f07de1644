"""Archives of others: what would do harm is refused with one sentence before anything is unpacked."""

import os
import resource
import stat
import zipfile

import pytest
from hostile_archives import BOMB, DOCUMENT, REFUSED, damaged, lying, zipped

from hfsa.cosim.archives.archive import Archive, read_file
from hfsa.cosim.fmi.description import describe
from hfsa.cosim.systems.errors import StructureError


def opened(tmp_path, content: bytes) -> Archive:
    """Return an archive of a file."""
    file = tmp_path / "box.fmu"
    file.write_bytes(content)
    return Archive(file, str(file), "FMU")


@pytest.mark.parametrize("name", REFUSED, ids=REFUSED)
def test_harm_is_refused(name, tmp_path):
    content, sentence = REFUSED[name]
    with pytest.raises(StructureError) as caught:
        opened(tmp_path, content)
    words = str(caught.value)
    assert words.startswith(str(tmp_path / "box.fmu"))
    assert sentence in words
    assert len(words) < len(str(tmp_path)) + 1000
    assert "\n" not in words
    assert [path.name for path in tmp_path.rglob("*")] == ["box.fmu"]


@pytest.mark.parametrize("name", REFUSED, ids=REFUSED)
def test_a_description_is_not_read_from_it(name, tmp_path):
    file = tmp_path / "box.fmu"
    file.write_bytes(REFUSED[name][0])
    with pytest.raises(StructureError, match=r"box\.fmu"):
        describe(file)


def test_what_is_unpacked(tmp_path):
    """Files and folders as they are, a name of another alphabet and an entry that stands twice with one content."""
    folder = tmp_path / "out"
    content = {"resources/größe/数.txt": b"text", "binaries/x/Box.so": bytes(3 << 20), "a": b"a"}
    with opened(tmp_path, zipped([*content.items(), ("a", b"a")])) as archive:
        archive.unpack(folder)
    found = {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert found.pop(DOCUMENT).startswith(b"<?xml")
    assert found == content
    assert all(not stat.S_IXUSR & path.stat().st_mode for path in folder.rglob("*") if path.is_file())


def test_only_what_is_wanted(tmp_path):
    with opened(tmp_path, zipped([("sources/a.c", b"x"), ("resources/b", b"y")])) as archive:
        archive.unpack(tmp_path / "out", lambda name: not name.startswith("sources/"))
    assert sorted(path.name for path in (tmp_path / "out").rglob("*")) == ["b", DOCUMENT, "resources"]


def test_nothing_is_written_over(tmp_path):
    """A file that is there already, or a link that somebody has put there, is left alone."""
    (tmp_path / "out").mkdir()
    (tmp_path / "target").write_text("mine")
    os.symlink(tmp_path / "target", tmp_path / "out" / "a")
    with (
        opened(tmp_path, zipped([("a", b"evil")])) as archive,
        pytest.raises(StructureError, match="a cannot be unpacked: File exists"),
    ):
        archive.unpack(tmp_path / "out")
    assert (tmp_path / "target").read_text() == "mine"


def test_damage_is_told_where_it_is(tmp_path):
    with (
        opened(tmp_path, damaged()) as archive,
        pytest.raises(StructureError, match=r"box\.fmu: resources/text is damaged: Bad CRC-32"),
    ):
        archive.unpack(tmp_path / "out")


@pytest.mark.parametrize("size", [10, 1 << 19], ids=["ten_bytes", "half"])
def test_an_entry_larger_than_it_says_is_damaged(size, tmp_path):
    """No more than the stated size is read of it, and the checksum is that of the whole."""
    with (
        opened(tmp_path, lying(size)) as archive,
        pytest.raises(StructureError, match="resources/zeros is damaged"),
    ):
        archive.unpack(tmp_path / "out")
    assert (tmp_path / "out/resources/zeros").stat().st_size <= size


def test_limits_are_those_of_the_environment(tmp_path, monkeypatch):
    monkeypatch.setenv("HFSA_LARGEST_ARCHIVE", "1e9")
    with opened(tmp_path, BOMB) as archive:
        assert "resources/zeros" in archive.names
    monkeypatch.setenv("HFSA_LARGEST_ARCHIVE", "1000")
    with pytest.raises(StructureError, match=r"expected at most 1,000; .* HFSA_LARGEST_ARCHIVE changes this limit"):
        opened(tmp_path, BOMB)
    monkeypatch.setenv("HFSA_LARGEST_ARCHIVE", "much")
    with pytest.raises(StructureError, match="HFSA_LARGEST_ARCHIVE is 'much', expected a positive number"):
        opened(tmp_path, BOMB)


def test_the_number_of_entries_is_bounded(tmp_path, monkeypatch):
    monkeypatch.setenv("HFSA_MOST_ENTRIES", "2")
    with pytest.raises(StructureError, match=r"has 3 entries, expected at most 2; .*HFSA_MOST_ENTRIES"):
        opened(tmp_path, zipped([("a", b""), ("b", b"")]))


def test_a_full_disk_is_told(tmp_path):
    """A file that cannot be written to its end: one sentence that names it."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    with opened(tmp_path, zipped([("resources/large", os.urandom(4 << 20))])) as archive:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, hard))
        try:
            with pytest.raises(StructureError, match="resources/large cannot be unpacked: File too large; TMPDIR"):
                archive.unpack(tmp_path / "out")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_prefix_and_a_comment_are_allowed(tmp_path):
    """Self-extracting archives have a program before them."""
    with opened(tmp_path, b"#!/bin/sh\necho\n" + zipped()) as archive:
        assert archive.read(DOCUMENT, "here").startswith(b"<?xml")


def test_a_large_list_of_64_bits_is_seen(tmp_path):
    """The sizes of more than 65535 entries are in a record of their own."""
    file = tmp_path / "many.fmu"
    with zipfile.ZipFile(file, "w") as archive:
        for number in range(70_000):
            archive.writestr(f"{number}", b"")
    with Archive(file, str(file), "FMU") as many:
        assert len(many.names) == 70_000


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with names")
@pytest.mark.parametrize(
    ("ending", "read"),
    [
        pytest.param(".fmu", describe, id="an FMU"),
        pytest.param(".xml", describe, id="a description"),
        pytest.param(".ssp", read_file, id="a package"),
    ],
)
def test_a_pipe_is_refused_before_anybody_waits_for_it(tmp_path, ending, read):
    pipe = tmp_path / f"box{ending}"
    os.mkfifo(pipe)
    with pytest.raises(StructureError, match="is a device or a pipe, expected a file"):
        read(pipe)
