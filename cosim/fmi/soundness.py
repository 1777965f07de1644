"""Soundness of a modelDescription.xml: what would make a run read or write other variables than those meant.

    refuse_unsound(file, root)          # StructureError with the first fault

Value references that wrap at 2^32, indices of FMI 2 that no variable has (an index 0 or -7 silently means one counted
from the end), two variables of one name, and types that FMI does not know. `hfsa check` knows many more rules.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path

from lxml import etree

from hfsa.cosim.systems.connectors import NUMBERS
from hfsa.cosim.systems.errors import StructureError

_TYPES = {*NUMBERS, "String", "Binary", "Clock"}
_USED = ("Outputs", "Derivatives", "Output", "ContinuousStateDerivative")
"""Lists of ModelStructure that a run needs: those of FMI 2, and the elements of FMI 3."""
_REFERENCES = 2**32


def refuse_unsound(file: Path, root: etree._Element) -> None:
    """Raise `StructureError` for a description whose variables are not what they seem; `root` is its XML."""
    for fault in _faults(root):
        raise StructureError(f"{file} cannot be run: {fault}; `hfsa check` lists all faults")


def _faults(root: etree._Element) -> Iterator[str]:
    """Yield sentences on the faults."""
    listed = root.find("ModelVariables")
    variables = [v for v in ([] if listed is None else listed) if isinstance(v.tag, str)]
    is_two = str(root.get("fmiVersion")).startswith("2")
    yield from _twins(variables)
    yield from _references(variables)
    yield from _types(variables, is_two)
    if is_two:
        known, word = {str(k) for k in range(1, len(variables) + 1)}, "index"
        slopes = [child for variable in variables for child in variable]
    else:
        known, word = {v.get("valueReference", "") for v in variables}, "valueReference"
        slopes = variables
    yield from _strangers(root, slopes, known, word)


def _twins(variables: Iterable[etree._Element]) -> Iterator[str]:
    """Yield faults of names that occur twice, those of aliases among them."""
    seen = set()
    for variable in variables:
        for name in [variable.get("name"), *(alias.get("name") for alias in variable.iterfind("Alias"))]:
            if name in seen:
                yield f"two variables have the name {name!r}, expected one (line {variable.sourceline})"
            seen.add(name)


def _references(variables: Iterable[etree._Element]) -> Iterator[str]:
    """Yield faults of value references that are no unsigned numbers of 32 bits."""
    for variable in variables:
        text = str(variable.get("valueReference")).strip()
        if not (text.isascii() and text.isdigit() and int(text) < _REFERENCES):
            yield (
                f"{variable.get('name')} has the value reference {text}, "
                f"expected a whole number from 0 to {_REFERENCES - 1} (line {variable.sourceline})"
            )


def _types(variables: Iterable[etree._Element], is_two: bool) -> Iterator[str]:
    """Yield faults of types that FMI does not know."""
    for variable in variables:
        tags = [str(child.tag) for child in variable if child.tag != "Annotations"] if is_two else [str(variable.tag)]
        if not _TYPES & set(tags):
            found = f"the type {tags[0]}" if tags else "no type"
            yield f"{variable.get('name')} has {found}, expected one of FMI (line {variable.sourceline})"


def _strangers(root: etree._Element, slopes: Iterable[etree._Element], known: set[str], word: str) -> Iterator[str]:
    """Yield faults of references to variables that do not exist."""
    for element in slopes:
        reference = element.get("derivative")
        if reference is not None and reference.strip() not in known:
            yield f"a derivative is that of {word} {reference}, which no variable has (line {element.sourceline})"
    structure = root.find("ModelStructure")
    for group in [] if structure is None else structure:
        if group.tag not in _USED:
            continue
        for element in group if word == "index" else [group]:
            for reference in (*element.get(word, "").split(), *element.get("dependencies", "").split()):
                if reference not in known:
                    yield f"{group.tag} names {word} {reference}, which no variable has (line {element.sourceline})"
