"""Check of any FMU against the rules of FMI: archive, XML, sources, binary, and a short run.

The order of the checks: archive -> schema -> references -> fmpy's validation and our own rules -> files -> exported
symbols -> a short run of each interface in a child process. A check is skipped if one that it depends on has failed.
"""

import re
import tempfile
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import fmpy
from fmpy.model_description import (
    ModelDescription,
    ValidationError,
    read_build_description,
    read_model_description,
)
from lxml import etree

from hfsa.fmus._archive import XML, archive_problems
from hfsa.fmus._interfaces import INTERFACES, binary_path
from hfsa.fmus._libraries import libraries, misplaced, own_rules, platforms, stray
from hfsa.fmus._platforms import PLATFORMS
from hfsa.fmus._rules import RULES, broken_references, is_ours
from hfsa.fmus._trial import identifier, trial
from hfsa.fmus._xml import xml_problem

_PLAIN = r"[A-Za-z_]\w*(\[\d+\])?(\.[A-Za-z_]\w*(\[\d+\])?)*"
_PLAIN_NAME = re.compile(rf"(?:{_PLAIN}|der\({_PLAIN}\))\Z", re.ASCII)

_BUILD = "sources/buildDescription.xml"

LONGEST = 32 * 1024**2
"""Size [bytes] of a description beyond which only archive and XML are checked: all rules take minutes and gigabytes."""


@dataclass(frozen=True)
class Report:
    """Result of a check.

    Attributes:
        problems: violations of rules.
        warnings: what is valid but may cause difficulties in an importer.
        platforms: folders of the platforms that the FMU has a library for, and `sources`.
    """

    problems: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    platforms: list[str] = field(default_factory=list)


def check(file: Path) -> list[str]:
    """Return the problems of an FMU, each with its location; empty for a valid FMU. No file raises an exception."""
    return examine(file).problems


def examine(file: Path) -> Report:
    """Return problems and warnings of an FMU; no file raises an exception."""
    report = Report()
    report.problems.extend(archive_problems(Path(file)))
    if report.problems:
        return report
    with tempfile.TemporaryDirectory(prefix="hfsa-") as scratch:
        folder = Path(scratch)
        try:
            with zipfile.ZipFile(file) as archive:
                archive.extractall(folder)
        except OSError as error:  # a file and a folder of the same name, a name that is too long, a full disk
            report.problems.append(f"archive: cannot be unpacked ({error})")
        else:
            _folder(folder, report)
    return report


def _folder(folder: Path, report: Report) -> None:
    """Add the platforms, problems and warnings of the unpacked FMU to the report."""
    report.platforms.extend(platforms(folder))
    document = folder / XML
    problems = [f"{name}: {xml_problem(folder / name)}" for name in (XML, _BUILD) if xml_problem(folder / name)]
    if problems:
        report.problems.extend(problems)
        return
    size = document.stat().st_size
    if size > LONGEST:
        report.warnings.append(
            f"{XML} has {size:,} bytes, more than {LONGEST:,}: schema, rules and a short run are left out"
        )
        return
    try:
        root = etree.parse(document, etree.XMLParser(resolve_entities=False)).getroot()
    except etree.XMLSyntaxError as error:  # a text that is too long
        report.problems.append(f"{XML}: is not well-formed XML: {error}")
        return
    found = [*_schema(root)] or [*broken_references(root)]
    if found:
        report.problems.extend(f"{XML}: {problem}" for problem in found)
        return
    try:
        description = read_model_description(folder, validate=False)
    except Exception as error:  # fmpy raises bare exceptions for what it cannot resolve
        report.problems.extend(f"{XML}: {problem}" for problem in _first_lines(error))
        return
    report.problems.extend(f"{XML}: {problem}" for problem in _validation(folder, description))
    report.problems.extend(_sources(folder, root))
    _library_rules(folder, description, report)
    _binaries(folder, description, report)


def _schema(root: etree._Element) -> Iterator[str]:
    """Yield violations of the XML schema of the FMU's version."""
    version = root.get("fmiVersion", "")
    if root.tag != "fmiModelDescription" or not (version == "2.0" or version.startswith("3.")):
        yield f"fmiVersion is {version!r}, expected 2.0 or 3.0"
        return
    major = version[0]
    file = Path(fmpy.__file__).parent / "schema" / f"fmi{major}" / f"fmi{major}ModelDescription.xsd"
    schema = etree.XMLSchema(etree.parse(file))
    if not schema.validate(root):
        for entry in list(schema.error_log):  # type: ignore[call-overload]
            yield f"line {entry.line}: {entry.message}"


def _validation(folder: Path, description: ModelDescription) -> Iterator[str]:
    """Yield the problems of the model description by fmpy's validation, then those by our own rules."""
    try:
        read_model_description(
            folder,
            validate=True,
            validate_variable_names=not _has_plain_names(description),
            validate_model_structure=True,
        )
    except Exception as error:
        yield from _first_lines(error)
    for rule in RULES:
        yield from rule(description)


def _has_plain_names(description: ModelDescription) -> bool:
    """Return whether all names have the most common form; fmpy's grammar, which takes seconds, is for the others."""
    return all(_PLAIN_NAME.match(variable.name) for variable in description.modelVariables)


def _first_lines(error: Exception) -> list[str]:
    """Return the first line of each problem in an exception of fmpy; further lines are internals of its parser."""
    problems = error.problems if isinstance(error, ValidationError) else [str(error) or type(error).__name__]
    return [problem.strip().split("\n")[0] for problem in problems]


def _sources(folder: Path, root: etree._Element) -> Iterator[str]:
    """Yield a problem for each C file that the FMU lists for its build but does not contain."""
    names = {file.get("name", "") for file in root.iterfind("*/SourceFiles/File")}
    if root.get("fmiVersion", "").startswith("3"):
        try:
            builds = read_build_description(folder)
        except Exception as error:  # fmpy raises bare exceptions
            yield f"{_BUILD}: {' '.join(str(error).split())}"
            return
        names = {name for build in builds for files in build.sourceFileSets for name in files.sourceFiles}
    for name in sorted(names):
        if not (folder / "sources" / name).is_file():
            yield f"sources: {name} is listed for the build but missing"


def _binaries(folder: Path, description: ModelDescription, report: Report) -> None:
    """Check the presence of this platform's binary of each interface, and run it.

    An FMU of ours may be for other platforms alone.
    """
    version = description.fmiMajorVersion
    seen: set[Path] = set()
    runnable: list[str] = []
    for interface in INTERFACES:
        element = description.coSimulation if interface == "CoSimulation" else description.modelExchange
        if element is None:
            continue
        library = binary_path(folder, version, identifier(description, interface))
        if not library.is_file() and library not in seen:
            paths = (platform.path(version, library.stem) for platform in PLATFORMS.values())
            is_for_others = is_ours(description) and any(path and (folder / path).is_file() for path in paths)
            (report.warnings if is_for_others else report.problems).append(_no_binary(folder, library))
        seen.add(library)
        if library.is_file():
            if element.needsExecutionTool:
                report.warnings.append(f"{interface}: not run, because it needs an execution tool")
            else:
                runnable.append(interface)
    report.problems.extend(trial(folder, runnable))
    if not seen:
        report.warnings.append("not run: neither Model Exchange nor Co-Simulation")


def _no_binary(folder: Path, library: Path) -> str:
    """Return the message for a missing binary of this platform, with the platforms that the FMU supports."""
    place = library.relative_to(folder).as_posix()
    others = sorted(p.name for p in (folder / "binaries").glob("*") if p.is_dir())
    hint = f"; there are binaries for {', '.join(others)}" if others else ""
    if any((folder / "sources").glob("*.c")):
        hint += "; it can be compiled from its sources"
    return f"binaries: {place} is missing{hint}"


def _library_rules(folder: Path, description: ModelDescription, report: Report) -> None:
    """Check the libraries of all platforms: ours by all rules, others by their place and, here, exported names."""
    version = description.fmiMajorVersion
    report.problems.extend(f"binaries: {problem}" for problem in misplaced(folder, version))
    for library in libraries(folder):
        label = f"binaries: {library.parent.name}/{library.name}"
        if is_ours(description):
            report.problems.extend(f"{label} {problem}" for problem in own_rules(library))
        elif library == binary_path(folder, version, library.stem) and (text := stray(library)):
            report.warnings.append(f"{label} {text}")
