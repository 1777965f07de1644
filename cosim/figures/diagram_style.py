"""Looks of a block diagram: by fill, line and dashes, so that none is known by its colour alone."""

from dataclasses import dataclass

from hfsa.cosim.figures.style import ACCENT, COLOURS
from hfsa.cosim.systems.diagram import Block, Link


@dataclass(frozen=True)
class Look:
    """Fill and line of a shape or an arrow: colours, width of the line [points], and whether it is dashed."""

    line: str
    fill: str = "none"
    width: float = 1.1
    is_dashed: bool = False


BLOCK = Look("#46617f", "#e8f0f8")
SAMPLED = Look("#a86400", "#fdeed3", 1.6)
FOREIGN = Look("#4a4e57", "#eeeeee")
SAMPLED_FOREIGN = Look("#a86400", "#f3e6d0", 1.6)
TERMINAL = Look("#4a4e57", "#ffffff", 0.9)
GROUP = Look("#4a4e57", width=0.9, is_dashed=True)
LINK = Look("#4a4e57")
SAMPLED_LOOP = Look(COLOURS[0], width=1.5, is_dashed=True)
ALGEBRAIC_LOOP = Look(ACCENT, width=2.6)


def block_look(block: Block) -> Look:
    """Return the look of a block."""
    if block.is_foreign:
        return SAMPLED_FOREIGN if block.is_sampled else FOREIGN
    return SAMPLED if block.is_sampled else BLOCK


def link_look(link: Link) -> Look:
    """Return the look of a link."""
    if link.loop:
        return ALGEBRAIC_LOOP
    return SAMPLED_LOOP if link.is_sampled_loop else LINK
