"""Dependencies of unknowns on knowns and their kinds, for ModelStructure, from CasADi's sparsity patterns.

The kinds are those of FMI. With unknown = f(known, ...), the derivative df/dknown is `constant`, or depends on `fixed`
parameters only, on `tunable` ones too, on sampled states too (`discrete`), or on any variable (`dependent`).
"""

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from hfsa.components._modelling.functions import Functions
from hfsa.fmus._variables import Role, Variable

KNOWNS = ((Role.TIME,), (Role.STATE,), (Role.SAMPLED_STATE,), (Role.INPUT,), (Role.PARAMETER,))
"""Roles of the knowns by argument of the model's functions: t, x, z, u, p."""

_T, _X, _Z, _U, _P = range(5)


@dataclass(frozen=True)
class Dependency:
    """Dependency of an unknown on one known; `kind` is one of FMI's dependenciesKind."""

    known: Variable
    kind: str


def dependencies(functions: Functions, variables: list[Variable]) -> dict[int, list[Dependency]]:
    """Return the dependencies of every derivative and output, by value reference, knowns in ascending order.

    Sampled outputs have no dependencies: they are held between ticks.
    """
    knowns = [[v for v in variables if v.role in roles] for roles in KNOWNS]
    rows: dict[int, list[Dependency]] = {v.reference: [] for v in variables if v.role is Role.SAMPLED_OUTPUT}
    for function, role in ((functions.rhs, Role.DERIVATIVE), (functions.out, Role.OUTPUT)):
        unknowns = [v for v in variables if v.role is role]
        rows |= {v.reference: [] for v in unknowns}
        if unknowns:
            _fill(rows, function, unknowns, knowns)
    return {reference: sorted(row, key=lambda d: d.known.reference) for reference, row in rows.items()}


def _fill(rows: dict[int, list[Dependency]], function: ca.Function, unknowns, knowns) -> None:
    """Add the structurally nonzero derivatives of the result of one function to `rows`, each with its kind."""
    symbols: Any = function.mx_in() if function.is_a("MXFunction") else function.sx_in()
    result: Any = function(*symbols)
    slopes = [ca.jacobian(result, symbol) for symbol in symbols]
    entries = ca.Function("slopes", symbols, [slope.nz[:] for slope in slopes])
    fixed = np.array([v.fixed for v in knowns[_P]], dtype=bool)
    for column, slope in enumerate(slopes):
        moved_by = [np.array(ca.DM(entries.jac_sparsity(column, k), 1)).astype(bool) for k in range(len(symbols))]
        rows_of, columns_of = slope.sparsity().get_triplet()
        for entry, (i, j) in enumerate(zip(rows_of, columns_of, strict=True)):
            kind = _kind([moved[entry] for moved in moved_by], fixed)
            rows[unknowns[i].reference].append(Dependency(knowns[column][j], kind))


def _kind(moved_by: list[np.ndarray], fixed: np.ndarray) -> str:
    """Return the kind of a derivative from the knowns that it depends on, one boolean row per argument."""
    if any(moved_by[k].any() for k in (_T, _X, _U)):
        return "dependent"
    if moved_by[_Z].any():
        return "discrete"
    if moved_by[_P].any():
        return "fixed" if fixed[moved_by[_P]].all() else "tunable"
    return "constant"
