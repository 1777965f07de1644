"""Facts shared by several parts: scenes are consistent; a change of one part is reported with the owner of the fact."""

import itertools
import random
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scene_variants import VARIANTS

from hfsa.components._modelling.parts import argument_values
from hfsa.cosim.assembly.agreement import conflicts, disagreements, known_facts, same
from hfsa.cosim.assembly.fuse import fused
from hfsa.cosim.assembly.load_scene import available_scenes, load_scene, written
from hfsa.cosim.assembly.models import available_parts
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene_file import scene_text
from hfsa.cosim.systems.system import Component, Connection, System

NUMBERS = {
    "sdelta_hfsa": {
        "posture.rotation": "3,2,1",
        "payload.mass": "1",
        "damping": "0.02",
        "gravity": "9.81",
        "sample_time": "1e-3",
        "encoder_noise": "1e-5",
    },
    "sdelta_shaker": {"posture.position": "0,0.01,0.15", "payload.mass": "0", "damping": "0.02"},
    "sdelta_accelerometer": {"posture.rotation": "3,2,1", "payload.mass": "5", "robot_damping": "0.02"},
    "sdelta_manoeuvre": {"posture.rotation": "3,2,1", "payload.mass": "2", "damping": "0.02", "gravity": "9.81"},
    "stage_tracking": {"pzt.blocking_force": "2000", "pzt.stroke": "20e-6", "damping_time": "1e-5"},
    "stage_bode": {"pzt.stiffness": "1e8", "pzt.full_voltage": "100", "damping_time": "1e-5", "bias": "30"},
    "stage_accelerometer": {"pzt.blocking_force": "2000", "damping_time": "1e-5", "bias": "30"},
    "stage_extremes": {"damping_time": "1e-5"},
    "beam_payload": {"kind": "tilted", "tilt": "30", "payload.mass": "0.3", "payload.center": "0.01,0,0.02"},
}
"""Values that are not the defaults, so that none of them agrees by chance."""

MOST = 300
"""Largest number of combinations of a scene's options that are tried."""

OF_ONE_PART = ("design", "sensor")
"""Options that reach a single part, and no fact."""

OWNERS = {
    "posture of the SDelta": {"posture.rotation", "posture.position"},
    "payload of the SDelta": {"payload.mass", "payload.center", "payload.inertia"},
    "stiffness of the SDelta": {"stiffness"},
    "damping ratio of the SDelta": {"damping", "robot_damping"},
    "damping model of the SDelta": {"damping_model"},
    "gravity on the SDelta": {"gravity"},
    "geometry of the SDelta": {"geometry.base_radius", "geometry.platform_radius"},
    "gear reduction of the SDelta": {"gear"},
    "screw pitch of the SDelta": {"pitch"},
    "rods of the SDelta": {f"rods.{name}" for name in ("length", "diameter", "elastic_modulus", "density")}
    | {"rods.tip_stiffness"},
    "shafts of the SDelta": {f"shafts.{name}" for name in ("length", "diameter", "shear_modulus", "coupling")},
    "inertia of the limbs of the SDelta": {
        f"limbs.{name}" for name in ("rotor_inertia", "screw_inertia", "tube_mass", "tube_inertia")
    },
    "platform of the SDelta": {"platform.mass", "platform.inertia"},
    "kinematics of the stage": {"kinematics"},
    "links of the stage": {f"links.{name}" for name in ("crank", "coupler", "radius", "psi1", "psi2", "arm")},
    "hinges of the stage": {
        f"hinge.{name}"
        for name in ("elastic_modulus", "width", "thickness", "radius", "yield_strength", "safety_factor")
    },
    "masses of the stage": {
        f"masses.{name}" for name in ("platform", "platform_inertia", "crank", "crank_inertia", "coupler")
    },
    "Jacobian of the stage": {"jacobian"},
    "stiffness of the stage": {"stiffness"},
    "inertia of the stage": {"mass"},
    "damping time of the stage": {"damping_time"},
    "stiffness of the stacks": {"pzt.blocking_force", "pzt.stiffness", "pzt.stroke"},
    "force per volt of the stacks": {"pzt.blocking_force", "pzt.stiffness", "pzt.full_voltage"},
    "free stroke of the stacks": {"pzt.stroke"},
    "full voltage of the stacks": {"pzt.full_voltage"},
    "mass of the body on the beams": {"payload.mass"},
    "inertia of the body on the beams": {"payload.inertia"},
    "mass centre of the body on the beams": {"payload.center"},
}


def options(name: str) -> Iterator[dict[str, Any]]:
    """Yield all combinations of a scene's options with a choice of values."""
    words = {
        a.name: a.values or (True, False)
        for a in available_scenes()[name].arguments.values()
        if a.values or a.annotation is bool
    }
    words = {option: values for option, values in words.items() if option not in OF_ONE_PART}
    for values in itertools.product(*words.values()):
        yield dict(zip(words, values, strict=True))


@pytest.mark.parametrize("name", list(available_scenes()))
def test_no_scene_disagrees_with_itself(name):
    draw, able = random.Random(0), 0
    every = list(options(name))
    every = draw.sample(every, min(MOST, len(every)))
    numbers = NUMBERS.get(name, {})
    some = draw.sample(every, min(40, len(every)))
    for arguments in [*({**numbers, **words} for words in every), *some]:
        try:
            scene = written(available_scenes()[name], arguments)
        except StructureError:  # a law that commands volts does not go with ideal forces
            continue
        able += 1
        assert conflicts(scene.system) == [], arguments
    assert able > len(every) / 2


# One part alone -------------------------------------------------------------------------------------------------------


def other(component: Component, name: str, value: Any, factor: float) -> Any:
    """Return another value of an argument or a variable."""
    argument = available_parts()[component.part].arguments.get(name)
    if argument is not None and argument.values:
        return next(word for word in argument.values if word not in (value, "measured"))
    if isinstance(value, list | tuple):
        return tuple(factor * item + 1e-4 for item in value)
    if value is None:
        is_matrix = argument is not None and "tuple" in str(argument.annotation)
        return tuple(1e5 * factor * np.eye(3).ravel()) if is_matrix else 1e5 * factor
    return factor * float(value) + (1e-4 if value == 0 else 0)


def single_changes(system: System) -> Iterator[tuple[str, Any, str, str]]:
    """Yield changes of one part: argument and value as typed, component and fact, where another part shares the fact.

    Each change has a different factor, so that no quotient of two values is preserved.
    """
    factors = (1.01 + 0.001 * i for i in itertools.count())
    for fact, holders in known_facts(system).items():
        if len({holder.source for holder in holders}) == 1:
            continue
        for holder in holders:
            part, is_analysis = holder.source
            if is_analysis:
                continue
            known = available_parts()[part].facts[fact].name
            for field, value in holder.values.items():
                name = f"{known}.{field}" if field else known
                component = system[holder.component]
                now = component.start.get(name, value)
                yield (
                    f"{holder.component}.{name}",
                    other(component, name, now, next(factors)),
                    holder.component,
                    fact.name,
                )


@pytest.mark.parametrize(
    ("name", "words"),
    [pytest.param(*it, marks=pytest.mark.slow if it[0] == "stage_accelerometer" else ()) for it in VARIANTS],
)
def test_a_part_that_is_changed_alone_is_in_conflict(name, words):
    changes = list(single_changes(load_scene(name, words).system))
    if name not in ("sdelta_shaker",):  # whose reference knows the posture only
        assert len(changes) > 1
    for key, value, component, fact in changes:
        found = conflicts(load_scene(name, {**words, key: value}).system)
        assert fact in [conflict.fact.name for conflict in found], key
        holders = next(conflict.holders for conflict in found if conflict.fact.name == fact)
        assert component in [holder.component for holder in holders]


@pytest.mark.parametrize(("name", "words"), VARIANTS)
def test_the_sentence_names_who_differs_by_how_much_and_the_owner(name, words):
    """One change for each fact, all at once."""
    typed = {}
    for key, value, component, fact in single_changes(load_scene(name, words).system):
        typed.setdefault(fact, (key, value, component))
    arguments = {**words, **{key: value for key, value, _ in typed.values()}}
    sentences = {
        text.partition(" differs: ")[0]: text for text in disagreements(name, arguments, load_scene(name, arguments))
    }
    assert typed.keys() <= sentences.keys()
    for fact, (key, value, component) in typed.items():
        assert component in sentences[fact]
        assert isinstance(value, tuple) or key.startswith("stack[") or _shown(value) in sentences[fact], sentences[fact]
        owners = [
            word.removeprefix("-p ").removesuffix("=VALUE") for word in sentences[fact].split("; ")[-1].split(" and ")
        ]
        owners[-1] = owners[-1].removesuffix("=VALUE changes all of them")
        assert set(owners) <= OWNERS[fact], sentences[fact]


def _shown(value: Any) -> str:
    return value if isinstance(value, str) else f"{float(value):.6g}"


# What does not have to agree ------------------------------------------------------------------------------------------


def robot_with(reference: str, robot: str, number: int = 1) -> tuple[list[Component], list[Connection]]:
    """A robot that follows a reference, each in a posture of its own."""
    return [
        Component(f"reference[{number}]", "sdelta_reference", None, {"posture.position": reference}),
        Component(f"robot[{number}]", "sdelta", None, {"posture.position": robot}),
    ], [Connection(f"reference[{number}].drive[1..3].slide", f"robot[{number}].drive[1..3].slide")]


def test_two_machines_beside_each_other_are_two():
    """Postures of two machines may differ; those within one may not."""
    (one, joined), (two, apart) = robot_with("0,0,0.15", "0,0,0.15"), robot_with("0,0,0.16", "0,0,0.16", 2)
    assert conflicts(System([*one, *two], [*joined, *apart])) == []
    (two, apart) = robot_with("0,0,0.16", "0,0,0.17", 2)
    (found,) = conflicts(System([*one, *two], [*joined, *apart]))
    assert [holder.component for holder in found.holders] == ["reference[2]", "robot[2]"]


@given(st.floats(-1e300, 1e300), st.floats(-1e-10, 1e-10))
def test_a_number_is_itself_but_for_rounding(number, rounding):
    assert same(number, number)
    assert same([number, 0.0], [number * (1 + rounding), 0.0])
    assert same((number, 1e-13 * number), (number, 0.0))
    assert not same(number, number + abs(number) + 1)
    assert not same([number], [number, number])


def test_numbers_agree_but_for_rounding():
    assert conflicts(System(*robot_with("0,0,0.15", "0,1e-18,0.15000000000000002"))) == []
    assert conflicts(System(*robot_with("0,0,0.15", "0,0,0.1500001"))) != []


def test_stacks_that_own_their_stiffness_may_differ():
    """Each stack has its own line; a stage that owns the stiffness of all has one number for them."""
    stacks = [
        Component(f"stack[{i}]", "pzt_stack", None, {"causality": "force"}, {"maximum.force": 800.0 + i})
        for i in (1, 2)
    ]
    pushed = [Connection(f"stack[{i}].stack.force", f"stage.stack[{i}].force") for i in (1, 2)]
    assert conflicts(System([*stacks, Component("stage", "rrr_stage", None, {"causality": "force"})], pushed)) == []
    blocked = [Component(s.name, s.part, None, {"causality": "source"}, s.start) for s in stacks]
    pushed = [Connection(f"stack[{i}].stack.blocking_force", f"stage.stack[{i}].blocking_force") for i in (1, 2)]
    found = conflicts(System([*blocked, Component("stage", "rrr_stage")], pushed))
    assert [conflict.fact.name for conflict in found] == ["stiffness of the stacks"]


def hung(upper: float, lower: float) -> System:
    """A body on beams, and a second one suspended from it: each suspension damps the body that it carries."""
    bodies = [Component(f"body[{i}]", "rigid_body", None, {"body.mass": m}) for i, m in ((1, 0.1), (2, 0.2))]
    beams = [
        Component(f"beams[{i}]", "beam_suspension", None, {"platform.mass": m}) for i, m in ((1, upper), (2, lower))
    ]
    joins = [Connection(f"body[{i}].platform.position[1..3]", f"beams[{i}].platform.position[1..3]") for i in (1, 2)]
    return System(
        [*bodies, *beams], [*joins, Connection("body[1].platform.position[1..3]", "beams[2].base.position[1..3]")]
    )


def test_a_body_agrees_with_the_beams_that_carry_it_not_with_those_that_hang_on_it():
    assert conflicts(hung(0.1, 0.2)) == []
    (found,) = conflicts(hung(0.2, 0.2))
    assert [holder.label for holder in found.holders] == ["body[1].body.mass", "beams[1].platform.mass"]


def test_a_mass_centre_counts_from_where_the_body_counts():
    """The reference points of suspension and body may differ: body.center = from_platform + platform.center."""
    center, arm = (0.01, 0.02, 0.03), (0.004, 0.0, -0.001)
    body = Component("body", "rigid_body", None, {"body.center": center})
    join = [Connection("body.platform.position[1..3]", "beams.platform.position[1..3]")]
    own = tuple(c - a for c, a in zip(center, arm, strict=True))
    for platform, agree in ((own, True), (center, False)):
        beams = Component("beams", "beam_suspension", None, {"platform.center": platform, "from_platform": arm})
        assert (conflicts(System([body, beams], join)) == []) is agree


def test_a_controller_on_a_simpler_model_is_on_purpose():
    for model in ("constant_jacobian", "exact"):
        assert conflicts(load_scene("stage_tracking", {"stage": "exact", "model": model}).system) == []


def test_what_a_level_does_not_use_may_differ():
    """The rigid feed-forward has no springs."""
    for level, found in (("rigid", []), ("elastic", ["stiffness of the SDelta"])):
        scene = load_scene("sdelta_hfsa", {"feed_forward": level, "robot.stiffness": "ch3_rods"})
        assert [conflict.fact.name for conflict in conflicts(scene.system)] == found


def test_a_torque_that_is_fed_forward_takes_the_place_of_the_controllers_gravity():
    scene = load_scene("sdelta_hfsa", {"law": "ctc", "feed_forward": "rigid", "gravity": "9.81"})
    assert scene.system["controller"].start["gravity"] == 0
    assert conflicts(scene.system) == []
    alone = load_scene("sdelta_hfsa", {"law": "ctc", "robot.gravity": "9.81"})
    assert [conflict.fact.name for conflict in conflicts(alone.system)] == ["gravity on the SDelta"]


def test_a_number_of_the_users_own_follows_from_nothing():
    """The gains are then no longer those of the payload, and the holding torque no longer that of gravity."""
    typed = {f"controller.axis[1..6].{gain}": 1.0 for gain in ("proportional_gain", "derivative_gain", "feed_forward")}
    assert conflicts(load_scene("sdelta_hfsa", {"robot.payload.mass": "1", "robot.gravity": "1", **typed}).system) == []
    typed.popitem()
    assert conflicts(load_scene("sdelta_hfsa", {"robot.payload.mass": "1", **typed}).system) != []


# Whatever a system comes from -----------------------------------------------------------------------------------------

MASSLESS = {"suspension": "massless", "payload.body.mass": "0.2"}


def test_a_scene_of_the_users_own_is_checked_too(tmp_path):
    scene = load_scene("beam_payload", MASSLESS)
    file = tmp_path / "mine.toml"
    file.write_text(scene_text(scene))
    (sentence,) = disagreements(str(file), {}, load_scene(str(file)))
    assert sentence == (
        "mass of the body on the beams differs: 0.1 kg in suspension.platform.mass; 0.2 kg in payload.body.mass; "
        "the scene has no argument that changes all of them"
    )


def test_members_of_one_fmu_are_checked_too():
    system = fused(load_scene("beam_payload", MASSLESS).system, [["suspension", "payload"]])
    assert len(system.components) == 1
    assert [conflict.fact.name for conflict in conflicts(system)] == ["mass of the body on the beams"]


def test_what_cannot_be_read_is_left_to_those_who_build_it():
    components, joined = robot_with("0,0,0.15", "nowhere")
    assert conflicts(System(components, joined)) == []
    assert conflicts(System([*components, Component("stranger", "no_such_part")], joined)) == []
    stacks = [
        Component(f"stack[{i}]", "pzt_stack", None, {"maximum.force": force}) for i, force in ((1, "much"), (2, 1))
    ]
    pushed = [Connection(f"stack[{i}].stack.blocking_force", f"stage.stack[{i}].blocking_force") for i in (1, 2)]
    assert conflicts(System([*stacks, Component("stage", "rrr_stage", None, {"causality": "forced"})], pushed)) == []


@pytest.mark.parametrize("name", sorted(name for name, part in available_parts().items() if part.facts))
def test_a_part_declares_names_that_it_has(name):
    part = available_parts()[name]
    own = set(argument_values(name, part.build, {})) | set(argument_values(name, part.analyze, {}))
    inputs = set()
    if part.build is not None:
        model = part.model()
        inputs = {quantity.name for quantity in model}
        own |= inputs
    for fact, known in part.facts.items():
        for argument in filter(None, (known.name, known.per, known.plus)):
            assert any(n == argument or n.startswith(f"{argument}.") for n in own), f"{fact.name}: {argument}"
        assert not known.unfed or known.unfed in inputs
        assert set(known.levels) <= set(part.levels)
        assert not known.results or set(known.results) <= set(part.analysis())
