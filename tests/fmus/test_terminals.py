"""Terminals, icons and documentation of an FMU."""

import io
import zipfile
from pathlib import Path

import fmpy
import pytest
from lxml import etree
from PIL import Image

import hfsa.components
import hfsa.controllers
from hfsa.components import Model
from hfsa.components._modelling.catalogue import find
from hfsa.fmus._documentation import documentation
from hfsa.fmus._icons import icons
from hfsa.fmus._terminals import terminals, terminals_and_icons
from hfsa.fmus.c_code import generate

PARTS = find([hfsa.components, hfsa.controllers])
SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3TerminalsAndIcons.xsd"
VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])


def of(part: str, level: str | None = None) -> dict:
    """Terminals of a part by name."""
    return {t.name: t for t in terminals(generate(PARTS[part].model(level)).variables)}


def test_every_part_is_valid_by_the_schema(part_model):
    sources = generate(part_model)
    document = etree.fromstring(terminals_and_icons(sources.variables))
    etree.XMLSchema(etree.parse(SCHEMA)).assertValid(document)
    names = {v.name for v in sources.variables}
    members = [m.get("variableName") for m in document.iter("TerminalMemberVariable")]
    assert set(members) <= names
    assert len(set(members)) == len(members)
    half = 100
    for place in document.iter("TerminalGraphicalRepresentation"):
        assert all(-half <= float(place.get(corner)) <= half for corner in ("x1", "y1", "x2", "y2"))
    places = [tuple(p.get(corner) for corner in ("x1", "y1")) for p in document.iter("TerminalGraphicalRepresentation")]
    assert len(set(places)) == len(places)


def test_the_tube_of_a_drive_fits_that_of_the_robot():
    """A plug fits where all members do, by name and by direction against each other."""
    tube, drives = of("c_drive")["tube"], [of("sdelta")[f"drive[{j}]"] for j in (1, 2, 3)]
    for drive in drives:
        assert tube.is_flange
        assert drive.is_flange
        assert set(tube.members) == set(drive.members)
        assert tube.kind == drive.kind == "org.hfsa.tube"
        for name, variable in tube.members.items():
            assert {variable.role.value, drive.members[name].role.value} == {"input", "output"}
            assert variable.unit == drive.members[name].unit


def test_kinds_of_terminals():
    robot, drive = of("sdelta"), of("c_drive")
    assert robot["platform"].kind == "org.hfsa.platform"
    assert robot["wrench"].kind == "org.hfsa.wrench"
    assert drive["motor[1]"].kind == "org.hfsa.motor"
    assert not robot["platform"].is_flange
    assert of("pd")["axis[1]"].kind == ""


def test_a_model_without_structured_names_has_no_terminals():
    m = Model("Plain", "Doubles")
    m.output("y", 2 * m.input("u", "1", "In"), "1", "Out")
    document = etree.fromstring(terminals_and_icons(generate(m).variables))
    assert document.find("Terminals") is None
    etree.XMLSchema(etree.parse(SCHEMA)).assertValid(document)


@VERSIONS
def test_files_in_the_archive(mass_on_spring_files, version):
    with zipfile.ZipFile(mass_on_spring_files[version]) as archive:
        names = set(archive.namelist())
        page = archive.read("documentation/index.html").decode()
        icon = Image.open(io.BytesIO(archive.read("terminalsAndIcons/icon.png")))
    assert {f"terminalsAndIcons/{n}" for n in ("terminalsAndIcons.xml", "icon.svg", "terminal.png")} <= names
    assert ("model.png" in names) == (version == 2)  # where FMI 2 has the icon
    assert icon.size[0] == icon.size[1] >= 100
    assert len(icon.convert("L").getcolors()) > 2
    assert "../terminalsAndIcons/icon.png" in page


def test_the_icon_tells_name_and_ports():
    found = terminals(generate(PARTS["c_drive"].model()).variables)
    svg = etree.fromstring(icons("CDrive_rotor", found)["terminalsAndIcons/icon.svg"])
    texts = {text.text for text in svg.iter("{*}text")}
    assert texts == {"CDrive_rotor", "motor[1]", "motor[2]", "tube", "command"}
    assert icons("A", found) == icons("A", found)
    assert icons("A", found) != icons("B", found)


@VERSIONS
def test_the_page_has_the_equations_and_working_links(version):
    model = PARTS["c_drive"].model("rotor")
    page = documentation(model, generate(model), version).decode()
    html = etree.HTML(page)
    assert "J_m thetadd = tau + J_C^T [F; T]" in "".join(html.find(".//pre").itertext())
    targets = {element.get("id") for element in html.iter() if element.get("id")}
    links = [link.get("href") for link in html.iter("a")]
    assert {link.removeprefix("#") for link in links if link.startswith("#")} == targets
    assert "../sources/model.c" in links
    assert html.find(".//h1").text == "CDrive_rotor"
    cells = {cell.text for cell in html.iter("td")}
    assert {"level", "rotor", "motor[1].torque", "N.m"} <= cells


def test_nothing_of_a_docstring_is_lost_on_the_page():
    for name, part in PARTS.items():
        if part.build:
            model = part.model()
            page = etree.HTML(documentation(model, generate(model), 3).decode())
            words = "".join("".join(page.itertext()).split())
            for line in (part.module.__doc__ or "").replace("`", "").splitlines():
                assert "".join(line.split()) in words, (name, line)
