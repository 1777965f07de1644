"""Ports of motion count from where a machine rests: zero there, at every posture, and small ones have digits."""

import casadi as ca
import numpy as np
import pytest
from conftest import PARTS, VARIANTS
from hypothesis import given, settings
from random_postures import postures

from hfsa.components import Model
from hfsa.components._mechanics.sdelta_kinematics import Kinematics
from hfsa.components._modelling.model import Kind

PLACES = {"m", "rad"}
MOTION = {f"{place}{per}" for place in PLACES for per in ("", "/s", "/s2", "/s3")}
ROBOTS = [
    ("sdelta", {"level": "rigid"}),
    ("sdelta", {"level": "cartesian"}),
    ("sdelta", {"level": "nonlinear"}),
    ("sdelta_reference", {"level": "linear"}),
    ("sdelta_reference", {"level": "exact"}),
    ("sdelta_feed_forward", {"level": "rigid"}),
    ("sdelta_feed_forward", {"level": "elastic"}),
    *(
        ("sdelta_computed_torque", {"level": "continuous", "feedback": feedback, "model": model})
        for feedback in ("motor", "encoder_pose", "measured_pose")
        for model in ("linear", "exact")
    ),
]
LABELS = [" ".join([name, *arguments.values()]) for name, arguments in ROBOTS]
OUTPUTS = (Kind.OUTPUT, Kind.SAMPLED_OUTPUT)


def at_start(model: Model) -> dict[str, float]:
    """Outputs at the start values, at 0 s."""
    known = [Kind.STATE, Kind.SAMPLED_STATE, Kind.INPUT, Kind.PARAMETER]
    for motion in model.motions:
        model.substitute(motion.acceleration, ca.solve(motion.mass, motion.force))
    outputs = ca.vertcat(ca.SX(0, 1), *[q.expression for q in model.of(*OUTPUTS)])
    arguments = [model.time, model.symbols(*known)]
    values = ca.Function("y", arguments, [outputs])(0.0, [q.start for q in model.of(*known)])
    return dict(zip([q.name for q in model.of(*OUTPUTS)], np.array(values).ravel().tolist(), strict=True))


def assert_zero_at_rest(model: Model, units: set[str]) -> None:
    """Fail unless all that moves, in these units, starts at zero and comes out as zero, to the last bit."""
    moving = {q.name for q in model if q.unit in units and q.kind not in (Kind.PARAMETER, Kind.CONSTANT)}
    started = {q.name: q.start for q in model.of(Kind.INPUT, Kind.STATE, Kind.SAMPLED_STATE) if q.name in moving}
    put_out = {name: value for name, value in at_start(model).items() if name in moving}
    assert {name: value for name, value in (started | put_out).items() if value} == {}


@pytest.mark.parametrize(("name", "level"), VARIANTS)
def test_every_part_is_at_zero_at_rest(name, level):
    """Places only: a part with a motion of its own may begin at full speed."""
    assert_zero_at_rest(PARTS[name].model(level), PLACES)


@pytest.mark.parametrize(("name", "arguments"), ROBOTS, ids=LABELS)
def test_at_every_posture(name, arguments):
    """Torques of the controllers are zero there too, without gravity."""

    @given(postures())
    @settings(max_examples=5)
    def check(posture):
        model = PARTS[name].build(**arguments, posture=posture)
        assert_zero_at_rest(model, MOTION)
        assert not any(value for output, value in at_start(model).items() if output.endswith(("command", "torque")))

    check()


@pytest.mark.parametrize(
    ("name", "arguments", "terminal"),
    [
        ("sdelta_reference", {}, "motor"),
        ("sdelta_feed_forward", {}, "motor"),
        ("sdelta_computed_torque", {}, "axis"),
    ],
)
def test_where_the_motors_stand_is_a_constant(name, arguments, terminal):
    @given(postures())
    @settings(max_examples=5)
    def check(posture):
        model = PARTS[name].build(**arguments, posture=posture)
        shown = [model[f"{terminal}[{i}].angle_at_posture"] for i in range(1, 7)]
        assert [q.start for q in shown] == Kinematics.at(posture).motor_angles.tolist()
        assert {(q.kind, q.unit) for q in shown} == {(Kind.CONSTANT, "rad")}

    check()
