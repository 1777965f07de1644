"""Design study of a beam module: its compliance and the separation of its freedoms over its dimensions.

Variables are the numbers that define the module: normalised ones, or lengths and constants of the material of a module
with dimensions, or all numbers of a list of beams. Responses are

    separation    ratio of the least compliant freedom to the most compliant constraint (`mobility.py`); freedoms are
                  the motions most like those of the present design
    center        place of the centre of compliance along X, from the reference point
    C11, C22, ... entries of the compliance that are not 0, one of each size; of a list those on the diagonal

Entries of equal size, as C22 and C33 of three beams, stay so while all beams change alike. Derivatives are central
differences (`sampled_study.py`).
"""

import numpy as np
from scipy.optimize import linear_sum_assignment

from hfsa.components._mechanics.beam_kinds import ASSEMBLY
from hfsa.components._mechanics.beam_module import Design, Module
from hfsa.components._mechanics.beam_numbers import numbers_of
from hfsa.components._mechanics.mobility import Mobility, mobility
from hfsa.components._modelling.errors import ModelError
from hfsa.components._modelling.sampled_study import sampled_study
from hfsa.components._modelling.study import Study

_SAME = 1e-9
"""Relative difference of the sizes of entries that are equal by symmetry."""


def design_study(design: Design) -> Study:
    """Return the study of a design; `ModelError` for a design that is not possible."""
    module = design.module
    numbers = numbers_of(design)
    found = mobility(module.compliance)
    freedoms = len(found.freedoms)
    pairs = freedoms * (6 - freedoms)
    entries = [(i, i) for i in range(6)] if design.kind == ASSEMBLY else _entries(_compliance(module))
    has_center = abs(found.center[0]) > _SAME

    def evaluate(values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return responses and margins; NaN where there is no module."""
        margins = np.full(len(numbers.conditions), -1.0)
        try:
            other = numbers.design(values.tolist())
            margins = np.array([margin(other) for margin in numbers.conditions.values()])
            there = other.module
            seen = mobility(there.compliance)
        except (ModelError, np.linalg.LinAlgError, ZeroDivisionError):
            return np.full(1 + has_center + len(entries), np.nan), margins, np.full(pairs, np.nan)
        eigenvalues = _followed(found, seen)
        ratios = np.divide.outer(eigenvalues[:freedoms], eigenvalues[freedoms:]).ravel()
        center = [seen.center[0] * (1.0 if there.size is None else there.size.length)] if has_center else []
        C = _compliance(there)
        return np.array([ratios.min(), *center, *(C[i, j] for i, j in entries)]), margins, ratios

    is_normalised = module.size is None
    responses = {"separation": ("1", f"Separation of {freedoms} freedoms")}
    if has_center:
        responses["center"] = ("1" if is_normalised else "m", "Place of the centre of compliance along X")
    for i, j in entries:
        unit = "1" if is_normalised else (("m/N", "1/N"), ("1/N", "rad/(N.m)"))[i // 3][j // 3]
        responses[f"C{i + 1}{j + 1}"] = (unit, f"Compliance, row {i + 1}, column {j + 1}")
    title = f"beam module {design.kind}"
    return sampled_study(title, numbers.dimensions, responses, list(numbers.conditions), evaluate, pairs)


def _compliance(module: Module) -> np.ndarray:
    """Return the compliance in SI units of a module with dimensions, else the normalised one, shape (6, 6)."""
    return module.compliance if module.size is None else module.dimensional_compliance()


def _followed(present: Mobility, other: Mobility) -> np.ndarray:
    """Return the eigenvalues of another design in the order of the eigenvectors of the present one, shape (6,)."""
    alike = (present.eigenvectors.T @ other.eigenvectors) ** 2
    return other.eigenvalues[linear_sum_assignment(alike, maximize=True)[1]]


def _entries(C: np.ndarray) -> list[tuple[int, int]]:
    """Return the places of the entries that are not 0, the diagonal first, of one size only one."""
    found: list[tuple[int, int]] = []
    for i, j in sorted(zip(*np.triu_indices(6), strict=True), key=lambda place: place[1] - place[0]):
        alike = (abs(abs(C[i, j]) - abs(C[k, n])) <= _SAME * abs(C[i, j]) for k, n in found)
        if C[i, j] != 0 and not any(alike):
            found.append((int(i), int(j)))
    return found
