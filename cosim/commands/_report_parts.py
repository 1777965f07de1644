"""Parts of a report by the kind of a results file."""

from collections.abc import Callable, Sequence
from pathlib import Path

from hfsa.components._modelling.errors import ModelError
from hfsa.cosim.commands._bodies import moving_bodies
from hfsa.cosim.pages.blocks import Section
from hfsa.cosim.pages.bode_section import bode_section
from hfsa.cosim.pages.machine_section import machine_section
from hfsa.cosim.pages.map_section import map_section
from hfsa.cosim.pages.provenance import provenance
from hfsa.cosim.pages.report_page import Part
from hfsa.cosim.pages.run_section import run_section
from hfsa.cosim.pages.table_section import table_section
from hfsa.cosim.pages.trade_section import trade_section
from hfsa.cosim.results.choices import read_scene
from hfsa.cosim.results.files import read_sweep
from hfsa.cosim.results.recorded import TIME, read_recorded
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.results.run import Run
from hfsa.cosim.results.source import groups_of, read_source
from hfsa.cosim.results.stability_map import read_stability_map
from hfsa.cosim.results.trade import Trade
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene_file import read_scene_text


def _of_run(file: Path) -> list[Section]:
    """Return the sections on a run: its signals, and the machines that moved where any can be drawn."""
    recorded = read_recorded(file)
    sections = [run_section(Run.read(file), recorded)]
    if recorded.axis == TIME:
        try:
            bodies, sentences = moving_bodies(recorded, read_scene_text(read_scene(file)).system)
        except (ModelError, ResultsError, StructureError) as error:  # a file of another version, or without its scene
            bodies, sentences = [], [f"no machine is drawn: {error}"]
        sections += [machine_section(recorded, bodies, sentences)] if bodies or sentences else []
    return sections


_SECTIONS: Sequence[tuple[Callable[[set[str]], bool], Callable[[Path], list[Section]]]] = (
    (lambda groups: "bode" in groups, lambda file: [bode_section(read_sweep(file))]),
    (lambda groups: "time" in groups, _of_run),
    (lambda groups: "trade" in groups, lambda file: [trade_section(Trade.read(file))]),
    (lambda groups: "map/growth" in groups, lambda file: [map_section(read_stability_map(file))]),
    (lambda _: True, lambda file: [table_section(file)]),
)
"""Sections on a file by the first of the groups that it has."""


def part_of(file: Path) -> Part:
    """Return the part of a report on a results file; `ResultsError` where it is none."""
    groups = groups_of(file)
    sections = next(make(file) for has, make in _SECTIONS if has(groups))
    return Part(f"{read_source(file).attributes.get('title', file.name)} ({file.name})", [*sections, provenance(file)])


def title_of(files: Sequence[Path]) -> str:
    """Return the titles of files, each once."""
    return ", ".join(dict.fromkeys(read_source(file).attributes.get("title", file.name) for file in files))
