"""Sources are resolved by the step, or refused with a sufficient step."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hfsa.cosim.results.files import read_run
from hfsa.cosim.signals.excitation import FEWEST_SAMPLES, window_steps

SHAKEN = """
inputs = []
outputs = ["mass.position"]
step_size = 1e-3
stop_time = 0.1

[[components]]
name = "shaker"
part = "sine_source"
arguments = { unit = "m" }
start = { frequency = 95.0, amplitude = 1e-3 }

[[components]]
name = "mass"
part = "mass_on_spring"

[[connections]]
start = "shaker.value"
end = "mass.base.position"
"""


@given(st.floats(1e-3, 1e9), st.floats(1.001, 1e6))
def test_the_step_that_would_do_does_and_is_hardly_shorter_than_it_must_be(frequency, times):
    longest = 1 / (FEWEST_SAMPLES * frequency)
    with pytest.raises(ValueError, match="steps of") as caught:
        window_steps(frequency, times * longest)
    step = float(re.search(r"a step of (\S+) s or less", str(caught.value))[1])
    assert window_steps(frequency, step) >= FEWEST_SAMPLES
    assert 0.98 * longest < step <= longest


@pytest.mark.parametrize("verb", [["run"], ["compare", "--over", "damping=1,2"]])
@pytest.mark.parametrize("how", [["--frequency", "9999"], ["-p", "source.frequency=9999"]])
def test_a_sine_that_the_step_does_not_resolve_is_refused(hfsa, verb, how):
    """Sampled once per period, 9999 Hz at 0.1 ms alias to 1 Hz: the mass would move by 1 mm instead of 1.3 nm."""
    words = [verb[0], "mass_on_spring", *verb[1:], *how, "--stop", "0.01"]
    code, out, err = hfsa(*words, "--step", "1e-4")
    assert (code, out) == (2, "")
    assert "source.frequency: 9999 Hz has 1 steps of 0.0001 s in a period, expected at least 10: a step of 1e-05" in err
    assert not list(Path().rglob("*.h5"))


def test_at_the_step_that_would_do_the_mass_stays_where_it_is(hfsa):
    code, _, _ = hfsa("run", "mass_on_spring", "--frequency", "9999", "--step", "1e-5", "--stop", "0.6")
    assert code == 0
    values, _ = read_run("results/mass_on_spring_run.h5")
    settled = values["mass.position"][values["time"] > 0.5]
    ratio = (2 * np.pi * 15.9155 / (2 * np.pi * 9999)) ** 2
    assert np.abs(settled - settled.mean()).max() < 10 * ratio * 1e-3
    assert np.abs(values["mass.base.position"]).max() > 0.9e-3


def test_a_source_that_a_scene_has_of_its_own_is_looked_at_as_well(hfsa):
    Path("own.toml").write_text(SHAKEN)
    assert hfsa("run", "own.toml")[0] == 0
    code, _, err = hfsa("run", "own.toml", "-p", "shaker.frequency=105", "--force")
    assert code == 2
    assert "shaker.frequency: 105 Hz has 9.52 steps of 0.001 s in a period" in err
    code, _, err = hfsa("run", "own.toml", "--step", "1.1e-3", "--fuse", "shaker,mass", "--force")
    assert code == 2
    assert "shaker.frequency: 95 Hz has 9.57 steps" in err


def test_a_motion_of_the_stage_is_looked_at_as_well(hfsa):
    words = ["run", "stage_tracking", "-p", "motion=three_axis", "-p", "actuator=force", "--stop", "1e-3"]
    code, _, err = hfsa(*words, "-p", "reference.frequency=20e3")
    assert code == 2
    assert "reference.frequency: 20000 Hz has 5 steps of 1e-05 s in a period" in err
    assert hfsa(*words, "-p", "reference.frequency=0")[0] == 0
