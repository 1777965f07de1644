"""documentation/index.html of an FMU: description, solver and tables of the variables."""

from lxml import etree

from hfsa.components import Model
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

_STYLE = "body{font:15px sans-serif;margin:2em;max-width:70em}td,th{text-align:left;padding:.2em 1em .2em 0}"


def documentation(model: Model, sources: Sources, version: Version) -> bytes:
    """Return an HTML page with the model's description and a table of its variables in that version of FMI."""
    html = etree.Element("html", {"lang": "en"})
    head = etree.SubElement(html, "head")
    etree.SubElement(head, "meta", {"charset": "utf-8"})
    _text(head, "title", model.name)
    _text(head, "style", _STYLE)
    body = etree.SubElement(html, "body")
    _text(body, "h1", model.name)
    _text(body, "p", model.description + ".")
    if any(v.role is Role.STATE for v in sources.variables):
        _text(body, "p", SOLVERS[sources.solver].sentence)
    if model.is_sampled:
        _text(
            body,
            "p",
            "Ticks are at start time + n sample_time, n = 0, 1, 2, ...; one at the end of a step belongs to the next.",
        )
    for title, roles, remark in _TABLES:
        rows = [v for v in sources.listed(version) if v.role in roles]
        if rows:
            _text(body, "h2", title)
            _text(body, "p", remark)
            _table(body, rows)
    return etree.tostring(html, method="html", encoding="UTF-8", doctype="<!DOCTYPE html>", pretty_print=True)


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
