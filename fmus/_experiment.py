"""Default experiment of a model: stop time and step size from its eigenvalues."""

import math
from dataclasses import dataclass

import numpy as np

from hfsa.components import Model
from hfsa.components._modelling.functions import Functions
from hfsa.components._modelling.model import Kind

STEPS_PER_PERIOD, PERIODS, MOST_STEPS = 20, 20, 10_000


@dataclass(frozen=True)
class Experiment:
    """Stop time and communication step size [s] of a simulation that starts at 0."""

    stop_time: float
    step_size: float


def default_experiment(model: Model, functions: Functions) -> Experiment:
    """Return an experiment that resolves the fastest mode of a model and covers the slowest, at the start values.

    The step is the sample time of a sampled model, else a 20th of the period of the fastest mode. The stop time is 20
    periods of the slowest mode, at least 1000 and at most 10000 steps. A model without modes gets 1 s in steps of 1 ms.
    """
    omega = _frequencies(model, functions)
    if model.is_sampled:
        step = model["sample_time"].start
    elif len(omega):
        step = _round(2 * math.pi / omega.max() / STEPS_PER_PERIOD)
    else:
        step = 1e-3
    longest = PERIODS * 2 * math.pi / omega.min() if len(omega) else 0.0
    return Experiment(min(max(_round(longest), 1000 * step), MOST_STEPS * step), step)


def _frequencies(model: Model, functions: Functions) -> np.ndarray:
    """Return the nonzero |eigenvalues| [rad/s] of the Jacobian at the start values; may be empty."""
    start = [[q.start for q in model.of(kind)] for kind in (Kind.STATE, Kind.SAMPLED_STATE, Kind.INPUT, Kind.PARAMETER)]
    jacobian = np.array(functions.jacobian(0.0, *start))
    if not jacobian.size or not np.isfinite(jacobian).all():
        return np.empty(0)
    omega = np.abs(np.linalg.eigvals(jacobian))
    return omega[omega > 1e-9 * max(omega.max(), 1e-300)]


def _round(value: float) -> float:
    """Return `value` rounded down to 1, 2 or 5 times a power of ten, so that the result is the same on all machines."""
    if value <= 0:
        return 0.0
    exponent = math.floor(math.log10(value) + 1e-9)
    digit = max(d for d in (1, 2, 5) if d <= value / 10.0**exponent * (1 + 1e-9))
    return float(f"{digit}e{exponent}")
