"""Pruning of a model to the quantities that some of its outputs need.

    found = dependencies(model)                                   # what each state and output depends on
    kept = found.reached(["platform.position[3]"])                # states and inputs included
    small = pruned(model, kept)                                   # the model of these alone, all parameters kept

The equation of a state or an output depends on the states, inputs and accelerations whose symbols it contains. An
acceleration depends on all of its irreducible block of the mass matrix. In a linear time-invariant model a coefficient
is zero as well where it is below `NEGLIGIBLE` of the largest in its row and in its column: rounding that is left of a
symmetry. Coefficients are compared in SI units and in units of the nominal values, and have to be negligible in both.
They are evaluated at the start values of the parameters and at random values, so that no setting of a parameter brings
a coefficient back. Rows with a function that is not smooth, such as a saturation, keep all their dependencies.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from hfsa.components._modelling.functions import is_linear
from hfsa.components._modelling.model import Kind, Model, Motion
from hfsa.components._modelling.quantity import Quantity

NEGLIGIBLE = 1e-12
"""Coefficient, relative to the largest in its row and to the largest in its column, that is rounding."""

STATES, OUTPUTS = (Kind.STATE, Kind.SAMPLED_STATE), (Kind.OUTPUT, Kind.SAMPLED_OUTPUT)

_SAMPLES, _SEED = 3, 1

_NOT_SMOOTH = {
    *(ca.OP_FLOOR, ca.OP_CEIL, ca.OP_SIGN, ca.OP_FABS, ca.OP_FMIN, ca.OP_FMAX, ca.OP_FMOD, ca.OP_REMAINDER),
    *(ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR, ca.OP_IF_ELSE_ZERO, ca.OP_COPYSIGN),
}


@dataclass(frozen=True)
class Dependencies:
    """What the equations of a model depend on.

    Attributes:
        kinds: kind of each input, state and output by name, in the order of declaration.
        needs: states and inputs that the equation of each state and output depends on, by name.
        is_sampled: whether the model has a sample time.
    """

    kinds: Mapping[str, Kind]
    needs: Mapping[str, Sequence[str]]
    is_sampled: bool = False

    def reached(self, names: Iterable[str]) -> list[str]:
        """Return these inputs, states and outputs and all that they depend on, in the order of declaration.

        A model with sampled and continuous quantities keeps a continuous one, because it ticks with the others.
        """
        found = self._closed(names)
        if self.is_sampled and found and not any(self.kinds[name] in (Kind.STATE, Kind.OUTPUT) for name in found):
            continuous = [name for kind in (Kind.OUTPUT, Kind.STATE) for name, k in self.kinds.items() if k is kind]
            found |= self._closed(continuous[:1])
        return [name for name in self.kinds if name in found]

    def _closed(self, names: Iterable[str]) -> set[str]:
        """Return these names and all that they depend on."""
        found, waiting = set(), list(names)
        while waiting:
            name = waiting.pop()
            if name not in found:
                found.add(name)
                waiting += self.needs.get(name, ())
        return found


def dependencies(model: Model) -> Dependencies:
    """Return the dependencies of a complete model; `ModelError` for an incomplete one, as `Model.check`."""
    model.check()
    moving = _Moving(model)
    rows = {q.name: _equation(model, q) for q in model.of(*STATES, *OUTPUTS)}
    forces = {str(a): force for motion in model.motions for a, force in _elements(motion.acceleration, motion.force)}
    direct = {name: moving.contained(expression) for name, expression in (rows | forces).items()}
    linear = moving.coefficients(rows | forces) if is_linear(model) else {}
    is_invariant = all(name in linear for name in (*model.der, *model.next, *forces)) and is_linear(model)
    if is_invariant:
        negligible = moving.negligible(linear)
        direct = {name: found - negligible.get(name, set()) for name, found in direct.items()}
    for motion in model.motions:
        for block in _blocks(model, motion, is_invariant):
            names = [str(motion.acceleration[i]) for i in block]
            rates = {motion.rates[i] for i in block}
            together = rates | moving.contained(motion.mass[block, block])
            together = together.union(*(direct[name] for name in names))
            direct |= dict.fromkeys(names, together)
    accelerations = {str(a) for motion in model.motions for a in ca.vertsplit(motion.acceleration)}
    needs = {}
    for name in rows:
        found = direct[name]
        found = found.union(*(direct[a] for a in found & accelerations)) - accelerations
        needs[name] = [q.name for q in moving.quantities if q.name in found]
    kinds = {q.name: q.kind for q in model.of(Kind.INPUT, *STATES, *OUTPUTS)}
    return Dependencies(kinds, needs, model.is_sampled)


def pruned(model: Model, kept: Collection[str]) -> Model:
    """Return the model of some inputs, states and outputs, as of `Dependencies.reached`, and of all parameters.

    What it leaves out is zero in the equations that are left. The solver stays that of the whole model.
    """
    left_out = [q for q in model.of(Kind.INPUT, *STATES) if q.name not in kept]
    small = Model(model.name, model.description)
    small.time, small.information, small.origin = model.time, dict(model.information), model.origin
    small.solver = model.solver or (None if is_linear(model) else "rosenbrock")
    staying = (Kind.PARAMETER, Kind.CONSTANT)
    small._quantities = {q.name: q for q in model if q.kind in staying or q.name in kept}
    small.der.update({name: rule for name, rule in model.der.items() if name in kept})
    small.next.update({name: rule for name, rule in model.next.items() if name in kept})
    zero = [q.expression for q in left_out]
    for motion in model.motions:
        inside = [i for i, rate in enumerate(motion.rates) if rate in kept]
        zero += [motion.acceleration[i] for i in range(len(motion.rates)) if i not in inside]
        if inside:
            rates = tuple(motion.rates[i] for i in inside)
            sides = motion.acceleration[inside], motion.mass[inside, inside], motion.force[inside]
            small.motions.append(Motion(rates, *sides))
    symbols = ca.vertcat(ca.SX(0, 1), *zero)
    small.substitute(symbols, ca.SX.zeros(symbols.shape[0]))
    small.check()
    return small


class _Moving:
    """The variables that move in a model: states, inputs and accelerations, with their symbols."""

    def __init__(self, model: Model):
        self.quantities = model.of(Kind.INPUT, *STATES)
        accelerations = [a for motion in model.motions for a in ca.vertsplit(motion.acceleration)]
        self.symbols = ca.vertcat(ca.SX(0, 1), *[q.expression for q in self.quantities], *accelerations)
        self.names = [*(q.name for q in self.quantities), *map(str, accelerations)]
        # an acceleration is never negligible: it has no nominal value to compare with
        self.nominal = np.array([q.nominal for q in self.quantities] + [np.inf] * len(accelerations))
        self._time, self._parameters = model.time, model.of(Kind.PARAMETER)
        self._names = {self.symbols[i].element_hash(): name for i, name in enumerate(self.names)}

    def contained(self, expression: ca.SX) -> set[str]:
        """Return the names of those that an expression contains."""
        found = (self._names.get(symbol.element_hash()) for symbol in ca.symvar(expression))
        return {name for name in found if name is not None}

    def coefficients(self, rows: Mapping[str, ca.SX]) -> dict[str, ca.SX]:
        """Return the derivatives by the moving variables, (1, n), of each row in which they are constant."""
        moving, found = ca.vertcat(self._time, self.symbols), {}
        for name, row in rows.items():
            slope = ca.jacobian(row, self.symbols)
            if not ca.depends_on(ca.vec(slope), moving) and _is_smooth(row):
                found[name] = slope
        return found

    def negligible(self, slopes: Mapping[str, ca.SX]) -> dict[str, set[str]]:
        """Return the names of those with a negligible coefficient in each row of constant coefficients."""
        if not slopes or not self.names:
            return {}
        column = ca.vertcat(ca.SX(0, 1), *[q.expression for q in self._parameters])
        matrix = ca.Function("coefficients", [column], [ca.densify(ca.vertcat(*slopes.values()))])
        small = np.ones((len(slopes), len(self.names)), dtype=bool)
        for values in _settings(self._parameters):
            found = np.abs(np.array(matrix(values), dtype=float))
            for nominal in (np.ones(len(self.names)), self.nominal):
                small &= _rounding(found, np.where(np.isfinite(self.nominal), nominal, np.inf))
        return {name: {self.names[j] for j in np.flatnonzero(row)} for name, row in zip(slopes, small, strict=True)}


def _rounding(size: NDArray[np.float64], nominal: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which coefficients are rounding, from their sizes, (rows, columns), in units of the nominal values."""
    finite = np.isfinite(nominal)
    scaled = np.where(size > 0, size * np.where(finite, nominal, 1.0), 0.0)
    largest = np.where(finite, scaled, 0.0).max(axis=1, keepdims=True)
    share = np.divide(scaled, largest, out=np.ones_like(scaled), where=largest > 0)
    share = np.where(scaled == 0, 0.0, share)
    # a NaN is no rounding, as it compares with nothing
    return finite & (share <= NEGLIGIBLE * share.max(axis=0, keepdims=True))


def _settings(parameters: Sequence[Quantity]) -> list[NDArray[np.float64]]:
    """Return values of parameters, (n,) each: the start values, and random ones of their size within the bounds."""
    start = np.array([q.start for q in parameters])
    size = np.array([abs(q.start) or q.nominal for q in parameters])
    low = np.array([-np.inf if q.min is None else q.min for q in parameters])
    high = np.array([np.inf if q.max is None else q.max for q in parameters])
    random = np.random.default_rng(_SEED)
    sign = np.where(start < 0, -1.0, 1.0)
    drawn = [sign * size * random.uniform(0.5, 2.0, len(parameters)) for _ in range(_SAMPLES - 1)]
    return [start, *(np.clip(values, low, high) for values in drawn)]


def _is_smooth(expression: ca.SX) -> bool:
    """Whether an expression has no function with a kink or a jump, whose derivative says nothing of the other side."""
    function = ca.Function("row", ca.symvar(expression), [expression])
    return not any(function.instruction_id(k) in _NOT_SMOOTH for k in range(function.n_instructions()))


def _blocks(model: Model, motion: Motion, is_invariant: bool) -> list[list[int]]:
    """Return the irreducible blocks of a mass matrix, as indices of its rates."""
    n = len(motion.rates)
    joined = np.array(ca.DM(ca.sparsify(motion.mass).sparsity(), 1)).astype(bool)
    if is_invariant:
        parameters = model.of(Kind.PARAMETER)
        column = ca.vertcat(ca.SX(0, 1), *[q.expression for q in parameters])
        matrix, couples = ca.Function("mass", [column], [ca.densify(motion.mass)]), np.zeros((n, n), dtype=bool)
        for values in _settings(parameters):
            mass = np.array(matrix(values), dtype=float)
            size = np.sqrt(np.abs(np.diag(mass)))
            couples |= ~(np.abs(mass) <= NEGLIGIBLE * np.outer(size, size))
        joined &= couples
    label = np.arange(n)
    for _ in range(n):
        label = np.array([label[joined[i] | joined[:, i] | (np.arange(n) == i)].min() for i in range(n)])
    return [np.flatnonzero(label == first).tolist() for first in np.unique(label)]


def _equation(model: Model, q: Quantity) -> ca.SX:
    """Return the derivative or next value of a state, or the expression of an output."""
    return {Kind.STATE: model.der, Kind.SAMPLED_STATE: model.next}[q.kind][q.name] if q.kind in STATES else q.expression


def _elements(*columns: ca.SX) -> Iterable[tuple[ca.SX, ...]]:
    """Return the elements of columns of one length, side by side."""
    return zip(*(ca.vertsplit(column) for column in columns), strict=True)
