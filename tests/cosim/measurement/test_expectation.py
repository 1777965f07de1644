"""A measured response is held against the linear one: relative to its surroundings, above noise, within tolerances."""

from dataclasses import replace

import numpy as np
import pytest

from hfsa.cosim.measurement.expectation import Expectation, relative, unsettled

OUTPUTS = ("a.large", "a.small", "a.rest")
FLOOR = np.full(3, 1e-9)


@pytest.fixture
def expected():
    response = np.array([1.0, 1e-4j, 0.0])
    return Expectation(response, 2e-3, np.zeros(3), scale=np.array([1.0, 1e-2, 1e-2]))


def sentence(expected, measured, distortion=0.0):
    return expected.sentence(OUTPUTS, np.asarray(measured, dtype=complex), FLOOR, distortion)


def test_what_is_within_the_tolerance_agrees(expected):
    assert sentence(expected, [1.0019, 1e-4j + 1.9e-5, 1e-5]) == ""
    assert sentence(expected, [1.0, 1e-4j, 1e-10]) == ""


@pytest.mark.parametrize(
    ("measured", "words"),
    [
        ([1.003, 1e-4j, 0.0], "a.large is 0.299 % off the linear response, 1 "),
        ([1.0, 1.3e-4j, 0.0], "a.small is 0.3 % off the linear response, 0.0001 "),
        ([1.0, 1e-4j, 1e-3], "a.rest is 10 % off the linear response, 0 "),
        ([0.0, 1e-4j, 0.0], "a.large is 100 % off"),
        ([-1.0, 1e-4j, 0.0], "a.large is 200 % off"),
    ],
    ids=["gain", "beside an antiresonance", "zero by symmetry", "no response", "sign"],
)
def test_what_is_off_says_which_and_how_far(expected, measured, words):
    found = sentence(expected, measured, 0.0125)
    assert found.startswith(words)
    assert "(distortion 1.2 %)" in found
    assert len(found.encode()) <= 240  # what a results file holds of a message


def test_steps_are_allowed_what_they_are_predicted_to_do(expected):
    measured = [1.05, 1e-4j, 0.0]
    assert sentence(expected, measured)
    assert sentence(replace(expected, step_error=np.array([0.05, 0, 0])), measured) == ""
    assert sentence(replace(expected, step_error=np.full(3, np.inf)), [7.0, 3.0, 5.0]) == ""
    of_steps = expected.of_steps(np.array([1.05, 1e-4j, 1e-17]))
    assert sentence(of_steps, measured) == ""
    assert of_steps.rests.tolist() == [False, False, True]


def test_a_distorted_response_of_our_own_fmus_is_nonlinear(expected):
    """Their derivatives are exact, so that only a response without harmonics can disagree."""
    ours = replace(expected, is_exact=True)
    measured = [1.3, 1e-4j, 0.0]
    assert sentence(ours, measured, 1e-3) == ""
    assert sentence(ours, measured, 1e-9)
    assert sentence(expected, measured, 1e-3)


def test_a_remaining_transient_of_nothing_is_no_division():
    found = relative(np.array([1.0, 0.0, 1.0]), np.array([2.0, 0.0, 0.0]))
    assert found.tolist() == [0.5, 0.0, np.inf]
    silent = np.array([False, True, False])
    assert unsettled(OUTPUTS, found, silent, 1e-3, 9.0).startswith("a.small has not responded after 9 s")
    assert unsettled(OUTPUTS, found, ~silent & silent, 1e-3, 9.0).startswith("a.rest has not settled after 9 s")
