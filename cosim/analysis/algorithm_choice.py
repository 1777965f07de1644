"""Algorithm `auto`: the cheapest algorithm within the tolerance; and the warnings about an algorithm and its step.

    choice = choose(analysis, step_size=50e-6, tolerance=1e-3)       # choice.algorithm, choice.errors of all tried
    for sentence in warnings(analysis, analysis.effect("gauss_seidel", 50e-6), tolerance=1e-3):
        print(sentence)

The algorithms of `CANDIDATES` are evaluated, the cheapest first, until one is good enough: the error of its responses
is within the tolerance, and it is stable exactly where the system is. If none is, `auto` takes the one with the
smallest error, and the warning names a sufficient step. Everything follows from the linearised FMUs
(`analysis/step_effect.py`) before a run.
"""

import math
from collections.abc import Collection, Iterator

from hfsa.cosim.analysis.sampling import sample_times, sampling_limit
from hfsa.cosim.analysis.step_effect import StepAnalysis, StepEffect
from hfsa.cosim.analysis.step_limits import advice, fitting
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.masters.algorithms import CANDIDATES
from hfsa.cosim.results.records import AlgorithmChoice
from hfsa.cosim.systems.errors import StructureError

_HALVINGS = 12
"""Largest number of halvings in the search for a step that is good enough or reveals an instability."""

NOT_KNOWN = (ValueError, ArithmeticError, StepError)
"""Errors of an analysis that is not possible; StructureError and LinAlgError are ValueErrors."""


def choose(
    analysis: StepAnalysis, step_size: float, tolerance: float, offered: Collection[str] = CANDIDATES
) -> AlgorithmChoice:
    """Return the choice of an algorithm for a step [s], among the algorithms of `CANDIDATES` in `offered`.

    Raises `StructureError` where none of them can run the system.
    """
    errors: dict[str, float] = {}
    refusals: dict[str, str] = {}
    for algorithm in CANDIDATES:
        if algorithm not in offered:
            continue
        try:
            errors[algorithm] = effective_error(analysis.effect(algorithm, step_size))
        except NOT_KNOWN as error:
            refusals[algorithm] = str(error)
            continue
        if errors[algorithm] <= tolerance:
            break
    if not errors:
        raise StructureError("; ".join(dict.fromkeys(refusals.values())))
    best = min(errors, key=errors.__getitem__)
    about = "response" if analysis.excitations else "modes"
    return AlgorithmChoice(best, step_size, tolerance, about, errors, refusals)


def effective_error(effect: StepEffect) -> float:
    """Return the error of an effect; infinite where the steps change stability."""
    return math.inf if effect.hides_instability or effect.causes_instability else effect.error


def warnings(analysis: StepAnalysis, effect: StepEffect, tolerance: float) -> list[str]:
    """Return the warnings about an algorithm and a step: of instability, else of responses beyond the tolerance."""
    if effect.own:
        return [_hidden(analysis, effect)] if effect.hides_instability else instability(analysis)
    if effect.causes_instability:
        sentence = advice(analysis.coupled, effect.algorithm, effect.step_size, _times(analysis))
        return [sentence] if sentence else []
    return [] if effect.error <= tolerance else [_inaccurate(analysis, effect, tolerance)]


# Instability ----------------------------------------------------------------------------------------------------------


def instability(analysis: StepAnalysis) -> list[str]:
    """Return the warnings about a system that is unstable without communication steps; none for a stable system."""
    if not analysis.coupled.exact.growth:
        return []
    return [f"{_growing(analysis)}; {_sampling(analysis) or 'no step and no algorithm makes it stable'}"]


def _hidden(analysis: StepAnalysis, effect: StepEffect) -> str:
    """Return the warning about steps that hide an instability of the system."""
    hides = (
        f"{_growing(analysis)}, which {effect.algorithm} at a step of {effect.step_size:.4g} s hides: its results are "
        "not the motion of the system"
    )
    return "; ".join(filter(None, (hides, _sampling(analysis), _shown(analysis, effect))))


def _growing(analysis: StepAnalysis) -> str:
    """Return the clause about the growing mode of an unstable system."""
    own = analysis.coupled.exact.growth
    at = f" at {own.frequency:.4g} Hz" if own.frequency else ""
    return f"the system itself is unstable: without communication steps a mode grows by {own.rate:.4g} 1/s{at}"


def _sampling(analysis: StepAnalysis) -> str:
    """Return the clause about the limit of the sample time; empty where nothing is sampled or no limit is known."""
    try:
        found = sampling_limit(analysis.system, analysis.instances, analysis.outputs)
    except NOT_KNOWN:
        return ""
    if found is None or math.isinf(found.longest):
        return ""
    if not found.longest:
        return f"its sample time is {found.sample_time:.4g} s, and none that was evaluated makes it stable"
    return f"it is stable up to a sample time of {found.longest:.4g} s, its own is {found.sample_time:.4g} s"


def _shown(analysis: StepAnalysis, effect: StepEffect) -> str:
    """Return the clause about an algorithm and a step that reveal the instability."""
    others = (algorithm for algorithm in CANDIDATES if algorithm != effect.algorithm)
    algorithm = next((name for name in others if _is_seen(analysis, name, effect.step_size)), None)
    steps = _shorter(analysis, effect.step_size)
    shorter = next((step for step in steps if _is_seen(analysis, effect.algorithm, step)), None)
    words = [*([algorithm] if algorithm else []), *([f"a step of {shorter:.4g} s"] if shorter else [])]
    return f"{' or '.join(words)} shows it" if words else ""


def _is_seen(analysis: StepAnalysis, algorithm: str, step_size: float) -> bool:
    """Whether an algorithm at a step [s] reveals that the system is unstable."""
    effect = _effect(analysis, algorithm, step_size)
    return effect is not None and not effect.hides_instability


# Accuracy -------------------------------------------------------------------------------------------------------------


def _inaccurate(analysis: StepAnalysis, effect: StepEffect, tolerance: float) -> str:
    """Return the warning about responses with errors beyond the tolerance."""
    step = f"{effect.algorithm} at a step of {effect.step_size:.4g} s"
    limit = f"more than the tolerance of {100 * tolerance:.3g} %"
    if not math.isfinite(effect.error):
        return f"with {step} no frequency of the band is resolved, and responses err by {limit}; take a shorter step"
    if effect.worst is None:
        errs = f"with {step} the rate of a mode errs by {100 * effect.error:.3g} %, {limit}"
    else:
        output, excited, frequency = effect.worst
        errs = (
            f"with {step} the response of {output} to {excited} errs by {100 * effect.error:.3g} % at "
            f"{frequency:.4g} Hz, {limit}"
        )
    would = [*_better(analysis, effect, tolerance), *_fine_enough(analysis, effect, tolerance)]
    return f"{errs}; {' or '.join(would)} would do" if would else f"{errs}; no step that was evaluated would do"


def _better(analysis: StepAnalysis, effect: StepEffect, tolerance: float) -> Iterator[str]:
    """Yield the cheapest other algorithm within the tolerance at this step."""
    for algorithm in CANDIDATES:
        other = None if algorithm == effect.algorithm else _effect(analysis, algorithm, effect.step_size)
        if other and effective_error(other) <= tolerance:
            yield f"the algorithm {algorithm} ({100 * other.error:.2g} %)"
            return


def _fine_enough(analysis: StepAnalysis, effect: StepEffect, tolerance: float) -> Iterator[str]:
    """Yield the longest of the halved steps within the tolerance with the same algorithm."""
    for shorter in _shorter(analysis, effect.step_size):
        other = _effect(analysis, effect.algorithm, shorter)
        if other and effective_error(other) <= tolerance:
            yield f"a step of {shorter:.4g} s ({100 * other.error:.2g} %)"
            return


def _effect(analysis: StepAnalysis, algorithm: str, step_size: float) -> StepEffect | None:
    """Return the effect of an algorithm at a step [s], `None` where it is not known or the step does not fit."""
    try:
        return analysis.effect(algorithm, step_size)
    except NOT_KNOWN:
        return None


def _shorter(analysis: StepAnalysis, step_size: float) -> Iterator[float]:
    """Yield shorter steps [s] that fit the sample times, each about half of the one before."""
    times = _times(analysis)
    for n in range(1, _HALVINGS + 1):
        yield fitting(step_size / 2**n, times)


def _times(analysis: StepAnalysis) -> Collection[float]:
    """Return the sample times [s] of the analysed system."""
    return sample_times(analysis.system, analysis.instances, {}).values()
