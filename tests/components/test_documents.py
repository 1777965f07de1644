"""Arguments that are files: read by their class, equal by content, and refused with file, place and what is right."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hfsa.components import Document, ModelError
from hfsa.components._modelling.arguments import arguments_of, read_value
from hfsa.components._modelling.documents import plain


@dataclasses.dataclass(frozen=True)
class Rod:
    """A rod."""

    end: tuple[float, float]
    shape: Literal["round", "square"] = "round"
    size: float | None = None

    def __post_init__(self):
        if self.size is not None and not self.size > 0:
            raise ModelError(f"size is {self.size:g} m, expected above 0")


@dataclasses.dataclass(frozen=True)
class Steel:
    """A material."""

    E: float


@dataclasses.dataclass(frozen=True)
class Frame(Document):
    """A frame of rods."""

    rod: tuple[Rod, ...]
    material: Mapping[str, Steel] = dataclasses.field(default_factory=dict)
    gain: float = 1.0


TEXT = """
[material.steel]
E = 210e9

[[rod]]
end = [0, 1.5]

[[rod]]
end = [2, 3]
shape = "square"
size = 0.1
"""
FRAME = Frame((Rod((0.0, 1.5)), Rod((2.0, 3.0), "square", 0.1)), {"steel": Steel(210e9)})


def frame(*, frame: Frame | None = None, other: Literal["none"] | Frame = "none") -> None:
    """Arguments of a part."""


def written(folder: Path, text: str | bytes) -> str:
    """Write a document and return its path."""
    file = folder / "frame.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return str(file)


def test_a_document_is_one_argument_by_its_own_name():
    assert list(arguments_of(frame)) == ["frame", "other"]


@pytest.mark.parametrize("annotation", [Frame, Frame | None, Literal["none"] | Frame], ids=["it", "or none", "or word"])
def test_path_table_and_object_are_the_same_value(tmp_path, annotation):
    path = written(tmp_path, TEXT)
    for value in (path, Path(path), plain(FRAME), FRAME):
        assert read_value("part: frame", annotation, value) == FRAME


def test_a_word_beside_a_document_is_still_a_word():
    assert read_value("part: frame", Literal["none"] | Frame, "none") == "none"
    with pytest.raises(ModelError, match=r"part: frame is 'some', expected one of none"):
        read_value("part: frame", Literal["none"] | Frame, "some")


def test_the_value_is_the_content_and_not_the_path(tmp_path):
    path = written(tmp_path, TEXT)
    first = read_value("part: frame", Frame, path)
    (tmp_path / "copy.toml").write_text(f"# another name\n{TEXT}")
    assert repr(read_value("part: frame", Frame, str(tmp_path / "copy.toml"))) == repr(first)
    written(tmp_path, TEXT.replace("0.1", "0.2"))
    changed = read_value("part: frame", Frame, path)
    assert changed != first
    assert repr(changed) != repr(first)


rods = st.builds(
    Rod,
    st.tuples(st.floats(allow_nan=False), st.floats(allow_nan=False)),
    st.sampled_from(["round", "square"]),
    st.none() | st.floats(1e-9, 1e9),
)
frames = st.builds(
    Frame,
    st.lists(rods, max_size=4).map(tuple),
    st.dictionaries(st.from_regex(r"[a-z]{1,6}", fullmatch=True), st.builds(Steel, st.floats(1, 1e12)), max_size=3),
    st.floats(allow_nan=False),
)


@given(frames)
def test_the_table_of_a_document_is_the_document(document):
    assert read_value("part: frame", Frame, plain(document)) == document


@pytest.mark.parametrize(
    ("text", "words"),
    [
        pytest.param("rod = [", r"frame\.toml: not a TOML document: ", id="no TOML"),
        pytest.param(b"rod = '\xff'", r"frame\.toml: .* byte 7 is 0xff, expected text in UTF-8", id="no text"),
        pytest.param("gain = 2", r"frame\.toml lacks the key 'rod'; it has gain$", id="missing"),
        pytest.param("rod = []\ngian = 2", r"frame\.toml has no key 'gian'; did you mean gain\?", id="unknown"),
        pytest.param("rod = 5", r"frame\.toml: rod is 5, expected tables, written \[\[rod\]\]", id="no tables"),
        pytest.param("rod = [5]", r"frame\.toml: rod\[1\] is 5, expected a table", id="no table"),
        pytest.param("[[rod]]\nend = [1]", r"frame\.toml: rod\[1\]\.end has 1 values, expected 2", id="too few"),
        pytest.param("[[rod]]\nend = [1, true]", r"rod\[1\]\.end is True, expected a number", id="no number"),
        pytest.param(
            "[[rod]]\nend = [1, 2]\nshape = 'rond'", r"rod\[1\]\.shape is 'rond'.*did you mean round", id="word"
        ),
        pytest.param(
            "[[rod]]\nend = [1, 2]\nsize = -1", r"frame\.toml: rod\[1\]: size is -1 m, expected above 0", id="value"
        ),
        pytest.param(
            "rod = []\nmaterial = 5", r"material is 5, expected tables by name, written \[material", id="names"
        ),
        pytest.param("rod = []\n[material.'a b']\nE = 1", r"material has the name 'a b', expected letters", id="name"),
        pytest.param("rod = []\n[material.a]", r"frame\.toml: material\.a lacks the key 'E'; it has none", id="inside"),
    ],
)
def test_a_wrong_file_is_named_with_the_place_and_what_is_right(tmp_path, text, words):
    with pytest.raises(ModelError, match=words):
        read_value("part: frame", Frame, written(tmp_path, text))


def test_a_table_that_is_no_file_is_named_by_its_argument(tmp_path):
    with pytest.raises(ModelError, match=r"^part: frame: rod\[1\] lacks the key 'end'"):
        read_value("part: frame", Frame, {"rod": [{}]})
    with pytest.raises(ModelError, match=r"^part: frame is 5, expected the path of a \.toml file or its table$"):
        read_value("part: frame", Frame, 5)
    with pytest.raises(ModelError, match=r"none\.toml cannot be read: No such file"):
        read_value("part: frame", Frame, str(tmp_path / "none.toml"))
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(ModelError, match=r"cannot be read: Is a directory"):
        read_value("part: frame", Frame, str(tmp_path / "folder.toml"))
