"""Section of a report on the machines of a run, each drawn where it is farthest from rest."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from hfsa.cosim.pages.blocks import Block, Machine, Section, paragraph
from hfsa.cosim.pages.bodies import Body
from hfsa.cosim.pages.panel_data import coordinates, panel_data, scale_of
from hfsa.cosim.results.recorded import Recorded


def machine_section(recorded: Recorded, bodies: Sequence[Body], sentences: Sequence[str]) -> Section:
    """Return the section on the bodies of a run, with sentences on those that are not drawn."""
    blocks: list[Block] = [_machine(recorded, body) for body in bodies]
    return Section("Machines", [*blocks, *(paragraph(f"{words[:1].upper()}{words[1:]}.") for words in sentences)])


def _machine(recorded: Recorded, body: Body) -> Block:
    """Return a body at the time of its largest displacement, beside itself at rest."""
    row = _farthest(body)
    if row is None:
        return paragraph(f"{body.name} is not drawn: its motion has values that are no numbers.")
    times, (factor, _) = body.magnification, scale_of(body.panel)
    data = panel_data(body.panel, body.name)
    pairs = zip(body.panel.layers, body.displacements, strict=True)
    drawn = [(layer, shift) for layer, shift in pairs if layer.cells.size]
    still: list[dict[str, Any]] = []
    for shown, (layer, shift) in zip(data["layers"], drawn, strict=True):
        if shift is not None and shift[row].any():
            still.append(shown | {"role": "rest", "name": "", "values": None, "texts": [], "notes": []})
            shown |= {"points": coordinates(layer.points + times * shift[row], factor), "rest": shown["points"]}
    data["layers"] = [*still, *data["layers"]]
    where = f"{body.name} at {recorded.at[row]:.5g} s, where it is farthest from rest"
    return Machine(data, f"{where}; its displacements are drawn {times:g} times as large" if times != 1 else where)


def _farthest(body: Body) -> int | None:
    """Return the row of the largest displacement; `None` where one is no number."""
    moving = [np.abs(shift).max(axis=(1, 2), initial=0.0) for shift in body.displacements if shift is not None]
    sizes = np.max(moving, axis=0) if moving else np.zeros(1)
    return int(np.argmax(sizes)) if np.all(np.isfinite(sizes)) else None
