"""The headers of the loop in C are the one statement of its structures: what else there might be is found at load."""

import re
import shutil
from graphlib import TopologicalSorter

import pytest

from hfsa.cosim.actions.algebraic_loop import STALE
from hfsa.cosim.fmi.library import TERMINATED
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.masters.native import headers
from hfsa.cosim.masters.native.details import detail
from hfsa.cosim.masters.native.library import Library, LibraryError
from hfsa.cosim.masters.native.program import _PERFORMERS
from hfsa.cosim.systems.system import System
from hfsa.fmus.compile import SUFFIX, compile_files


@pytest.fixture
def compiled(tmp_path):
    """Compile the sources with some words of one file replaced, as whoever changes a header and no more would."""

    def compile_changed(name: str, old: str, new: str):
        folder = shutil.copytree(headers.FOLDER, tmp_path / "changed")
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new))
        library = tmp_path / f"changed{SUFFIX}"
        compile_files(headers.sources(folder), library)
        return library

    return compile_changed


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("algebraic_loop.h", "  int passes;", "  int passes, more;\n  double room;", "another Loop .*: Loop is 120, "),
        (
            "iterated.h",
            "double tolerance, rounding, reuse;",
            "double rounding, tolerance, reuse;",
            "another IteratedStep ",
        ),
        ("iterated.h", "int tried, rounds;", "long long tried, rounds;", "another Progress "),
        ("call.h", "  int is_final;", "  short is_final, other;", "another Call .*: Call.other is 58, expected None"),
        ("step.h", "COMPLETE, CALL_NOT_OK", "CALL_NOT_OK, COMPLETE", "another .*: .* is [01], expected [01]"),
        ("feedback.c", "hfsa_find_rates", "hfsa_find_rate", "has no hfsa_find_rates, which its headers declare"),
    ],
)
def test_a_library_of_other_layouts_is_refused(compiled, name, old, new, words):
    library = compiled(name, old, new)
    with pytest.raises(LibraryError, match=words):
        make_master({}, System([]), library=library)


def test_comments_and_code_are_no_layouts(compiled):
    assert Library.load(compiled("newton.h", "/* The larger", "/* By far the larger")).c.STALE == STALE


def test_words_are_the_same_in_python(library):
    c = Library.load(library).c
    assert (c.STALE, c.TERMINATED) == (STALE, TERMINATED)


def test_whatever_python_asks_for_is_there(library):
    c = Library.load(library).c
    names = {name for versions in _PERFORMERS.values() for name in versions.values()}
    names |= set(re.findall(r'Detail\("(\w+)"', (headers.FOLDER / "details.py").read_text()))
    exported = {name for name in dir(c) if name.startswith("hfsa_")}
    assert names == exported - {"hfsa_advance", "hfsa_sizes"}


def test_what_has_no_twin_is_refused():
    with pytest.raises(TypeError, match="has no twin in C"):
        detail(object())


def test_no_c_file_knows_another():
    """Each includes its own header, and headers stand in floors."""
    includes = {}
    for file in headers.FOLDER.glob("*.[ch]"):
        includes[file.name] = set(re.findall(r'^#include "(.+)"$', file.read_text(), re.MULTILINE))
    assert list(TopologicalSorter(includes).static_order())
    for name, found in includes.items():
        assert found <= {"call.h", "newton.h", name.removesuffix("c") + "h"}
