"""Damaged results files: one sentence from every reader, within a time limit."""

import multiprocessing
import random
from multiprocessing.connection import Connection
from pathlib import Path

import h5py
import numpy as np
import pytest

from hfsa.cosim.results import soundness, store
from hfsa.cosim.results.files import ResultsError, read_choices, read_status, read_sweep, read_warnings
from hfsa.cosim.results.flat import read_flat
from hfsa.cosim.results.store import reading


def test_any_damage_is_one_sentence_or_none(results, monkeypatch):
    """A file that would keep a reader busy for ever, or crash it, is what the look before refuses."""
    monkeypatch.setattr(soundness, "LIMIT", 1.5)
    rng, whole, refusals = random.Random(19), results.read_bytes(), []
    for _ in range(40):
        data = bytearray(whole)
        for _ in range(rng.choice([1, 20, 500])):
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        results.write_bytes(data[: rng.choice([len(data), rng.randrange(len(data))])])
        told = refusals_without_look(results)
        if told is None:
            with pytest.raises(ResultsError, match="it is damaged; looking through it") as error:
                soundness.check_sound(results)
            told = [str(error.value)]
        refusals += told
    assert len(refusals) > 20
    assert [text for text in refusals if str(results) not in text or "\n" in text] == []


def refusals_without_look(path: Path, limit: float = 1.0) -> list[str] | None:
    """Return what readers in another process tell of a file; `None` where the HDF5 library crashes or does not end."""
    near, far = multiprocessing.Pipe(duplex=False)
    reader = multiprocessing.get_context("fork").Process(target=_tell_refusals, args=(path, far))
    reader.start()
    far.close()
    try:
        return near.recv() if near.poll(limit) else None
    except EOFError:
        return None
    finally:
        reader.kill()
        reader.join()


def _tell_refusals(path: Path, far: Connection) -> None:
    """Send the refusals of all readers of a file that nobody has looked at before."""
    store.check_sound = lambda _: None
    refusals = []
    for read in (read_sweep, read_flat, read_choices, read_warnings, read_status):
        try:
            read(path)
        except ResultsError as error:
            refusals.append(str(error))
    far.send(refusals)


def test_a_file_whose_reading_does_not_end_is_refused(results, monkeypatch):
    monkeypatch.setattr(soundness, "_LOOK", "while True: pass")
    monkeypatch.setattr(soundness, "LIMIT", 0.5)
    monkeypatch.setattr(soundness, "_known", set())
    with pytest.raises(ResultsError, match=r"old.h5: it is damaged; looking through it did not end in 0.5 s"):
        read_sweep(results)


def test_a_file_whose_reading_crashes_is_refused(results, monkeypatch):
    monkeypatch.setattr(soundness, "_LOOK", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    monkeypatch.setattr(soundness, "_known", set())
    with pytest.raises(ResultsError, match=r"old.h5: it is damaged; looking through it crashes the HDF5 library"):
        read_sweep(results)


def test_the_look_takes_a_sound_file_and_leaves_it_alone(results, monkeypatch):
    monkeypatch.setattr(soundness, "_known", set())
    before = results.read_bytes(), results.stat().st_mtime_ns
    soundness.check_sound(results)
    assert soundness._known
    assert (results.read_bytes(), results.stat().st_mtime_ns) == before


def test_a_newer_format_is_refused_with_both_numbers(results):
    with h5py.File(results, "r+") as file:
        file.attrs["format_version"] = "2"
    with pytest.raises(ResultsError, match="has format version 2, expected 1"), reading(results):
        pass


def test_messages_need_no_fill_value_and_no_attribute_for_netcdf(results):
    with h5py.File(results) as file:
        message = file["bode/message"]
        assert h5py.check_string_dtype(message.dtype) == ("utf-8", 240)
        assert message.id.get_create_plist().fill_value_defined() != h5py.h5d.FILL_VALUE_USER_DEFINED
        assert "_Encoding" not in message.attrs
        assert np.isnan(file["bode/phase"].fillvalue)


def test_a_sweep_whose_warnings_are_no_text_is_resumed(tmp_path, monkeypatch, hfsa):
    words = ("sweep", "mass_on_spring", "-p", "damping=5", "--points", "2", "--jobs", "1", "-o", "w.h5")
    assert hfsa(*words)[0] == 0
    with h5py.File("w.h5", "r+") as file:
        file.attrs["warnings"] = np.bytes_(b"spring: worn \xff\x89 out".ljust(len(file.attrs["warnings"]), b"\0"))
    assert hfsa(*words, "--resume")[0] == 0
    assert read_warnings("w.h5") == [r"spring: worn \xff\x89 out"]
