"""Conventions of names in an FMU of another maker, as a scene declares them.

    file = following(Path("Valve.fmu"))        # a copy whose description says so, from the cache

FMUs that hfsa has made say by their generation tool that their names mean something. A copy that says the same is read
alike in every process, also on another machine.
"""

import hashlib
import tempfile
import zipfile
from pathlib import Path

from lxml import etree

from hfsa.components._modelling.cache import cache_subfolder
from hfsa.cosim.archives.archive import Archive
from hfsa.cosim.archives.xml import parse
from hfsa.cosim.fmi.description import CONVENTIONS

_DESCRIPTION = "modelDescription.xml"


def following(file: Path) -> Path:
    """Return a copy of an FMU that declares our conventions."""
    folder = cache_subfolder("conventions") / hashlib.sha256(file.read_bytes()).hexdigest()[:32]
    folder.mkdir(exist_ok=True)
    copy = folder / file.name
    if not copy.is_file():
        with tempfile.NamedTemporaryFile(dir=folder, delete=False) as unfinished:
            _declare(file, Path(unfinished.name))
        Path(unfinished.name).rename(copy)
    return copy


def _declare(file: Path, copy: Path) -> None:
    """Write a copy of an FMU with our name before that of its generation tool."""
    with Archive(file, str(file), "FMU") as archive, zipfile.ZipFile(copy, "w", zipfile.ZIP_DEFLATED) as other:
        for name in archive.names:
            content = archive.read(name, str(file))
            if name == _DESCRIPTION:
                root = parse(content, f"{file}: {name}")
                root.set("generationTool", f"{CONVENTIONS}conventions, {root.get('generationTool', 'unknown tool')}")
                content = etree.tostring(root, xml_declaration=True, encoding="UTF-8")
            other.writestr(name, content)
