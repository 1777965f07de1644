"""Soundness of a modelDescription.xml: what would make a run read or write other variables than those meant.

    refuse_unsound(file, raw)          # StructureError with the first fault

Value references that wrap at 2^32, indices of FMI 2 that no variable has (an index 0 or -7 silently means one counted
from the end), two variables of one name, types that FMI does not know, and binaries outside the FMU. `hfsa check`
knows many more rules.
"""

import re
from collections.abc import Iterator
from pathlib import Path

from hfsa.cosim.fmi.raw_description import TYPES, RawDescription
from hfsa.cosim.systems.errors import StructureError

_REFERENCES = 2**32


def refuse_unsound(file: Path, raw: RawDescription) -> None:
    """Raise `StructureError` for a description whose variables are not what they seem."""
    for fault in _faults(raw):
        raise StructureError(f"{file} cannot be run: {fault}; `hfsa check` lists all faults")


def _faults(raw: RawDescription) -> Iterator[str]:
    """Yield sentences on the faults."""
    yield from _binaries(raw)
    yield from _twins(raw)
    yield from _references(raw)
    yield from _types(raw)
    yield from _strangers(raw)


def _binaries(raw: RawDescription) -> Iterator[str]:
    """Yield faults of names of binaries, which become paths."""
    for interface, attributes in raw.interfaces.items():
        name = attributes.get("modelIdentifier", "")
        if not re.fullmatch(r"\w[\w.\- ]*", name):
            yield f"{interface} has the modelIdentifier {name[:100]!r}, expected the name of a binary in the FMU"


def _twins(raw: RawDescription) -> Iterator[str]:
    """Yield faults of names that are missing or occur twice, those of aliases among them."""
    seen = set()
    for variable in raw.variables:
        if variable.name is None:
            yield f"a variable has no name, expected one (line {variable.line})"
        for name in (variable.name, *variable.aliases):
            if name in seen:
                yield f"two variables have the name {name!r}, expected one (line {variable.line})"
            seen.add(name)


def _references(raw: RawDescription) -> Iterator[str]:
    """Yield faults of value references that are no unsigned numbers of 32 bits."""
    for variable in raw.variables:
        text = str(variable.reference).strip()
        if not (text.isascii() and text.isdigit() and len(text) <= 10 and int(text) < _REFERENCES):
            yield (
                f"{variable.name} has the value reference {text[:100]}, "
                f"expected a whole number from 0 to {_REFERENCES - 1} (line {variable.line})"
            )


def _types(raw: RawDescription) -> Iterator[str]:
    """Yield faults of types that FMI does not know."""
    known = TYPES[raw.version]
    for variable in raw.variables:
        if variable.type not in known:
            found = f"the type {variable.type}" if variable.type else "no type"
            yield f"{variable.name} has {found}, expected one of FMI {raw.version} (line {variable.line})"


def _strangers(raw: RawDescription) -> Iterator[str]:
    """Yield faults of references to variables that do not exist."""
    if raw.version == 2:
        known, word = {str(k) for k in range(1, len(raw.variables) + 1)}, "index"
    else:
        known, word = {str(v.reference).strip() for v in raw.variables}, "valueReference"
    for v in raw.variables:
        if v.derivative is not None and v.derivative.strip() not in known:
            yield f"a derivative is that of {word} {v.derivative}, which no variable has (line {v.line})"
    for unknown in raw.unknowns:
        for reference in (*(unknown.reference or "").split(), *(unknown.dependencies or "").split()):
            if reference not in known:
                yield f"{unknown.kind} names {word} {reference}, which no variable has (line {unknown.line})"
        if len((unknown.reference or "").split()) != 1:
            yield f"{unknown.kind} names no {word}, expected one (line {unknown.line})"
