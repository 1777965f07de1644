"""FMU of bad manners for tests, and a scene of it: see tests/cosim/hostile.c."""

from pathlib import Path

from foreign_fmu import foreign_fmu

MANNERS = (
    *("crash", "leave", "abort", "divide", "kill", "hang"),
    *("flood", "move", "trap", "sleep", "disturb", "last_words", "talk", "eat"),
)
"""Manners by number, from 1."""

_DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Hostile" guid="{1d}">
  <CoSimulation modelIdentifier="Hostile" canHandleVariableCommunicationStepSize="true"
    canBeInstantiatedOnlyOncePerProcess="true" providesDirectionalDerivative="true"/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="1" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="2" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="manner" valueReference="3" causality="parameter" variability="tunable">
      <Real start="0"/></ScalarVariable>
    <ScalarVariable name="at" valueReference="4" causality="parameter" variability="tunable">
      <Real start="1e9"/></ScalarVariable>
    <ScalarVariable name="process" valueReference="5" causality="output"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="2" dependencies="1"/><Unknown index="5" dependencies=""/></Outputs>
  <InitialUnknowns><Unknown index="2"/><Unknown index="5"/></InitialUnknowns></ModelStructure>
</fmiModelDescription>
"""


def hostile_fmu(folder: Path, always: str = "") -> Path:
    """Return the FMU, made in a folder; with a manner from the first step on, if one is named."""
    source = Path(__file__).with_name("cosim") / "hostile.c"
    number = MANNERS.index(always) + 1 if always else 0
    return foreign_fmu(folder, 2, "Hostile", source, _DESCRIPTION, f"-DALWAYS={number}")


def hostile_scene(path: Path, fmu: Path, manner: str, at: float = 0.05, stop: float = 0.2) -> Path:
    """Write a scene with one such FMU, which misbehaves at a time [s], and return its path."""
    number = MANNERS.index(manner) + 1
    path.write_text(f"""
inputs = ["box.u"]
outputs = ["box.y"]
band = [1.0, 50.0]
amplitude = {{ "1" = 1.0 }}
step_size = 1e-3
stop_time = {stop}

[[components]]
name = "box"
part = "{fmu}"
start = {{ manner = {number}, at = {at} }}
""")
    return path
