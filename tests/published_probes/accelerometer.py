"""Numbers of the triangular accelerometer that no analysis returns."""

from typing import Any

import numpy as np

from hfsa.components import tba_accelerometer
from hfsa.components._mechanics.tba_design import DESIGNS
from hfsa.components._modelling.linearize import linearize


def accelerometer_design(design: str) -> dict[str, Any]:
    """Dimensions and material of a design, what 1 N moves it by in the plane, frequencies in and out of it [rad/s]."""
    found = _analysis(design)
    return {
        **DESIGNS[design].shape._asdict(),
        "by_one_newton": 1 / found["stiffness"][0],
        "omega": 2 * np.pi * found["natural_frequencies_hz"][1:],
    }


def accelerometer_differences(design: str, mass: list[float], frequencies: list[float]) -> dict[str, Any]:
    """Differences of a design's masses and natural frequencies from those of finite elements, by these."""
    found = _analysis(design)
    return {
        "mass": np.abs(found["mass"] / mass - 1),
        "frequency": np.abs(found["natural_frequencies_hz"] / frequencies - 1),
    }


def accelerometer_gain(mems: list[float], optimum: list[float]) -> dict[str, Any]:
    """What the optimum has more of f3 / f1 and less of w / t_m than the first design, from f1 and f3 of both."""
    shapes = [DESIGNS[name].shape for name in ("mems", "optimum")]
    first, second = (shape.w / shape.tm for shape in shapes)
    gain = (optimum[1] / optimum[0]) / (mems[1] / mems[0])
    return {
        "aspect": [first, second],
        "aspect_loss": 1 - second / first,
        "ratio_gain": gain - 1,
        "gain_by_aspect": gain * first / second - 1,
    }


def accelerometer_at_ten_g(mass: float, stiffness: float) -> dict[str, Any]:
    """Displacement of a mass on a spring under 10 g, 98.1 m/s2, and its velocity where it would fall that far."""
    acceleration = 98.1
    displacement = mass / stiffness * acceleration
    return {"displacement": displacement, "velocity": np.sqrt(2 * acceleration * displacement)}


def accelerometer_sensitivity(design: str) -> dict[str, Any]:
    """Sensitivities of f3 / f1, of the dimensions that the source varies, by that to the thickness of the feet."""
    found = _analysis(design)["sensitivity"]
    by_thickness = {name: found[name] / abs(found["tm"]) for name in ("a", "s", "e", "b", "c", "d", "tm", "l")}
    others = [abs(value) for name, value in by_thickness.items() if name not in ("tm", "l")]
    return {
        "foot_length": abs(by_thickness["l"]),
        "largest_other": max(others),
        "signs": np.sign(list(by_thickness.values())),
    }


def accelerometer_prototype_differences(displacement: float, frequency: float, test: float) -> dict[str, Any]:
    """Differences of the prototype from finite elements, by 1 N and in its frequency, and from a test, by these."""
    by_one_newton = accelerometer_design("rapid_prototype")["by_one_newton"]
    found = _analysis("rapid_prototype")["natural_frequencies_hz"][0]
    return {
        "displacement": abs(by_one_newton / displacement - 1),
        "frequency": abs(found / frequency - 1),
        "test": abs(found / test - 1),
    }


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


def _analysis(design: str) -> dict[str, Any]:
    return tba_accelerometer.analyze(design=design)  # type: ignore[arg-type]
