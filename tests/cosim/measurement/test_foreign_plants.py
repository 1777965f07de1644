"""Plants of other makers are measured right, or the point says why it is not: drift, dead time, names, derivatives."""

from pathlib import Path

import numpy as np
import pytest
from foreign_fmu import foreign_fmu

from hfsa.cosim.results.files import Status, read_limit_flags, read_sweep
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component

SOURCE = Path(__file__).with_name("plant.c")
STEP = 1e-3
DELAY = 1.5
KINDS = ("double_integrator", "creep", "cubic", "wrapped", "delay", "echo", "late", "pair", "level", "gain")

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Plant" guid="{{77}}" generationTool="{tool}">
  <CoSimulation modelIdentifier="Plant" canHandleVariableCommunicationStepSize="true" {derivatives}/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="{y}" valueReference="1" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="{other}" valueReference="2" causality="{causality}"><Real start="0"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="2" {dependencies}/></Outputs></ModelStructure>
</fmiModelDescription>
"""


@pytest.fixture
def plant(tmp_path):
    """Write the scene of one plant, and return its path."""

    def write(kind, *, y="y", other="q", causality="parameter", tool="Trial", offers=False, keys=""):
        fmu = foreign_fmu(
            tmp_path,
            2,
            "Plant",
            SOURCE,
            DESCRIPTION.format(
                y=y,
                other=other,
                causality=f'{causality}" variability="tunable' if causality == "parameter" else causality,
                tool=tool,
                derivatives='providesDirectionalDerivative="true"' if offers else "",
                dependencies='dependencies="1"' if offers else 'dependencies=""',
            ),
            f"-DKIND={KINDS.index(kind) + 1}",
            "-lm",
        )
        scene = tmp_path / "plant.toml"
        scene.write_text(
            f'inputs = ["p.u"]\noutputs = ["p.{y}"]\nband = [1.0, 10.0]\namplitude = {{ "1" = 1.0 }}\n'
            f'step_size = {STEP}\nstop_time = 0.2\n[[components]]\nname = "p"\npart = "{fmu}"\n{keys}'
        )
        return scene

    return write


@pytest.fixture
def swept(hfsa):
    """Sweep a scene at a few frequencies; return the sweep, the exit code and what is said."""

    def sweep(scene, *options, points=2):
        tokens = ("--points", points, "--grid", "log", "-j", 1, "-o", "sweep.h5", "--force")
        code, out, err = hfsa("sweep", scene, *tokens, *options)
        return read_sweep("sweep.h5"), code, out + err

    return sweep


def only(bode):
    """Return the responses of the one output to the one input."""
    return bode.response[:, 0, 0]


def held(z):
    """Return the response of a double integrator to an input that is held over each step at its value at the end."""
    return STEP**2 / 2 * z * (z + 1) / (z - 1) ** 2


@pytest.mark.parametrize(
    ("periods", "high"),
    [(1, 8.0), (3, 9.7), pytest.param(1, 9.7, marks=pytest.mark.slow)],
    ids=["one period of whole samples", "three periods of broken samples", "one period of broken samples"],
)
def test_a_double_integrator_with_a_constant_load_has_its_own_gain(plant, swept, periods, high):
    """Its position is a parabola of metres and an oscillation of millimetres; u is held over a step."""
    bode, code, _ = swept(plant("double_integrator"), "--to", high, "--measurement-periods", periods)
    z = np.exp(2j * np.pi * bode.frequency * STEP)
    assert code == 0
    assert only(bode) == pytest.approx(held(z), rel=1e-7)
    assert np.all(bode.harmonic_distortion < 1e-6)


def test_a_multisine_sees_through_the_drift_too(plant, swept):
    bode, code, _ = swept(plant("double_integrator"), "--method", "multisine", points=4)
    z = np.exp(2j * np.pi * bode.frequency * STEP)
    assert code == 0
    assert only(bode) == pytest.approx(held(z), rel=1e-5)


def test_creep_settles_at_the_gain_beneath_it(plant, swept):
    """The logarithm creeps on for ever, 200 times as far as the response is large."""
    bode, code, _ = swept(plant("creep"))
    assert code == 0
    assert np.abs(only(bode)) == pytest.approx(0.01, rel=2e-3)


@pytest.mark.parametrize("kind", ["cubic", "wrapped"])
def test_a_drift_beyond_a_parabola_does_not_settle(plant, swept, kind):
    """A cubic, and an angle that jumps at every turn, three times in two seconds."""
    bode, code, told = swept(plant(kind), "--settling-time", 10)
    assert code == 1
    assert np.all(bode.status == Status.NOT_SETTLED)
    assert "p.y has not settled" in told


@pytest.mark.parametrize("method", ["stepped", "multisine"])
def test_a_dead_time_is_awaited_while_nothing_comes(plant, swept, method):
    bode, code, told = swept(plant("delay"), "--method", method, "--from", 4, points=3)
    assert code == 0
    assert only(bode) == pytest.approx(np.exp(-2j * np.pi * bode.frequency * (DELAY - STEP)), rel=3e-3)
    assert "--settling-time-min waits for a dead time" in told


@pytest.mark.parametrize("method", ["stepped", "multisine"])
def test_an_output_that_never_responds_is_not_settled(plant, swept, method):
    bode, code, told = swept(plant("delay"), "--method", method, "--from", 7, "--to", 40, "--settling-time", 0.1)
    assert code == 1
    assert np.all(bode.status == Status.NOT_SETTLED)
    assert "p.y has not responded after" in told


@pytest.mark.parametrize(
    ("kind", "wait"),
    [
        pytest.param("echo", ("--settling-time-min", 2.2), marks=pytest.mark.slow),
        ("echo", ("--settling-periods", 90)),
        pytest.param("late", ("--settling-time-min", 2.2), marks=pytest.mark.slow),
        ("late", ("--settling-time-min", 2.2, "--method", "multisine")),
    ],
    ids=["echo by time", "echo by periods", "late by time", "late by a multisine"],
)
def test_a_wait_sees_what_comes_late(plant, swept, kind, wait):
    """A part of the response after a dead time, or a gain that is 0.2 for the first two seconds."""
    bode, code, told = swept(plant(kind), *wait, "--from", 7, "--to", 40)
    z = np.exp(2j * np.pi * bode.frequency * STEP)
    exact = 0.1 + z ** (1 - DELAY / STEP) if kind == "echo" else np.ones(len(z))
    assert code == 0
    assert only(bode) == pytest.approx(exact, rel=3e-3)
    assert "waits for a dead time" not in told


@pytest.mark.parametrize("method", ["stepped", "multisine"])
def test_derivatives_of_another_function_disagree(plant, swept, hfsa, method):
    """They say y = u, while y = 1.1 u."""
    bode, code, told = swept(plant("gain", offers=True), "--method", method, points=3)
    assert code == 1
    assert np.all(bode.status == Status.DISAGREES)
    assert only(bode) == pytest.approx(1.1, rel=1e-9)
    assert "p.y is 9.09 % off the linear response, 1 " in told
    assert hfsa("bode", "sweep.h5", "-o", "bode.png")[0] == 0


def test_an_input_with_a_name_like_a_derivative_is_an_input_of_its_own(plant, swept):
    bode, code, _ = swept(plant("pair", other="u_rate", causality="input"))
    assert code == 0
    assert only(bode) == pytest.approx(1.0, rel=1e-6)


def test_an_output_called_saturated_is_no_flag(plant, swept, hfsa):
    scene = plant("level", y="steam.saturated")
    bode, code, _ = swept(scene)
    assert (code, Status(bode.status[0, 0])) == (0, Status.DONE)
    assert only(bode) == pytest.approx(1.0, rel=1e-9)
    code, out, err = hfsa("run", scene, "-o", "run.h5", "--frequency", "5")
    assert code == 0
    assert "p.steam.saturated: 2.7" in out
    assert "a command is held" not in out + err
    assert read_limit_flags("run.h5") == []


@pytest.mark.parametrize("value", [0.0, pytest.param(0.7e-3, marks=pytest.mark.slow)], ids=["inherited", "no multiple"])
def test_a_parameter_called_sample_time_is_a_parameter(plant, swept, value):
    bode, code, _ = swept(plant("gain", other="sample_time", keys=f"start = {{ sample_time = {value} }}"))
    assert code == 0
    assert only(bode) == pytest.approx(1.1, rel=1e-9)


@pytest.mark.parametrize("said", ["by the tool", "by the scene"])
def test_names_mean_what_ours_mean_where_that_is_said(plant, swept, said):
    """The rate of the sine enters 10 times: 1 + 10 j omega."""
    given = {"tool": "hfsa 1.0"} if said == "by the tool" else {"keys": 'conventions = "hfsa"'}
    bode, code, _ = swept(plant("pair", other="u_rate", causality="input", **given))
    assert code == 0
    assert only(bode) == pytest.approx(1 + 20j * np.pi * bode.frequency, rel=2e-3)


def test_other_conventions_are_refused():
    with pytest.raises(StructureError, match="conventions are 'x', expected 'hfsa'"):
        Component("p", "p.fmu", conventions="x")
