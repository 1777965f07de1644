"""The check finds no problem in FMUs of hfsa, finds every seeded fault, and accepts any binary file."""

import random
import re
import shutil
import struct
import subprocess
import zipfile
from pathlib import Path

import pytest
from lxml import etree

from hfsa.fmus._binary import read_binary
from hfsa.fmus._interfaces import all_functions, binary_path, functions
from hfsa.fmus._trial import trial
from hfsa.fmus.check import check, examine
from hfsa.fmus.compile import FLAGS, compiler
from hfsa.fmus.export import pack


def contents(file: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(file) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def edited(file: Path, folder: Path, edit) -> Path:
    """A copy whose modelDescription.xml went through `edit(root)`."""
    files = contents(file)
    root = etree.fromstring(files["modelDescription.xml"])
    edit(root)
    files["modelDescription.xml"] = etree.tostring(root)
    pack(folder / "edited.fmu", files)
    return folder / "edited.fmu"


def variable(root, name):
    """The element that holds unit, start and bounds."""
    found = root.find(f"ModelVariables/*[@name='{name}']")
    return found[0] if found.tag == "ScalarVariable" else found


def setting(path, **attributes):
    """An edit: set attributes (`None` deletes) of the first element at `path`, or of the variable `path` ends with."""

    def edit(root):
        element = variable(root, path[1:]) if path.startswith("@") else root.find(path)
        for name, value in attributes.items():
            if value is None:
                del element.attrib[name]
            else:
                element.set(name, value)

    return edit


def renamed(old, new):
    return lambda root: root.find(f"ModelVariables/*[@name='{old}']").set("name", new)


def without(path):
    def edit(root):
        element = root.find(path)
        element.getparent().remove(element)

    return edit


def doubled(path):
    def edit(root):
        element = root.find(path)
        element.addnext(etree.fromstring(etree.tostring(element)))

    return edit


def misnamed_token(root):
    root.set("guide", root.attrib.pop("guid"))


def zero_based(root):
    for name in ("der(mass.position)", "der(mass.velocity)"):
        variable(root, name).set("derivative", str(int(variable(root, name).get("derivative")) - 1))


OUTPUT = "ModelStructure/Outputs/Unknown"
SLOPE = "ModelStructure/Derivatives/Unknown[2]"
UNIT = "UnitDefinitions/Unit[@name='m']"

FAULTS_2 = {
    "input without start": (setting("@base.position", start=None), "base.position"),
    "outputs empty": (without("ModelStructure/Outputs"), "ModelStructure/Outputs"),
    "unit not defined": (setting("@position", unit="furlong"), "furlong"),
    "token misnamed": (misnamed_token, "guid"),
    "two variables of one name": (renamed("position", "mass.position"), "not unique"),
    "index 0": (setting(OUTPUT, index="0"), "index 0"),
    "dependency that is no variable": (setting(OUTPUT, dependencies="99"), "index 99"),
    "indices from 0 in derivative": (zero_based, "cannot be a state"),
    "derivative twice": (setting("@der(mass.velocity)", derivative="2"), "2 derivatives"),
    "derivative not listed": (without(SLOPE), "does not list"),
    "output listed twice": (doubled(OUTPUT), "expected once"),
    "initial unknown forgotten": (without("ModelStructure/InitialUnknowns/Unknown[3]"), "InitialUnknowns"),
    "initial unknown of wrong kind": (
        setting("ModelStructure/InitialUnknowns/Unknown[1]", dependenciesKind="tunable"),
        "expected constant or dependent",
    ),
    "dependencies in disorder": (setting(SLOPE, dependencies="6 3 2"), "are not ascending"),
    "dependency on a derivative": (setting(OUTPUT, dependencies="4"), "neither input, continuous state, parameter nor"),
    "kinds fewer than dependencies": (setting(SLOPE, dependenciesKind="tunable"), "do not match"),
    "start below min": (setting("@stiffness", start="-1.0"), "outside"),
    "start not a number": (setting("@stiffness", start="NaN"), "finite"),
    "min above max": (setting("@stiffness", max="-5"), "above max"),
    "nominal 0": (setting("@position", nominal="0"), "nominal"),
    "start of a calculated variable": (setting("@position", start="1.0"), "position"),
    "name not structured": (renamed("position", "the position"), "the position"),
    "unit twice": (doubled(UNIT), "defined 2 times"),
    "factor 0": (setting(f"{UNIT}/DisplayUnit", factor="0"), "factor"),
    "stop before start": (setting("DefaultExperiment", stopTime="-1"), "stopTime"),
    "step 0": (setting("DefaultExperiment", stepSize="0"), "stepSize"),
    "source file missing": (setting("CoSimulation/SourceFiles/File", name="gone.c"), "gone.c"),
    "identifier not in C": (setting("CoSimulation", modelIdentifier="Mass-On-Spring"), "C identifier"),
    "binary under another name": (setting("ModelExchange", modelIdentifier="Other"), "is missing"),
    "shared reference, two units": (
        lambda root: root.find("ModelVariables/*[@name='mass']").set("valueReference", "7"),
        "units differ",
    ),
    "serialise without get": (setting("CoSimulation", canGetAndSetFMUstate="false"), "serialise"),
    "no description": (
        lambda root: root.find("ModelVariables/*[@name='mass']").attrib.pop("description"),
        "description",
    ),
    "FMI 1": (setting(".", fmiVersion="1.0"), "expected 2.0 or 3.0"),
}

FAULTS_3 = {
    "input without start": (setting("@base.position", start=None), "base.position"),
    "output not listed": (without("ModelStructure/Output"), "Outputs"),
    "unit not defined": (setting("@position", unit="furlong"), "furlong"),
    "two variables of one name": (renamed("position", "mass.position"), "not unique"),
    "one reference twice": (setting("@time", valueReference="2"), "same value reference"),
    "reference to nothing": (setting("ModelStructure/Output", valueReference="99"), "value reference 99"),
    "initial unknown forgotten": (without("ModelStructure/InitialUnknown"), "InitialUnknowns"),
    "start above max": (setting("@stiffness", max="5"), "outside"),
    "nominal negative": (setting("@position", nominal="-1"), "nominal"),
    "no independent variable": (setting("@time", causality="local"), "independent"),
}


FAULTS_OF_THE_PAIR = {
    "another guid": (2, setting(".", guid="{other}"), "Co-Simulation: instantiation"),
    "another token": (3, setting(".", instantiationToken="{other}"), "Model Exchange: instantiation"),
    "a state too few": (3, without("ModelStructure/ContinuousStateDerivative"), "has 2 continuous states"),
}
"""Faults that only the description and the binary together show."""


@pytest.fixture
def no_run(monkeypatch):
    """Leave out the run of the binary: the fault is in the file."""
    monkeypatch.setattr("hfsa.fmus.check.trial", lambda folder, interfaces: [])


@pytest.mark.parametrize(("version", "edit", "words"), FAULTS_OF_THE_PAIR.values(), ids=FAULTS_OF_THE_PAIR)
def test_a_seeded_fault_is_found_by_running(mass_on_spring_files, tmp_path, version, edit, words):
    problems = check(edited(mass_on_spring_files[version], tmp_path, edit))
    assert any(words in problem for problem in problems), problems


@pytest.mark.usefixtures("no_run")
@pytest.mark.parametrize(("edit", "words"), FAULTS_2.values(), ids=FAULTS_2)
def test_a_seeded_fault_is_found_in_fmi2(mass_on_spring_files, tmp_path, edit, words):
    problems = check(edited(mass_on_spring_files[2], tmp_path, edit))
    assert any(words in problem for problem in problems), problems


@pytest.mark.usefixtures("no_run")
@pytest.mark.parametrize(("edit", "words"), FAULTS_3.values(), ids=FAULTS_3)
def test_a_seeded_fault_is_found_in_fmi3(mass_on_spring_files, tmp_path, edit, words):
    problems = check(edited(mass_on_spring_files[3], tmp_path, edit))
    assert any(words in problem for problem in problems), problems


@pytest.mark.parametrize("version", [2, 3])
def test_an_untouched_copy_is_clean(mass_on_spring_files, tmp_path, version):
    """So that what the faults above show is the fault, not the copying."""
    report = examine(edited(mass_on_spring_files[version], tmp_path, lambda root: None))
    assert report.problems == []
    assert report.warnings == []


# Archives -------------------------------------------------------------------------------------------------------------


def damaged(data: bytes) -> bytes:
    """Flip bytes inside the first member's compressed data."""
    start = 30 + sum(struct.unpack_from("<HH", data, 26)) + 40
    return data[:start] + bytes(b ^ 0xFF for b in data[start : start + 8]) + data[start + 8 :]


BROKEN = {
    "no zip": (lambda data: b"This is a letter.", "zip"),
    "empty": (lambda data: b"", "zip"),
    "cut short": (lambda data: data[: len(data) // 2], "zip"),
    "damaged": (damaged, "archive"),
}


@pytest.mark.parametrize(("change", "words"), BROKEN.values(), ids=BROKEN)
def test_a_broken_archive_is_a_problem(mass_on_spring_files, tmp_path, change, words):
    file = tmp_path / "broken.fmu"
    file.write_bytes(change(mass_on_spring_files[2].read_bytes()))
    (problem,) = check(file)
    assert words in problem


def test_a_missing_file_is_a_problem(tmp_path):
    assert "does not exist" in check(tmp_path / "none.fmu")[0]
    assert "not a file" in check(tmp_path)[0]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("../escape.txt", "outside"),
        ("/etc/escape.txt", "outside"),
        ("resources\\a.txt", "backslash"),
        ("documentation/index.html", "2 times"),
    ],
)
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_a_bad_member_is_a_problem(mass_on_spring_files, tmp_path, name, words):
    file = shutil.copy(mass_on_spring_files[2], tmp_path / "bad.fmu")
    with zipfile.ZipFile(file, "a") as archive:
        archive.writestr(name, "text")
    assert any(words in problem for problem in check(file))
    assert not (tmp_path / "escape.txt").exists()


def test_a_file_in_the_place_of_a_folder_is_a_problem(mass_on_spring_files, tmp_path):
    pack(tmp_path / "clash.fmu", {**contents(mass_on_spring_files[2]), "documentation": b"a file"})
    (problem,) = check(tmp_path / "clash.fmu")
    assert "cannot be unpacked" in problem


def test_a_foreign_compression_is_a_problem(mass_on_spring_files, tmp_path):
    with zipfile.ZipFile(tmp_path / "lzma.fmu", "w", zipfile.ZIP_LZMA) as archive:
        for name, data in contents(mass_on_spring_files[2]).items():
            archive.writestr(name, data)
    assert any("neither stored nor deflated" in problem for problem in check(tmp_path / "lzma.fmu"))


def changed(file: Path, folder: Path, changes: dict[str, bytes | None]) -> Path:
    """A copy with members replaced, or left out (`None`)."""
    files = {**contents(file), **changes}
    pack(folder / "changed.fmu", {name: data for name, data in files.items() if data is not None})
    return folder / "changed.fmu"


def test_a_missing_or_malformed_description_is_a_problem(mass_on_spring_files, tmp_path):
    file = mass_on_spring_files[2]
    assert "no modelDescription.xml" in check(changed(file, tmp_path, {"modelDescription.xml": None}))[0]
    assert "well-formed" in check(changed(file, tmp_path, {"modelDescription.xml": b"<fmiModelDescription"}))[0]
    assert "fmiVersion" in check(changed(file, tmp_path, {"modelDescription.xml": b"<letter/>"}))[0]


def test_a_nested_folder_is_pointed_at(mass_on_spring_files, tmp_path):
    pack(tmp_path / "nested.fmu", {f"Mass/{name}": data for name, data in contents(mass_on_spring_files[2]).items()})
    (problem,) = check(tmp_path / "nested.fmu")
    assert "Mass/modelDescription.xml" in problem


# Binaries -------------------------------------------------------------------------------------------------------------


def library(version: int) -> str:
    return binary_path(Path(), version, "MassOnSpring").as_posix()


@pytest.mark.parametrize("version", [2, 3])
def test_our_binary_exports_fmi_and_nothing_else(mass_on_spring_files, tmp_path, version):
    file = tmp_path / "library"
    file.write_bytes(contents(mass_on_spring_files[version])[library(version)])
    binary = read_binary(file)
    assert binary
    assert binary.exported == all_functions()


@pytest.mark.parametrize("keep", [0, 10, 5000])
def test_a_binary_that_cannot_be_loaded_is_a_problem(mass_on_spring_files, tmp_path, keep):
    files = contents(mass_on_spring_files[2])
    files[library(2)] = files[library(2)][:keep]
    pack(tmp_path / "cut.fmu", files)
    problems = check(tmp_path / "cut.fmu")
    assert any("Model Exchange: loading" in problem for problem in problems)
    assert any("Co-Simulation: loading" in problem for problem in problems)


def test_a_missing_binary_is_a_problem(mass_on_spring_files, tmp_path):
    files = contents(mass_on_spring_files[2])
    files["binaries/win63/MassOnSpring.dll"] = files.pop(library(2))
    pack(tmp_path / "none.fmu", files)
    (problem,) = check(tmp_path / "none.fmu")
    assert library(2) in problem
    assert "win63" in problem
    assert "compiled from its sources" in problem


def foreign(file: Path, folder: Path, body: str, leave_out: str = "") -> Path:
    """A Co-Simulation FMU of somebody else: every function returns OK, but for the definitions in `body`."""
    export = '__attribute__((visibility("default")))'
    own = {"fmi2Instantiate": f"{export} void* fmi2Instantiate(void) {{ return &here; }}"}
    names = functions(2)["CoSimulation"] - {leave_out}
    lines = [
        own.get(name, f"{export} int {name}(void) {{ return 0; }}") for name in sorted(names) if f" {name}(" not in body
    ]
    code = "\n".join(["#include <stdlib.h>", "static int here;", body.replace("EXPORT", export), *lines])
    (folder / "foreign.c").write_text(code + "\n")
    binary = folder / "foreign.so"
    subprocess.run([*compiler(), *FLAGS, "-shared", str(folder / "foreign.c"), "-o", str(binary)], check=True)

    files = contents(file)
    files[library(2)] = binary.read_bytes()
    root = etree.fromstring(files["modelDescription.xml"])
    root.set("generationTool", "Somebody's tool")
    root.remove(root.find("ModelExchange"))
    files["modelDescription.xml"] = etree.tostring(root)
    pack(folder / "foreign.fmu", files)
    return folder / "foreign.fmu"


DEATHS = {
    "crash": ("EXPORT int fmi2DoStep(void) { abort(); }", "step of 0.002 s: the binary crashed with SIGABRT"),
    "end": ("EXPORT int fmi2DoStep(void) { exit(3); }", "ended the process with exit code 3"),
    "end without complaint": (
        "EXPORT int fmi2DoStep(void) { exit(0); }",
        "step of 0.002 s: the binary ended the process",
    ),
    "crash at the start": ("EXPORT int fmi2EnterInitializationMode(void) { abort(); }", "initialization: the binary"),
    "error": ("EXPORT int fmi2DoStep(void) { return 3; }", "fmi2DoStep failed with status 3"),
    "refusal": ("EXPORT void* fmi2Instantiate(void) { return 0; }", "instantiation"),
    "not a number": (
        "EXPORT int fmi2GetReal(void* c, const unsigned* r, size_t n, double* v)"
        " { (void)c; (void)r; while (n--) v[n] = 0.0 / here; return 0; }",
        "position is nan",
    ),
}


@pytest.mark.parametrize(("body", "words"), DEATHS.values(), ids=DEATHS)
def test_a_foreign_binary_takes_only_its_own_process(mass_on_spring_files, tmp_path, body, words):
    problems = check(foreign(mass_on_spring_files[2], tmp_path, body))
    assert any(words in problem for problem in problems), problems


def test_a_foreign_binary_that_behaves_is_clean_but_for_its_stray_names(mass_on_spring_files, tmp_path):
    body = "EXPORT int helper(void) { return 1; }"
    report = examine(foreign(mass_on_spring_files[2], tmp_path, body))
    assert report.problems == []
    (warning,) = report.warnings
    assert "helper" in warning


def test_a_missing_function_is_named(mass_on_spring_files, tmp_path):
    problems = check(foreign(mass_on_spring_files[2], tmp_path, "", leave_out="fmi2Reset"))
    assert any("does not export fmi2Reset" in problem for problem in problems)


def test_a_binary_that_hangs_is_given_up(mass_on_spring_files, tmp_path):
    body = "static volatile int turns; EXPORT int fmi2DoStep(void) { for (;;) turns++; }"
    file = foreign(mass_on_spring_files[2], tmp_path, body)
    with zipfile.ZipFile(file) as archive:
        archive.extractall(tmp_path / "unpacked")
    (problem,) = trial(tmp_path / "unpacked", ["CoSimulation"], timeout=5)
    assert "did not return within 5 s" in problem
    assert "step of" in problem


@pytest.mark.usefixtures("no_run")
@pytest.mark.parametrize("version", [2, 3])
def test_no_random_damage_is_more_than_a_problem(mass_on_spring_files, tmp_path, version):
    """Bytes of the archive, letters and attribute values of the description, changed at random: never an exception."""
    file, original = tmp_path / "random.fmu", mass_on_spring_files[version].read_bytes()
    description = contents(mass_on_spring_files[version])["modelDescription.xml"].decode()
    found = 0
    for seed in range(20):
        rng = random.Random(seed)
        data = bytearray(original)
        for _ in range(3):
            data[rng.randrange(len(data))] = rng.randrange(256)
        file.write_bytes(data)
        check(file)

        at = rng.randrange(len(description))
        letters = description[:at] + rng.choice("019<>&\"' -.") + description[at + 1 :]
        old, new = (rng.choice(re.findall(r'"[^"]*"', description)) for _ in range(2))
        values = description.replace(old, rng.choice([new, '""', '"-1"', '"1e400"', '"é"']), 1)
        for text in (letters, values):
            found += bool(
                check(changed(mass_on_spring_files[version], tmp_path, {"modelDescription.xml": text.encode()}))
            )
    assert found > 20
