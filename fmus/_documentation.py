"""documentation/index.html of an FMU: description, docstrings of its parts, solver and tables of the variables."""

import inspect

from lxml import etree

from hfsa.components import Model
from hfsa.components._modelling.prose import blocks
from hfsa.fmus._icons import ICON
from hfsa.fmus._solvers import SOLVERS
from hfsa.fmus._variables import Role, Variable
from hfsa.fmus.c_code import Sources
from hfsa.fmus.model_description import Version

_TABLES = (
    ("Inputs", (Role.INPUT,), "Real numbers; an input may be set at any communication point."),
    (
        "Outputs",
        (Role.OUTPUT,),
        "Evaluated at every read, also after an input has been set without a step between.",
    ),
    ("Sampled outputs", (Role.SAMPLED_OUTPUT,), "Evaluated at each tick and held until the next."),
    ("Parameters", (Role.PARAMETER,), "Tunable at any communication point unless fixed."),
    ("Solver", (Role.SOLVER,), "Settings of Co-Simulation, fixed after initialization."),
    (
        "Counters",
        (Role.COUNTER,),
        "Work of the solver, rejected communication steps included; not a part of the FMU state, 0 in Model Exchange.",
    ),
    (
        "Input derivatives",
        (Role.INPUT_DERIVATIVE,),
        "Tunable at any communication point: in a step from t an input is u(t + s) = u + u' s + u'' s^2/2.",
    ),
    ("States", (Role.STATE, Role.SAMPLED_STATE), "Their start values may be set before initialization."),
    (
        "Structure",
        (Role.CONSTANT, Role.TEXT),
        "Structural arguments of this FMU and constants computed from them; they cannot be set.",
    ),
)

_STYLE = (
    "body{font:15px sans-serif;margin:2em;max-width:70em}td,th{text-align:left;padding:.2em 1em .2em 0}"
    "pre{background:#f4f4f4;padding:.6em}"
)


def documentation(model: Model, sources: Sources, version: Version) -> bytes:
    """Return an HTML page with the model's description and tables of its variables in that version of FMI.

    Docstrings of the model's parts are sections with their equations.
    """
    html = etree.Element("html", {"lang": "en"})
    head = etree.SubElement(html, "head")
    etree.SubElement(head, "meta", {"charset": "utf-8"})
    _text(head, "title", model.name)
    _text(head, "style", _STYLE)
    body = etree.SubElement(html, "body")
    etree.SubElement(body, "img", {"src": f"../{ICON}", "alt": "", "width": "160", "style": "float:right"})
    _text(body, "h1", model.identifier)
    _text(body, "p", model.description + ".")
    tables = [(title, rows, remark) for title, roles, remark in _TABLES if (rows := _rows(sources, version, roles))]
    _contents(body, [*model.origin.documents, *(title for title, _, _ in tables)])
    if any(v.role is Role.STATE for v in sources.variables):
        _text(body, "p", SOLVERS[sources.solver].sentence)
    if model.is_sampled:
        _text(
            body,
            "p",
            "Ticks are at start time + n sample_time, n = 0, 1, 2, ...; one at the end of a step belongs to the next.",
        )
    for part, text in model.origin.documents.items():
        _heading(body, part)
        _prose(body, text)
    for title, rows, remark in tables:
        _heading(body, title)
        _text(body, "p", remark)
        _table(body, rows)
    return etree.tostring(html, method="html", encoding="UTF-8", doctype="<!DOCTYPE html>", pretty_print=True)


def _rows(sources: Sources, version: Version, roles: tuple[Role, ...]) -> list[Variable]:
    """Return the variables of some roles; texts are told here in both versions."""
    listed = [v for v in sources.listed(version) if v.role is not Role.TEXT]
    texts = [v for v in sources.variables if v.role is Role.TEXT]
    return [v for v in [*listed, *texts] if v.role in roles]


def _contents(body: etree._Element, titles: list[str]) -> None:
    """Add links to the sections of this page, to the code and to the licences."""
    links = [(title, f"#{_anchor(title)}") for title in titles]
    links += [("Equations in C", "../sources/model.c"), ("Licence", "licenses/license.txt")]
    line = etree.SubElement(body, "p")
    for text, target in links:
        link = etree.SubElement(line, "a", {"href": target})
        link.text, link.tail = text, " "


def _heading(body: etree._Element, title: str) -> None:
    """Add the heading of a section, which links lead to."""
    etree.SubElement(body, "h2", {"id": _anchor(title)}).text = title


def _anchor(title: str) -> str:
    """Return the name of a section in links."""
    return title.lower().replace(" ", "-")


def _prose(body: etree._Element, text: str) -> None:
    """Add a docstring: paragraphs, with code in backticks, and equations as they are set."""
    for is_code, lines in blocks(text):
        if is_code:
            _text(body, "pre", inspect.cleandoc("\n".join(["", *lines])).replace("`", ""))
            continue
        paragraph = etree.SubElement(body, "p")
        first, *rest = "\n".join(lines).split("`")
        paragraph.text = first
        for code, after in zip(rest[::2], [*rest[1::2], ""], strict=False):
            element = etree.SubElement(paragraph, "code")
            element.text, element.tail = code, after


def _table(body: etree._Element, rows: list[Variable]) -> None:
    """Add a table of variables."""
    table = etree.SubElement(body, "table")
    header = etree.SubElement(table, "tr")
    for title in ("Name", "Unit", "Start", "Description"):
        _text(header, "th", title)
    for variable in rows:
        start = "" if variable.start is None else str(variable.start)
        more = " (fixed)" if variable.role is Role.PARAMETER and variable.fixed else ""
        row = etree.SubElement(table, "tr")
        for text in (variable.name, variable.unit, start, variable.description + more):
            _text(row, "td", text)


def _text(parent: etree._Element, tag: str, text: str) -> None:
    """Add an element with text."""
    etree.SubElement(parent, tag).text = text
