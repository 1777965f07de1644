"""Trades of random scenes: predicted errors are those that are measured, and the answer meets the tolerance."""

import pytest
from random_scenes import COUNT, random_scene

from hfsa.cosim import trade

BOUND, LEAST = 1.5, 1e-6
"""Largest ratio of predicted and measured errors, and the error above which it is judged."""


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(COUNT))
def test_a_random_scene_has_the_predicted_errors_and_an_answer(seed, tmp_path):
    name, arguments, excited, tolerance = random_scene(seed)
    found = trade(name, arguments, inputs=[excited], tolerance=tolerance, path=tmp_path / "t.h5", warn=lambda _: None)
    assert found.best is not None, found.sentences
    assert found.best.measured_error <= tolerance
    for row in found.rows:
        if row.is_measured and min(row.measured_error, row.predicted_error) > LEAST:
            assert 1 / BOUND < row.predicted_error / row.measured_error < BOUND, str(row)
