"""Systems and scenes as data: refusals before anything runs, and the text of a stored scene."""

from typing import Any

import numpy as np
import pytest

from hfsa.cosim.systems.check import check
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.feedthrough import feedthrough, refuse_loops
from hfsa.cosim.systems.names import companions, expand
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.scene_file import read_scene, read_scene_text, scene_text
from hfsa.cosim.systems.system import Analysis, Component, Connection, System


def ports(**kinds: str) -> dict[str, Connector]:
    """Return connectors by name from words: causality, unit, then the dependencies of an output (`*` for all)."""
    found = {}
    for name, words in kinds.items():
        causality, unit, *inputs = words.split()
        followed = None if inputs == ["*"] else tuple(inputs)
        found[name] = Connector(name, 0, causality, unit=unit, dependencies=followed)
    return found


def ring(first: str, second: str) -> tuple[System, dict]:
    system = System([Component("a", "x"), Component("b", "x")], [Connection("a.y", "b.u"), Connection("b.y", "a.u")])
    return system, {"a": ports(u="input m", y=first), "b": ports(u="input m", y=second)}


# Names ----------------------------------------------------------------------------------------------------------------


def test_ranges():
    assert expand("drive[1..3].slide") == ["drive[1].slide", "drive[2].slide", "drive[3].slide"]
    assert expand("a[2..3].b[1..2]") == ["a[2].b[1]", "a[2].b[2]", "a[3].b[1]", "a[3].b[2]"]
    assert expand("plain[3].name") == ["plain[3].name"]
    with pytest.raises(StructureError, match="empty"):
        expand("a[3..1]")


def test_a_range_joins_pairwise():
    system = System([Component("a", "x"), Component("b", "x")], [Connection("a.y[1..2]", "b.u[4..5]")])
    assert [str(c) for c in system.connections] == ["a.y[1] -> b.u[4]", "a.y[2] -> b.u[5]"]


def test_companions():
    assert companions("command.position[3]") == (
        "command.position_rate[3]",
        "command.position_acceleration[3]",
        "command.position_jerk[3]",
    )
    assert companions("base.position") == ("base.position_rate", "base.position_acceleration", "base.position_jerk")


# Refused at once ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("connections", "words"),
    [
        ([Connection("a.y[1..3]", "b.u[1..2]")], r"joins 3 output\(s\) to 2 input\(s\)"),
        ([Connection("a.y", "b.u"), Connection("a.z", "b.u")], "input b.u is fed twice: by a.y and by a.z"),
        ([Connection("plnt.y", "b.u")], "no component is called 'plnt'; did you mean plant"),
        ([Connection("y", "b.u")], "'y' is not a full name"),
    ],
)
def test_wrong_wiring(connections, words):
    with pytest.raises(StructureError, match=words):
        System([Component("a", "x"), Component("b", "x"), Component("plant", "x")], connections)


def test_names_of_components():
    with pytest.raises(StructureError, match="two components are called a"):
        System([Component("a", "x"), Component("a", "y")])
    with pytest.raises(StructureError, match="not an identifier"):
        Component("a.b", "x")


@pytest.mark.parametrize(
    ("start", "end", "words"),
    [
        ("output N", "input m", r"a\.y -> b\.u: a\.y is in N, but b\.u in m"),
        ("input m", "input m", r"a\.y is an FMU's input, expected an output"),
        ("output m", "parameter m", r"b\.u is an FMU's parameter, expected an input"),
    ],
)
def test_connectors_that_do_not_fit(start, end, words):
    system = System([Component("a", "x"), Component("b", "x")], [Connection("a.y", "b.u")])
    with pytest.raises(StructureError, match=words):
        check(system, {"a": ports(y=start), "b": ports(u=end)})


def test_a_unit_may_be_spelt_differently():
    """`Newton` of a foreign FMU equals `N` where both are kg.m/s2; a variable without a unit accepts any."""
    newton = (1.0, 1.0, -2.0, 0, 0, 0, 0, 0, 1.0, 0)
    system = System([Component("a", "x"), Component("b", "x")], [Connection("a.y", "b.u")])
    ours = {"u": Connector("u", 0, "input", unit="N", base_unit=newton)}
    check(system, {"a": {"y": Connector("y", 0, "output", unit="Newton", base_unit=newton)}, "b": ours})
    check(system, {"a": {"y": Connector("y", 0, "output")}, "b": ours})
    joule = (1.0, 2.0, *newton[2:])
    with pytest.raises(StructureError, match="in Joule"):
        check(system, {"a": {"y": Connector("y", 0, "output", unit="Joule", base_unit=joule)}, "b": ours})


def test_unknown_variables():
    system = System([Component("a", "x", start={"gian": 1.0})])
    with pytest.raises(StructureError, match=r"a \(x\) has no variable 'gian'; did you mean gain"):
        check(system, {"a": ports(gain="parameter 1")})


# Loops ----------------------------------------------------------------------------------------------------------------


def test_an_algebraic_loop_is_spelt_out():
    with pytest.raises(StructureError, match=r"a\.y -> b\.u -> b\.y -> a\.u|b\.y -> a\.u -> a\.y -> b\.u"):
        refuse_loops(*ring("output m u", "output m u"))


def test_unstated_dependencies_count_as_all():
    with pytest.raises(StructureError, match="algebraic loop"):
        refuse_loops(*ring("output m *", "output m u"))


def test_a_state_breaks_the_loop():
    system, connectors = ring("output m u", "output m")
    refuse_loops(system, connectors)
    assert feedthrough(system, connectors).levels == {"b.y": 0, "a.y": 1}


def test_a_loop_shares_its_level_with_nothing_else():
    system, connectors = ring("output m u", "output m u")
    more = System(
        [*system.components, Component("c", "x"), Component("d", "x")],
        [*system.connections, Connection("c.y", "d.u"), Connection("d.y", "c.u")],
    )
    found = feedthrough(more, {**connectors, "c": ports(u="input m", y="output m"), "d": connectors["b"]})
    assert found.levels == {"a.y": 1, "b.y": 1, "c.y": 0, "d.y": 2}
    assert [{str(connection) for connection in loop} for loop in found.loops] == [{"a.y -> b.u", "b.y -> a.u"}]


def test_two_instances_may_pass_values_back_and_forth():
    """Not a loop: a.pose has no feedthrough, b.force depends on it, a.acceleration depends on the force."""
    system = System(
        [Component("a", "x"), Component("b", "x"), Component("c", "x")],
        [Connection("a.pose", "b.pose"), Connection("b.force", "a.force"), Connection("a.acc", "c.acc")],
    )
    connectors = {
        "a": ports(force="input N", pose="output m", acc="output m/s2 force"),
        "b": ports(pose="input m", force="output N pose"),
        "c": ports(acc="input m/s2"),
    }
    check(system, connectors)
    levels = feedthrough(system, connectors).levels
    assert levels["a.pose"] < levels["b.force"] < levels["a.acc"]


def test_outputs_share_a_level_where_nothing_waits():
    """One call reads both: no later output depends on the one that could be read earlier."""
    system = System(
        [Component("s", "x"), Component("a", "x"), Component("b", "x")],
        [Connection("s.y", "a.u"), Connection("a.follows", "b.u"), Connection("a.holds", "b.v")],
    )
    connectors = {
        "s": ports(y="output m"),
        "a": ports(u="input m", follows="output m u", holds="output m"),
        "b": ports(u="input m", v="input m"),
    }
    assert feedthrough(system, connectors).levels == {"s.y": 0, "a.follows": 1, "a.holds": 1}


# Scenes ---------------------------------------------------------------------------------------------------------------


def scene(**changes) -> Scene:
    robot = Component("robot", "sdelta", "cartesian", {"posture.rotation": (1.0, 2.0, 3e-7)}, {"damping_ratio": 0.1})
    fields = {
        "system": System([Component("a", "x"), robot], [Connection("a.y[1..2]", "robot.drive[1..2].slide")]),
        "inputs": ["a.u[1..3]"],
        "outputs": ["robot.z"],
        "band": (1, 50),
        "amplitude": {"m": 1e-5, "N.m": 0.1},
        "step_size": 5e-5,
        "stop_time": 2.0,
        "marks": {"vibration test": 255.0},
        "scale": {"robot.z": 1e-3, "a.y[1..2]": 0.1 + 0.2},
    }
    return Scene(**{**fields, **changes})


def test_a_scene_keeps_every_bit_as_text(tmp_path):
    given = scene(step_size=0.1 + 0.2)
    text = scene_text(given)
    assert read_scene_text(text) == given
    assert scene_text(read_scene_text(text)) == text
    (tmp_path / "own.toml").write_text(text)
    assert read_scene(tmp_path / "own.toml") == given
    assert scene_text(scene()) != text
    assert given.scale == {"robot.z": 1e-3, "a.y[1]": 0.1 + 0.2, "a.y[2]": 0.1 + 0.2}


def test_a_scene_written_by_hand():
    found = read_scene_text(
        """
        inputs = ["mass.base.position"]
        outputs = ["mass.position"]
        band = [1, 100]
        amplitude = { m = 1e-3 }
        step_size = 1e-4
        stop_time = 1
        [[components]]
        name = "mass"
        part = "mass_on_spring"
        start = { damping = 1 }
        """
    )
    assert found.system["mass"].start == {"damping": 1}
    assert (found.algorithm, found.band, found.source.part) == ("auto", (1.0, 100.0), "sine_source")


def test_a_scene_with_a_motion_of_its_own_needs_neither_inputs_nor_amplitude():
    given = scene(inputs=(), amplitude={})
    assert read_scene_text(scene_text(given)) == given
    lines = [line for line in scene_text(given).splitlines() if not line.startswith(("band", "amplitude"))]
    found = read_scene_text("\n".join(lines))
    assert (found.inputs, found.amplitude, found.band) == ((), {}, (1.0, 100.0))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"outputs": []}, "a scene needs outputs"),
        ({"amplitude": {}}, "a scene with inputs needs their amplitude"),
        ({"outputs": ["robt.z"]}, "no component is called 'robt'; did you mean robot"),
        ({"band": (5.0, 1.0)}, "band is 5 to 1 Hz"),
        ({"marks": {"test": "255 Hz"}}, "mark 'test' is at '255 Hz', expected a frequency in Hz"),
        ({"scale": {"robt.z": 1.0}}, "no component is called 'robt'; did you mean robot"),
        ({"scale": {"robot.z[1..2]": -1e-3}}, r"the scale of robot.z\[1\] is -0.001, expected a positive number"),
        ({"scale": {"robot.z": "12 um"}}, "the scale of robot.z is '12 um', expected a positive number in its unit"),
        ({"step_size": 0.0}, "step_size is 0, expected a positive number"),
    ],
)
def test_a_scene_that_makes_no_sense(change, words):
    with pytest.raises(StructureError, match=words):
        scene(**change)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('algorithm = "auto"', 'algoritm = "jacobi"', "own.toml has no key 'algoritm'; did you mean algorithm"),
        ('part = "sdelta"', 'prt = "sdelta"', "component has no key 'prt'; did you mean part"),
        ("band = [1.0, 50.0]", "band = 3", "band is 3, expected a list of two numbers"),
        ("step_size = 5e-05", 'step_size = "small"', "step_size is 'small', expected a number"),
        ('marks = { "vibration test" = 255.0 }', "marks = 255", "marks is 255, expected a table of numbers"),
        ('scale = { "robot.z" = 0.001', 'scale = "small" # {', "scale is 'small', expected a table of numbers"),
        ("stop_time = 2.0", "", "own.toml lacks the key 'stop_time'"),
        ("stop_time = 2.0", "stop_time = ", "own.toml: not a TOML document"),
        ("[[components]]", "[[component]]", "has no key 'component'; did you mean components"),
    ],
)
def test_a_scene_file_that_is_wrong(old, new, words):
    text = scene_text(scene())
    assert old in text
    with pytest.raises(StructureError, match=words):
        read_scene_text(text.replace(old, new), "own.toml")


# Wrong types ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("system", 5, "system is 5, expected a System"),
        ("source", "sine", "source is 'sine', expected a Component"),
        ("inputs", [5], "inputs is [5], expected a list of full names"),
        ("inputs", "a.u", "inputs is 'a.u', expected a list of full names"),
        ("outputs", None, "outputs is None, expected a list of full names"),
        ("outputs", [True], "outputs is [True], expected a list of full names"),
        ("band", 3, "band is 3, expected a list of two numbers"),
        ("band", ["a", 5.0], "band is ['a', 5.0], expected a list of two numbers"),
        ("band", [1.0, 2.0, 3.0], "band is [1.0, 2.0, 3.0], expected a list of two numbers"),
        ("band", [True, 5.0], "band is [True, 5.0], expected a list of two numbers"),
        ("amplitude", 5, "amplitude is 5, expected a table of numbers"),
        ("amplitude", {"m": "1e-5"}, "the amplitude in m is '1e-5', expected a number"),
        ("step_size", True, "step_size is True, expected a number"),
        ("step_size", 10**400, "step_size is 1000000"),
        ("stop_time", [10**5000], "stop_time is a number of too many digits, expected a number"),
        ("stop_time", "2 s", "stop_time is '2 s', expected a number"),
        ("tolerance", None, "tolerance is None, expected a number"),
        ("algorithm", 5, "algorithm is 5, expected the name of an algorithm"),
        ("marks", [255.0], "marks is [255.0], expected a table of numbers"),
        ("marks", {"test": True}, "mark 'test' is at True, expected a frequency in Hz"),
        ("fuse", 5, "fuse is 5, expected a list of lists of component names"),
        ("fuse", ["ab"], "a group of fuse is 'ab', expected a list of component names"),
        ("fuse", [[5]], "a group of fuse is [5], expected a list of component names"),
        ("scale", 5, "scale is 5, expected a table of numbers"),
        ("scale", {"robot.z": True}, "the scale of robot.z is True, expected a positive number"),
    ],
)
def test_a_value_of_a_wrong_type_in_a_scene(key, value, words):
    with pytest.raises(StructureError) as refusal:
        scene(**{key: value})
    assert str(refusal.value).startswith(words)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"name": 5}, "component name 5 is not an identifier"),
        ({"part": None}, "component m: part is None, expected the name or path of a part"),
        ({"level": 5}, "component m: level is 5, expected the name of a level"),
        ({"arguments": 5}, "component m: arguments is 5, expected a table of arguments"),
        ({"arguments": {5: 1}}, "component m: arguments is {5: 1}, expected a table of arguments"),
        ({"start": 5}, "component m: start is 5, expected a table of start values"),
        ({"start": {"damping": True}}, "m.damping is True, expected a number"),
        ({"start": {"damping": "much"}}, "m.damping is 'much', expected a number"),
        ({"start": {"damping": [[1]]}}, "m.damping is [[1]], expected a number"),
        ({"start": {"damping": {"a": 1}}}, "m.damping is {'a': 1}, expected a number, or an analysis with the keys"),
        ({"start": {"damping": {"part": 5, "key": "k"}}}, "m.damping: the part of an analysis is 5, expected"),
        ({"members": 5}, "component m: members is 5, expected a list of Components"),
        ({"connections": ["ab"]}, "component m: connections[1] is 'ab', expected a Connection"),
        ({"computed": 5}, "component m: computed is 5, expected a table of analyses"),
    ],
)
def test_a_value_of_a_wrong_type_in_a_component(changes, words):
    with pytest.raises(StructureError) as refusal:
        Component(**{"name": "m", "part": "x", **changes})
    assert str(refusal.value).startswith(words)


@pytest.mark.parametrize(
    ("kind", "values", "words"),
    [
        (Connection, (5, "b.u"), "start of a connection is 5, expected the full name of an output"),
        (Connection, ("a.y", None), "end of the connection from a.y is None, expected the full name of an input"),
        (System, (5,), "components is 5, expected a list of Components"),
        (System, ([5],), "components[1] is 5, expected a Component"),
        (System, ([], [("a.y", "b.u")]), "connections[1] is ('a.y', 'b.u'), expected a Connection"),
        (Analysis, ("x", "angles[a..b]"), "the key of an analysis is 'angles[a..b]', expected the name of a result"),
        (Analysis, ("x", "angles", 5), "the arguments of an analysis is 5, expected a table of arguments"),
        (expand, (5,), "a name is 5, expected a text"),
    ],
)
def test_a_value_of_a_wrong_type_in_a_system(kind: Any, values, words):
    with pytest.raises(StructureError) as refusal:
        kind(*values)
    assert str(refusal.value).startswith(words)


def test_numbers_of_numpy_are_numbers():
    given = scene(step_size=np.float64(5e-5), band=np.array([1, 50]), stop_time=np.int64(2), tolerance=np.float32(0.5))
    assert given == scene(tolerance=0.5)
    assert read_scene_text(scene_text(given)) == given


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"\xff\xfe", "own.toml: not a TOML document: byte 0 is 0xff, expected text in UTF-8"),
        (b"step_size = " + b"9" * 5000, "own.toml: not a TOML document: "),
        (b"step_size = " + b"[" * 5000, "own.toml: not a TOML document: "),
    ],
    ids=["bytes", "digits", "brackets"],
)
def test_a_file_that_is_no_toml(tmp_path, text, words):
    (tmp_path / "own.toml").write_bytes(text)
    with pytest.raises(StructureError) as refusal:
        read_scene(tmp_path / "own.toml")
    assert words in str(refusal.value)
