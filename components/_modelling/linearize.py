"""Linearisation of a model at one point as a `control.StateSpace`, by exact derivatives.

    der(x) = A dx + B du,  dy = C dx + D du            continuous models
    next(z) = A dz + B du, held = C dz + D du          sampled models: the tick map, with its sample time

Signal names are the names of the quantities with `/` for the dot, `mass/position`, because `control` reserves the dot
for `system.signal`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.model import Kind, Model, ModelError

if TYPE_CHECKING:
    from control import StateSpace


def linearize(model: Model, values: Mapping[str, float] | None = None, *, time: float = 0.0) -> StateSpace:
    """Return the linearisation of a model at its start values or the given `values`.

    Args:
        model: a complete model, continuous or sampled; a model with both kinds of states has no single state space.
        values: parameters, inputs and states that differ from their start values, by name.
        time: value of the independent variable [s].

    Raises:
        ModelError: an unknown name in `values`, or a model with continuous *and* sampled states.
    """
    import control

    values = dict(values or {})
    for name in values:
        _ = model[name]
    sampled = bool(model.of(Kind.SAMPLED_STATE, Kind.SAMPLED_OUTPUT))
    if sampled and model.of(Kind.STATE):
        raise ModelError(f"{model.name} has continuous and sampled states; linearise its members separately")
    point = [
        time,
        *[_values(model, kind, values) for kind in (Kind.STATE, Kind.SAMPLED_STATE, Kind.INPUT, Kind.PARAMETER)],
    ]
    state, output = (Kind.SAMPLED_STATE, Kind.SAMPLED_OUTPUT) if sampled else (Kind.STATE, Kind.OUTPUT)
    A, C = _columns(model, point, state, sampled)
    B, D = _columns(model, point, Kind.INPUT, sampled)
    sample_time = values.get("sample_time", model["sample_time"].start) if sampled else 0
    return control.StateSpace(
        A,
        B,
        C,
        D,
        sample_time,
        name=model.name,
        states=_labels(model, state),
        inputs=_labels(model, Kind.INPUT),
        outputs=_labels(model, output),
        remove_useless_states=False,
    )


def _labels(model: Model, kind: Kind) -> list[str]:
    """Return the names of the quantities of a kind, with `/` for the dot."""
    return [q.name.replace(".", "/") for q in model.of(kind)]


def _values(model: Model, kind: Kind, values: Mapping[str, float]) -> np.ndarray:
    """Return the values of the quantities of a kind, by default their start values, shape (n,)."""
    return np.array([values.get(q.name, q.start) for q in model.of(kind)], dtype=float)


def _columns(model: Model, point: list, kind: Kind, sampled: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return the Jacobians of (der, out) or (next, held) with respect to all quantities of one kind."""
    fwd = functions(model).fwd
    seeds = [np.zeros(np.size(v)) for v in point]
    where = {Kind.STATE: 1, Kind.SAMPLED_STATE: 2, Kind.INPUT: 3}[kind]
    pick = (2, 3) if sampled else (0, 1)
    columns = []
    for i in range(np.size(point[where])):
        direction = list(seeds)
        direction[where] = np.eye(np.size(point[where]))[i]
        result = fwd(*point, *direction)
        columns.append([np.array(result[k], dtype=float).reshape(-1) for k in pick])
    rows = [model.of(k) for k in ((Kind.SAMPLED_STATE, Kind.SAMPLED_OUTPUT) if sampled else (Kind.STATE, Kind.OUTPUT))]
    return tuple(np.column_stack([c[k] for c in columns]) if columns else np.zeros((len(rows[k]), 0)) for k in (0, 1))  # type: ignore[return-value]
