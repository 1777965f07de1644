"""Every capability flag in both model descriptions has tests that exercise it; the list is printed (pytest -s).

Each flag is exercised twice: by a function of harness/exercise.c, which talks to the binary in C and runs under the
sanitizers (test_sanitizers.py), and by a test in Python that compares with an independent result.
"""

import ast
import re
from pathlib import Path

import pytest
from lxml import etree

from hfsa.components.mass_on_spring import mass_on_spring
from hfsa.fmus.c_code import generate
from hfsa.fmus.model_description import model_description

FOLDER = Path(__file__).parent

STATES = ("exercise_states", "test_runtime_states.py::test_a_restored_state_repeats_bit_for_bit")
SERIALIZED = ("exercise_states", "test_runtime_states.py::test_a_serialized_state_carries_over")
FORWARD = ("exercise_derivatives", "test_runtime_derivatives.py::test_forward_derivatives_equal_finite_differences")
COMPLETED = ("exercise_model_exchange", "test_runtime_model_exchange.py::test_model_exchange_needs_no_completed_step")
TESTS = {
    "canGetAndSetFMUstate": STATES,
    "canGetAndSetFMUState": STATES,
    "canSerializeFMUstate": SERIALIZED,
    "canSerializeFMUState": SERIALIZED,
    "providesDirectionalDerivative": FORWARD,
    "providesDirectionalDerivatives": FORWARD,
    "providesAdjointDerivatives": (
        "exercise_derivatives",
        "test_runtime_derivatives.py::test_adjoint_derivatives_are_the_transpose",
    ),
    "canNotUseMemoryManagementFunctions": (
        "exercise_states",
        "test_sanitizers.py::test_a_million_steps_allocate_nothing",
    ),
    "completedIntegratorStepNotNeeded": COMPLETED,
    "needsCompletedIntegratorStep": COMPLETED,
    "canInterpolateInputs": ("exercise_steps", "test_solvers.py::test_exact_equals_the_matrix_exponential"),
    "canHandleVariableCommunicationStepSize": (
        "exercise_steps",
        "test_runtime_steps.py::test_the_communication_step_may_vary",
    ),
    "maxOutputDerivativeOrder": (
        "exercise_output_derivatives",
        "test_runtime_derivatives.py::test_output_derivatives_follow_the_motion",
    ),
    "hasEventMode": ("exercise_the_rest", "test_runtime.py::test_calls_that_an_fmu_does_not_offer"),
    "providesIntermediateUpdate": (
        "exercise_intermediate_update",
        "test_intermediate_update.py::test_outputs_inside_a_step_are_those_of_shorter_steps",
    ),
    "canReturnEarlyAfterIntermediateUpdate": (
        "exercise_intermediate_update",
        "test_intermediate_update.py::test_a_limit_is_met_where_it_is_crossed",
    ),
    "mightReturnEarlyFromDoStep": ("exercise_states", "test_runtime_steps.py::test_last_successful_time"),
}
"""Flag: function of harness/exercise.c, test in Python."""

MORE = {
    "any number of instances": ("exercise_states", "test_runtime.py::test_two_instances_do_not_disturb_each_other"),
    "reset": ("exercise_states", "test_runtime.py::test_reset_is_a_new_instance"),
    "an error is a status and a message": (
        "exercise_errors",
        "test_runtime_steps.py::test_an_input_that_is_no_number_stops_the_step",
    ),
    "ticks at the sample time": (
        "exercise_steps",
        "test_runtime_steps.py::test_ticks_are_the_same_for_any_communication_step",
    ),
}
"""What an FMU of ours promises beside its flags."""


@pytest.fixture(scope="module")
def flags() -> list[tuple[int, str, str, str]]:
    """Version, interface, flag and value of every attribute that states a capability."""
    model = mass_on_spring()
    sources = generate(model)
    rows = []
    for version in (2, 3):
        root = etree.fromstring(model_description(model, sources, version))
        for element in root.iterchildren("ModelExchange", "CoSimulation"):
            rows += [(version, element.tag, *item) for item in element.items() if item[0] != "modelIdentifier"]
    return rows


def test_every_flag_has_its_tests(flags):
    lines = [
        f"FMI {version}  {interface:14} {flag + '=' + value:44} {TESTS[flag][0]:28} {TESTS[flag][1]}"
        for version, interface, flag, value in flags
    ]
    lines += [f"{promise:66} {function:28} {test}" for promise, (function, test) in MORE.items()]
    print("", *lines, sep="\n")
    assert {flag for _, _, flag, _ in flags} == set(TESTS)


@pytest.mark.parametrize(("function", "name"), sorted({*TESTS.values(), *MORE.values()}))
def test_the_tests_exist_and_the_harness_calls_its_own(function, name):
    file, test = name.split("::")
    tree = ast.parse((FOLDER / file).read_text())
    assert test in [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
    program = (FOLDER / "harness" / "exercise.c").read_text()
    assert re.search(rf"^static void {function}\(", program, re.MULTILINE)
    assert re.search(rf"{function}\(", program[program.index("int main(") :])
