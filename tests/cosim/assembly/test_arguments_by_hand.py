"""Arguments of a scene reach every part: equal to setting each part by hand, range by range."""

from typing import Any

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scene_variants import VARIANTS

from hfsa.components._modelling.model import Kind
from hfsa.components._modelling.parts import argument_values
from hfsa.cosim.assembly.agreement import known_facts, same
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.assembly.models import available_parts
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import System


def resolved(system: System) -> dict[str, tuple[Any, ...]]:
    """Return level, arguments and start values of each component, including the defaults of its part."""
    found = {}
    for c in system.components:
        part = available_parts()[c.part]
        values = argument_values(c.part, part.build, {k: v for k, v in c.arguments.items() if part.has_argument(k)})
        found[c.name] = (c.level, values, dict(c.start))
    return found


def assert_same(one: System, another: System) -> None:
    first, second = resolved(one), resolved(another)
    assert first.keys() == second.keys()
    for name, (level, arguments, start) in first.items():
        assert level == second[name][0]
        for these, those in ((arguments, second[name][1]), (start, second[name][2])):
            assert these.keys() == those.keys()
            for key, value in these.items():
                assert same(value, those[key]), f"{name}.{key}: {value} by the scene, {those[key]} by hand"


def by_hand(name: str, words: dict[str, Any], fact: str, field: str, value: Any) -> dict[str, Any]:
    """Return arguments that set a fact in every part that has it, and every number that an analysis derives from it."""
    system, typed = load_scene(name, words).system, {}
    for known_fact, holders in known_facts(system).items():
        if known_fact.name != fact:
            continue
        for holder in holders:
            part = available_parts()[holder.source[0]]
            argument = ".".join(filter(None, (part.facts[known_fact].name, field)))
            if not holder.source[1]:
                typed[f"{holder.component}.{argument}"] = value
                continue
            for variable, analysis in system[holder.component].computed.items():
                if analysis.part != part.name:
                    continue
                changed = part.analysis(**{**analysis.arguments, argument: value})
                stem, _, members = analysis.key.partition("[")
                first = int(members.partition("..")[0] or 1) if members else 1
                at = int(variable.partition("[")[2].partition("]")[0]) - 1
                typed[f"{holder.component}.{variable}"] = float(changed[stem][first - 1 + at])
    return typed


CONTROL = st.fixed_dictionaries(
    {
        "law": st.sampled_from(["pd", "ctc", "ctc_cartesian"]),
        "feed_forward": st.sampled_from(["none", "rigid", "elastic"]),
        "execution": st.sampled_from(["sampled", "continuous"]),
        "gravity": st.just(9.81),
    }
)
ROBOT_FACTS = st.one_of(
    st.tuples(st.just(("payload.mass", "payload of the SDelta", "mass")), st.floats(0, 20)),
    st.tuples(st.just(("payload.center", "payload of the SDelta", "center")), st.tuples(*[st.floats(-0.1, 0.1)] * 3)),
    st.tuples(
        st.just(("payload.inertia", "payload of the SDelta", "inertia")), st.tuples(*[st.floats(0.01, 0.019)] * 3)
    ),
    st.tuples(st.just(("posture.rotation", "posture of the SDelta", "rotation")), st.tuples(*[st.floats(-5, 5)] * 3)),
    st.tuples(st.just(("gravity", "gravity on the SDelta", "")), st.floats(0, 20)),
    st.tuples(st.just(("damping", "damping ratio of the SDelta", "")), st.floats(1e-3, 0.1)),
    st.tuples(
        st.just(("stiffness", "stiffness of the SDelta", "")), st.sampled_from(["ch3_full", "ch3_rods", "ch4_full"])
    ),
)


@settings(max_examples=40, deadline=None)
@given(CONTROL, ROBOT_FACTS)
@pytest.mark.slow
def test_the_robots_arguments_are_all_parts_by_hand(words, changed):
    (argument, fact, field), value = changed
    assume((argument, words["feed_forward"]) != ("stiffness", "rigid"))  # which takes the robot for rigid
    typed = by_hand("sdelta_hfsa", words, fact, field, value)
    hand = load_scene("sdelta_hfsa", {**words, **typed})
    assert_same(load_scene("sdelta_hfsa", {**words, argument: value}).system, hand.system)


@settings(max_examples=25, deadline=None)
@given(
    st.sampled_from([words for name, words in VARIANTS if name == "stage_tracking"]),
    st.sampled_from([("damping_time", "damping time of the stage"), ("kinematics", "kinematics of the stage")]),
    st.floats(0, 1e-4),
)
def test_the_stages_arguments_are_all_parts_by_hand(words, changed, number):
    argument, fact = changed
    value = "calibrated" if argument == "kinematics" else number
    typed = by_hand("stage_tracking", words, fact, "", value)
    hand = load_scene("stage_tracking", {**words, **typed})
    assert_same(load_scene("stage_tracking", {**words, argument: value}).system, hand.system)


@settings(max_examples=25, deadline=None)
@given(
    st.sampled_from([(n, w) for n, w in VARIANTS if n.startswith("stage_") and n != "stage_extremes"]),
    st.floats(100, 1e4),
    st.floats(5e-6, 1e-4),
)
def test_another_stack_is_all_parts_by_hand(variant, force, stroke):
    """By the formulas of a stack of the Tokin's ceramic: k33, Q_m and density as of F0 = 833 N, s0 = 16 um."""
    name, words = variant
    scene = load_scene(name, {**words, "pzt.blocking_force": force, "pzt.stroke": stroke})
    size = force * stroke / (833 * 16e-6)
    k, tip = force / stroke, size * 7700 * 5e-3 * 5e-3 * 20e-3 / 3
    line = {"stack.stiffness": k, "stack.coupling": force / 150}
    expected = {
        "stage": {"stack.stiffness": k, "stack.tip_mass": tip, "stack.damping": (k * tip) ** 0.5 / 25},
        "voltage": {**line, "maximum.voltage": 150.0},
        "feed_forward": line,
        **{
            f"stack[{i}]": {
                "maximum.force": force,
                "maximum.elongation": stroke,
                "maximum.voltage": 150.0,
                "clamped_capacitance": size * (1.4e-6 - 833 * 16e-6 / 150**2),
            }
            for i in (1, 2, 3)
        },
    }
    for component in scene.system.components:
        if component.name == "stage" and component.arguments.get("causality") == "force":
            continue
        starts = component.start
        if component.name == "stage":  # by arguments, from which the parameters of its FMU follow
            model = available_parts()["rrr_stage"].model(component.level, **component.arguments)
            starts = {quantity.name: quantity.start for quantity in model.of(Kind.PARAMETER)}
        for variable, value in expected.get(component.name, {}).items():
            assert starts[variable] == pytest.approx(value, rel=1e-9), f"{component.name}.{variable}"
    if "elongation" in "".join(scene.system["stage"].start):
        rest = [scene.system["stage"].start[f"leg[{i}].elongation"] for i in (1, 2, 3)]
        stack = {"stack.blocking_force": force, "stack.stroke": stroke}
        volts = available_parts()["rrr_stage"].analysis(elongation=rest, **stack)["voltage"]
        assert list(volts) == pytest.approx([75.0] * 3, rel=1e-6)


def test_a_range_of_components_is_each_of_them():
    whole = load_scene("stage_tracking", {"stack[1..3].maximum.force": "2000", "stack[2..3].level": "linear"})
    single = load_scene(
        "stage_tracking",
        {
            **{f"stack[{i}].maximum.force": 2000 for i in (1, 2, 3)},
            "stack[2].level": "linear",
            "stack[3].level": "linear",
        },
    )
    assert whole == single
    structural = load_scene("sdelta_hfsa", {"drive[1..3].encoder_noise": "true"})
    assert all(structural.system[f"drive[{j}]"].arguments["encoder_noise"] == "true" for j in (1, 2, 3))


@pytest.mark.parametrize(
    ("name", "typed", "words"),
    [
        ("sdelta_shaker", "gravity", "no argument 'gravity', but components have it: -p robot.gravity=VALUE"),
        ("stage_bode", "maximum.force", r"but components have it: -p stack\[1..3\].maximum.force=VALUE"),
        ("stage_bode", "stack[1..4].maximum.force", r"no component is called 'stack\[4\]'"),
        ("stage_bode", "stak[1..3].maximum.force", r"did you mean stack\[1..3\].maximum.force"),
        ("stage_bode", "stack[3..1].maximum.force", r"range \[3..1\] in stack\[3..1\] is empty"),
        ("sdelta_hfsa", "payload.mas", "did you mean payload.mass"),
        ("sdelta_hfsa", "body.mass", "no argument 'body.mass'; did you mean"),
        ("beam_payload", "platform.mass", "but components have it: -p payload.platform.mass=VALUE"),
    ],
)
def test_an_argument_that_is_not_there_is_answered_with_what_works(name, typed, words):
    with pytest.raises(StructureError, match=words):
        load_scene(name, {typed: "1"})


def test_every_suggestion_works():
    for name, typed, value in (("sdelta_shaker", "gravity", "1"), ("stage_bode", "maximum.force", "900")):
        with pytest.raises(StructureError) as error:
            load_scene(name, {typed: value})
        suggested = str(error.value).partition("-p ")[2].removesuffix("=VALUE")
        assert load_scene(name, {suggested: value}).system != load_scene(name).system
