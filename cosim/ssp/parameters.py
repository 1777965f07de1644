"""Parameter sets (.ssv), inline or in files, with mappings (.ssm): values by the names that they set.

Later bindings of one element count more than earlier ones.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from hfsa.cosim.archives.xml import Node, at, attribute, children, flag, is_of, local, number, read_number
from hfsa.cosim.ssp.structure import Value
from hfsa.cosim.ssp.units import Affine, read_units, unit_named
from hfsa.cosim.ssp.vocabulary import SSC, SSD, SSM, SSV
from hfsa.cosim.systems.errors import StructureError

Source = Callable[[Node, str, str], tuple[Node, str]]
"""Function of a node with a source, its base and its place, which returns the document and its name."""

_REALS = ("Real", "Float64", "Float32")
_SET_TYPE, _MAP_TYPE = "application/x-ssp-parameter-set", "application/x-ssp-parameter-mapping"
_MAPPINGS = ("BooleanMappingTransformation", "IntegerMappingTransformation", "EnumerationMappingTransformation")


def bound_values(element: Node, where: str, source: Source) -> tuple[Value, ...]:
    """Return the values that the parameter bindings of an element set, in their order."""
    found: list[Value] = []
    for binding in children(element, SSD, "ParameterBindings", "ParameterBinding"):
        place = at(where, binding)
        root, document = _content(binding, "ParameterValues", SSV, "ParameterSet", _SET_TYPE, where, source)
        prefix = binding.get("prefix") or ""
        values = {f"{prefix}{value.name}": value for value in _values(root, document)}
        mapping = binding.find(f"{{{SSD}}}ParameterMapping")
        if mapping is None:
            found += [Value(name, v.value, v.unit, v.place) for name, v in values.items()]
        else:
            entries, document = _content(mapping, None, SSM, "ParameterMapping", _MAP_TYPE, where, source)
            found += _mapped(values, entries, document, place)
    return tuple(found)


def _content(
    node: Node, inside: str | None, namespace: str, name: str, kind: str, where: str, source: Source
) -> tuple[Node, str]:
    """Return the document that a node holds or names, and what it is called."""
    given = node.get("type") or kind
    if given != kind:
        raise StructureError(f"{at(where, node)}: {local(node)} is of type {given}, expected {kind}")
    if node.get("source"):
        root, document = source(node, where, at(where, node))
    else:
        holder = node if inside is None else node.find(f"{{{SSD}}}{inside}")
        root, document = (None if holder is None else holder.find(f"{{{namespace}}}{name}")), where
        if root is None:
            raise StructureError(f"{at(where, node)}: {local(node)} has neither a source nor a {name} inside")
    if not is_of(root, namespace, name):
        raise StructureError(f"{document}: the document is {root.tag}, expected {name} of {namespace}")
    return root, document


def _values(root: Node, where: str) -> Iterator[Value]:
    """Yield the values of a parameter set."""
    units = read_units(root.findall(f"{{{SSV}}}Units"), where)
    for node in children(root, SSV, "Parameters", "Parameter"):
        name, place = attribute(node, "name", where), at(where, node)
        typed = next((child for child in node if child.tag != f"{{{SSV}}}Annotations"), None)
        if typed is None:
            raise StructureError(f"{place}: parameter {name} has no value")
        yield Value(name, _value(typed, name, where), unit_named(typed.get("unit"), units), place)


def _value(node: Node, name: str, where: str) -> Any:
    """Return the value of a parameter: a number, true or false, or a text."""
    kind, text = local(node), attribute(node, "value", where).strip()
    what = f"{at(where, node)}: parameter {name}"
    if kind in _REALS:
        return read_number(text, what)
    if kind == "Boolean":
        return flag(node, "value", where)
    if kind.startswith(("Int", "UInt")):
        try:
            return int(text)
        except ValueError:
            raise StructureError(f"{what} is {text!r}, expected a whole number") from None
    if kind in ("String", "Enumeration"):
        return node.get("value")
    raise StructureError(f"{what} is of type {kind}, expected a number, a Boolean or a text")


def _mapped(values: Mapping[str, Value], root: Node, where: str, place: str) -> Iterator[Value]:
    """Yield the values that a mapping selects, under their new names."""
    for node in root.findall(f"{{{SSM}}}MappingEntry"):
        source, target = attribute(node, "source", where), attribute(node, "target", where)
        if source not in values:
            raise StructureError(
                f"{at(where, node)}: the mapping takes {source}, which the parameter set of {place} does not have"
            )
        value, is_converted = values[source], not flag(node, "suppressUnitConversion", where)
        yield Value(target, value.value, value.unit, at(where, node), is_converted, transformation(node, where))


def transformation(node: Node, where: str) -> Affine:
    """Return the linear transformation of a connection or mapping; `StructureError` for one of another kind."""
    for child in node:
        if local(child) in _MAPPINGS:
            raise StructureError(
                f"{at(where, child)}: {local(child)} cannot be simulated, expected LinearTransformation"
            )
    # older documents have it among their own names
    linear = next(
        (child for child in node if local(child) == "LinearTransformation" and child.tag.startswith("{")), None
    )
    if linear is None:
        return Affine()
    if not linear.tag.startswith((f"{{{SSC}}}", f"{{{SSD}}}", f"{{{SSM}}}")):
        raise StructureError(f"{at(where, linear)}: {linear.tag} is no transformation of the standard")
    return Affine(number(linear, "factor", 1.0, where), number(linear, "offset", 0.0, where))
