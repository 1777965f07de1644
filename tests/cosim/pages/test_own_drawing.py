"""The part of the page on looking: a part of one's own is drawn, and moves in a run, from its one file."""

import json
import re
from pathlib import Path

import numpy as np

PAGE = Path(__file__).parents[3] / "docs/view.md"


def test_a_part_of_ones_own_is_drawn_as_the_docs_say(hfsa, tmp_path):
    (code,) = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(), re.MULTILINE | re.DOTALL)
    (tmp_path / "slider.py").write_text(f'"""A slider."""\n\n{code}')
    assert hfsa("view", "./slider.py", "-o", "slider.html")[0] == 0
    (tmp_path / "shake.toml").write_text(
        """
inputs = ["rod.command"]
outputs = ["rod.position"]
band = [1.0, 10.0]
amplitude = { m = 1e-5 }
step_size = 1e-3
stop_time = 1.0

[[components]]
name = "rod"
part = "./slider.py"
"""
    )
    assert hfsa("run", "./shake.toml", "--frequency", "5", "-o", "run.h5")[0] == 0
    code, out, _ = hfsa("view", "run.h5", "--json")
    assert code == 0
    assert json.loads(out)["bodies"] == ["rod"]
    found = re.search(r'id="data">(.*?)</script>', (tmp_path / "run.html").read_text(), re.DOTALL)
    assert found
    data = json.loads(found[1])
    shifts = np.array(data["bodies"][0]["shifts"][0])  # frames, axes, points [mm]
    assert np.abs(shifts[:, 0]).max() == np.float64(0.01)
    np.testing.assert_array_equal(shifts[:, 1:], 0)
