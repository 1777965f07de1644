"""Counts of the work of the solvers inside instances: their steps, and the evaluations of their derivatives.

    counts = solver_counts(master.instances)    # {"robot": {"steps": 120, "evaluations": 960, ...}}
    total(counts)                               # {"steps": 120, "evaluations": 960, ...}

Counts begin at 0 at each initialization. They repeat exactly, where times do not. Rejected communication steps count
too: a restored state does not undo the work. FMUs without counters are left out: those of others, and ours whose steps
all cost the same (no states, or the solver `exact`).
"""

from collections import Counter
from collections.abc import Mapping

from hfsa.cosim.fmi.base_instance import BaseInstance

_PREFIX = "solver."


def solver_counts(instances: Mapping[str, BaseInstance]) -> dict[str, dict[str, int]]:
    """Return the counts of each instance that has any, by the part of the counter's name after `solver.`."""
    counts = {}
    for name, instance in instances.items():
        if counters := instance.fmu.description.counters:
            values = instance.get(instance.handle(counters))
            words = (counter.removeprefix(_PREFIX) for counter in counters)
            counts[name] = {word: int(value) for word, value in zip(words, values, strict=True)}
    return counts


def total(counts: Mapping[str, Mapping[str, int]]) -> dict[str, int]:
    """Return the sums over the instances, of each count that any of them has."""
    sums: Counter[str] = Counter()
    for own in counts.values():
        sums.update(own)
    return dict(sums)
