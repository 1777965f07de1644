"""A step that an FMU ends early, without leave, ends the run: its outputs are those of another time."""

from pathlib import Path

import numpy as np
import pytest
from foreign_fmu import foreign_fmu

from hfsa.cosim.results.files import read_run

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Early" instantiationToken="{1d}">
  <CoSimulation modelIdentifier="Early" canHandleVariableCommunicationStepSize="true"
    mightReturnEarlyFromDoStep="true"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
    <Float64 name="u" valueReference="1" causality="input" start="0"/>
    <Float64 name="y" valueReference="2" causality="output"/>
  </ModelVariables>
  <ModelStructure><Output valueReference="2"/><InitialUnknown valueReference="2"/></ModelStructure>
</fmiModelDescription>
"""


@pytest.mark.parametrize("backend", ["c", "python"])
def test_a_step_that_ends_early_ends_the_run(hfsa, tmp_path, backend):
    file = foreign_fmu(tmp_path, 3, "Early", Path(__file__).parents[1] / "early.c", DESCRIPTION)
    (tmp_path / "early.toml").write_text(f"""
inputs = ["box.u"]
outputs = ["box.y"]
band = [1.0, 50.0]
amplitude = {{ "1" = 1.0 }}
step_size = 1e-2
stop_time = 0.2

[[components]]
name = "box"
part = "{file.name}"
""")
    code, _, err = hfsa("run", "./early.toml", "--backend", backend, "-o", "run.h5")
    assert code == 4
    assert "box: fmi3DoStep: returned early at t = 0.05 s" in err
    assert "a smaller step may help" in err
    values, _ = read_run(tmp_path / "run.h5")
    reached = np.isfinite(values["box.y"])
    np.testing.assert_allclose(values["box.y"][reached], values["time"][reached], atol=1e-12)
    assert values["time"][reached][-1] == pytest.approx(0.05)
