"""Parts of a report by the kind of a results file."""

from collections.abc import Callable, Sequence
from pathlib import Path

from hfsa.cosim.pages.blocks import Section
from hfsa.cosim.pages.bode_section import bode_section
from hfsa.cosim.pages.map_section import map_section
from hfsa.cosim.pages.provenance import provenance
from hfsa.cosim.pages.report_page import Part
from hfsa.cosim.pages.run_section import run_section
from hfsa.cosim.pages.table_section import table_section
from hfsa.cosim.pages.trade_section import trade_section
from hfsa.cosim.results.files import read_sweep
from hfsa.cosim.results.recorded import read_recorded
from hfsa.cosim.results.run import Run
from hfsa.cosim.results.source import groups_of, read_source
from hfsa.cosim.results.stability_map import read_stability_map
from hfsa.cosim.results.trade import Trade

_SECTIONS: Sequence[tuple[Callable[[set[str]], bool], Callable[[Path], Section]]] = (
    (lambda groups: "bode" in groups, lambda file: bode_section(read_sweep(file))),
    (lambda groups: "time" in groups, lambda file: run_section(Run.read(file), read_recorded(file))),
    (lambda groups: "trade" in groups, lambda file: trade_section(Trade.read(file))),
    (lambda groups: "map/growth" in groups, lambda file: map_section(read_stability_map(file))),
    (lambda _: True, table_section),
)
"""Section on a file by the first of the groups that it has."""


def part_of(file: Path) -> Part:
    """Return the part of a report on a results file; `ResultsError` where it is none."""
    groups = groups_of(file)
    section = next(make(file) for has, make in _SECTIONS if has(groups))
    return Part(f"{read_source(file).attributes.get('title', file.name)} ({file.name})", [section, provenance(file)])


def title_of(files: Sequence[Path]) -> str:
    """Return the titles of files, each once."""
    return ", ".join(dict.fromkeys(read_source(file).attributes.get("title", file.name) for file in files))
