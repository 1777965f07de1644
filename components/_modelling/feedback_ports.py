"""Ports for linearised feedback: within a step, an input responds linearly to the outputs of its own model.

    u_i  ->  u_i + sum_j G_ij (y_j - y0_j)        G_ij: feedback.gain.u_i.y_j, y0_j: feedback.at.y_j

This replaces u_i in all equations. The model is unchanged while the gains are 0, their start value, and at y = y0. An
implicit solver includes the feedback in its Jacobian, so a stiff feedback does not limit the step. The difference
y - y0 is evaluated before the product with the gain: a motion of nanometres keeps its digits under gains of 1e16. A
linear model stays linear. y0 are inputs rather than parameters because a change of a parameter makes the `exact`
solver recompute its matrices.
"""

from collections.abc import Sequence

import casadi as ca

from hfsa.components._modelling.model import Kind, Model, ModelError
from hfsa.components._modelling.units import quotient_unit


def with_linear_feedback(model: Model, pairs: Sequence[tuple[str, str]]) -> Model:
    """Add feedback ports for pairs (input, output) to the model and return it, the same object.

    An input that affects no state derivative gets no ports.

    Raises:
        ModelError: an unknown quantity, or one that is not a continuous input or output; an output with direct
            feedthrough from one of the inputs or from an acceleration.
    """
    moving = ca.veccat(*model.der.values(), *[side for m in model.motions for side in (m.mass, m.force)])
    pairs = [(u, y) for u, y in pairs if ca.depends_on(moving, _symbol(model, u))]
    if not pairs:
        return model
    inputs, outputs = list(dict.fromkeys(u for u, _ in pairs)), list(dict.fromkeys(y for _, y in pairs))
    direct = ca.vertcat(*[_symbol(model, u) for u in inputs], *[motion.acceleration for motion in model.motions])
    differences: dict[str, ca.SX] = {}
    for name in outputs:
        y = model[name]
        if y.kind is not Kind.OUTPUT:
            raise ModelError(f"{model.name}: {name} is a {y.kind.replace('_', ' ')}, expected an output to feed back")
        if ca.depends_on(y.expression, direct):
            raise ModelError(
                f"{model.name}: {name} has direct feedthrough from an input of its feedback, expected a state between"
            )
        at = model.input(f"feedback.at.{name}", y.unit, f"{name} at the communication point", nominal=y.nominal)
        differences[name] = y.expression - at
    fed = {name: model[name].expression for name in inputs}
    for u, y in pairs:
        unit = quotient_unit(model[u].unit, model[y].unit)
        gain = model.parameter(f"feedback.gain.{u}.{y}", 0.0, unit, f"Feedback gain from {y} to {u}")
        fed[u] += gain * differences[y]
    model.substitute(ca.vertcat(*[_symbol(model, u) for u in inputs]), ca.vertcat(*fed.values()))
    return model


def _symbol(model: Model, name: str) -> ca.SX:
    """Return the symbol of an input; `ModelError` for any other quantity."""
    quantity = model[name]
    if quantity.kind is not Kind.INPUT:
        raise ModelError(f"{model.name}: {name} is a {quantity.kind.replace('_', ' ')}, expected an input")
    return quantity.expression
