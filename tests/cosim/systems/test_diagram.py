"""Block diagrams: every connection is in one link, loops are those of the graph, many of one part are one block."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hfsa.cosim.assembly.load_scene import available_scenes, load_scene
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.cycles import on_cycles
from hfsa.cosim.systems.diagram import Facts, diagram
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System

METRE = (0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)


def scene_of(components, connections, **more) -> Scene:
    """Return a scene of components by name, and connections, whose output is that of the last component."""
    system = System([Component(name, "part") for name in components], connections)
    return Scene(system, (), [f"{components[-1]}.y"], step_size=1e-3, stop_time=1.0, **more)


@pytest.mark.parametrize("name", list(available_scenes()))
def test_every_connection_and_terminal_is_drawn_once(name):
    scene = load_scene(name)
    found = diagram(scene, name)
    pairs = [(f"{link.start}.{a}", f"{link.end}.{b}") for link in found.links for a, b in link.pairs]
    assert sorted(pairs) == sorted((c.start, c.end) for c in scene.system.connections)
    assert [block.name for block in found.blocks] == [component.name for component in scene.system.components]
    ends = {f"{one.block}.{name}" for one in found.terminals for name in one.names}
    assert ends == {*scene.inputs, *scene.outputs, *scene.recorded}


@given(st.integers(1, 7).flatmap(lambda n: st.tuples(st.just(n), st.sets(st.tuples(*[st.integers(0, n - 1)] * 2)))))
def test_nodes_on_common_cycles_reach_each_other(graph):
    """By the powers of the adjacency matrix."""
    n, edges = graph
    step = np.eye(n, dtype=int)
    for start, end in edges:
        step[start, end] = 1
    reach = np.linalg.matrix_power(step, n) > 0
    expected = {tuple(map(str, np.flatnonzero(reach[i] & reach[:, i]))) for i in range(n)}
    found = on_cycles(map(str, range(n)), [(str(start), str(end)) for start, end in edges])
    assert set(found) == expected
    assert [group[0] for group in found] == sorted(group[0] for group in found)


def test_only_links_around_the_sampled_part_are_on_its_loop():
    joined = [
        "command.y -> law.r",
        "law.y -> plant.u",
        "plant.y -> law.u",
        "plant.y -> sensor.u",
        "a.y -> b.u",
        "b.y -> a.u",
    ]
    scene = scene_of(
        ["command", "law", "plant", "a", "b", "sensor"], [Connection(*words.split(" -> ")) for words in joined]
    )
    found = diagram(scene, "Loop", {"law": Facts(sample_time=1e-3)})
    assert [block.name for block in found.blocks if block.is_sampled] == ["law"]
    assert "sampled every 1 ms" in found.blocks[1].words
    assert [(link.start, link.end) for link in found.links if link.is_sampled_loop] == [
        ("law", "plant"),
        ("plant", "law"),
    ]


def test_a_ring_of_feedthrough_is_a_loop_with_what_its_connections_do():
    """A factor and an offset close a ring without a state; the way out is not on it."""
    ring = [Connection("a.y", "b.u"), Connection("b.y", "a.u", 0.25, -2.0), Connection("b.y", "c.u")]
    scene = scene_of(["a", "b", "c"], ring)

    def variables(unit, base, depends):
        u = Connector("u", 0, "input", unit="m", base_unit=METRE)
        return {"u": u, "y": Connector("y", 1, "output", unit=unit, base_unit=base, dependencies=depends)}

    connectors = {
        "a": variables("mm", (*METRE[:-2], 1e-3, 0.0), ("u",)),
        "b": variables("m", METRE, ("u",)),
        "c": variables("m", METRE, ()),
    }
    links = {(link.start, link.end): link for link in diagram(scene, "Ring", {}, connectors).links}
    assert {ends: link.loop for ends, link in links.items()} == {("a", "b"): 1, ("b", "a"): 1, ("b", "c"): 0}
    assert links["a", "b"].words == ["y", "x 0.001 (mm to m)", "algebraic loop 1"]
    assert links["b", "a"].marks == ("x 0.25 - 2",)
    assert not links["b", "c"].marks


def test_many_masses_are_one_block_and_lose_no_signal():
    names = [f"mass[{i}]" for i in range(1, 61)]
    chain = [Connection(f"mass[{i}].x", f"mass[{i + 1}].u") for i in range(1, 60)]
    found = diagram(scene_of([*names, "end"], [*chain, Connection("mass[60].x", "end.u")]), "Chain")
    many, _ = found.blocks
    assert (many.name, many.words[0]) == ("mass[1..60]", "60 components")
    own, out = found.links
    assert own.words == ["mass[1..59].x"]
    assert own.pairs == tuple((connection.start, connection.end) for connection in chain)
    assert (out.start, out.end, out.words) == ("mass[1..60]", "end", ["mass[60].x"])
    fused = diagram(scene_of(names, chain, fuse=[names]), "Fused")
    assert len(fused.blocks) == 60


def test_what_cannot_be_printed_is_marked():
    system = System([Component("a", "my\nparts/a\u0000b.py", arguments={"unit": "x\u0007" + 40 * "y"})])
    found = diagram(Scene(system, (), ["a.y"], step_size=1e-3, stop_time=1.0), "Title\u0000")
    (block,) = found.blocks
    assert found.title == "Title?"
    assert block.words == ("a?b.py", f"unit = x?{7 * 'y'}...{16 * 'y'}")


def test_an_output_that_no_fmu_has_is_refused():
    with pytest.raises(StructureError, match=r"a \(part\) has no variable 'y'; did you mean yy"):
        diagram(scene_of(["a"], []), "Typo", {}, {"a": {"yy": Connector("yy", 0, "output")}})


def test_a_long_list_of_signals_is_counted():
    signals = [f"{letter}_signal" for letter in "abcdefg"]
    found = diagram(scene_of(["a", "b"], [Connection(f"a.{x}", f"b.{x}") for x in signals]), "Bundle")
    assert found.links[0].words == ["a_signal", "b_signal", "c_signal", "... 7 signals"]
    assert all(name in found.description for name in signals)
