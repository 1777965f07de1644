"""Packages that cannot be simulated: one sentence with file and place, and nothing outside the cache is touched."""

import io
import stat
import struct
import zipfile

import pytest
from ssp_by_hand import EXPERIMENT, PLAIN, bound, inline, packed, structure

from hfsa.cosim.archives import archive
from hfsa.cosim.assembly.packages import package_of
from hfsa.cosim.systems.errors import StructureError

SYSTEM = PLAIN.format(plant="")
ROOT_PORT = '<ssd:Connectors><ssd:Connector name="u" kind="input"/></ssd:Connectors>'
MORE = "</ssd:Connections>"


def with_link(words: str, inside: str = "") -> str:
    """Return the loop with one more connection."""
    return SYSTEM.replace(MORE, f"<ssd:Connection {words}>{inside}</ssd:Connection>{MORE}")


SYSTEMS = {
    "unknown_element": (
        with_link('startElement="plnt" startConnector="velocity" endElement="pd" endConnector="position"'),
        "line 9: no element is called 'plnt'; did you mean plant?",
    ),
    "unknown_variable": (
        SYSTEM.replace('"force" endElement', '"forces" endElement'),
        "line 8: pd (Pd.fmu) has no variable 'forces'; did you mean force?",
    ),
    "unknown_connector_of_the_system": (
        ROOT_PORT + with_link('startConnector="v" endElement="pd" endConnector="position"'),
        "line 9: the system root has no connector 'v'; there are u",
    ),
    "fed_twice": (
        with_link('startElement="plant" startConnector="velocity" endElement="pd" endConnector="position"'),
        "line 9: pd.position is fed twice, also by ",
    ),
    "two_outputs": (
        with_link('startElement="plant" startConnector="velocity" endElement="pd" endConnector="force"'),
        "line 9: plant.velocity and pd.force both give a value",
    ),
    "two_elements_of_one_name": (
        SYSTEM.replace('name="pd"', 'name="plant"'),
        "two elements are called plant",
    ),
    "no_fmu": (
        SYSTEM.replace("Pd.fmu", "Pdd.fmu"),
        "line 4: there is no resources/Pdd.fmu in the archive; did you mean",
    ),
    "path_that_leaves": (
        SYSTEM.replace("resources/Pd.fmu", "../../etc/passwd"),
        "line 4: source '../../etc/passwd' leaves the archive",
    ),
    "absolute_path": (SYSTEM.replace("resources/Pd.fmu", "/etc/passwd"), "source '/etc/passwd' leaves the archive"),
    "address": (
        SYSTEM.replace("resources/Pd.fmu", "https://example.org/Pd.fmu"),
        "source 'https://example.org/Pd.fmu' is an address",
    ),
    "unknown_type": (
        SYSTEM.replace('name="pd"', 'name="pd" type="application/x-matlab"'),
        "component pd is of type application/x-matlab",
    ),
    "no_name": (SYSTEM.replace('name="pd" ', ""), "line 4: Component lacks the attribute 'name'"),
    "mapping_of_booleans": (
        with_link(
            'startElement="plant" startConnector="velocity" endElement="plant" endConnector="f"',
            "<ssc:BooleanMappingTransformation/>",
        ),
        "BooleanMappingTransformation cannot be simulated",
    ),
    "factor_that_is_no_number": (
        with_link(
            'startElement="plant" startConnector="velocity" endElement="plant" endConnector="f"',
            '<ssc:LinearTransformation factor="two"/>',
        ),
        "LinearTransformation: factor is 'two', expected a number",
    ),
    "value_that_is_no_number": (PLAIN.format(plant=inline("x=one")), "parameter x is 'one', expected a number"),
    "values_of_another_dimension": (
        PLAIN.format(plant=inline("x=1 kg", '<ssc:Unit name="kg"><ssc:BaseUnit kg="1"/></ssc:Unit>')),
        "converts kg to m, expected units of one dimension",
    ),
    "no_parameter_file": (PLAIN.format(plant=bound("x.ssv")), "line 3: there is no x.ssv in the archive"),
    "dictionary_that_nobody_defines": (
        '<ssd:Elements><ssd:SignalDictionaryReference name="d" dictionary="bus"/></ssd:Elements>',
        "no signal dictionary is called 'bus'",
    ),
    "itself": (
        '<ssd:Elements><ssd:Component name="a" source="SystemStructure.ssd"/></ssd:Elements>',
        "lies 21 descriptions deep",
    ),
}


@pytest.mark.parametrize(("system", "sentence"), SYSTEMS.values(), ids=list(SYSTEMS))
def test_a_system_that_does_not_fit(packages, system, sentence):
    file = packages(system)
    with pytest.raises(StructureError) as caught:
        package_of(file)
    assert str(caught.value).startswith(f"{file}: SystemStructure.ssd")
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("beside", "sentence"),
    [
        (EXPERIMENT.replace('"0"', '"5"'), "starts at 5 s, expected 0 s"),
        (EXPERIMENT.replace('"0.5"', '"soon"'), "DefaultExperiment: stopTime is 'soon', expected a number"),
    ],
    ids=["later_start", "no_number"],
)
def test_an_experiment_that_does_not_fit(packages, beside, sentence):
    with pytest.raises(StructureError, match=sentence):
        package_of(packages(SYSTEM, beside))


ENTITY = '<!DOCTYPE x [<!ENTITY all SYSTEM "file:///etc/passwd">]>'
LAUGHS = '<!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>'


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (ENTITY + structure(SYSTEM).replace('"by hand"', '"&all;"'), "entit"),
        (LAUGHS + structure(SYSTEM), "has a document type, which may declare entities"),
        (structure(SYSTEM)[:-20], "is not well-formed XML"),
        ("", "is not well-formed XML"),
        ("<a/>", "the document is a, expected one of http://ssp-standard.org"),
        (structure(SYSTEM, version="3.0"), "is of SSP version 3.0, expected 1.0 or 2.0"),
        (structure(SYSTEM).replace("SSP1", "Draft"), "expected one of http://ssp-standard.org"),
    ],
    ids=["entity_of_a_file", "entities", "cut_off", "empty", "another_document", "version", "draft"],
)
def test_a_document_that_cannot_be_read(tmp_path, text, sentence):
    file = packed(tmp_path / "model.ssp", {"SystemStructure.ssd": text})
    with pytest.raises(StructureError, match=sentence) as caught:
        package_of(file)
    assert str(caught.value).startswith(f"{file}: SystemStructure.ssd")


def linked() -> bytes:
    """An archive with a symbolic link."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as made:
        entry = zipfile.ZipInfo("resources/a.fmu")
        entry.external_attr = (stat.S_IFLNK | 0o777) << 16
        made.writestr(entry, "/etc/passwd")
    return buffer.getvalue()


def archived(name: str, content: bytes, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """An archive of one entry."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as made:
        made.writestr(name, content)
    return buffer.getvalue()


def damaged() -> bytes:
    """An archive whose description has other bytes than it was packed with."""
    whole = archived("SystemStructure.ssd", structure(SYSTEM).encode(), zipfile.ZIP_STORED)
    at = whole.index(b"plant")
    return whole[:at] + b"plane" + whole[at + 5 :]


def encrypted() -> bytes:
    """An archive that says its entry is encrypted."""
    whole = bytearray(archived("SystemStructure.ssd", b"x"))
    at = whole.index(b"PK\x01\x02")
    whole[at + 8 : at + 10] = struct.pack("<H", 1)
    return bytes(whole)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "is not a readable SSP"),
        (b"PK\x03\x04 and no more", "is not a readable SSP"),
        (damaged(), "SystemStructure.ssd is damaged"),
        (archived("another.ssd", b"<a/>"), "there is no SystemStructure.ssd in the archive; there are another.ssd"),
        (archived("../evil.fmu", b"x"), "the entry '../evil.fmu' leaves the archive"),
        (archived("/evil.fmu", b"x"), "the entry '/evil.fmu' leaves the archive"),
        (archived("a\\..\\..\\evil.fmu", b"x"), "leaves the archive"),
        (linked(), "the entry 'resources/a.fmu' is a link"),
        (encrypted(), "is encrypted"),
        (archived("bomb", bytes(archive.NEVER_TOO_LARGE + 1)), "unpacks to 67,108,865 bytes from"),
    ],
    ids=[
        "empty",
        "cut_off",
        "damaged",
        "no_description",
        "upwards",
        "absolute",
        "backslashes",
        "link",
        "encrypted",
        "bomb",
    ],
)
def test_an_archive_that_is_not_unpacked(tmp_path, content, sentence):
    file = tmp_path / "model.ssp"
    file.write_bytes(content)
    with pytest.raises(StructureError) as caught:
        package_of(file)
    assert str(caught.value).startswith(str(file))
    assert sentence in str(caught.value)
    assert [path.name for path in tmp_path.rglob("*")] == ["model.ssp"]


def test_too_many_entries(tmp_path, monkeypatch):
    monkeypatch.setenv("HFSA_MOST_ENTRIES", "2")
    file = packed(tmp_path / "model.ssp", {"a": "", "b": "", "c": ""})
    with pytest.raises(StructureError, match="has 3 entries, expected at most 2"):
        package_of(file)


@pytest.mark.parametrize("verb", ["run", "sweep", "stability", "compare", "trade", "list"])
def test_every_verb_says_the_sentence(hfsa, packages, verb):
    packages(SYSTEM.replace("Pd.fmu", "Pdd.fmu"))
    words = {"compare": ["--over", "plant.x=1,2"], "trade": ["--tolerance", "0.01"]}.get(verb, [])
    file = "./model.ssp" if verb == "list" else "model.ssp"
    code, out, err = hfsa(verb, file, *words)
    assert (code, out) == (2, "")
    assert err.startswith("error: model.ssp: SystemStructure.ssd, line 4: there is no resources/Pdd.fmu in the archive")


def test_a_file_that_is_not_there_and_a_folder(hfsa, tmp_path):
    (tmp_path / "folder.ssp").mkdir()
    assert hfsa("run", "none.ssp")[2] == "error: there is no file none.ssp\n"
    assert "is a folder" in hfsa("run", "folder.ssp")[2]


def test_a_damaged_fmu_in_a_package(packages):
    file = packages(SYSTEM, resources__Broken_dot_fmu="no FMU")
    text = structure(SYSTEM.replace("Pd.fmu", "Broken.fmu"))
    packed(file, {"SystemStructure.ssd": text, "resources/Broken.fmu": "no FMU", "resources/Plant.fmu": "no FMU"})
    with pytest.raises(StructureError, match=r"(Broken|Plant)\.fmu is not a readable FMU"):
        package_of(file)


def test_values_in_a_file_that_are_no_parameter_set(packages):
    system = PLAIN.format(plant=bound("resources/x.ssv"))
    file = packages(system, resources__x_dot_ssv="<a/>")
    with pytest.raises(StructureError, match=r"resources/x.ssv: the document is a, expected ParameterSet"):
        package_of(file)


CIRCLE = """
<ssd:Connectors><ssd:Connector name="y" kind="output"/></ssd:Connectors>
<ssd:Elements>{systems}</ssd:Elements>
<ssd:Connections>
  <ssd:Connection startElement="a" startConnector="out" endElement="b" endConnector="in"/>
  <ssd:Connection startElement="b" startConnector="out" endElement="a" endConnector="in"/>
  <ssd:Connection startElement="a" startConnector="out" endConnector="y"/>
</ssd:Connections>
"""
THROUGH = (
    '<ssd:System name="{0}"><ssd:Connectors><ssd:Connector name="in" kind="inout"/>'
    '<ssd:Connector name="out" kind="inout"/></ssd:Connectors>'
    '<ssd:Connections><ssd:Connection startConnector="in" endConnector="out"/></ssd:Connections></ssd:System>'
)


def test_connectors_of_systems_that_feed_each_other_in_a_circle(packages):
    file = packages(CIRCLE.format(systems=THROUGH.format("a") + THROUGH.format("b")))
    with pytest.raises(StructureError, match="the connection feeds itself"):
        package_of(file)


def test_descriptions_that_use_each_other_again_and_again(tmp_path, monkeypatch):
    monkeypatch.setenv("HFSA_MOST_ENTRIES", "1000")
    use = '<ssd:Elements><ssd:Component name="a" source="{0}"/><ssd:Component name="b" source="{0}"/></ssd:Elements>'
    last = {"x15.ssd": structure("")}
    more = {f"x{k}.ssd": structure(use.format(f"x{k + 1}.ssd")) for k in range(15)}
    file = packed(tmp_path / "model.ssp", {"SystemStructure.ssd": structure(use.format("x0.ssd")), **more, **last})
    with pytest.raises(StructureError, match="more than 1000 elements, those of a description counted as often"):
        package_of(file)


def test_systems_too_deep_within_each_other(packages):
    deep = '<ssd:Elements><ssd:System name="s">' * 101 + "</ssd:System></ssd:Elements>" * 101
    with pytest.raises(StructureError, match="more than 100 systems lie within each other"):
        package_of(packages(deep))
