"""Analyses of a part for values of its arguments, as one table.

    found = analyze_over("rrr_stage", {"links.arm": ["3e-3", "4e-3"]}, {"voltage": "150,150,150"})
    found.cases, found.numbers["range"], found.units["range"]

A case that the part refuses has no numbers, but the reason.
"""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hfsa.components import ModelError
from hfsa.components._modelling.catalogue import part_named
from hfsa.cosim.assembly.models import available_parts
from hfsa.cosim.experiments.arguments import checked
from hfsa.cosim.results.analyses import Analyses
from hfsa.cosim.systems.errors import StructureError


@checked()
def analyze_over(part: str, over: Mapping[str, Sequence[Any]], arguments: Mapping[str, Any] | None = None) -> Analyses:
    """Return the analyses of a part for each combination of values.

    Args:
        part: name of a part, or the path of its file.
        over: values by argument.
        arguments: other arguments, the same in all cases.

    Raises:
        ModelError: the part's reason, where it refuses every case.
        StructureError: no argument to vary; one that is in `arguments` as well.
    """
    given = dict(arguments or {})
    if not over:
        raise StructureError("no argument is varied; expected values of at least one")
    for name in over:
        if name in given:
            raise StructureError(f"{name} is given with -p and with --over; expected one of them")
    owner = part_named(part, available_parts())
    cases = [dict(zip(over, values, strict=True)) for values in itertools.product(*over.values())]
    found: list[dict[str, Any]] = []
    refusals: dict[int, str] = {}
    for i, case in enumerate(cases):
        try:
            found.append(owner.analysis(**given, **case))
        except ModelError as error:
            refusals[i] = str(error)
            found.append({})
    if len(refusals) == len(cases):
        raise ModelError(refusals[0])
    words = " ".join([owner.name, *(f"{name}={value}" for name, value in owner.with_contents(given).items())])
    keys = dict.fromkeys(key for numbers in found for key in _flat(numbers))
    flat = [_flat(numbers) for numbers in found]
    numbers = {key: _stacked([numbers.get(key) for numbers in flat]) for key in keys}
    units = {key: unit for key in keys if (unit := owner.units.get(key.partition(".")[0])) is not None}
    columns = {name: tuple(case[name] for case in cases) for name in over}
    return Analyses(owner.name, words, columns, numbers, units, refusals)


def _flat(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Return results with those that are numbers by name, `hinge_stress.A1`, one by one."""
    found: dict[str, Any] = {}
    for key, value in numbers.items():
        found |= {f"{key}.{name}": item for name, item in value.items()} if isinstance(value, Mapping) else {key: value}
    return found


def _stacked(values: Sequence[Any]) -> np.ndarray:
    """Return a result over the cases, (cases, ...): numbers with NaN, or texts, empty, where a case has none."""
    arrays = [None if value is None else np.asarray(value) for value in values]
    shapes = {array.shape for array in arrays if array is not None}
    if len(shapes) == 1 and all(array is None or array.dtype.kind in "fiubc" for array in arrays):
        (shape,) = shapes
        kind = complex if any(array is not None and array.dtype.kind == "c" for array in arrays) else float
        nothing = np.full(shape, np.nan)
        return np.array([nothing if array is None else array for array in arrays], dtype=kind)
    return np.array(["" if value is None else str(value) for value in values], dtype=object)
