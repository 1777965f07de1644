"""Ports for linearised feedback: inputs that follow the model's own outputs within a step, as who feeds them would.

    u_i  ->  u_i + sum_j G_ij (y_j - y0_j)        G_ij: feedback.gain.u_i.y_j, y0_j: feedback.at.y_j

wherever the equations use u_i. With the gains 0, as they start, or at y = y0 nothing is changed. A solver that treats
the equations implicitly takes the feedback so, too: its stiffness limits no step. y - y0 is formed as it stands, so
that a motion of nanometres keeps its digits under gains of 1e16. A linear model stays linear; y0 are inputs and not
parameters, because only new gains take new matrices.
"""

from collections.abc import Sequence

import casadi as ca

from hfsa.components._modelling.model import Kind, Model, ModelError
from hfsa.components._modelling.units import quotient_unit


def with_linear_feedback(model: Model, pairs: Sequence[tuple[str, str]]) -> Model:
    """Return the model with ports for pairs (input, output) added; it is the same object.

    An input that no state follows takes no ports.

    Raises:
        ModelError: a quantity that is not there, or is not a continuous input or output; an output that follows one of
            the inputs, or an acceleration, without a state between.
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
                f"{model.name}: {name} follows an input that it is to be fed back to, without a state between"
            )
        at = model.input(f"feedback.at.{name}", y.unit, f"{name} at the communication point", nominal=y.nominal)
        differences[name] = y.expression - at
    fed = {name: model[name].expression for name in inputs}
    for u, y in pairs:
        unit = quotient_unit(model[u].unit, model[y].unit)
        gain = model.parameter(f"feedback.gain.{u}.{y}", 0.0, unit, f"What {u} follows {y} by")
        fed[u] += gain * differences[y]
    model.substitute(ca.vertcat(*[_symbol(model, u) for u in inputs]), ca.vertcat(*fed.values()))
    return model


def _symbol(model: Model, name: str) -> ca.SX:
    """Return the symbol of an input; `ModelError` where it is none."""
    quantity = model[name]
    if quantity.kind is not Kind.INPUT:
        raise ModelError(f"{model.name}: {name} is a {quantity.kind.replace('_', ' ')}, expected an input")
    return quantity.expression
