"""Predicted errors are those that a run shows: of responses by the one-step matrix, of motions by their spectrum."""

from contextlib import ExitStack
from dataclasses import replace

import numpy as np
import pytest

from hfsa.cosim import load_scene
from hfsa.cosim.assembly.native_loop import stepping_library
from hfsa.cosim.tradeoff.configuration import Composition, Configuration
from hfsa.cosim.tradeoff.motion import Motion, Outputs, Signals
from hfsa.cosim.tradeoff.responses import Place, Responses

BOUND = 1.5
"""Largest ratio of a predicted error to the measured one, either way."""

RESPONSES = {
    "a mass, inputs held": ("mass_on_spring", {"damping": 20}, "jacobi", 2e-4, ()),
    "a mass, inputs extrapolated": ("mass_on_spring", {"damping": 20}, "gauss_seidel_linear", 1e-3, ()),
    "a wrench across a step": ("beam_payload", {"suspension": "massless"}, "gauss_seidel", 2e-6, ()),
    "one FMU": ("beam_payload", {"suspension": "massless"}, "jacobi_linear", 2e-5, (("suspension", "payload"),)),
}


@pytest.mark.parametrize("case", RESPONSES.values(), ids=RESPONSES)
def test_responses_have_the_predicted_error(case):
    name, arguments, algorithm, step, fuse = case
    scene = load_scene(name, arguments)
    with ExitStack() as stack:
        question = Responses(scene, stepping_library(), stack)
        configuration = Configuration(Composition(fuse=fuse), algorithm, step)
        predicted = question.predicted(configuration)
        places = question.places([configuration])
        found = question.measured(configuration, places, 1e-4)
        measured, where = question.error(found, question.exact(places))
    assert predicted.error / BOUND < measured < BOUND * predicted.error
    assert predicted.error > 1e-6
    assert "Hz" in where


def test_steps_beyond_a_limit_are_not_offered():
    scene = load_scene("beam_payload", {"suspension": "massless"})
    with ExitStack() as stack:
        question = Responses(scene, None, stack)
        inside = Configuration(Composition(), "gauss_seidel", 6.9e-6)  # the limit is 7.01 us
        outside = Configuration(Composition(), "gauss_seidel", 7.1e-6)
        assert np.isfinite(question.predicted(inside).error)
        assert np.isinf(question.predicted(outside).error)
        assert question.margin(inside) == pytest.approx(7.01 / 6.9, rel=2e-3)


MASS, ROBOT = "mass.position", "robot.platform.rotation[1]"
MOTIONS = {
    "a sine from rest, held": ("mass_on_spring", {"damping": 20}, MASS, "gauss_seidel", 2e-3),
    "a sine from rest, extrapolated": ("mass_on_spring", {"damping": 20}, MASS, "gauss_seidel_linear", 4e-3),
}
SLOW_MOTIONS = {"a robot under sampled control": ("sdelta_hfsa", {"law": "ctc"}, ROBOT, "gauss_seidel", 2.5e-4)}


@pytest.mark.parametrize(
    "case",
    [
        *(pytest.param(case, id=label) for label, case in MOTIONS.items()),
        *(pytest.param(case, id=label, marks=pytest.mark.slow) for label, case in SLOW_MOTIONS.items()),
    ],
)
def test_motions_have_the_predicted_error(case):
    name, arguments, output, algorithm, step = case
    scene = replace(load_scene(name, arguments), stop_time=0.4, outputs=[output])
    with ExitStack() as stack:
        question = Motion(scene, stepping_library(), stack)
        configuration = Configuration(Composition(), algorithm, step)
        predicted = question.predicted(configuration)
        places = question.places([configuration])
        found = question.measured(configuration, places, 1e-4)
        measured, _ = question.error(found, question.exact(places))
    assert predicted.error / BOUND < measured < BOUND * predicted.error


def test_signals_are_continued_without_a_jump():
    time = np.linspace(0, 1, 1001)
    signals = Signals(1e-3, np.column_stack([2 + time, np.sin(3 * time)]), np.array([2.0, 0.0]))
    continued = signals.continued
    assert continued[0] == pytest.approx([0, 0])
    assert np.abs(np.diff(continued, axis=0)).max() < 4e-3
    assert continued[-1] == pytest.approx([0, 0])
    assert np.array_equal(continued[:1000], signals.values[:1000] - signals.rest)


def test_extrapolation_removes_an_error_of_first_order():
    with ExitStack() as stack:
        question = Responses(load_scene("mass_on_spring"), None, stack)
        place, exact = Place("mass.base.position", 10.0), np.array([2.0 + 1j])
        values = [{place: exact + step * (0.3 - 0.2j)} for step in (1e-3, 2e-3)]
        assert question.extrapolated(*values)[place] == pytest.approx(exact)
        motion = Motion(load_scene("mass_on_spring"), None, stack)
        coarse = np.linspace(0, 1, 51)
        fine = np.linspace(0, 1, 101)
        runs = [Outputs(at, np.sin(at)[:, None] + step * at[:, None]) for at, step in ((fine, 0.1), (coarse, 0.2))]
        assert motion.extrapolated(*runs).values[:, 0] == pytest.approx(np.sin(coarse), abs=1e-9)


def test_a_response_that_is_no_number_is_no_small_error():
    with ExitStack() as stack:
        question = Responses(load_scene("mass_on_spring"), None, stack)
        place = Place("mass.base.position", 16.0)
        exact = question.exact([place])
        assert question.error({place: exact[place] * np.nan}, exact)[0] == np.inf
        assert question.error(exact, exact)[0] == 0.0
