"""State and time events of a foreign FMU in monolithic runs: a bouncing ball."""

from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from algorithm_groups import MONOLITHIC, MONOLITHIC_DAE
from foreign_fmu import foreign_fmu

from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.masters.algorithms import open_master
from hfsa.cosim.systems.system import Component, Connection, System

ALGORITHMS = pytest.mark.parametrize("algorithm", [MONOLITHIC, MONOLITHIC_DAE])
VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
GRAVITY, RESTITUTION = 9.81, 0.7
FALL = np.sqrt(2 / GRAVITY)
"""Duration [s] of a fall of 1 m."""


@pytest.fixture(scope="module")
def balls(tmp_path_factory) -> dict[int, Path]:
    """The ball by FMI version: see bouncing_ball.c."""
    source = Path(__file__).with_name("bouncing_ball.c")
    return {
        version: foreign_fmu(tmp_path_factory.mktemp(f"ball{version}"), version, "Ball", source, DESCRIPTIONS[version])
        for version in (2, 3)
    }


def run(files, names, steps, step_size, algorithm, starts=None, connections=()) -> np.ndarray:
    """Values at all points of a run, (steps + 1, names)."""
    system = System([Component(name, "x", start=(starts or {}).get(name, {})) for name in files], connections)
    with closing(open_master(Assembly.read(system, files), algorithm, step_size, None)) as master:
        recording = master.record(names, rows=steps + 1)
        master.initialize()
        master.advance(steps)
        return recording.values


def bounce_times(number: int) -> np.ndarray:
    """When a ball that falls from 1 m touches the floor [s], (number,)."""
    return FALL + 2 * FALL * np.concatenate([[0.0], np.cumsum(RESTITUTION ** np.arange(1, number))])


def height(time: np.ndarray) -> np.ndarray:
    """Height at times [s] before the 20th bounce."""
    bounces = np.concatenate([[-FALL], bounce_times(20)])  # as if thrown from the floor, to reach 1 m at 0 s
    last = np.searchsorted(bounces, time, side="right") - 1
    speed = GRAVITY * FALL * RESTITUTION**last
    since = time - bounces[last]
    return speed * since - GRAVITY / 2 * since**2


@VERSIONS
@ALGORITHMS
def test_a_bouncing_ball(balls, version, algorithm):
    """Times of bounces to 1e-9 s, and the height in between; a bounce leaves e^2 of the energy."""
    names = ["ball.h", "ball.v", "ball.bounces", "ball.bounced_at"]
    values = run({"ball": balls[version]}, names, 200, 0.01, algorithm)
    time = 0.01 * np.arange(201)
    found = np.unique(values[:, 3])[1:]
    assert len(found) == values[-1, 2] == np.sum(bounce_times(20) < 2.0)
    np.testing.assert_allclose(found, bounce_times(20)[: len(found)], rtol=0, atol=1e-9)
    np.testing.assert_allclose(values[:, 0], height(time), rtol=0, atol=1e-8)
    energy = values[:, 1] ** 2 / 2 + GRAVITY * values[:, 0]
    np.testing.assert_allclose(energy, GRAVITY * RESTITUTION ** (2 * values[:, 2]), rtol=1e-7)


@VERSIONS
@ALGORITHMS
def test_a_time_event(balls, version, algorithm):
    """A kick at 0.2 s, between two points."""
    values = run({"ball": balls[version]}, ["ball.h"], 4, 0.1 + 1e-3, algorithm, {"ball": {"kick_at": 0.2}})
    time = 0.101 * np.arange(5)
    exact = 1 - GRAVITY / 2 * time**2 + np.maximum(0, time - 0.2)
    np.testing.assert_allclose(values[:, 0], exact, rtol=0, atol=1e-9)


@ALGORITHMS
def test_a_ball_on_a_spring(balls, files, algorithm):
    """An event of one FMU leaves another's states alone: a mass on a spring drives the ball by its acceleration."""
    found = {"plant": files["Plant", 2], "ball": balls[2]}
    wire = [Connection("plant.acceleration", "ball.push")]
    starts = {"plant": {"x": 0.05}}
    values = run(found, ["plant.x", "plant.v", "ball.h", "ball.bounces"], 100, 0.01, algorithm, starts, wire)
    alone = run({"plant": files["Plant", 2]}, ["plant.x"], 100, 0.01, MONOLITHIC, starts)
    np.testing.assert_allclose(values[:, 0], alone[:, 0], rtol=0, atol=1e-9)
    falling = values[:, 3] == 0
    time = 0.01 * np.arange(101)
    exact = 1 - GRAVITY / 2 * time**2 + values[:, 0] - 0.05
    assert 10 < falling.sum() < 100
    np.testing.assert_allclose(values[falling, 2], exact[falling], rtol=0, atol=1e-8)


@VERSIONS
def test_a_ball_that_comes_to_rest(balls, version):
    """The ball comes to rest at its smallest speed."""
    starts = {"ball": {"least_speed": 0.1}}
    values = run({"ball": balls[version]}, ["ball.h", "ball.v", "ball.bounces"], 40, 0.1, MONOLITHIC, starts)
    assert values[-1].tolist() == [0.0, 0.0, 11.0]


@ALGORITHMS
def test_ever_shorter_bounces_are_told(balls, algorithm):
    """Without a smallest speed the bounces accumulate before 2.56 s."""
    with pytest.raises(
        StepError, match=r"ball: event indicators: does not settle at t = 2\.558.* state events"
    ) as caught:
        run({"ball": balls[3]}, ["ball.h"], 30, 0.1, algorithm)
    assert caught.value.time == pytest.approx(FALL * (1 + RESTITUTION) / (1 - RESTITUTION), abs=1e-6)


_VARIABLES = [
    ("h", 1, 'causality="output" initial="exact"', 'start="1"'),
    ("der(h)", 2, 'causality="local"', 'derivative="{}"'),
    ("v", 3, 'causality="output" initial="exact"', 'start="0"'),
    ("der(v)", 4, 'causality="local"', 'derivative="{}"'),
    ("push", 5, 'causality="input"', 'start="0"'),
    ("bounces", 6, 'causality="output" variability="discrete"', ""),
    ("bounced_at", 7, 'causality="output" variability="discrete"', ""),
    ("restitution", 8, 'causality="parameter" variability="fixed"', 'start="0.7"'),
    ("least_speed", 9, 'causality="parameter" variability="fixed"', 'start="0"'),
    ("kick_at", 10, 'causality="parameter" variability="fixed"', 'start="-1"'),
    ("floor", 11, 'causality="local"', ""),
]
"""Name, reference, attributes of the variable and of its type; derivatives refer to the state before them."""


def _described(version: int) -> str:
    """The ball's modelDescription.xml."""
    rows = [(n, r, a, t.format(r - 1)) for n, r, a, t in _VARIABLES]  # FMI 2 counts from 1, as references do here
    if version == 2:
        head = 'guid="{ba11}" numberOfEventIndicators="1"'
        variables = "".join(
            f'<ScalarVariable name="{n}" valueReference="{r}" {a}><Real {t}/></ScalarVariable>' for n, r, a, t in rows
        )
        outputs = "".join(f'<Unknown index="{r}" dependencies=""/>' for r in (1, 3, 6, 7))
        structure = f'<Outputs>{outputs}</Outputs><Derivatives><Unknown index="2"/><Unknown index="4"/></Derivatives>'
    else:
        head = 'instantiationToken="{ba11}"'
        variables = "".join(f'<Float64 name="{n}" valueReference="{r}" {a} {t}/>' for n, r, a, t in rows)
        variables += '<Float64 name="time" valueReference="0" causality="independent"/>'
        structure = "".join(f'<Output valueReference="{r}" dependencies=""/>' for r in (1, 3, 6, 7))
        structure += "".join(f'<ContinuousStateDerivative valueReference="{r}"/>' for r in (2, 4))
        structure += '<EventIndicator valueReference="11"/>'
    return (
        f'<fmiModelDescription fmiVersion="{version}.0" modelName="Ball" {head}><ModelExchange modelIdentifier="Ball"/>'
        f"<ModelVariables>{variables}</ModelVariables><ModelStructure>{structure}</ModelStructure></fmiModelDescription>"
    )


DESCRIPTIONS = {version: _described(version) for version in (2, 3)}
