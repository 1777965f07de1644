"""Descriptions of others: any length in one pass, and no entity, file, address or depth harms."""

import tracemalloc

import pytest
from hostile_archives import DESCRIPTION, DOCUMENT, zipped

from hfsa.cosim.fmi.description import describe
from hfsa.cosim.systems.errors import StructureError

HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
LAUGHS = '<!ENTITY a "ha">' + "".join(f'<!ENTITY {chr(98 + k)} "{f"&{chr(97 + k)};" * 10}">' for k in range(9))


def with_type(declared: str, used: str = "Box") -> str:
    """Return the description with a document type, and a text in the place of its name."""
    return DESCRIPTION.replace(HEAD, f"{HEAD}<!DOCTYPE x {declared}>").replace('"Box"', f'"{used}"')


BROKEN = {
    "laughs": (with_type(f"[{LAUGHS}]", "&j;"), "line 2: a document type may declare entities"),
    "file": (with_type('[<!ENTITY a SYSTEM "file:///etc/hostname">]', "&a;"), "line 2: a document type"),
    "address": (with_type('SYSTEM "http://127.0.0.1:9/x.dtd"'), "line 2: a document type"),
    "parameter": (with_type('[<!ENTITY % p SYSTEM "file:///etc/hostname"> %p;]'), "line 2: a document type"),
    "undeclared": (DESCRIPTION.replace('"Box"', '"&a;"'), "not well-formed XML: undefined entity: line 2"),
    "deep": (DESCRIPTION.replace("<ModelVariables>", "<a>" * 100_000), "line 4: there are more than 256 elements"),
    "empty": ("", "is not well-formed XML: no element found"),
    "cut": (DESCRIPTION[:-40], "is not well-formed XML: "),
    "latin": (DESCRIPTION.replace("Box", "B\xf6x").encode("latin-1"), "is not well-formed XML: not well-formed"),
    "nul": (DESCRIPTION.replace("Box", "B\0x"), "is not well-formed XML: not well-formed"),
    "encoding": (DESCRIPTION.replace("UTF-8", "UTF-9"), "is not well-formed XML: unknown encoding"),
    "html": ("<html/>", "is of FMI version None; expected 2.0 or 3.0"),
    "path": (DESCRIPTION.replace('er="Box"', 'er="../../tmp/evil"'), "modelIdentifier '../../tmp/evil', expected the"),
    "causality": (DESCRIPTION.replace('"output"', '"sideways"'), "line 5: y has the causality sideways"),
    "type": (DESCRIPTION.replace("<Real", '<Real declaredType="Nowhere"'), "line 5: y has the declared type 'Nowhere'"),
    "indicators": (DESCRIPTION.replace("guid", 'numberOfEventIndicators="2000000000" guid'), "2000000000 event"),
}


@pytest.mark.parametrize("name", BROKEN, ids=BROKEN)
def test_a_broken_description_is_one_sentence(name, tmp_path):
    text, sentence = BROKEN[name]
    file = tmp_path / "box.fmu"
    file.write_bytes(zipped(description=text))
    with pytest.raises(StructureError) as caught:
        describe(file)
    assert str(caught.value).startswith(str(file))
    assert sentence in str(caught.value)
    assert len(str(caught.value)) < len(str(file)) + 300


@pytest.mark.parametrize("code", ["utf-16", "latin-1", "utf-8-sig"])
def test_an_encoding_that_is_declared_is_read(code, tmp_path):
    file = tmp_path / "box.fmu"
    declared = DESCRIPTION.replace("UTF-8", code.removesuffix("-sig").upper()).replace('"Box"', '"Größe"', 1)
    file.write_bytes(zipped(description=declared.encode(code)))
    assert describe(file).name == "Größe"


def test_an_array_of_a_thousand_million_elements_is_refused(tmp_path):
    file = tmp_path / DOCUMENT
    three = DESCRIPTION.replace("2.0", "3.0").replace("guid", "instantiationToken")
    variable = '<Float64 name="y" valueReference="0" causality="output">{}</Float64>'
    start, end = three.index("<ScalarVariable"), three.index("</ModelVariables>")
    text = three[:start] + variable + three[end:]
    text = text.replace('<Outputs><Unknown index="1"/></Outputs>', '<Output valueReference="0"/>')
    for inside, sentence in {
        '<Dimension start="1000000000"/>': "there are 1,000,000,000 variables, expected at most 2,000,000; .*HFSA_MOST",
        '<Dimension start="-3"/>': "dimension of y .* is -3, expected a whole number from 0",
        '<Dimension valueReference="0"/>': "dimension of y .* is None, expected a whole number",
        '<Dimension valueReference="7"/>': "dimension of y .* is valueReference 7, which no variable has",
    }.items():
        file.write_text(text.format(inside))
        with pytest.raises(StructureError, match=sentence):
            describe(file)
    file.write_text(text.format('<Dimension start="2"/><Dimension start="3"/>'))
    assert list(describe(file).variables) == [f"y[{i},{j}]" for i in (1, 2) for j in (1, 2, 3)]


def test_a_long_description_costs_little_memory(tmp_path):
    """Each of 20,000 variables takes less than a kilobyte, the whole way from the archive to the connectors."""
    count = 20_000
    more = "".join(
        f'<ScalarVariable name="x{k}" valueReference="{k}" causality="local"><Real/></ScalarVariable>\n'
        for k in range(count)
    )
    file = tmp_path / "long.fmu"
    file.write_bytes(zipped(description=DESCRIPTION.replace("</ModelVariables>", more + "</ModelVariables>")))
    tracemalloc.start()
    try:
        found = describe(file)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(found.variables) == count + 1
    assert peak < 1000 * count


def test_more_variables_than_allowed(tmp_path, monkeypatch):
    monkeypatch.setenv("HFSA_MOST_VARIABLES", "1")
    file = tmp_path / DOCUMENT
    more = '<ScalarVariable name="z" valueReference="1"><Real/></ScalarVariable></ModelVariables>'
    file.write_text(DESCRIPTION.replace("</ModelVariables>", more))
    with pytest.raises(StructureError, match=r"line 6: there are more than 1 variables; .*HFSA_MOST_VARIABLES"):
        describe(file)
