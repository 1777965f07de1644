"""Where a results file comes from: its attributes, the FMUs with their hashes, and the scene with its connections."""

from pathlib import Path

from hfsa.cosim.pages.blocks import Section, folded, paragraph, table
from hfsa.cosim.results.source import Source, read_source
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
    """Return the connections of a scene as a table, and its text."""
    try:
        system = read_scene_text(found.scene).system
    except StructureError:
        return [paragraph(found.scene)] if found.scene else []
    pairs: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for connection in system.connections:
        ends = [system.split(name) for name in (connection.start, connection.end)]
        pairs.setdefault((ends[0][0], ends[1][0]), []).append((ends[0][1], ends[1][1]))
    rows = [
        (start, end, ", ".join(compact([a for a, _ in names])), ", ".join(compact([b for _, b in names])))
        for (start, end), names in pairs.items()
    ]
    tables = [table(["from", "to", "outputs", "inputs"], rows, "Connections")] if rows else []
    return [*tables, folded("The scene as a file", found.scene)]
