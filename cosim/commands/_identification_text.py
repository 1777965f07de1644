"""Answer of the verb `identify` as text and as data for JSON."""

import math
from typing import Any

import numpy as np

from hfsa.cosim.commands._shell import rendered, table
from hfsa.cosim.results.inertia import Identification


def identification_text(found: Identification) -> str:
    """Return the parameters as a table, and sentences on their errors and on what is not determined."""
    whole = table("", ">value", ">standard deviation", ">model", "unit")
    columns = found.value, found.standard_deviation, found.model
    for (name, unit), value, deviation, model in zip(found.parameters.items(), *columns, strict=True):
        whole.add_row(name, _number(value, ".6g"), _number(deviation, ".2g"), _number(model, ".6g"), unit)
    center = ", ".join(_number(1e3 * c, ".5g") for c in found.center)
    unknown = "mass centre not known, as no mass is found"
    of = f"the payload of {found.body}" if found.of == "payload" else found.body
    lines = [
        f"{found.path}: inertia of {of}; {found.motion} motion, {found.regressor} equations",
        rendered(whole),
        f"mass centre {center} mm from the reference point, body axes"
        if np.all(np.isfinite(found.center))
        else unknown,
        f"rank {found.rank} of {len(found.parameters)}, condition number {found.condition_number:.5g}",
        f"residuals {found.torque_residual:.3g} N.m, {found.force_residual:.3g} N; standard deviations are for noise "
        f"of {found.torque_noise:.3g} N.m, {found.force_noise:.3g} N",
    ]
    return "\n".join([*lines, *found.sentences, *unseen_sentences(found)])


def unseen_sentences(found: Identification) -> list[str]:
    """Return a sentence for each parameter or combination that the manoeuvre does not determine."""
    alone = [group[0] for group in found.unseen if len(group) == 1]
    lines = [f"not seen by this manoeuvre: {', '.join(alone)}"] if alone else []
    return lines + [
        f"seen in combinations only, not one by one: {', '.join(group)}" for group in found.unseen if len(group) > 1
    ]


def identification_data(found: Identification) -> dict[str, Any]:
    """Return an identification for JSON, in SI units; parameters that are not determined are null."""
    columns = found.value, found.standard_deviation, found.model
    return {
        "file": found.path,
        "source": found.source,
        "alone": found.alone_file or None,
        "body": found.body,
        "of": found.of,
        "motion": found.motion,
        "regressor": found.regressor,
        "parameters": [
            {"name": name, "value": value, "standard_deviation": deviation, "model": model, "unit": unit}
            for (name, unit), value, deviation, model in zip(
                found.parameters.items(), *(np.asarray(column).tolist() for column in columns), strict=True
            )
        ],
        "mass_center": found.center,
        "covariance": found.covariance,
        "condition_number": found.condition_number,
        "rank": found.rank,
        "unseen": found.unseen,
        "noise": {"torque": found.torque_noise, "force": found.force_noise},
        "residual": {"torque": found.torque_residual, "force": found.force_residual},
        "sentences": [*found.sentences, *unseen_sentences(found)],
    }


def _number(value: float, digits: str) -> str:
    """Return a number as text."""
    return "not known" if math.isnan(value) else f"{value:{digits}}"
