"""Rules of the standard's schemas: documents of version 1 in a package are validated by those that fmpy brings."""

from functools import cache
from pathlib import Path

import fmpy
from lxml import etree

from hfsa.cosim.archives.archive import Archive, read_file
from hfsa.cosim.archives.xml import parse
from hfsa.cosim.ssp.vocabulary import MAIN
from hfsa.cosim.systems.errors import StructureError

_SCHEMAS = {
    ".ssd": "SystemStructureDescription.xsd",
    ".ssv": "SystemStructureParameterValues.xsd",
    ".ssm": "SystemStructureParameterMapping.xsd",
    ".ssb": "SystemStructureSignalDictionary.xsd",
}


def schema_problems(file: Path) -> list[str]:
    """Return a sentence for each place where a document of a package breaks its schema; none for other versions.

    `StructureError` for an archive that cannot be read, or has no description.
    """
    archive = Archive(read_file(file), str(file))
    archive.read(MAIN, str(file))
    found: list[str] = []
    for name in archive.names:
        schema = _SCHEMAS.get(Path(name).suffix)
        if schema is None:
            continue
        try:
            root = parse(archive.read(name, str(file)), name)
        except StructureError as error:
            found.append(str(error))
            continue
        validator = _validator(schema)
        if root.get("version", "1.0").startswith("1.") and not validator.validate(root):
            errors = iter(validator.error_log)  # type: ignore[call-overload] (the stubs know no iteration)
            found += [f"{name}, line {entry.line}: {entry.message}" for entry in errors]
    return found


@cache
def _validator(schema: str) -> etree.XMLSchema:
    """Return the validator of a schema."""
    return etree.XMLSchema(file=str(Path(fmpy.__file__).parent / "ssp" / "schema" / schema))
