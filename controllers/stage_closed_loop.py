"""Closed-loop analysis of the 3-RRR stage with ideal force actuators under PD and computed torque (CTC) control.

    M l'' + D l' + H(l) = Q,   e = r - l              stage; D = damping_time K0, 0 in the source
    pd    Q = Kp e + Kv e'                            Kp [N/m],  Kv [N.s/m]
    ctc   Q = M (r'' + Kv e' + Kp e) + D l' + H(l)    Kp [1/s2], Kv [1/s]

so that, with K = dH/dl at equilibrium, the error dynamics are

    pd    M e'' + (D + Kv) e' + (K + Kp) e = 0        with the equilibrium Kp e = H(r - e)
    ctc   e'' + Kv e' + Kp e = 0                      with the equilibrium e = 0

PD is stable for all Kp, Kv >= 0: with r constant and P the energy of the hinges, T + P + Kp e'e / 2 never grows.
Without damping the error does not settle, without stiffness it does not vanish. `verdict` contains:

    converges             the transient of a motion decays
    rings_for_ever        the transient does not decay: the loop has no damping (Kv = 0, damping_time = 0)
    softer_than_hinges    Kp is below a stiffness of the hinges: less than half of the motion is reached (pd)
    keeps_its_error       Kp = 0: the loop has no restoring force (ctc)

`converges` refers to the continuous loop, not to a numerical solution. The trapezoidal rule does not damp unresolved
modes: a step h multiplies a mode with a fast pole s by (1 + h s / 2) / (1 - h s / 2), close to -1, so the numerical
error alternates in sign at every step long after the loop has settled. `trapezoidal_factor` is the magnitude of that
factor.

An analysis, not a model: `hfsa analyze stage_closed_loop -p law=pd -p proportional_gain=1e9 -p derivative_gain=5e4`.

Source: thesis of 2000 on the 3-RRR stage, eqs (5.1) and (5.8), which prints the states in place of their errors, and
table 5.1; the thesis reports that its PD gains do not converge.
"""

from collections.abc import Callable
from enum import StrEnum
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np

from hfsa.components import ModelError
from hfsa.components._mechanics.rrr_design import THESIS_DESIGN, Design
from hfsa.components._modelling.model import one_of
from hfsa.components.rrr_stage import analyze as analyze_stage
from hfsa.controllers._feedback import poles, sample_time_limit

Level = Literal["constant_jacobian", "exact"]
Law = Literal["pd", "ctc"]
Triple = tuple[float, float, float]

_ITERATIONS = 20
_SETTLED = 1e-12
"""Last Newton step of the equilibrium search, relative to the error."""


class Verdict(StrEnum):
    """Long-term behaviour of an error, as defined in the docstring of the module."""

    CONVERGES = "converges"
    RINGS = "rings_for_ever"
    SOFT = "softer_than_hinges"
    KEEPS = "keeps_its_error"


class _Stage(NamedTuple):
    """The linearised stage in its elongations: M, D, K, shape (3, 3), and the holding forces H, (3,)."""

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    force: np.ndarray


class _Loop(NamedTuple):
    """Error dynamics mass e'' + damping e' + stiffness e = 0, and the gains of the control law, (3, 3) each."""

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    position_gain: np.ndarray
    rate_gain: np.ndarray


UNITS = {
    "verdict": "1",
    "poles": "1/s",
    "natural_frequencies_hz": "Hz",
    "damping_ratios": "1",
    "final_share": "1",
    "trapezoidal_factor": "1",
    "time_constant": "s",
    "peak_time": "s",
    "sample_time_limit": "s",
    "final_error": "m",
    "peak_error": "m",
    "start_force": "N",
}
"""Units of the results of `analyze`, in the notation of `_modelling/parts.py`."""


def analyze(
    *,
    level: Level = "constant_jacobian",
    law: Law = "pd",
    proportional_gain: float = 1e9,
    derivative_gain: float = 5e4,
    rate: float = 3e-6,
    elongation: Triple = (12e-6, 12e-6, 12e-6),
    damping_time: float = 0.0,
    solver_steps: int = 74,
    design: Design = THESIS_DESIGN,
) -> dict[str, Any]:
    """Return the behaviour of the error under a ramp of all elongations, in SI units; arrays are per stack or per pole.

    Args:
        level: level of the stage, `constant_jacobian` or `exact`.
        law: `pd` or `ctc`; the model of `ctc` is the controlled stage itself.
        proportional_gain: Kp of each stack [N/m] (pd), [1/s2] (ctc).
        derivative_gain: Kv of each stack [N.s/m] (pd), [1/s] (ctc).
        rate: initial rate of the reference of all three stacks [m/s].
        elongation: reference at the end of the motion [m].
        damping_time: D / K0 of the stage [s]; 0 in the source.
        solver_steps: number of equal solver steps from 0 to `elongation`.
        design: design of the stage, the arguments `kinematics`, `links`, `hinge`, `masses`, `jacobian`, `stiffness` and
            `mass`, as in `rrr_stage`.

    Returns:
        verdict: one or two of the identifiers above.
        poles: poles of the loop at equilibrium, by magnitude, (6,) [1/s].
        natural_frequencies_hz: |pole| / (2 pi), (6,) [Hz].
        damping_ratios: -real part / |pole|, 1 for a real pole, (6,).
        time_constant: slowest time constant, infinite for an undamped pole [s].
        final_error: error at equilibrium, (3,) [m].
        final_share: largest final error / largest elongation [1].
        peak_error, peak_time: largest error of the initial transient and its time, without the part due to H(r) / Kp
            [m], [s].
        start_force: force of each stack at the start of the motion [N].
        sample_time_limit: largest stable sample time with the command `held` between samples and with an additional
            delay of one sample (`held_delayed`), with the prediction of `stage_computed_torque` for `ctc`; `rigid` and
            `rigid_delayed` are those of the masses without hinges. 0 if no sample time is stable, infinite if all are
            [s].
        trapezoidal_factor: largest factor per step over all poles [1].

    Raises:
        ModelError: as `rrr_stage`; an unknown law, level or parameter set; a gain or damping time below 0; a rate or
            number of steps that is not above 0; elongations without a pose.
    """
    one_of(law, ("pd", "ctc"), "stage_closed_loop: law")
    one_of(level, ("constant_jacobian", "exact"), "stage_closed_loop: level")
    gains = {"proportional_gain": proportional_gain, "derivative_gain": derivative_gain}
    for name, value in {**gains, "damping_time": damping_time}.items():
        if not (np.isfinite(value) and value >= 0):
            raise ModelError(f"stage_closed_loop: {name} is {value:g}, expected 0 or more")
    for name, value in (("rate", rate), ("solver_steps", solver_steps)):
        if not (np.isfinite(value) and value > 0):
            raise ModelError(f"stage_closed_loop: {name} is {value:g}, expected more than 0")

    stage_of = partial(analyze_stage, level=level, design=design)

    def stage_at(point: np.ndarray) -> _Stage:
        """Return the linearised stage at elongations [m]."""
        found = stage_of(elongation=tuple(point.tolist()))
        return _Stage(found["inertia"], damping, found["stiffness"], found["force"])

    damping = damping_time * stage_of()["stiffness"]
    reference, duration = np.array(elongation), max(map(abs, elongation)) / rate
    start = _loop(law, stage_at(np.zeros(3)), proportional_gain, derivative_gain)
    if law == "pd":
        error, stage = _balance(lambda e: stage_at(reference - e), proportional_gain)
    else:
        kept = 0.0 if proportional_gain else rate * _inverse(derivative_gain)
        error, stage = np.full(3, kept), stage_at(reference)
    loop = _loop(law, stage, proportional_gain, derivative_gain)
    s = poles(loop.mass, loop.damping, loop.stiffness)
    peak_error, peak_time = _first_peak(start, rate)
    return {
        "verdict": _verdict(law, loop, stage, proportional_gain),
        "poles": s,
        "natural_frequencies_hz": np.abs(s) / (2 * np.pi),
        "damping_ratios": np.divide(-np.real(s), np.abs(s), out=np.zeros(6), where=s != 0),
        "time_constant": _inverse(np.abs(np.real(s)).min()),
        "final_error": error,
        "final_share": np.abs(error).max() / np.abs(reference).max() if reference.any() else 0.0,
        "peak_error": peak_error,
        "peak_time": peak_time,
        "start_force": start.rate_gain @ np.full(3, rate),
        "sample_time_limit": _limits(law, stage, proportional_gain, derivative_gain),
        "trapezoidal_factor": _trapezoidal_factor(s, duration / solver_steps),
    }


def _loop(law: Law, stage: _Stage, proportional_gain: float, derivative_gain: float) -> _Loop:
    """Return the loop about a point; the gains of CTC include the cancellation of the hinges and their damping."""
    M, D, K, _ = stage
    if law == "pd":
        position_gain, rate_gain = proportional_gain * np.eye(3), derivative_gain * np.eye(3)
    else:
        position_gain, rate_gain = proportional_gain * M - K, derivative_gain * M - D
    return _Loop(M, D + rate_gain, K + position_gain, position_gain, rate_gain)


def _balance(stage_at: Callable[[np.ndarray], _Stage], proportional_gain: float) -> tuple[np.ndarray, _Stage]:
    """Return the error (3,) [m] at which Kp e = H, and the stage there.

    `stage_at` maps an error to the stage. The error is the unknown because the difference r - l would lose digits.
    """
    error = np.zeros(3)
    for _ in range(_ITERATIONS):
        stage = stage_at(error)
        step = np.linalg.solve(stage.stiffness + proportional_gain * np.eye(3), stage.force - proportional_gain * error)
        error = error + step
        if np.abs(step).max() <= _SETTLED * np.abs(error).max():
            return error, stage
    raise ModelError(
        f"stage_closed_loop: no equilibrium found near the reference at proportional_gain {proportional_gain:g} N/m"
    )


def _verdict(law: Law, loop: _Loop, stage: _Stage, proportional_gain: float) -> list[Verdict]:
    """Return whether the error decays and whether its final value is small."""
    if law == "ctc" and proportional_gain == 0:
        return [Verdict.KEEPS]
    verdict = [Verdict.CONVERGES if loop.damping.any() else Verdict.RINGS]
    if law == "pd" and proportional_gain < np.linalg.eigvalsh(stage.stiffness).max():
        verdict.append(Verdict.SOFT)
    return verdict


def _first_peak(loop: _Loop, rate: float) -> tuple[float, float]:
    """Return the largest e [m] from the initial state e = 0, e' = rate on all stacks, and its time [s].

    Equal stacks at rest move in one mode, e'' + 2 a e' + w^2 e = 0; at e' = 0, e is rate exp(-a t) / w.
    """
    mass, damping, stiffness = (matrix.sum() for matrix in loop[:3])
    a, w = damping / (2 * mass), np.sqrt(stiffness / mass)
    if w == 0:
        return rate * _inverse(2 * a), np.inf
    b = np.sqrt(abs(a**2 - w**2))
    turn = np.log((a + b) / w) if a > w else np.arctan2(b, a)
    time = turn / b if b else 1 / w
    return rate * np.exp(-a * time) / w, time


def _limits(law: Law, stage: _Stage, proportional_gain: float, derivative_gain: float) -> dict[str, float]:
    """Return the sample-time limits of the stage and of its masses alone, without and with a delay of one sample."""
    nothing = np.zeros((3, 3))
    limits = {}
    for name, plant in (("held", stage), ("rigid", stage._replace(damping=nothing, stiffness=nothing))):
        gains = _loop(law, plant, proportional_gain, derivative_gain)[3:]
        for word, delay, samples_late in ((name, False, 0.5), (f"{name}_delayed", True, 1.5)):
            ahead = -samples_late * plant.stiffness if law == "ctc" else nothing
            limits[word] = sample_time_limit(*plant[:3], *gains, ahead, delay=delay)
    return limits


def _trapezoidal_factor(s: np.ndarray, step: float) -> float:
    """Return the largest |(1 + z) / (1 - z)|, z = step s / 2, by its logarithm, which is accurate close to 1."""
    z = step * s / 2
    return float(np.exp(0.5 * np.log1p(4 * z.real / np.abs(1 - z) ** 2)).max())


def _inverse(value: float) -> float:
    """Return 1 / value, infinite for 0."""
    return 1 / value if value else np.inf
