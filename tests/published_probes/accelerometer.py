"""Numbers of the triangular accelerometer that no analysis returns."""

from typing import Any

import numpy as np

from hfsa.components import tba_accelerometer
from hfsa.components._linearize import linearize
from hfsa.components._tba_design import DESIGNS


def accelerometer_design(design: str) -> dict[str, Any]:
    """Dimensions and material of a design, and what 1 N moves it by in the plane."""
    stiffness_in_plane = tba_accelerometer.analyze(design=design)["stiffness"][0]  # type: ignore[arg-type]
    return {**DESIGNS[design].shape._asdict(), "by_one_newton": 1 / stiffness_in_plane}


def accelerometer_shares() -> dict[str, Any]:
    """Bands by the natural frequency, and the sensitivity out of the plane by that in it."""
    found = tba_accelerometer.analyze()
    sensitivity = found["static_sensitivity"]
    return {
        "bands": found["bandwidth_hz"] / found["natural_frequencies_hz"][0],
        "rejection": sensitivity["out_of_plane"] / sensitivity["in_plane"],
    }


def accelerometer_on_a_shaker() -> float:
    """Amplitude of the proof mass on a base that shakes by 1 um at 50 Hz along x."""
    system = linearize(tba_accelerometer.tba_accelerometer())
    s = 2j * np.pi * 50
    row = system.output_labels.index("proof_mass/position[1]")
    column = system.input_labels.index("base/acceleration[1]")
    inside = np.linalg.solve(s * np.eye(system.nstates) - system.A, system.B[:, column])
    return 1e-6 * float(np.abs(s**2 * (system.C[row] @ inside + system.D[row, column])))
