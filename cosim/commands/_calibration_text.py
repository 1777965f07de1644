"""Answer of the verb `calibrate` as text and as data for JSON."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from hfsa.components._modelling.calibration import Fit
from hfsa.cosim.commands._shell import rendered, table


def calibration_text(found: Fit) -> str:
    """Return the dimensions and the errors as tables, and sentences on what is not determined."""
    study = found.task.study
    dimensions = table("dimension", ">before", ">after", ">standard deviation", "unit", "")
    for name, value in found.values.items():
        variable, bound = study.variables[name], found.at_bound[name]
        note = f"at its {bound} bound" if bound else ""
        deviation = _deviation(found.deviations[name])
        dimensions.add_row(name, f"{variable.value:.7g}", f"{value:.7g}", deviation, variable.unit, note)
    for name, (value, deviation) in found.others.items():
        response = study.responses[name]
        dimensions.add_row(name, "", f"{value:.7g}", _deviation(deviation), response.unit, "not measured")
    errors = table("error", ">rms before", ">rms after", ">largest before", ">largest after", "unit")
    for name in found.measured:
        one, other = found.before[name], found.after[name]
        numbers = (_rms(one), _rms(other), np.abs(one).max(), np.abs(other).max())
        errors.add_row(name, *(f"{number:.4g}" for number in numbers), study.responses[name].unit)
    head = f"{study.title}: {found.rows} rows of {', '.join(found.measured)}, {found.objective}"
    return "\n".join([head, rendered(dimensions, errors), *sentences(found)])


def sentences(found: Fit) -> list[str]:
    """Return sentences on the worst row, on what is not determined, and on the end of the solver."""
    lines = []
    for word, errors in (("before", found.before), ("after", found.after)):
        weighted = found.weighted(errors)
        worst = int(np.argmax(weighted))
        lines.append(f"worst row {word}: row {worst + 1}, weighted square {weighted[worst]:.4g}")
    relative = ", ".join(f"{value:.3g}" for value in found.singular_values)
    lines.append(f"rank {found.rank} of {len(found.free)}, singular values {relative}")
    unseen = [name for name, deviation in found.deviations.items() if math.isinf(deviation)]
    if unseen:
        seen = [name for name, (_, deviation) in found.others.items() if not math.isinf(deviation)]
        told = f"; determined are {', '.join([*_determined(found), *seen])}" if seen or _determined(found) else ""
        lines.append(
            f"these rows do not determine {', '.join(unseen)} one by one: the values are one choice of many{told}"
        )
        lines += [f"no row changes along {_combination(direction)}" for direction in found.directions]
    if any(math.isnan(deviation) for deviation in found.deviations.values()):
        reason = "the largest error was minimised" if found.objective == "largest" else "no number is redundant"
        lines.append(f"standard deviations are not known, because {reason}")
    bound = [name for name, side in found.at_bound.items() if side]
    if bound:
        lines.append(f"{', '.join(bound)} ended at a bound: what would fit better is beyond it (--bounds)")
    if not found.is_converged:
        lines.append(f"NOT converged: {found.message}")
    return lines


def calibration_data(found: Fit, path: Any) -> dict[str, Any]:
    """Return a result for JSON, in SI units; a standard deviation that is not known or infinite is null."""
    study = found.task.study
    return {
        "calibrated": study.title,
        "file": path,
        "rows": found.rows,
        "objective": found.objective,
        "dimensions": [
            {
                "name": name,
                "before": study.variables[name].value,
                "value": value,
                "standard_deviation": _finite(found.deviations[name]),
                "is_determined": not math.isinf(found.deviations[name]),
                "at_bound": found.at_bound[name] or None,
                "unit": study.variables[name].unit,
            }
            for name, value in found.values.items()
        ],
        "responses": [
            {
                "name": name,
                "value": value,
                "standard_deviation": _finite(deviation),
                "unit": study.responses[name].unit,
            }
            for name, (value, deviation) in found.others.items()
        ],
        "errors": {
            name: {
                "rms_before": _rms(found.before[name]),
                "rms_after": _rms(found.after[name]),
                "largest_before": float(np.abs(found.before[name]).max()),
                "largest_after": float(np.abs(found.after[name]).max()),
                "unit": study.responses[name].unit,
            }
            for name in found.measured
        },
        "rank": found.rank,
        "singular_values": found.singular_values,
        "undetermined_directions": found.directions,
        "is_converged": found.is_converged,
        "sentences": sentences(found),
    }


def arguments_text(found: Fit) -> str:
    """Return the dimensions as arguments of the part."""
    return " ".join(f"-p {name}={value:.9g}" for name, value in found.values.items())


def _determined(found: Fit) -> list[str]:
    """Return the names of the free dimensions that are determined."""
    return [name for name, deviation in found.deviations.items() if not math.isinf(deviation)]


def _combination(direction: Mapping[str, float]) -> str:
    """Return a direction in words, in shares of the present values."""
    return ", ".join(f"{name} {100 * share:+.3g} %" for name, share in direction.items())


def _deviation(value: float) -> str:
    """Return a standard deviation as text."""
    if math.isinf(value):
        return "not determined"
    return "not known" if math.isnan(value) else f"{value:.2g}"


def _finite(value: float) -> float | None:
    """Return a number, `None` where it is not finite."""
    return value if math.isfinite(value) else None


def _rms(values: np.ndarray) -> float:
    """Return the root mean square."""
    return float(np.sqrt((values**2).mean()))
