"""Pruning of a system: what is left out, what stays, and the same numbers with less."""

import textwrap
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from hfsa.cosim import load_scene, run, stability, sweep
from hfsa.cosim.assembly.assemble import Variants, assemble
from hfsa.cosim.assembly.build import with_ports
from hfsa.cosim.assembly.fuse import with_fusion
from hfsa.cosim.linear.linearize import linear_response
from hfsa.cosim.masters.algorithms import open_master
from hfsa.cosim.results.files import Bode
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System

HEIGHT, COMMAND = "robot.platform.position[3]", "reference.command.position[3]"
VERTICAL = {"inputs": [COMMAND], "outputs": [HEIGHT]}
SAME = 1e-12

BODY = """
    from hfsa.components import Model

    def body(*, rate: float = -1.0) -> Model:
        \"\"\"A mass on a spring, a state of its own that nothing else moves, and a flag of it.\"\"\"
        m = Model("Body", "Mass on a spring")
        k = m.parameter("stiffness", 100.0, "N/m", "Stiffness")
        u = m.input("force", "N", "Force")
        other = m.input("load", "N", "Force that moves the rest alone")
        x, v = m.state("x", "m", "Position"), m.state("v", "m/s", "Velocity")
        rest = m.state("rest", "N", "Beside it", start=0.0)
        m.der[x], m.der[v], m.der[rest] = v, u - k * x - 0.4 * v, rate * rest + other
        m.output("position", x, "m", "Position")
        m.output("beside", rest, "N", "Beside it")
        m.output("spring", k * x, "N", "Force of the spring")
        return m
"""


@pytest.fixture
def chain(tmp_path, monkeypatch):
    """Three bodies in a row, each pushed by the spring of the one before; the second has a state of a given rate."""
    monkeypatch.chdir(tmp_path)
    Path("body.py").write_text(textwrap.dedent(BODY))

    def scene(rate: float = -1.0, **more) -> Scene:
        components = [
            Component("first", "./body.py"),
            Component("second", "./body.py", None, {"rate": rate}, {"rest": 1e-3}),
            Component("third", "./body.py"),
        ]
        connections = [Connection(f"{a}.spring", f"{b}.force") for a, b in (("first", "second"), ("second", "third"))]
        given = {"inputs": ["first.force"], "outputs": ["second.position"], "amplitude": {"N": 1.0}}
        settings = {"step_size": 1e-3, "stop_time": 0.2, "band": (0.1, 10.0)}
        return Scene(System(components, connections), **{**given, **settings, **more})

    return scene


def parts(variants: Variants) -> dict[str, tuple[str, ...] | None]:
    """What each component keeps; `None` of a whole one."""
    return {component.name: component.kept for component in variants.parts.system.components}


# What is left out -----------------------------------------------------------------------------------------------------


def test_vertical_motion_of_the_robot_takes_two_of_twelve_states():
    variants = Variants(load_scene("sdelta_shaker"), keep="needed", observed=[HEIGHT], excited=[COMMAND])
    assert variants.left_out.sentence == (
        "reference: 36 outputs; robot: 10 of 12 states and 41 outputs reach nothing observed and are left out; "
        "--keep all keeps them"
    )
    states = [state for state, _ in variants.parts.descriptions["robot"].states]
    assert states == ["center.position[3]", "center.velocity[3]"]
    assert "damping_ratio" in variants.parts.descriptions["robot"].variables
    pushed = [c for c in variants.parts.system.connections if c.end.startswith("robot.")]
    assert len(pushed) == 6


def test_what_nothing_observed_follows_is_left_out_through_the_system(chain):
    """The third body altogether, with it the connection to it; of the second its state aside and its force."""
    variants = Variants(chain(), keep="needed")
    assert parts(variants) == {
        "first": ("force", "x", "v", "spring"),
        "second": ("force", "x", "v", "position"),
    }
    assert [str(c) for c in variants.parts.system.connections] == ["first.spring -> second.force"]
    assert "third: all states and outputs" in variants.left_out.sentence
    assert Variants(chain(), keep="needed", observed=["first.position"]).parts.system.connections == ()


@pytest.mark.parametrize(
    ("observed", "kept"),
    [
        pytest.param("second.der(rest)", {"load", "rest"}, id="derivative"),
        pytest.param("second.rest", {"load", "rest"}, id="state"),
        pytest.param("second.load", {"load"}, id="input"),
        pytest.param("second.stiffness", set(), id="parameter"),
        pytest.param("third.beside", {"rest"}, id="other-part"),
    ],
)
def test_any_recorded_variable_is_kept_with_what_moves_it(chain, observed, kept):
    variants = Variants(chain(), keep="needed", observed=[observed], excited=[])
    name = observed.partition(".")[0]
    assert kept <= set(parts(variants)[name] or ())
    with closing(open_master(variants.plain, "jacobi", 1e-3, None)) as master:
        recording = master.record([observed], rows=3)
        master.initialize()
        master.advance(2)
        assert np.isfinite(recording.values).all()


def test_an_excited_input_stays_where_it_reaches_nothing(chain):
    """The response is zero, as it is, not an error."""
    scene = chain(inputs=["first.load"])
    variants = Variants(scene, keep="needed")
    assert "load" in (parts(variants)["first"] or ())
    bode = sweep(scene, method="linear", points=3, path="none.h5", warn=lambda _: None)
    assert np.all(bode.response == 0)


def test_start_values_of_what_is_left_out_are_dropped_and_wrong_ones_are_not(chain):
    scene = chain()
    assert assemble(scene).system["second"].start == {"rest": 1e-3}
    assert Variants(scene, keep="needed").parts.system["second"].start == {}
    parts = [Component("it", "mass_on_spring", start={"masss": 1.0})]
    wrong = Scene(System(parts), [], ["it.position"], step_size=1e-3, stop_time=1.0)
    with pytest.raises(StructureError, match="did you mean mass"):
        Variants(wrong, keep="needed")


def test_flags_of_limits_stay_with_what_leads_to_them():
    """A saturation in a part that the output does not follow would otherwise go unseen."""
    scene = load_scene("sdelta_hfsa", {"law": "pd"})
    variants = Variants(scene, keep="needed", observed=[HEIGHT], excited=[COMMAND])
    flags = [name for name in variants.plain.descriptions["controller"].variables if name.endswith(".saturation")]
    assert len(flags) == 6
    assert len(variants.plain.descriptions["drive[2]"].states) == 4


def test_a_foreign_fmu_stays_whole_with_what_feeds_it(chain, foreign):
    scene = chain()
    components = [*scene.system.components, Component("box", str(foreign[2]))]
    connections = [*scene.system.connections, Connection("third.spring", "box.u")]
    object.__setattr__(scene, "system", System(components, connections))
    kept = parts(Variants(scene, keep="needed"))
    assert kept["box"] is None
    assert "spring" in (kept["third"] or ())


def test_one_set_of_fmus_serves_all_inputs_of_a_sweep():
    scene = load_scene("sdelta_shaker")
    variants = Variants(scene, keep="needed")
    files = [variants.instrumented(name).files["robot"] for name in scene.inputs]
    assert len(set(files)) == 1


def test_a_source_alone_takes_what_is_observed():
    """Neither the source's amplifier nor its default outputs bring back what is left out."""
    scene = load_scene("sdelta_shaker")
    variants = Variants(scene, keep="needed", observed=[HEIGHT], excited=[COMMAND])
    driven, measured = variants.driven(COMMAND, 20.0), variants.instrumented(COMMAND)
    assert "lock_in" not in driven.files
    assert driven.files["robot"] == measured.files["robot"] == variants.parts.files["robot"]
    assert measured.system["lock_in"].arguments == {"units": ("m",)}


# The same numbers -----------------------------------------------------------------------------------------------------

LINEAR = [
    ("mass_on_spring", {}),
    ("sdelta_shaker", {}),
    ("sdelta_shaker", {"posture.rotation": "10,5,8", "posture.position": "0.005,0.003,0.155"}),
    ("sdelta_hfsa", {"law": "pd"}),
    ("sdelta_hfsa", {"law": "ctc"}),
    ("sdelta_hfsa", {"law": "ctc_cartesian", "feed_forward": "elastic", "gravity": "9.81"}),
    ("sdelta_accelerometer", {}),
    ("accelerometer_shaker", {}),
    ("stage_bode", {}),
    ("stage_accelerometer", {}),
    ("beam_bode", {}),
    ("beam_payload", {"suspension": "massless"}),
]
# of these sampled loops no state is left out, only outputs: what differs is rounding, in which a compiler orders sums
# otherwise; with ctc_cartesian another order of the components changes responses as much
ROUNDING = {"sdelta_hfsa": 1e-11}
IDS = [f"{name}-{'-'.join(arguments.values())}".rstrip("-") for name, arguments in LINEAR]


QUICK = ("mass_on_spring", "beam_bode")
"""Scenes that are compared in every run of the tests."""


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        pytest.param(*case, id=label, marks=() if case[0] in QUICK else pytest.mark.slow)
        for label, case in zip(IDS, LINEAR, strict=True)
    ],
)
def test_each_response_of_a_scene_is_that_of_the_whole_one(opened, name, arguments):
    """All outputs for all inputs, and one for one, against the largest in its unit at the scene's amplitudes."""
    scene = load_scene(name, arguments)
    frequency = np.geomspace(*scene.band, 30)
    whole = assemble(scene)
    expected = linear_response(whole.system, opened(whole.files), scene.inputs, scene.outputs, frequency)
    units = [whole.connector(output).unit for output in scene.outputs]
    amplitude = np.array([scene.amplitude[whole.connector(name).unit or "1"] for name in scene.inputs])
    size = (np.abs(expected) * amplitude).max(axis=(0, 2))
    largest = np.array([max(s for s, other in zip(size, units, strict=True) if other == unit) for unit in units])
    scale = largest[:, None] / amplitude
    for i, k in ((slice(None), slice(None)), (slice(0, 1), slice(0, 1)), (slice(-1, None), slice(-1, None))):
        inputs, outputs = scene.inputs[k], scene.outputs[i]
        found = Variants(scene, keep="needed", observed=outputs, excited=inputs).plain
        response = linear_response(found.system, opened(found.files), inputs, outputs, frequency)
        assert np.all(np.abs(response - expected[:, i, k]) <= ROUNDING.get(name, SAME) * scale[i, k])


MOTIONS = [
    ("stage_tracking", {"law": "ctc"}),
    ("stage_tracking", {"law": "pd_ff", "motion": "step", "stack": "hysteretic"}),
    ("stage_tracking", {"law": "integral_ff", "actuator": "pzt"}),
    ("stage_extremes", {}),
]


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        pytest.param(*case, id=label, marks=() if label == "ctc" else pytest.mark.slow)
        for label, case in zip(("ctc", "hysteretic", "integral", "extremes"), MOTIONS, strict=True)
    ],
)
def test_a_motion_is_that_of_the_whole_scene(library, name, arguments):
    """All outputs of a scene without inputs, and one alone, over 200 steps."""
    scene = load_scene(name, arguments)
    expected = stepped(assemble(scene), scene.outputs, scene, library)
    for outputs in (scene.outputs, scene.outputs[-1:]):
        found = stepped(Variants(scene, keep="needed", observed=outputs).plain, outputs, scene, library)
        reference = expected[:, [scene.outputs.index(output) for output in outputs]]
        assert np.all(np.abs(found - reference) <= SAME * np.abs(reference).max(axis=0))


def stepped(assembly, outputs, scene, library) -> np.ndarray:
    """Outputs at 200 steps, (201, outputs)."""
    with closing(open_master(with_ports(assembly, "gauss_seidel"), "gauss_seidel", scene.step_size, library)) as master:
        recording = master.record(outputs, rows=201)
        master.initialize()
        master.advance(200)
        return recording.values.copy()


def both(tmp_path, *arguments, **options) -> tuple[Bode, Bode]:
    """A sweep of the whole scene and of what it needs."""
    how = {"warn": lambda _: None, "jobs": 1, **options}
    return tuple(sweep(*arguments, keep=keep, path=tmp_path / f"{keep}.h5", **how) for keep in ("all", "needed"))


@pytest.mark.parametrize("algorithm", ["gauss_seidel", "gauss_seidel_linear", "jacobi"])
def test_a_stepped_sweep_measures_the_same(tmp_path, algorithm):
    whole, found = both(tmp_path, "sdelta_shaker", **VERTICAL, algorithm=algorithm, points=4, low=5.0)
    assert np.all(np.abs(found.response - whole.response) <= SAME * np.abs(whole.response))


@pytest.mark.parametrize("fuse", ["robot,reference", "second,third"], ids=["both", "one-left"])
def test_fused_parts_are_pruned_before(chain, opened, fuse):
    """Also where pruning leaves a single one of the group."""
    scene = load_scene("sdelta_shaker") if "robot" in fuse else chain()
    scene = with_fusion(scene, [fuse])
    inputs, outputs = ([COMMAND], [HEIGHT]) if "robot" in fuse else (scene.inputs, scene.outputs)
    frequency = np.array([1.0, 10.0])
    found = Variants(scene, keep="needed", observed=outputs, excited=inputs).plain
    whole = assemble(scene)
    one, other = (linear_response(a.system, opened(a.files), inputs, outputs, frequency) for a in (found, whole))
    assert np.all(np.abs(one - other) <= SAME * np.abs(other))
    assert sum(len(d.states) for d in found.descriptions.values()) < sum(
        len(d.states) for d in whole.descriptions.values()
    )


# What a user sees -----------------------------------------------------------------------------------------------------


def test_a_run_names_and_stores_what_it_leaves_out(chain):
    said: list[str] = []
    found = run(chain(), record=["first.beside"], path="a.h5", warn=said.append)
    assert np.isfinite(found["first.beside"]).all()
    sentence = "second: 1 of 3 states and 2 outputs"
    assert any(sentence in line for line in said)
    with found_file("a.h5") as file:
        assert sentence in file["system"].attrs["left_out"]
    said.clear()
    run(chain(), path="b.h5", keep="all", warn=said.append)
    assert not any("left out" in line for line in said)
    with found_file("b.h5") as file:
        assert "left_out" not in file["system"].attrs


def test_a_signal_that_is_not_needed_is_still_known(chain):
    with pytest.raises(StructureError, match=r"did you mean third\.beside"):
        run(chain(), record=["third.besid"], warn=lambda _: None, path="a.h5")
    found = run(chain(), record=["third.beside"], warn=lambda _: None, path="a.h5")
    assert np.isfinite(found["third.beside"]).all()


def test_stability_judges_the_whole_scene_unless_it_is_asked_for_less(chain):
    """A state that grows by 2 1/s and reaches no output: a run is free of it, and `stability` shows it."""
    scene = chain(rate=2.0)
    assert stability(scene, algorithm="jacobi").growth == pytest.approx(2.0, rel=1e-6)
    said: list[str] = []
    found = stability(scene, algorithm="jacobi", keep="needed", warn=said.append)
    assert found.growth == pytest.approx(-0.2, rel=1e-3)
    assert any("left out" in line for line in said)
    whole: list[str] = []
    sweep(scene, method="linear", points=2, path="a.h5", keep="all", outputs=["second.beside"], warn=whole.append)
    assert any("unstable" in line for line in whole)


def test_what_grows_and_is_observed_is_noticed(chain):
    said: list[str] = []
    sweep(chain(rate=2.0), method="linear", points=2, path="a.h5", outputs=["second.beside"], warn=said.append)
    assert any("unstable" in line for line in said)


def found_file(path: str):
    """An HDF5 file."""
    import h5py

    return h5py.File(path)
