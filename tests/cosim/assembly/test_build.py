"""Assembly of a scene from FMU files: names, cache, instruments, and misfits."""

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from hfsa.components import ModelError
from hfsa.cosim.assembly import fmu_cache
from hfsa.cosim.assembly.build import build, instrument
from hfsa.cosim.assembly.fmu_cache import cache_folder, fmu_file
from hfsa.cosim.assembly.level_rules import check_levels
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.assembly.models import model_of
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene_file import scene_text
from hfsa.cosim.systems.system import Component, Connection, System

MASS = Component("mass", "mass_on_spring")


@pytest.fixture
def counted(monkeypatch, tmp_path):
    """An empty cache and a stub of the exporter; returns the list of exported models."""
    calls = []

    def export(model, folder, versions, _platforms=()):
        calls.append(model)
        file = Path(folder) / f"{model.name}.fmi{versions[0]}.fmu"
        file.write_text(model.name)
        return [file]

    monkeypatch.setenv("HFSA_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(fmu_cache, "export", export)
    return calls


# Scenes by name -------------------------------------------------------------------------------------------------------


def test_arguments_of_a_scene():
    scene = load_scene("sdelta_shaker", {"damping": "0.02", "posture.position": "0,0,0.16", "robot.gravity": "9.81"})
    robot = scene.system["robot"]
    assert robot.start == {"damping_ratio": 0.02, "gravity": 9.81}
    assert robot.arguments["posture.position"] == (0.0, 0.0, 0.16)
    assert scene.system["reference"].arguments["posture.position"] == (0.0, 0.0, 0.16)
    scene = load_scene("sdelta_shaker", {"robot.level": "rigid", "reference.level": "exact", "robot.payload.mass": "1"})
    assert (scene.system["robot"].level, scene.system["reference"].level) == ("rigid", "exact")
    assert scene.system["robot"].arguments["payload.mass"] == "1"
    scene = load_scene("sdelta_shaker", {"robot.solver": "rk4"})
    assert model_of(scene.system["robot"]).solver == "rk4"


@pytest.mark.parametrize(
    ("name", "arguments", "words"),
    [
        ("sdelta_shakr", {}, "no scene is called 'sdelta_shakr'; did you mean sdelta_shaker"),
        ("sdelta_shaker", {"dampng": 1}, "has no argument 'dampng'; did you mean damping"),
        ("sdelta_shaker", {"robt.level": "rigid"}, r"has no argument 'robt\.level'; did you mean robot\.level"),
        ("sdelta_shaker", {"robot.gravity": "down"}, r"robot\.gravity is 'down', expected a number"),
        ("nowhere/scene.py", {}, "there is no file nowhere/scene.py"),
        ("nowhere/scene.toml", {}, "there is no file nowhere/scene.toml"),
    ],
)
def test_names_that_do_not_exist(name, arguments, words):
    with pytest.raises(StructureError, match=words):
        load_scene(name, arguments)


@pytest.mark.parametrize(
    ("name", "arguments", "words"),
    [
        (5, {}, "a scene is 5, expected the name or path of a scene"),
        (None, {}, "a scene is None, expected the name or path of a scene"),
        ("mass_on_spring", 5, "the arguments of a scene is 5, expected a table"),
        ("mass_on_spring", {5: 1}, "the arguments of a scene is {5: 1}, expected a table"),
        ("mass_on_spring", {"mass.level": 5}, "component mass: level is 5, expected the name of a level"),
        ("mass_on_spring", {"mass.damping": None}, "mass.damping is None, expected a number"),
        ("mass_on_spring", {"mass.damping": True}, "mass.damping is True, expected a number"),
    ],
)
def test_scenes_and_arguments_of_a_wrong_type(name, arguments, words):
    with pytest.raises(StructureError) as refusal:
        load_scene(name, arguments)
    assert str(refusal.value).startswith(words)


@pytest.mark.parametrize(
    ("part", "arguments", "words"),
    [
        ("mass_on_spring", {"level": 5}, "mass_on_spring has no argument 'level'"),
        ("mass_on_spring", {"self": 5}, "mass_on_spring has no argument 'self'"),
        ("mass_on_spring", {"solver": 5}, "mass_on_spring: solver is 5"),
        ("mass_on_spring", {"damping": [1]}, "mass_on_spring: damping is (1,), expected a number"),
        ("mass_on_spring", {"damping": True}, "mass_on_spring: damping is True, expected a number"),
        ("sdelta", {"level": 5}, "sdelta: level is 5, expected one of"),
        ("sdelta", {"posture.rotation": 5}, "sdelta: posture.rotation is 5, expected a list of values"),
        ("sdelta_tuning", {}, "it: sdelta_tuning is an analysis and has no model"),
        (".", {}, "it: . is a folder"),
    ],
)
def test_arguments_of_a_part_of_a_wrong_type(counted, tmp_path, monkeypatch, part, arguments, words):
    monkeypatch.chdir(tmp_path)
    with pytest.raises((ModelError, StructureError)) as refusal:
        build(System([Component("it", part, None, arguments)]))
    assert str(refusal.value).startswith(words)
    assert not counted


def test_the_level_may_be_among_the_arguments():
    by_name = model_of(Component("it", "sdelta", None, {"level": "rigid"}))
    assert by_name.information == model_of(Component("it", "sdelta", "rigid")).information


def test_arguments_that_make_no_sense():
    with pytest.raises(ModelError, match="stiffness is 'ch5', expected one of"):
        load_scene("sdelta_shaker", {"stiffness": "ch5"})


def test_scenes_of_the_users_own(tmp_path):
    text = scene_text(load_scene("mass_on_spring"))
    (tmp_path / "mine.toml").write_text(text)
    assert load_scene(str(tmp_path / "mine.toml"), {"mass.damping": 2}).system["mass"].start == {"damping": 2.0}
    (tmp_path / "mine.py").write_text(
        '"""Mine."""\n'
        "from hfsa.cosim.scenes.mass_on_spring import mass_on_spring\n"
        "def mine(*, damping: float = 1.0):\n"
        '    """Mine."""\n'
        "    return mass_on_spring(damping=damping)\n"
    )
    assert load_scene(str(tmp_path / "mine.py"), {"damping": "3"}).system["mass"].start == {"damping": 3.0}
    (tmp_path / "other.py").write_text('"""Nothing."""\n')
    with pytest.raises(StructureError, match="defines no function other"):
        load_scene(str(tmp_path / "other.py"))


# The cache ------------------------------------------------------------------------------------------------------------


def test_a_file_is_built_once(counted):
    first = fmu_file(MASS)
    assert first.name == "MassOnSpring.fmi2.fmu"
    assert first.is_relative_to(cache_folder())
    assert fmu_file(MASS) == first
    assert fmu_file(Component("other", "mass_on_spring", start={"damping": 3.0})) == first  # set at run time
    assert len(counted) == 1
    assert fmu_file(MASS, 3) != first
    assert fmu_file(Component("mass", "mass_on_spring", arguments={"damping": 3.0})) != first  # another start value
    assert fmu_file(Component("mass", "mass_on_spring", arguments={"solver": "rosenbrock"})) != first
    assert len(counted) == 4


def test_the_same_argument_in_other_words(counted):
    rotation = {"posture.rotation": (10.0, 5.0, 8.0)}
    first = fmu_file(Component("a", "sdelta_reference", arguments=rotation))
    assert fmu_file(Component("b", "sdelta_reference", arguments={"posture.rotation": "10, 5, 8"})) == first
    assert fmu_file(Component("c", "sdelta_reference")) != first
    assert len(counted) == 2


def test_sources_are_part_of_the_key(counted, monkeypatch):
    first = fmu_file(MASS)
    monkeypatch.setattr(fmu_cache, "sources", lambda: "changed")
    assert fmu_file(MASS) != first


def test_many_at_once_build_one_folder(counted):
    with ThreadPoolExecutor(8) as pool:
        found = set(pool.map(fmu_file, [MASS] * 16))
    assert len(found) == 1
    (file,) = found
    assert file.read_text() == "MassOnSpring"
    assert os.listdir(file.parent.parent) == [file.parent.name]  # and nothing unfinished is left


def test_a_build_that_fails_leaves_nothing(counted, monkeypatch):
    def fails(model, folder, versions, _platforms=()):
        (Path(folder) / "half").write_text("")
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(fmu_cache, "export", fails)
        with pytest.raises(KeyboardInterrupt):
            fmu_file(MASS)
    assert os.listdir(cache_folder() / "fmus") == []
    assert fmu_file(MASS).is_file()


def test_what_a_killed_process_left_is_swept_up(counted):
    left = cache_folder() / "fmus" / ".unfinished-x"
    left.mkdir(parents=True)
    fmu_file(MASS)
    assert left.is_dir()  # somebody may be at work there
    os.utime(left, (0, 0))
    fmu_file(MASS, 3)
    assert not left.exists()


def test_a_foreign_fmu_beside_its_scene(foreign, tmp_path, monkeypatch):
    (tmp_path / "scene").mkdir()
    (tmp_path / "scene" / "spring.fmu").write_bytes(foreign[2].read_bytes())
    (tmp_path / "scene" / "own.toml").write_text(
        """
        inputs = ["spring.u"]
        outputs = ["spring.y"]
        band = [1, 10]
        amplitude = { 1 = 1.0 }
        step_size = 1e-3
        stop_time = 1
        components = [{ name = "spring", part = "spring.fmu" }]
        """
    )
    monkeypatch.chdir(tmp_path)
    scene = load_scene("scene/own.toml", {"spring.behaviour": "1"})
    assert build(scene.system).files == {"spring": tmp_path / "scene" / "spring.fmu"}
    assert instrument(scene, "spring.u")["source"].arguments == {"unit": "1"}  # it states no unit


def test_a_foreign_fmu(foreign, tmp_path):
    assert fmu_file(Component("spring", str(foreign[2]))) == foreign[2]
    with pytest.raises(StructureError, match="spring: there is no file"):
        fmu_file(Component("spring", str(tmp_path / "none.fmu")))
    with pytest.raises(StructureError, match=r"Foreign\.fmu is a finished FMU"):
        fmu_file(Component("spring", str(foreign[2]), arguments={"gain": 1}))


def test_wrong_parts_and_levels():
    with pytest.raises(ModelError, match="no part is called 'sdleta'; did you mean sdelta"):
        fmu_file(Component("robot", "sdleta"))
    with pytest.raises(ModelError, match="level is 'cartesan', expected one of"):
        fmu_file(Component("robot", "sdelta", "cartesan"))
    with pytest.raises(StructureError, match=r"robot: level auto is .* name one of rigid, cartesian"):
        fmu_file(Component("robot", "sdelta", "auto"))


# What fits together ---------------------------------------------------------------------------------------------------


def joined(level: str | None, driver: Component) -> System:
    robot = Component("robot", "sdelta", level)
    return System([driver, robot], [Connection("drive.drive[1..3].slide", "robot.drive[1..3].slide")])


def test_a_rigid_robot_follows_ideal_drives_only(foreign):
    check_levels(joined("rigid", Component("drive", "sdelta_reference")))
    check_levels(joined("cartesian", Component("drive", str(foreign[2]))))
    check_levels(joined(None, Component("drive", str(foreign[2]))))
    with pytest.raises(StructureError, match=r"robot is sdelta at level rigid, .*held inertial reaction diverges"):
        build(joined("rigid", Component("drive", str(foreign[2]))))


def test_instruments():
    scene = load_scene("mass_on_spring", {"source.frequency": 3})
    system = instrument(scene, "mass.base.position")
    assert [c.name for c in system.components] == ["source", "mass", "lock_in"]
    assert system["source"].arguments == {"unit": "m"}
    assert system["source"].start == {"amplitude": 1e-3, "frequency": 3.0}
    assert system["lock_in"].arguments == {"units": ("m",)}
    assert system["lock_in"].start == {"sample_time": 1e-4}
    assert [str(c) for c in system.connections] == [
        "source.value -> mass.base.position",
        "source.sine -> lock_in.sine",
        "source.cosine -> lock_in.cosine",
        "mass.position -> lock_in.signal[1]",
    ]


def test_instruments_that_do_not_fit():
    scene = load_scene("mass_on_spring")
    with pytest.raises(StructureError, match=r"has no variable 'base\.positon'; did you mean base\.position"):
        instrument(scene, "mass.base.positon")
    poor = load_scene("mass_on_spring")
    object.__setattr__(poor, "amplitude", {"rad": 1.0})
    with pytest.raises(StructureError, match=r"no amplitude for mass\.base\.position in m; it has rad"):
        instrument(poor, "mass.base.position")
