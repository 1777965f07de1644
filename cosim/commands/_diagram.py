"""Block diagram of a scene on the command line: what is known of its parts, its file, and the answer."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hfsa.cosim.assembly.models import AUTO, level_of
from hfsa.cosim.commands import _shell
from hfsa.cosim.experiments.setup import Setup, set_up
from hfsa.cosim.figures.diagram import TEXT, write_diagram
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.results.target import check_diagram, check_picture, picture_format
from hfsa.cosim.systems.diagram import Facts, diagram
from hfsa.cosim.systems.system import Component


def diagram_answer(scene: str, arguments: Mapping[str, str], file: Path) -> tuple[dict[str, Any], str]:
    """Write the block diagram of a scene; return the answer as data and as text.

    Raises:
        ResultsError: a file that cannot be written. StructureError, ModelError: a scene that cannot be set up.
    """
    _check(file)
    setup = set_up(scene, arguments)
    for sentence in setup.disagreements:
        _shell.warn(sentence)
    found = diagram(setup.scene, setup.title, _facts(setup), setup.highest.check().connectors)
    write_diagram(file, found)
    loops = max((link.loop for link in found.links), default=0)
    data = {
        "diagram": file,
        "title": found.title,
        "blocks": [block.name for block in found.blocks],
        "sampled": [block.name for block in found.blocks if block.is_sampled],
        "foreign": [block.name for block in found.blocks if block.is_foreign],
        "links": [{"from": link.start, "to": link.end, "signals": len(link.pairs)} for link in found.links],
        "algebraic_loops": loops,
    }
    system = setup.scene.system
    counts = f"{_count(len(system.components), 'component')}, {_count(len(system.connections), 'connection')}"
    words = f"{found.title}: {counts}" + (f", {_count(loops, 'algebraic loop')}" if loops else "")
    return data, f"{words}\n{file}"


def _count(number: int, noun: str) -> str:
    """Return a number with its noun."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _check(file: Path) -> None:
    """Raise `ResultsError` for a file that cannot be written, before anything is set up."""
    if file.suffix == TEXT:
        check_diagram(file)
        return
    try:
        picture_format(file)
    except ResultsError as error:
        raise ResultsError(f"{error}, or {TEXT} for text") from None
    check_picture(file)


def _facts(setup: Setup) -> dict[str, Facts]:
    """Return what is known of the components of a scene, by name."""
    return {component.name: _facts_of(component, setup.highest) for component in setup.scene.system.components}


def _facts_of(component: Component, highest: Assembly) -> Facts:
    """Return what is known of a component; its level is `auto, up to` the highest one where it is to be chosen."""
    description = highest.descriptions[component.name]
    level = level_of(component) or ""
    if level == AUTO:
        level = f"auto, up to {highest.system[component.name].level}"
    sample_time = description.sample_time(component.start)
    if not component.is_foreign:
        return Facts(level, sample_time)
    tool = description.demands.tool
    return Facts(level, sample_time, f"FMI {description.version}" + (f", {tool}" if tool else ""))
