"""A scene out and in again: the same system, the same settings, the same numbers; names that are legal everywhere."""

import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree
from ssp_by_hand import SSP

from hfsa.cosim import load_scene, run, sweep
from hfsa.cosim.assembly.packages import package_of
from hfsa.cosim.experiments.package import package
from hfsa.cosim.ssp.element_names import legal_names
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System

QUIET = {"warn": lambda _: None}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The package of a scene with an input, at another frequency and amplitude than the scene's."""
    file = tmp_path_factory.mktemp("made") / "mass.ssp"
    return package("mass_on_spring", {"damping": 5.0}, frequency=12.0, amplitude=2e-3, path=file, **QUIET)


def test_settings_come_back(made):
    scene, own = load_scene(made.file), load_scene("mass_on_spring", {"damping": 5.0})
    for field in ("inputs", "outputs", "band", "step_size", "stop_time", "tolerance", "algorithm", "scale", "recorded"):
        assert getattr(scene, field) == getattr(own, field)
    assert scene.amplitude == {"m": 2e-3}
    assert scene.source.start == {"frequency": 12.0}
    assert [component.name for component in scene.system.components] == ["mass"]
    assert package_of(made.file).remarks == ()


@pytest.mark.parametrize("algorithm", ["jacobi_plain", "gauss_seidel_linear", "monolithic"])
def test_a_run_of_the_package_is_that_of_the_scene(made, tmp_path, algorithm):
    options = {"algorithm": algorithm, "stop_time": 0.2, **QUIET}
    sine = {"frequency": 12.0, "amplitude": 2e-3}
    found = run(made.file, path=tmp_path / "package.h5", **options)
    own = run("mass_on_spring", {"damping": 5.0}, path=tmp_path / "scene.h5", **sine, **options)
    np.testing.assert_array_equal(found.time, own.time)
    scale = np.abs(own["mass.position"]).max()
    np.testing.assert_allclose(found["mass.position"], own["mass.position"], rtol=0, atol=1e-12 * scale)


@pytest.mark.slow
def test_a_sweep_of_the_package_is_that_of_the_scene(made, tmp_path):
    options = {"low": 5.0, "high": 40.0, "points": 3, "jobs": 1, **QUIET}
    found = sweep(made.file, path=tmp_path / "package.h5", **options)
    own = sweep("mass_on_spring", {"damping": 5.0}, amplitude=2e-3, path=tmp_path / "scene.h5", **options)
    names = "mass.position", "mass.base.position"
    np.testing.assert_allclose(found.entry(*names), own.entry(*names), rtol=1e-9)


def numbered() -> Scene:
    """Two masses with numbers, of which the second starts elsewhere, and a motion of their own."""
    return Scene(
        System(
            [
                Component(
                    "shaker", "sine_source", arguments={"unit": "m"}, start={"amplitude": 1e-3, "frequency": 4.0}
                ),
                Component("mass[2]", "mass_on_spring", start={"damping": 20.0}),
                Component("mass[1]", "mass_on_spring"),
            ],
            [
                Connection("shaker.value", "mass[1].base.position"),
                Connection("mass[1].position", "mass[2].base.position", factor=-2.0, offset=1e-3),
            ],
        ),
        inputs=(),
        outputs=["mass[1..2].position"],
        step_size=1e-3,
        stop_time=0.3,
        algorithm="jacobi_plain",
        scale={"mass[1..2].position": 1.0},
    )


def test_numbers_in_names_order_and_transformations(tmp_path):
    found = package(numbered(), path=tmp_path / "two.ssp", **QUIET)
    assert found.elements["mass[2]"] == "mass_2"
    with zipfile.ZipFile(found.file) as archive:
        root = etree.fromstring(archive.read("SystemStructure.ssd"))
    elements = [node.get("name") for node in root.iter(f"{{{SSP}Description}}Component")]
    assert elements == ["shaker", "mass_2", "mass_1", "transformation_1"]
    again = load_scene(found.file)
    assert [c.name for c in again.system.components] == ["shaker", "mass[2]", "mass[1]", "transformation[1]"]
    assert again.outputs == ("mass[1].position", "mass[2].position")
    runs = [
        run(scene, path=tmp_path / f"{i}.h5", algorithm="gauss_seidel", **QUIET)
        for i, scene in enumerate((numbered(), again))
    ]
    for name in again.outputs:
        np.testing.assert_array_equal(runs[0][name], runs[1][name])


def test_a_package_of_a_package(made, tmp_path):
    """FMUs of a package are foreign ones, with parameter sets alone; what comes out runs the same."""
    file = package(made.file, path=tmp_path / "again.ssp", **QUIET).file
    options = {"algorithm": "jacobi_plain", "stop_time": 0.05, **QUIET}
    one, two = (run(f, path=tmp_path / f"{f.stem}.h5", **options) for f in (made.file, file))
    np.testing.assert_array_equal(one["mass.position"], two["mass.position"])


def test_without_a_source(tmp_path):
    found = package("mass_on_spring", amplitude=0, path=tmp_path / "rest.ssp", **QUIET)
    assert list(found.elements) == ["mass"]
    assert load_scene(found.file).amplitude == load_scene("mass_on_spring").amplitude


@pytest.mark.slow
def test_groups_are_one_element(tmp_path):
    scene = numbered()
    system = System(
        scene.system.components, [scene.system.connections[0], Connection("mass[1].position", "mass[2].base.position")]
    )
    fused = Scene(system, (), ["mass[2].position"], step_size=1e-3, stop_time=0.1)
    found = package(fused, fuse=["mass[1],mass[2]"], path=tmp_path / "fused.ssp", **QUIET)
    assert set(found.elements) == {"shaker", "fused"}
    assert load_scene(found.file).outputs == ("fused.mass[2].position",)
    options = {"algorithm": "monolithic", **QUIET}
    one = run(fused, path=tmp_path / "one.h5", **options)["mass[2].position"]
    two = run(found.file, path=tmp_path / "two.h5", **options)["fused.mass[2].position"]
    np.testing.assert_allclose(one, two, rtol=0, atol=1e-9 * np.abs(one).max())


def test_the_same_scene_gives_the_same_bytes(made, tmp_path):
    again = package(
        "mass_on_spring", {"damping": 5.0}, frequency=12.0, amplitude=2e-3, path=tmp_path / "mass.ssp", **QUIET
    )
    assert again.file.read_bytes() == made.file.read_bytes()


@given(st.lists(st.text(min_size=1, max_size=8), unique=True, max_size=8))
def test_any_names_become_legal_and_stay_apart(names):
    found = legal_names(names)
    assert list(found) == names
    assert len(set(found.values())) == len(names)
    assert all(name.isascii() and name.isidentifier() for name in found.values())
    assert legal_names(found.values()) == {name: name for name in found.values()}


# The verb ----------------------------------------------------------------------------------------------------------


def test_the_verb(hfsa, tmp_path):
    code, out, err = hfsa("export", "mass_on_spring", "--ssp", "--frequency", "12", "-p", "damping=5")
    assert (code, out, err) == (0, "mass_on_spring.ssp\n", "")
    assert hfsa("run", "mass_on_spring.ssp", "--stop", "0.01")[0] == 0
    assert "mass.base.position" in hfsa("list", "./mass_on_spring.ssp")[1]
    assert hfsa("stability", "mass_on_spring.ssp")[0] == 0
    assert hfsa("sweep", "mass_on_spring.ssp", "--method", "linear")[0] == 0


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["mass_on_spring", "--step", "1e-3"], "--step would have no effect: an FMU has no step and no source"),
        (["mass_on_spring", "--ssp", "--level", "x"], "a scene has no level 'x'"),
        (["mass_on_spring", "--ssp", "-o", "x.zip"], "x.zip is to be an SSP, expected a name that ends in .ssp"),
        (["mass_on_spring", "--ssp", "-o", "text.ssp"], "text.ssp"),
        (["pd", "--ssp"], "pd is a part, expected a scene"),
        (["stage_tracking", "--ssp", "--frequency", "3"], "the scene has a motion of its own"),
    ],
    ids=["no_ssp", "level", "ending", "another_file", "part", "own_motion"],
)
def test_what_the_verb_refuses(hfsa, tmp_path, words, sentence):
    (tmp_path / "text.ssp").write_text("a text")
    code, out, err = hfsa("export", *words)
    assert code in (2, 4)
    assert out == ""
    assert sentence in err
    assert (tmp_path / "text.ssp").read_text() == "a text"


def test_versions_of_fmi(tmp_path):
    with pytest.raises(StructureError, match="fmi is 1, expected 2 or 3"):
        package("mass_on_spring", fmi=1, path=tmp_path / "x.ssp")
