"""Numbers of every type, elements of arrays and texts: set at the start, connected, recorded, bit for bit."""

import ctypes
from pathlib import Path

import numpy as np
import pytest
from foreign_fmu import foreign_fmu

from hfsa.cosim.fmi.co_simulation import Fmu, Instance
from hfsa.cosim.fmi.step_error import StepError
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.results.files import read_run
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, Connection, System

SOURCE = Path(__file__).with_name("echo.c")
TYPES = {
    2: ("Real", "Integer", "Boolean"),
    3: (
        *("Float64", "Float32", "Int8", "UInt8", "Int16", "UInt16"),
        *("Int32", "UInt32", "Int64", "UInt64", "Boolean"),
    ),
}
LARGEST = {
    "Real": 1.5,
    "Float64": -2.5,
    "Float32": 0.5,
    "Integer": 2**31 - 1,
    "Boolean": 1,
    "Enumeration": 2,
    **{f"Int{n}": 2 ** (n - 1) - 1 for n in (8, 16, 32)},
    **{f"UInt{n}": 2**n - 1 for n in (8, 16, 32)},
    "Int64": -(2**53),
    "UInt64": 2**53,
}
EVERY = [pytest.param(version, kind, id=f"fmi{version}-{kind}") for version in (2, 3) for kind in TYPES[version]]
VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])


@pytest.fixture(scope="module")
def echo(tmp_path_factory) -> dict[int, Path]:
    """The FMU by version."""
    return {
        version: foreign_fmu(
            tmp_path_factory.mktemp(f"echo{version}"),
            version,
            "Echo",
            SOURCE,
            SOURCE.with_name(f"echo.fmi{version}.xml").read_text(),
        )
        for version in (2, 3)
    }


def chain(*joined: tuple[str, str], first: dict | None = None) -> System:
    """Return two such FMUs, with connections from the first to the second, and start values of the first."""
    parts = Component("a", "echo.fmu", start=first or {}), Component("b", "echo.fmu")
    return System(parts, [Connection(f"a.{start}", f"b.{end}") for start, end in joined])


def run(both, echo, version: int, system: System, names: list[str], steps: int = 3) -> np.ndarray:
    """Return recorded values (steps + 1, n), after a check that both loops agree on them."""
    rows = []

    def go(master):
        recording = master.record(names, rows=steps + 1)
        master.initialize()
        master.advance(steps)
        rows.append(recording.values.copy())
        return recording

    python, compiled = both(system, dict.fromkeys("ab", echo[version]), go)
    assert python == compiled
    return rows[0]


@pytest.mark.parametrize(("version", "kind"), EVERY)
def test_a_value_of_a_type_reaches_its_like(both, echo, version, kind):
    """A step of each FMU away, in Gauss-Seidel order: the first echoes its start, the second what it got."""
    system = chain((f"out_{kind}", f"in_{kind}"), first={f"in_{kind}": LARGEST[kind]})
    found = run(both, echo, version, system, [f"a.out_{kind}", f"b.in_{kind}", f"b.out_{kind}"])
    assert found.tolist() == [[0, 0, 0], *[[LARGEST[kind]] * 3] * 3]


@pytest.mark.parametrize(("version", "kind"), EVERY)
def test_a_value_of_a_type_reaches_a_real_and_back(both, echo, version, kind):
    real = "Real" if version == 2 else "Float64"
    back = [] if kind == real else [Connection(f"b.out_{real}", f"b.in_{kind}")]
    parts = chain(first={f"in_{kind}": LARGEST[kind]}).components
    system = System(parts, [Connection(f"a.out_{kind}", f"b.in_{real}"), *back])
    found = run(both, echo, version, system, [f"a.out_{kind}", f"b.out_{real}", f"b.in_{real if back == [] else kind}"])
    assert found[-1].tolist() == [LARGEST[kind]] * 3


@VERSIONS
def test_an_enumeration_and_the_length_of_a_text(both, echo, version):
    system = chain(("out_Enumeration", "in_Enumeration"), first={"in_Enumeration": 2, "in_String": "Größe"})
    found = run(both, echo, version, system, ["b.out_Enumeration", "a.length", "b.length"])
    assert found[-1].tolist() == [2, len("Größe".encode()), 0]


def test_elements_of_an_array_are_set_one_by_one(both, echo):
    """The others stay at their start values; a row of the first feeds a column of the second."""
    system = chain(
        ("out_array[2,1]", "in_array[1,2]"), ("out_array[2,3]", "in_array[2,2]"), first={"in_array[2,3]": 7.0}
    )
    names = [f"b.in_array[{i},{j}]" for i in (1, 2) for j in (1, 2, 3)]
    found = run(both, echo, 3, system, ["a.out_array[1,3]", "a.out_array[2,3]", *names])
    assert found[-1].tolist() == [6.0, 14.0, 1, 8, 3, 4, 14, 6]


def test_elements_are_back_at_their_starts_in_the_next_run(echo):
    with Instance(Fmu.load(echo[3]), "it") as it:
        for start, expected in (({"in_array[1,1]": 9.0}, 9.0), ({"in_array[2,2]": 8.0}, 1.0)):
            it.start(values=start)
            assert it.get(it.handle(["in_array[1,1]"]))[0] == expected


@pytest.mark.parametrize(
    ("kind", "value", "words"),
    [
        pytest.param("Int8", 128.0, "a whole number of type Int8", id="too-large"),
        pytest.param("UInt16", -1.0, "a whole number of type UInt16", id="negative"),
        pytest.param("Int32", 0.5, "a whole number of type Int32", id="half"),
        pytest.param("Int64", 2.0**60, "a whole number of type Int64", id="beyond-a-double"),
        pytest.param("Boolean", 2.0, "0 or 1", id="neither"),
        pytest.param("Int32", float("nan"), "a whole number", id="nan"),
    ],
)
def test_a_number_that_a_variable_does_not_take_is_an_error(echo, kind, value, words):
    with Instance(Fmu.load(echo[3]), "it") as it:
        it.start()
        with pytest.raises(StepError, match=rf"it: fmi3Set{kind}: error.*in_{kind} is set to .*, expected {words}"):
            it.set(it.handle([f"in_{kind}"]), [value])


@pytest.mark.parametrize("way", [None, "c"], ids=["python", "c"])
def test_a_half_that_meets_a_whole_number_ends_a_run(opened, echo, library, way):
    system = chain(("out_Float64", "in_Int16"), first={"in_Float64": 0.5})
    master = make_master(opened(dict.fromkeys("ab", echo[3])), system, "jacobi", 0.1, library if way else None)
    master.initialize()
    with pytest.raises(StepError, match=r"b: fmi3SetInt16: error at .*in_Int16 is set to 0\.5, expected a whole"):
        master.advance(3)


@pytest.mark.parametrize(
    ("start", "words"),
    [
        pytest.param({"in_Int32": 0.5}, "a.in_Int32 is 0.5, expected a whole number", id="half"),
        pytest.param({"in_Boolean": 2}, "a.in_Boolean is 2, expected true or false", id="two"),
        pytest.param({"in_String": 5}, "a.in_String is 5, expected a text", id="number"),
        pytest.param({"in_Float64": "five"}, "a.in_Float64 starts at five", id="text"),
        pytest.param({"tick": 1}, "a.tick is of type Clock and takes no start value", id="clock"),
    ],
)
def test_start_values_have_the_type_of_their_variable(opened, echo, start, words):
    with pytest.raises(StructureError, match=words):
        make_master(opened(dict.fromkeys("ab", echo[3])), chain(first=start), "jacobi", 0.1)


def test_texts_and_clocks_are_not_connected(opened, echo):
    for start, end, kind in (("out_Int8", "in_String", "parameter"), ("tick", "in_Boolean", "of type Clock")):
        with pytest.raises(StructureError, match=kind):
            make_master(opened(dict.fromkeys("ab", echo[3])), chain((start, end)), "jacobi", 0.1)


def test_a_whole_number_beyond_a_double_is_not_rounded_in_silence(echo):
    """Between 2^53 and 2^54 every other whole number is lost."""
    with Instance(Fmu.load(echo[3]), "it") as it:
        it.start()
        set_ = it.function_named("fmi3SetInt64")
        value, reference = ctypes.c_int64(2**53 + 1), ctypes.c_uint(it.fmu.variables["in_Int64"].reference)
        n = ctypes.c_size_t(1)
        assert set_(it.component, ctypes.byref(reference), n, ctypes.byref(value), n) == 0
        it.step(0.0, 0.1)
        with pytest.raises(StepError, match=r"out_Int64 is 9007199254740993, beyond 2\^53"):
            it.get(it.handle(["out_Int64"]))


def test_a_scene_sets_texts_and_booleans_and_records_every_type(hfsa, echo, tmp_path):
    """From the scene's file and from the command line, into the results file."""
    Path("echo.toml").write_text(f"""
inputs = []
outputs = ["p.out_Int32"]
step_size = 0.1
stop_time = 0.5
quiet_inputs = true
[[components]]
name = "p"
part = "{echo[3]}"
start = {{ in_Boolean = true, in_String = "abc", "in_array[2,3]" = 4.5 }}
""")
    signals = [word for name in ("length", "out_Boolean", "out_array[2,3]") for word in ("--signal", f"p.{name}")]
    given = ["-p", "p.in_Int32=7", "-p", "p.in_String=hello"]
    code, _, err = hfsa("run", "echo.toml", *given, *signals, "-o", tmp_path / "echo.h5")
    assert code == 0
    assert err == f"hfsa: echo.toml names programs outside its folder, and runs them: p: {echo[3].resolve()}\n"
    values, _ = read_run(tmp_path / "echo.h5")
    last = {name.removeprefix("p."): column[-1] for name, column in values.items()}
    expected = {"out_Int32": 7, "length": 5, "out_Boolean": 1, "out_array[2,3]": 9.0}
    assert {name: last[name] for name in expected} == expected
