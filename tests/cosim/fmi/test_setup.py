"""Start values reach an FMU that takes its own again when the experiment is set up, as some exporters' FMUs do."""

import pytest
from foreign_fmu import foreign_fmu

from hfsa.cosim.fmi.co_simulation import open_instances

SOURCE = """
#include <stddef.h>
#include <stdlib.h>
#include "fmi2Functions.h"

typedef struct { double v[2]; } Fmu;

fmi2Component fmi2Instantiate(fmi2String n, fmi2Type t, fmi2String g, fmi2String r, const fmi2CallbackFunctions* c,
                              fmi2Boolean v, fmi2Boolean l) { return calloc(1, sizeof(Fmu)); }
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, fmi2Real b, fmi2Real s, fmi2Boolean e, fmi2Real t) {
  ((Fmu*)c)->v[0] = 1;
  return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real x[]) {
  for (size_t i = 0; i < n; i++) ((Fmu*)c)->v[r[i]] = x[i];
  return fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real x[]) {
  for (size_t i = 0; i < n; i++) x[i] = 2 * ((Fmu*)c)->v[0];
  return fmi2OK;
}
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
"""

DESCRIPTION = """<fmiModelDescription fmiVersion="2.0" modelName="Setup" guid="{1}">
  <CoSimulation modelIdentifier="Setup"/>
  <ModelVariables>
    <ScalarVariable name="p" valueReference="0" causality="parameter" variability="fixed">
      <Real start="1"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="1" causality="output"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="2"/></Outputs></ModelStructure>
</fmiModelDescription>"""


@pytest.mark.parametrize(("values", "expected"), [({}, 2.0), ({"p": 5.0}, 10.0)], ids=["own", "given"])
def test_values_are_set_after_the_setup(tmp_path, values, expected):
    source = tmp_path / "setup.c"
    source.write_text(SOURCE)
    file = foreign_fmu(tmp_path, 2, "Setup", source, DESCRIPTION)
    with open_instances({"it": file}) as instances:
        instances["it"].start(values=values)
        assert instances["it"].get(instances["it"].handle(["y"])) == [expected]
