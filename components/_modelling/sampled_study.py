"""Design studies of functions that are not CasADi expressions, such as eigenvalues: responses from numbers alone.

    dimensions = {"mass": Dimension(1.0, 1.0, "kg", "Mass"), "place": Dimension(0.0, 0.1, "m", "Place")}
    study = sampled_study("beam", dimensions, {"f1": ("Hz", "First frequency")}, ["a mass above 0"], evaluate)

`evaluate` takes the values of all dimensions and returns responses, margins of the conditions, and what an optimisation
maximises together instead of the first response, or nothing; all are finite wherever possible, on either side of a
condition. Derivatives are central differences, in steps of 6e-6 of a dimension's size: their error
is about 1e-9 of the response, and they have no meaning where a response has a kink, as the lower of two frequencies
that cross.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._modelling.study import Response, Study, Variable

Evaluate = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]
"""From the values of all dimensions to responses, margins of the conditions, and what is maximised together."""

_POINTS, _STARTS = 51, 4
_KEPT = 100_000


class Dimension(NamedTuple):
    """A free dimension: present value, size of a large change of it, unit and description."""

    value: float
    size: float
    unit: str
    description: str


def sampled_study(
    title: str,
    dimensions: Mapping[str, Dimension],
    responses: Mapping[str, tuple[str, str]],
    conditions: Sequence[str],
    evaluate: Evaluate,
    together: int = 0,
    remarks: Sequence[str] = (),
) -> Study:
    """Return the study of a function.

    Args:
        title: name of the design in messages and figures.
        dimensions: free dimensions by name.
        responses: unit and description of every response by name; the first is the objective to maximise.
        conditions: descriptions of the conditions.
        evaluate: the function.
        together: number of values that are maximised together instead of the first response, their least one.
        remarks: notes for the reader of an optimum.
    """
    sizes = np.array([dimension.size for dimension in dimensions.values()])
    own = len(responses) + len(conditions)
    function = _Function(lambda u: evaluate(sizes * u), len(dimensions), own + together)
    x = ca.MX.sym("x", len(dimensions))
    found = function(x / ca.DM(sizes))
    return _SampledStudy(
        title,
        {name: Variable(x[i], d.value, d.unit, d.description) for i, (name, d) in enumerate(dimensions.items())},
        {
            name: Response(found[i], *texts, found[own:] if i == 0 and together else None)
            for i, (name, texts) in enumerate(responses.items())
        },
        {text: found[len(responses) + i] for i, text in enumerate(conditions)},
        {},
        {},
        remarks,
        _POINTS,
        _STARTS,
        function=function,
    )


@dataclass(frozen=True)
class _SampledStudy(Study):
    """A study that keeps the Python object which its expressions call, as CasADi does not."""

    function: Any = None


class _Function(ca.Callback):
    """A Python function of numbers as a CasADi function; its derivatives are central differences."""

    def __init__(self, evaluate: Evaluate, inputs: int, outputs: int):
        ca.Callback.__init__(self)
        self._shape = inputs, outputs
        self._found = lru_cache(_KEPT)(lambda *values: np.concatenate(evaluate(np.array(values))))
        self.construct("responses", {"enable_fd": True, "fd_method": "central"})

    def get_n_in(self) -> int:
        """Return the number of arguments."""
        return 1

    def get_n_out(self) -> int:
        """Return the number of results."""
        return 1

    def get_sparsity_in(self, i: int) -> ca.Sparsity:  # noqa: ARG002 (CasADi's own)
        """Return the shape of the argument."""
        return ca.Sparsity.dense(self._shape[0])

    def get_sparsity_out(self, i: int) -> ca.Sparsity:  # noqa: ARG002 (CasADi's own)
        """Return the shape of the result."""
        return ca.Sparsity.dense(self._shape[1])

    def eval(self, arg: Any) -> list[ca.DM]:
        """Return responses and margins in a column, at the values in a column."""
        return [ca.DM(self._found(*arg[0].full().ravel().tolist()))]
