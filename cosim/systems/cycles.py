"""Cycles of a directed graph: which of its nodes lead to each other and back."""

from collections.abc import Collection, Iterable, Mapping
from graphlib import CycleError, TopologicalSorter

import numpy as np


def representatives(before: Mapping[str, Collection[str]]) -> dict[str, str]:
    """Return by node a representative of those that it lies on cycles with; mostly the node itself.

    `before` holds all nodes, and of each the nodes with an edge to it.
    """
    try:
        TopologicalSorter(before).prepare()
    except CycleError:
        pass
    else:
        return {name: name for name in before}
    from scipy.sparse import csr_matrix  # imported here, as it takes a third of a second and few systems have loops
    from scipy.sparse.csgraph import connected_components

    names = list(before)
    places = {name: i for i, name in enumerate(names)}
    pairs = [(places[name], places[other]) for name, others in before.items() for other in others]
    rows, columns = zip(*pairs, strict=True)
    graph = csr_matrix((np.ones(len(pairs)), (rows, columns)), shape=(len(names), len(names)))
    _, labels = connected_components(graph, directed=True, connection="strong")
    first: dict[int, str] = {}
    return {name: first.setdefault(int(label), name) for name, label in zip(names, labels, strict=True)}


def on_cycles(names: Iterable[str], edges: Iterable[tuple[str, str]]) -> list[tuple[str, ...]]:
    """Return the groups of names that lie on cycles with each other, a name on none alone, in the order of names.

    Edges from or to other names do not count.
    """
    before: dict[str, set[str]] = {name: set() for name in names}
    for start, end in edges:
        if start in before and end in before:
            before[end].add(start)
    groups: dict[str, list[str]] = {}
    for name, first in representatives(before).items():
        groups.setdefault(first, []).append(name)
    return [tuple(group) for group in groups.values()]
