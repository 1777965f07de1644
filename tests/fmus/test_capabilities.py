"""Every capability flag in both model descriptions has a test that exercises it; the list is printed (pytest -s)."""

import ast
from pathlib import Path

import pytest
from lxml import etree

from hfsa.components.mass_on_spring import mass_on_spring
from hfsa.fmus.c_code import generate
from hfsa.fmus.model_description import model_description

STATES = "test_runtime.py::test_a_restored_state_repeats_bit_for_bit"
SERIALIZED = "test_runtime.py::test_a_serialized_state_carries_over"
FORWARD = "test_runtime.py::test_forward_derivatives_equal_finite_differences"
TESTS = {
    "canGetAndSetFMUstate": STATES,
    "canGetAndSetFMUState": STATES,
    "canSerializeFMUstate": SERIALIZED,
    "canSerializeFMUState": SERIALIZED,
    "providesDirectionalDerivative": FORWARD,
    "providesDirectionalDerivatives": FORWARD,
    "providesAdjointDerivatives": "test_runtime.py::test_adjoint_derivatives_are_the_transpose",
    "canNotUseMemoryManagementFunctions": "test_sanitizers.py::test_every_call_is_clean",
    "completedIntegratorStepNotNeeded": "test_runtime.py::test_model_exchange_needs_no_completed_step",
    "needsCompletedIntegratorStep": "test_runtime.py::test_model_exchange_needs_no_completed_step",
    "canInterpolateInputs": "test_solvers.py::test_exact_equals_the_matrix_exponential",
    "canHandleVariableCommunicationStepSize": "test_runtime.py::test_the_communication_step_may_vary",
    "maxOutputDerivativeOrder": "test_runtime.py::test_output_derivatives_follow_the_motion",
    "hasEventMode": "test_sanitizers.py::test_every_call_is_clean",
    "mightReturnEarlyFromDoStep": "test_runtime.py::test_last_successful_time",
}
MORE = {
    "any number of instances": "test_runtime.py::test_two_instances_do_not_disturb_each_other",
    "no allocation in a million steps": "test_sanitizers.py::test_a_million_steps_allocate_nothing",
    "sampled models tick at their sample time": "test_runtime.py::test_ticks_are_the_same_for_any_communication_step",
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


def test_every_flag_has_its_test(flags):
    lines = [
        f"FMI {version}  {interface:14} {flag + '=' + value:45} {TESTS[flag]}"
        for version, interface, flag, value in flags
    ]
    lines += [f"{promise:67} {test}" for promise, test in MORE.items()]
    print("", *lines, sep="\n")
    assert {flag for _, _, flag, _ in flags} == set(TESTS)


@pytest.mark.parametrize("name", sorted({*TESTS.values(), *MORE.values()}))
def test_the_tests_exist(name):
    file, function = name.split("::")
    tree = ast.parse((Path(__file__).parent / file).read_text())
    assert function in [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
