"""Where a results file comes from: its attributes, the FMUs with their hashes, and the scene with its blocks."""

from pathlib import Path

from hfsa.cosim.figures.diagram import diagram_figure, svg
from hfsa.cosim.figures.diagram_layout import is_available, layout
from hfsa.cosim.pages.blocks import Section, folded, paragraph, picture, table
from hfsa.cosim.results.source import Source, read_source
from hfsa.cosim.systems.diagram import Diagram, Facts, diagram
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import compact
from hfsa.cosim.systems.scene_file import read_scene_text

_HASH = 16
"""Digits of a hash that are shown."""


def provenance(file: Path) -> Section:
    """Return the section on the origin of a results file."""
    found = read_source(file)
    blocks = [table(["", ""], [(name.replace("_", " "), value) for name, value in found.attributes.items() if value])]
    if found.instances:
        rows = [
            (one.instance, one.name, one.level or "-", f"{one.fmi_version}", one.solver or "-", one.sha256[:_HASH])
            for one in found.instances
        ]
        blocks.append(table(["instance", "FMU", "level", "FMI", "solver", "sha256"], rows, "FMUs"))
    blocks += [paragraph(words) for words in found.sentences]
    blocks += _scene(found)
    return Section("Origin", blocks)


def _scene(found: Source) -> list[str]:
    """Return the block diagram of a scene, its connections as a table, and its text."""
    try:
        scene = read_scene_text(found.scene)
    except StructureError:
        return [paragraph(found.scene)] if found.scene else []
    facts = {one.instance: Facts(one.level, one.sample_time) for one in found.instances}
    made = diagram(scene, found.attributes.get("title", "Scene"), facts)
    rows = [(link.start, link.end, *(", ".join(compact(names)) for names in link.names)) for link in made.links]
    tables = [table(["from", "to", "outputs", "inputs"], rows, "Connections")] if rows else []
    return [*_picture(made), *tables, folded("The scene as a file", found.scene)]


def _picture(made: Diagram) -> list[str]:
    """Return the picture of a diagram; none without the library that places its blocks."""
    if not is_available():
        return []
    drawn = svg(made, diagram_figure(made, layout(made)))
    remark = "Algebraic loops and conversions of units are not marked, as the file does not have them."
    return [picture(drawn, "image/svg+xml", f"{made.title}: {made.description}"), paragraph(remark)]
