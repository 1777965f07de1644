"""XML of somebody else: no entities, no files or addresses from outside, and every error with its line.

Elements within each other and texts are as deep and long as the parser allows without `huge_tree`.
"""

from collections.abc import Iterator

from lxml import etree

from hfsa.cosim.systems.errors import StructureError

Node = etree._Element


def parse(content: bytes, where: str) -> Node:
    """Return the root of a document; `StructureError` for one that is not well-formed, or declares entities."""
    parser = etree.XMLParser(
        resolve_entities=False,
        load_dtd=False,
        no_network=True,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )
    try:
        root = etree.fromstring(content, parser)
    except etree.XMLSyntaxError as error:
        raise StructureError(f"{where} is not well-formed XML: {error}") from None
    if root.getroottree().docinfo.internalDTD is not None:
        raise StructureError(f"{where} has a document type, which may declare entities; expected XML without one")
    return root


def local(node: Node) -> str:
    """Return the name of a node without its namespace."""
    return etree.QName(node).localname


def is_of(node: Node, namespace: str, name: str) -> bool:
    """Whether a node has a name of a namespace."""
    return node.tag == f"{{{namespace}}}{name}"


def children(node: Node | None, namespace: str, group: str, name: str) -> Iterator[Node]:
    """Yield the nodes of a name in a group of a node; none where there is no group."""
    if node is not None:
        for inside in node.findall(f"{{{namespace}}}{group}"):
            yield from inside.findall(f"{{{namespace}}}{name}")


def attribute(node: Node, name: str, where: str) -> str:
    """Return an attribute that a node must have."""
    value = node.get(name)
    if value is None:
        raise StructureError(f"{at(where, node)}: {local(node)} lacks the attribute {name!r}")
    return value


def number(node: Node, name: str, default: float, where: str) -> float:
    """Return an attribute that is a number."""
    text = node.get(name)
    return default if text is None else read_number(text, f"{at(where, node)}: {local(node)}: {name}")


def read_number(text: str, what: str) -> float:
    """Return the number of a text as XML Schema writes it."""
    try:
        return float(text)
    except ValueError:
        raise StructureError(f"{what} is {text!r}, expected a number") from None


def flag(node: Node, name: str, where: str) -> bool:
    """Return an attribute that is true or false, by default false."""
    text = (node.get(name) or "false").strip()
    if text not in ("true", "false", "1", "0"):
        raise StructureError(f"{at(where, node)}: {local(node)}: {name} is {text!r}, expected true or false")
    return text in ("true", "1")


def at(where: str, node: Node) -> str:
    """Return a place for messages: document and line."""
    return f"{where}, line {node.sourceline}"
