"""The order of steps, chosen or computed: its effect on the error, predicted and measured."""

import json
import math
import re
from dataclasses import replace
from itertools import pairwise, permutations

import h5py
import numpy as np
import pytest

from hfsa.cosim.analysis.order import MOST, Before, ModeCriterion, OrderProblem, best_order, exchanged, order_of, search
from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.assembly import build
from hfsa.cosim.assembly.fuse import fused, with_fusion
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.experiments.orders import with_computed_order, with_order
from hfsa.cosim.linear.linearize import linear_response, linearize
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.measurement.rig import Rig, Settings, Task
from hfsa.cosim.measurement.sweep import Bench
from hfsa.cosim.results.files import read_order, read_run
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.scene_file import read_scene_text, scene_text
from hfsa.cosim.systems.system import Component, Connection, System, in_order

EXCITED, FREQUENCY = "first.base.position", 7.0

# What an order makes of an error -------------------------------------------------------------------------------------


def chain(*names: str) -> Scene:
    """Return two masses, each on a damped spring, the second one's base on the first one, in an order of components."""
    start = {"stiffness": 1e4, "damping": 40.0}
    components = [Component(name, "mass_on_spring", start=start) for name in names]
    return Scene(
        System(components, [Connection("first.position", "second.base.position")]),
        inputs=[EXCITED],
        outputs=["second.position"],
        band=(1.0, 20.0),
        amplitude={"m": 1e-3},
        step_size=1e-3,
        stop_time=1.0,
    )


def bench_of(scene: Scene, step_size: float, library) -> Bench:
    system = build.instrument(replace(scene, step_size=step_size), scene.inputs[0])
    return Bench(build.build(system), tuple(scene.outputs), library=library)


def measured(bench: Bench, step_size: float, frequency: float) -> np.ndarray:
    """Return the response measured by a stepped sweep, (outputs,)."""
    settings = Settings(step_size=step_size, settling_tolerance=1e-4)
    rig = Rig(bench, settings)
    point = rig.measure(Task(0, 0, bench, settings, frequency, bench.assembly.system["source"].start["amplitude"]))
    rig.close()
    assert point.response is not None
    return point.response


@pytest.fixture
def exact(opened):
    """Return a scene's response to its first input at one frequency, (outputs,)."""

    def response(scene: Scene, frequency: float) -> np.ndarray:
        instances = opened(build.build(scene.system).files)
        inputs = scene.inputs[:1]
        return linear_response(scene.system, instances, inputs, scene.outputs, np.array([frequency]))[0, :, 0]

    return response


@pytest.mark.parametrize(("names", "order"), [(("first", "second"), 1), (("second", "first"), 2)])
def test_down_a_chain_the_error_is_of_first_order_and_by_turns_of_second(opened, library, exact, names, order):
    scene, steps = chain(*names), np.array([2e-3, 1e-3, 0.5e-3])
    true = exact(scene, FREQUENCY)[0]
    found = []
    for step_size in steps:
        bench = bench_of(scene, step_size, library)
        coupled = CoupledStep(bench.assembly.system, opened(bench.assembly.files), source="source", lock_in="lock_in")
        predicted = coupled.over(step_size).response([FREQUENCY])[0]
        found.append(measured(bench, step_size, FREQUENCY)[0])
        assert found[-1] == pytest.approx(predicted[0], rel=1e-4)
    errors = np.abs(np.array(found) / true - 1)
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx([order, order], abs=0.1)


def orders_that_differ(scene: Scene, names) -> dict[frozenset, tuple[str, ...]]:
    """Return one order for each different order of the connected pairs, by enumeration."""
    system = scene.system
    pairs = {frozenset(system.split(end)[0] for end in (c.start, c.end)) for c in system.connections}
    found = {}
    for order in permutations(names):
        key = frozenset(tuple(sorted(pair, key=order.index)) for pair in pairs)
        found.setdefault(key, order)
    return found


@pytest.mark.slow
def test_the_computed_order_of_the_stage_is_the_best_of_all_that_are_measured(library, exact):
    """At 2 kHz, where the error is largest, starting from the order down the chain."""
    scene, names = load_scene("stage_bode"), ("stack[1]", "stack[2]", "stack[3]", "stage")
    scene = replace(scene, step_size=10e-6)
    scene = replace(scene, inputs=scene.inputs[:1], outputs=scene.outputs[1:2], band=(1e3, 2e3))
    scene = replace(scene, system=in_order(scene.system, names))
    true, errors = exact(scene, 2e3), {}
    for order in orders_that_differ(scene, names).values():
        bench = bench_of(replace(scene, system=in_order(scene.system, order)), scene.step_size, library)
        errors[order] = np.abs(measured(bench, scene.step_size, 2e3) / true - 1).max()
    computed, choice = with_computed_order(scene, "computed")
    assert choice is not None
    assert tuple(component.name for component in computed.system.components) == choice.order
    assert (choice.own, choice.compared, choice.is_complete) == (names, 8, True)
    assert errors[choice.order] == pytest.approx(min(errors.values()), rel=1e-3)
    assert choice.error == pytest.approx(errors[choice.order], rel=0.01)
    assert choice.own_error == pytest.approx(errors[names], rel=0.01) == pytest.approx(0.123, rel=0.01)


def decay(positions: np.ndarray, step_size: float) -> complex:
    """Return the complex rate [1/s] of a free oscillation, from a recurrence over three values."""
    before = np.stack([positions[1:-1], positions[:-2]], axis=1)
    slope, offset = np.linalg.lstsq(before, positions[2:], rcond=None)[0]
    multiplier = np.roots([1.0, -slope, -offset])[0]
    return complex(np.log(multiplier) / step_size)


def test_the_computed_order_of_a_ring_keeps_its_modes_best(files, mass_on_spring_files, opened):
    """A mass under a controller that measures it through another: six orders in two classes of equal modes."""
    of = {"plant": files["Plant", 2], "sensor": mass_on_spring_files[2], "control": files["Pd", 2]}
    lag = {"stiffness": 1e4, "damping": 100.0}
    connections = [
        Connection("plant.position", "sensor.base.position"),
        Connection("sensor.position", "control.position"),
        Connection("control.force", "plant.force"),
    ]
    components = [Component(name, str(file), start=lag if name == "sensor" else {}) for name, file in of.items()]
    system, instances, step_size = System(components, connections), opened(of), 2e-3
    pole = max(linearize(system, instances, [], ["plant.position"]).poles, key=lambda pole: (pole.real, pole.imag))
    errors, choices = {}, {}
    for order in permutations(of):
        ordered = in_order(system, order)
        master = make_master(instances, ordered, step_size=step_size)
        recording = master.record(["plant.position"], rows=1001)
        master.initialize(starts={"plant.x": 1.0})
        master.advance(1000)
        found = decay(recording.values[300:, 0], step_size)
        errors[order] = abs(complex(found.real, abs(found.imag)) - pole) / abs(pole)
        case = OrderProblem(ordered, instances, "gauss_seidel", step_size, ["plant.position"])
        choices[order] = best_order(case, ModeCriterion(case, ["plant.position"], 1.0))
    for order, choice in choices.items():
        assert choice.own_error == pytest.approx(errors[order], rel=1e-4)
        assert errors[choice.order] == pytest.approx(min(errors.values()), rel=1e-4)
        assert choice.order == order or errors[order] > 1.01 * min(errors.values())


def test_a_scene_that_nothing_excites_is_ordered_by_its_modes():
    scene = with_fusion(load_scene("sdelta_hfsa", {"execution": "continuous"}), ["robot,drives"])
    _, choice = with_computed_order(scene, "computed", inputs=())
    assert choice is not None
    assert (choice.about, choice.own, choice.compared) == ("modes", ("reference", "controller", "fused"), 4)
    assert 0 < choice.error <= choice.own_error < 0.1


def test_what_ticks_among_others_goes_first_in_any_order():
    """The controller, fused with its plant, uses the reference's output from before both step."""
    scene = with_fusion(load_scene("sdelta_hfsa"), ["robot,drives,controller"])
    same, choice = with_computed_order(scene, "computed", inputs=scene.inputs[2:3])
    assert choice is not None
    assert same == scene
    assert (choice.order, choice.compared) == (("fused", "reference"), 1)


def test_a_stable_order_goes_before_one_that_errs_less():
    merits = {"here": (0.5, math.inf), "slower": (0.1, math.inf), "stable": (0.0, 10.0), "alike": (0.0, 9.99)}
    names = {frozenset([(name, name)]): name for name in merits}
    first, *others = names
    found = search(first, lambda at: iter(others if at == first else ()), lambda at: merits[names[at]])
    assert (names[found.best], found.is_complete) == ("stable", True)


def test_where_nothing_is_joined_no_order_makes_a_difference():
    scene = load_scene("mass_on_spring")
    same, choice = with_computed_order(scene, "computed")
    assert choice is not None
    assert same == scene
    assert choice.sentence.endswith(", the scene's order; all orders are equivalent")


# Orders that differ --------------------------------------------------------------------------------------------------


def joined_as(order, pairs) -> Before:
    return frozenset(tuple(sorted(pair, key=order.index)) for pair in pairs)


@pytest.mark.parametrize(
    ("pairs", "count"),
    [
        (["ab", "bc", "cd"], 8),  # a chain
        (["ab", "bc", "ca"], 6),  # a ring of three, and one by itself
        (["ab", "bc", "cd", "da", "ac"], 18),
        ([], 1),
    ],
)
def test_exchanges_reach_every_order_that_differs_and_no_other(pairs, count):
    """Against all permutations: each set of pairs is reproduced by its order, the original one by itself."""
    names = "abcd"
    every = {joined_as(order, pairs) for order in permutations(names)}
    merits = search(joined_as(names, pairs), lambda before: exchanged(before, ()), lambda _: (0.0, 0.0)).merits
    assert set(merits) == every
    assert len(every) == count
    assert all(joined_as(order_of(names, before), pairs) == before for before in every)
    assert order_of(names, joined_as(names, pairs)) == tuple(names)


def test_what_is_fixed_keeps_its_place_beside_what_it_is_joined_to():
    pairs = ["ab", "bc"]
    found = search(joined_as("abc", pairs), lambda before: exchanged(before, "a"), lambda _: (0.0, 0.0))
    assert set(found.merits) == {joined_as(order, pairs) for order in ("abc", "acb")}


def test_of_many_orders_the_best_is_looked_for_by_exchanges():
    """A chain of 14: of 8192 orders the one with the odd places first."""
    names = [f"n[{i}]" for i in range(14)]
    pairs = list(pairwise(names))
    own = joined_as(names, pairs)

    def error(before: Before) -> tuple[float, float]:
        """Number of pairs that do not alternate."""
        return 0.0, 1.0 + sum((pair in before) == bool(i % 2) for i, pair in enumerate(pairs))

    found = search(own, lambda before: exchanged(before, ()), error)
    assert error(found.best) == (0.0, 1.0)
    assert not found.is_complete
    assert MOST / 2 < len(found.merits) < 1000


# As a user types it --------------------------------------------------------------------------------------------------


def order_in(scene: Scene) -> list[str]:
    return [component.name for component in scene.system.components]


RECORDED = ("rotation_error", "position_error")
"""Components of `sdelta_hfsa` that feed no other."""


def test_named_components_take_the_places_that_they_have():
    scene = load_scene("sdelta_hfsa")
    assert order_in(scene) == ["reference", "controller", "drive[1]", "drive[2]", "drive[3]", "robot", *RECORDED]
    ordered = with_order(scene, "robot,drives")
    assert order_in(ordered) == ["reference", "controller", "robot", "drive[1]", "drive[2]", "drive[3]", *RECORDED]
    assert ordered.system.connections == scene.system.connections
    assert order_in(with_order(scene, "drive[3], reference")) == [
        "drive[3]", "controller", "drive[1]", "drive[2]", "reference", "robot", *RECORDED
    ]  # fmt: skip


def test_the_order_is_that_of_what_is_left_after_fusing():
    scene = load_scene("stage_accelerometer")
    fusing = with_fusion(scene, ["stage,stacks"])
    assert order_in(fusing) == ["sensor", "ideal", "stage", "stack[1]", "stack[2]", "stack[3]"]
    ordered = with_order(fusing, "fused,ideal")
    assert [c.name for c in fused(ordered.system, ordered.fuse).components] == ["sensor", "fused", "ideal"]
    with pytest.raises(StructureError, match="stage is part of fused, which steps as one"):
        with_order(fusing, "stage,ideal")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--order", "stak[1],stage"], r"no component is called 'stak\[1\]'; did you mean stack\[1\]"),
        (["--order", "stage,stacks,stage"], "stage is named twice in an order"),
        (["--order", "stage,stacks", "--algorithm", "jacobi"], "with jacobi the order of steps makes no difference; "),
        (["--order", "computed", "--algorithm", "monolithic"], "it does with gauss_seidel, gauss_seidel_linear, "),
    ],
)
def test_an_order_that_is_none_is_refused(hfsa, words, message):
    code, out, err = hfsa("run", "stage_bode", *words)
    assert (code, out) == (2, "")
    assert re.search(message, err)


def test_what_ticks_is_not_put_into_another_place(hfsa):
    code, _, err = hfsa("run", "sdelta_hfsa", "--order", "robot,controller")
    assert code == 2
    assert "controller is sampled, and the order of its ticks is part of the system; there are reference" in err


def test_the_linear_method_takes_no_order(hfsa):
    for more, message in (
        ([], "the linear method takes no steps and has no order"),
        (
            ["--open-loop", "controller.axis[1].command"],
            "--order would have no effect: --open-loop uses the linearised",
        ),
    ):
        code, _, err = hfsa("sweep", "sdelta_hfsa", "--method", "linear", "--order", "computed", *more)
        assert code == 2
        assert message in err


def test_a_computed_order_is_reported_stored_and_run(hfsa, tmp_path):
    """For a user's scene, whose components are stored in the order of their steps."""
    path, text = tmp_path / "chain.toml", scene_text(chain("first", "second"))
    path.write_text(text)
    code, out, err = hfsa("run", path, "--order", "computed", "--stop", "0.01", "--json", "-o", "run.h5")
    assert code == 0
    assert "hfsa: order second, first: response within 0." in err
    assert "the scene's order within " in err
    assert "; 2 orders compared, all different ones" in err
    stored = read_order("run.h5")
    assert stored is not None
    assert json.loads(out)["order"]["order"] == list(stored.order) == ["second", "first"]
    assert stored.own_error > 50 * stored.error
    with h5py.File("run.h5") as file:
        again = read_scene_text(file["system"].attrs["scene"])
    assert again == replace(chain("second", "first"), stop_time=0.01, algorithm=again.algorithm)
    path.write_text(scene_text(again))
    assert hfsa("run", path, "--stop", "0.01", "-o", "again.h5")[0] == 0
    assert read_order("again.h5") is None
    first, second = (read_run(name)[0]["second.position"] for name in ("run.h5", "again.h5"))
    np.testing.assert_array_equal(first, second)


def test_a_sweep_and_a_comparison_take_an_order_too(hfsa, tmp_path):
    path = tmp_path / "chain.toml"
    path.write_text(scene_text(chain("first", "second")))
    code, out, err = hfsa(
        "sweep", path, "--order", "computed", "--points", "2", "--from", "5", "--to", "8", "--json", "-j", "1"
    )
    assert code == 0
    assert json.loads(out)["order"]["order"] == ["second", "first"]
    assert "hfsa: order second, first" in err
    words = ["--over", "first.damping=40,50", "--order", "computed", "--stop", "0.01", "--json", "-j", "1"]
    code, out, err = hfsa("compare", path, *words)
    assert code == 0
    assert [run["order"]["order"] for run in json.loads(out)["runs"]] == [["second", "first"]] * 2
    assert "hfsa: first.damping=40: order second, first" in err


def test_a_comparison_fuses(hfsa, tmp_path):
    path = tmp_path / "chain.toml"
    path.write_text(scene_text(chain("first", "second")))
    code, out, _ = hfsa(
        "compare",
        path,
        "--over",
        "first.damping=40,50",
        "--fuse",
        "first,second",
        "--stop",
        "0.01",
        "-j",
        "1",
        "--json",
    )
    assert code == 0
    for run in json.loads(out)["runs"]:
        with h5py.File(run["file"]) as file:
            assert "fused" in file["system"]


@pytest.mark.slow
def test_stability_is_looked_at_in_an_order(hfsa):
    """The stage's loop over the stacks' charge has the same reported step limit in both orders."""
    words = ["stability", "stage_bode", "--algorithm", "gauss_seidel", "--json"]
    code, out, _ = hfsa(*words, "--order", "stacks,stage")
    assert code == 0
    found = json.loads(out)
    assert found["order"] is None
    code, out, _ = hfsa(*words, "--order", "computed")
    assert code == 0
    assert json.loads(out)["order"]["order"] == ["stage", "stack[1]", "stack[2]", "stack[3]"]
