"""Limit flags: the outputs that are flags, their evaluation over a run, and their messages."""

import numpy as np
import pytest

from hfsa.cosim.measurement.limit_flags import LIMITS, active_limits, limit_signals
from hfsa.cosim.systems.connectors import Connector


def test_limits_are_outputs_told_by_the_last_part_of_their_name():
    def variables(**causalities: str) -> dict[str, Connector]:
        return {name: Connector(name, 0, causality, is_conventional=True) for name, causality in causalities.items()}

    stack = variables(**{"contact_lost": "output", "axis[1].saturation": "output", "saturation": "parameter"})
    other = variables(**{"saturation.level": "output", "hinge.overload": "output", "position": "output"})
    found = limit_signals({"stack[1]": stack, "stage": other})
    assert found == ["stack[1].contact_lost", "stack[1].axis[1].saturation", "stage.hinge.overload"]
    assert limit_signals({"boiler": {"steam.saturated": Connector("steam.saturated", 0, "output")}}) == []


def test_a_run_tells_when_each_limit_acted_first_and_how_often():
    time = np.arange(5.0)
    values = {
        "time": time,
        "stage.position": np.ones(5),
        "stage.hinge.overload": np.array([0, 0, 1, 0, np.nan]),
        "pd.axis[1].saturation": np.array([0, 1, 1, 0, 1.0]),
        "pd.axis[2].saturation": np.zeros(5),
        "stack.contact_lost": np.full(5, np.nan),
    }
    found = active_limits(time, values)
    assert [(f.signal, f.first_time, f.share, f.lasting_since) for f in found] == [
        ("pd.axis[1].saturation", 1.0, pytest.approx(0.6), 4.0),
        ("stage.hinge.overload", 2.0, pytest.approx(0.25), None),
    ]
    beginning = "pd: axis[1].saturation: saturated, first at t = 1 s, 60 % of the time, to the end from 4 s on: "
    assert found[0].message.startswith(beginning)
    assert found[0].message.endswith("take a smaller motion or a higher limit")


def test_a_limit_that_acts_throughout():
    (found,) = active_limits([0.0, 1.0], {"pd.saturation": [1.0, 1.0]})
    assert (found.first_time, found.share, found.lasting_since) == (0.0, 1.0, 0.0)


def test_a_warning_of_a_load_or_a_displacement_leaves_a_response_what_it_is():
    (overload,) = active_limits([0.0], {"stage.hinge.overload": [1.0]})
    (saturation,) = active_limits([0.0], {"pd.saturation": [1.0]})
    assert "small-signal" in saturation.response_message
    assert "small-signal" not in overload.response_message
    assert [name for name, limit in LIMITS.items() if not limit.spoils_response] == [
        "overload",
        "displacement_warning",
    ]
