"""Level `auto` of the robot on random scenes: its error, against the highest level, is within the tolerance."""

import numpy as np
import pytest

from hfsa.cosim import sweep

COUNT = 50
MEASURED = 3e-4
"""Largest error of two measured responses: their steps of second order, and the rest of their transients."""
NOTCH = 0.1
"""Size of a response, 1 at low frequency, below which it is a notch, whose relative error says little."""


def random_scene(seed: int) -> tuple[dict[str, str], str, str, tuple[float, float], float, float]:
    """Return arguments, input, output, band [Hz], amplitude [m] and tolerance of a seed."""
    draw = np.random.default_rng(seed)
    rotation = ",".join(f"{angle:.2f}" for angle in draw.uniform(-6, 6, 3))
    position = ",".join(f"{p:.4f}" for p in np.array([0, 0, 0.15]) + draw.uniform(-8e-3, 8e-3, 3))
    arguments = {"posture.rotation": rotation, "posture.position": position}
    axis = int(draw.integers(1, 4))
    low = float(10 ** draw.uniform(0.3, 1.5))
    high = low * float(draw.uniform(1.1, 2.0))
    amplitude = float(10 ** draw.uniform(-6, -3))
    tolerance = float(10 ** draw.uniform(-3, -1))
    name = f"platform.position[{axis}]"
    return arguments, f"command.position[{axis}]", name, (low, high), amplitude, tolerance


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(COUNT), ids=lambda seed: f"seed{seed}")
def test_a_chosen_level_is_within_the_tolerance_of_the_highest(seed, tmp_path):
    arguments, excited, output, (low, high), amplitude, tolerance = random_scene(seed)

    def swept(level: str):
        return sweep(
            "sdelta_shaker",
            {**arguments, "robot.level": level},
            inputs=[excited],
            outputs=[output],
            low=low,
            high=high,
            points=3,
            amplitude=amplitude,
            tolerance=tolerance,
            algorithm="gauss_seidel_quadratic",
            settling_tolerance=1e-4,
            path=tmp_path / f"{level}.h5",
            warn=lambda _: None,
        )

    chosen, highest = swept("auto"), swept("nonlinear")
    difference = np.abs(chosen.response - highest.response) / np.maximum(np.abs(highest.response), NOTCH)
    assert difference.max() <= tolerance + MEASURED
