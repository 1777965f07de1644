"""The variables of an exported FMU: one list for the C table and both model descriptions.

Value references count from 1 (time) in this order and are the same in FMI 2 and FMI 3. That of a number is its position
in either description, as some tools take dependencies of FMI 3 for positions. In addition to the quantities of the
model an FMU has the derivatives `der(x)`, the value `next.z` of each sampled state after the next tick, the settings
and counters of the Co-Simulation solver, the structural arguments of the model and constants computed from them. The
last variables are, in FMI 3 only, the derivatives of the inputs within a communication step, for which FMI 2 has a
function, and, in FMI 2 only, the structural arguments that are texts, for which FMI 3 has annotations.
"""

from dataclasses import dataclass
from enum import StrEnum

from hfsa.components import Model
from hfsa.components._modelling.argument_docs import explanation_of
from hfsa.components._modelling.functions import Functions
from hfsa.components._modelling.model import Kind, Quantity
from hfsa.components._modelling.units import rate_unit
from hfsa.fmus._solvers import SOLVERS


class Role(StrEnum):
    """The role of a variable in the runtime."""

    TIME = "time"
    STATE = "state"
    DERIVATIVE = "derivative"
    SAMPLED_STATE = "sampled_state"
    NEXT = "next"
    INPUT = "input"
    OUTPUT = "output"
    SAMPLED_OUTPUT = "sampled_output"
    PARAMETER = "parameter"
    SOLVER = "solver"
    COUNTER = "counter"
    CONSTANT = "constant"
    TEXT = "text"
    INPUT_DERIVATIVE = "input_derivative"


@dataclass(frozen=True)
class Variable:
    """One variable of an FMU.

    `index` counts within the role. `start` is a number, a string for `Role.TEXT`, or `None` for a calculated variable.
    `unit` is empty for texts and for structural arguments that have none.
    """

    reference: int
    name: str
    role: Role
    index: int
    unit: str
    description: str
    start: float | str | None
    nominal: float = 1.0
    min: float | None = None
    max: float | None = None
    fixed: bool = False


def solver_of(model: Model, functions: Functions) -> str:
    """Return the Co-Simulation solver: that of the model, by default `exact` if it is linear, else `rosenbrock`."""
    return model.solver or ("exact" if functions.is_linear else "rosenbrock")


def variables(model: Model, functions: Functions) -> list[Variable]:
    """Return all variables of the model's FMU in the order of their value references."""
    rows: list[tuple] = [("time", Role.TIME, "s", "Time", None, {})]
    states, sampled = model.of(Kind.STATE), model.of(Kind.SAMPLED_STATE)
    rows += [_row(q, Role.STATE) for q in states]
    rows += [
        (f"der({q.name})", Role.DERIVATIVE, rate_unit(q.unit), f"Derivative of {q.name}", None, {}) for q in states
    ]
    rows += [_row(q, Role.SAMPLED_STATE) for q in sampled]
    rows += [(f"next.{q.name}", Role.NEXT, q.unit, f"Value of {q.name} after the next tick", None, {}) for q in sampled]
    for kind in (Kind.INPUT, Kind.OUTPUT, Kind.SAMPLED_OUTPUT, Kind.PARAMETER):
        rows += [_row(q, Role(kind.value)) for q in model.of(kind)]
    if states:
        solver = SOLVERS[solver_of(model, functions)]
        rows += [
            (s.name, Role.SOLVER, s.unit, s.description, s.start, {"fixed": True, "min": s.low, "max": s.high})
            for s in solver.settings
        ]
        rows += [(c.name, Role.COUNTER, "1", c.description, None, {}) for c in solver.counters]
    told = [(name, value, *_explained(name, model)) for name, value in model.information.items()]
    rows += [(name, Role.CONSTANT, unit, text, value, {}) for name, value, text, unit in told if _is_number(value)]
    rows += [_row(q, Role.CONSTANT) for q in model.of(Kind.CONSTANT)]
    rows += _input_derivatives(model.of(Kind.INPUT))
    rows += [(name, Role.TEXT, "", text, value, {}) for name, value, text, _ in told if not _is_number(value)]
    counts: dict[Role, int] = {}
    result = []
    for reference, (name, role, unit, description, start, more) in enumerate(rows, 1):
        index = counts.get(role, 0)
        counts[role] = index + 1
        result.append(Variable(reference, name, role, index, unit, description, start, **more))
    return result


def _is_number(value: float | str) -> bool:
    """Whether a structural argument is a number, not a text."""
    return not isinstance(value, str)


def _explained(name: str, model: Model) -> tuple[str, str]:
    """Return a sentence on a structural argument, and its unit."""
    said = explanation_of(name, model.origin.explained)
    return (f"Structural argument {name}", "") if said is None else (said.sentence, said.unit)


def _input_derivatives(inputs: list[Quantity]) -> list[tuple]:
    """Return the rows of the first derivatives of all inputs, then of the second ones, in the order of the runtime."""
    rows, units = [], {q.name: q.unit for q in inputs}
    for order, word in ((1, "First"), (2, "Second")):
        units = {name: rate_unit(unit) for name, unit in units.items()}
        for name, unit in units.items():
            text = f"{word} derivative of {name} in each communication step of Co-Simulation, until changed"
            rows.append((f"input_derivative[{order}].{name}", Role.INPUT_DERIVATIVE, unit, text, 0.0, {}))
    return rows


def _row(q: Quantity, role: Role):
    """Return the row of a quantity as a variable with a role."""
    start = None if role is Role.OUTPUT else q.start
    return (
        q.name,
        role,
        q.unit,
        q.description,
        start,
        {"nominal": q.nominal, "min": q.min, "max": q.max, "fixed": q.fixed},
    )
