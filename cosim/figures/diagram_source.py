"""Block diagram as text in the DOT language of Graphviz, which people can edit and other tools draw.

source(diagram)      # digraph "Scene" { "mass" [label="mass", class="block", ...]; ... }

Blocks, links and terminals have classes (`block sampled`), colours of the diagram, and names by which
`diagram_layout.py` finds them again.
"""

from hfsa.cosim.figures.diagram_style import TERMINAL, block_look, link_look
from hfsa.cosim.results.file_kind import DIAGRAM
from hfsa.cosim.systems.diagram import Block, Diagram, Link, Terminal, printable

_INDENT = "  "


def source(diagram: Diagram, direction: str = "LR") -> str:
    """Return the DOT text of a diagram, drawn from left to right, or by direction `TB` from above to below."""
    grouped = {name for group in diagram.groups for name in group}
    lines = [
        f'rankdir={direction}; label={_quoted(diagram.title)}; labelloc=t; fontname="sans-serif";',
        'node [shape=box, style=filled, fontname="sans-serif", fontsize=10];',
        'edge [fontname="sans-serif", fontsize=8];',
        *[_block(block) for block in diagram.blocks if block.name not in grouped],
    ]
    by_name = {block.name: block for block in diagram.blocks}
    for number, group in enumerate(diagram.groups, 1):
        inside = " ".join(_block(by_name[name]) for name in group)
        lines.append(f'subgraph cluster_{number} {{ label="one FMU"; style=dashed; fontsize=9; {inside} }}')
    lines += [_terminal(terminal, number) for number, terminal in enumerate(diagram.terminals)]
    lines += [_link(link, number) for number, link in enumerate(diagram.links)]
    body = "\n".join(f"{_INDENT}{line}" for line in lines)
    return f"{DIAGRAM}\ndigraph {_quoted(diagram.title)} {{\n{body}\n}}\n"


def terminal_name(number: int) -> str:
    """Return the name of the node of a terminal by its place; no component has such a name."""
    return f"terminal {number}"


def _block(block: Block) -> str:
    """Return the node of a block."""
    look = block_look(block)
    label = _quoted("\n".join([block.name, *block.words]))
    kinds = {"block": True, "sampled": block.is_sampled, "foreign": block.is_foreign}
    kind = " ".join(name for name, is_one in kinds.items() if is_one)
    paint = f'fillcolor="{look.fill}", color="{look.line}", peripheries={2 if block.is_foreign else 1}'
    return f'{_quoted(block.name)} [label={label}, class="{kind}", {paint}];'


def _terminal(terminal: Terminal, number: int) -> str:
    """Return the node of a terminal, and its edge."""
    name, block = _quoted(terminal_name(number)), _quoted(terminal.block)
    label = _quoted("\n".join([terminal.side, *terminal.words]))
    edge = f"{name} -> {block}" if terminal.side == "input" else f"{block} -> {name}"
    look = f'shape=box, style="rounded,filled", fillcolor="{TERMINAL.fill}", color="{TERMINAL.line}"'
    kind = f'class="terminal {terminal.side}"'
    return f'{name} [label={label}, {kind}, {look}]; {edge} [key={name}, color="{TERMINAL.line}"];'


def _link(link: Link, number: int) -> str:
    """Return the edge of a link."""
    look = link_look(link)
    style = f'color="{look.line}", penwidth={look.width:g}' + (", style=dashed" if look.is_dashed else "")
    label, notes = _quoted("\n".join(link.words)), _quoted(link.sentence)
    ends = f"{_quoted(link.start)} -> {_quoted(link.end)}"
    return f'{ends} [key="link {number}", label={label}, edgetooltip={notes}, {style}];'


def _quoted(text: str) -> str:
    """Return a quoted string of DOT, of one or several lines."""
    lines = "\n".join(map(printable, text.split("\n")))
    escaped = lines.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
