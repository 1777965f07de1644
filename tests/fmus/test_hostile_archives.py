"""A check of an archive that would do harm: a problem with its place, and nothing is unpacked or expanded."""

import pytest
from hostile_archives import DESCRIPTION, REFUSED, damaged, zipped

from hfsa.fmus import check as rules
from hfsa.fmus.check import examine

DOCTYPE = '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/hostname">]>\n<fmiModelDescription'


@pytest.mark.parametrize("name", [name for name in REFUSED if name not in ("two-ways", "long-directory")])
def test_harm_is_a_problem_of_the_archive(name, tmp_path):
    file = tmp_path / "box.fmu"
    file.write_bytes(REFUSED[name][0])
    report = examine(file)
    assert report.problems
    assert all(problem.startswith("archive: ") and len(problem) < 1000 for problem in report.problems)
    assert [path.name for path in tmp_path.rglob("*")] == ["box.fmu"]


@pytest.mark.parametrize("place", ["modelDescription.xml", "sources/buildDescription.xml"], ids=["model", "build"])
def test_an_entity_is_not_declared(place, tmp_path):
    """Neither in the description nor in that of the build, which has a parser of its own."""
    file = tmp_path / "box.fmu"
    text = DESCRIPTION.replace("<fmiModelDescription", DOCTYPE, 1)
    is_model = place == "modelDescription.xml"
    file.write_bytes(zipped(description=text) if is_model else zipped([(place, text)]))
    (problem,) = examine(file).problems
    assert problem.startswith(f"{place}: line 2: has a document type, which may declare entities")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (DESCRIPTION.replace("<ModelVariables>", "<a>" * 100_000), "line 4: has more than 256 elements"),
        (DESCRIPTION[:-9], "is not well-formed XML"),
        (DESCRIPTION.replace("Box", "B\xf6x").encode("latin-1"), "is not well-formed XML"),
    ],
    ids=["deep", "cut", "latin"],
)
def test_xml_that_cannot_be_read(text, sentence, tmp_path):
    file = tmp_path / "box.fmu"
    file.write_bytes(zipped(description=text))
    (problem,) = examine(file).problems
    assert problem.startswith(f"modelDescription.xml: {sentence}")


def test_damage(tmp_path):
    file = tmp_path / "box.fmu"
    file.write_bytes(damaged())
    assert examine(file).problems == ["archive: resources/text is damaged, its checksum is wrong"]


def test_a_description_that_takes_minutes_is_read_once_only(tmp_path, monkeypatch):
    """Beyond a size the rules are left out, and a warning says so; what cannot be read is a problem still."""
    monkeypatch.setattr(rules, "LONGEST", 100)
    file = tmp_path / "box.fmu"
    file.write_bytes(zipped())
    report = examine(file)
    assert report.problems == []
    (warning,) = report.warnings
    assert "more than 100: schema, rules and a short run are left out" in warning
    file.write_bytes(zipped(description=DESCRIPTION[:-9]))
    assert "is not well-formed XML" in examine(file).problems[0]
