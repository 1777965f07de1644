"""3D models: places at rest and displaced are those of the mechanics, read again by trimesh and from the bytes."""

import io
import json
import sys

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from hfsa.components import Drawing, Layer, Panel
from hfsa.components._mechanics.sdelta_geometry import C_AXES, Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE
from hfsa.components._mechanics.sdelta_picture import robot_drawing
from hfsa.components._mechanics.sdelta_robot import THESIS_MACHINE, Robot
from hfsa.components.rrr_stage import picture as stage_picture
from hfsa.components.sdelta import analyze
from hfsa.components.sdelta import moving as robot_moving
from hfsa.cosim.gltf import file as gltf_file
from hfsa.cosim.gltf.file import glb, write_model
from hfsa.cosim.gltf.of_drawing import PERIOD, model_of_drawing
from hfsa.cosim.gltf.of_run import model_of_run
from hfsa.cosim.pages.bodies import Body
from hfsa.cosim.results.recorded import TIME, Recorded
from hfsa.cosim.results.records import ResultsError

TILTED = Posture((10.0, 5.0, 8.0), (0.02, 0.01, 0.155))
UPRIGHT = Rotation.from_euler("x", -90, degrees=True).as_matrix()
"""From the axes of the machine, Z up, to those of glTF, Y up."""

ONE = Panel([Layer(np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]), np.array([[0, 1]]), name="rod")], unit="m")


class Read:
    """A binary glTF file, read by the layout of its bytes."""

    def __init__(self, content: bytes):
        magic, version, length = content[:4], *np.frombuffer(content[4:12], "<u4")
        assert (magic, version, length) == (b"glTF", 2, len(content))
        size = int.from_bytes(content[12:16], "little")
        self.tree = json.loads(content[20 : 20 + size])
        self._blob = content[28 + size :]

    def numbers(self, accessor: int) -> np.ndarray:
        """Return the numbers of an accessor."""
        found = self.tree["accessors"][accessor]
        view = self.tree["bufferViews"][found["bufferView"]]
        kind = {5126: "<f4", 5125: "<u4"}[found["componentType"]]
        width = {"SCALAR": 1, "VEC3": 3}[found["type"]]
        values = np.frombuffer(self._blob, kind, found["count"] * width, view["byteOffset"]).reshape(-1, width)
        np.testing.assert_array_equal(values.min(axis=0), found["min"])
        np.testing.assert_array_equal(values.max(axis=0), found["max"])
        return values if width > 1 else values.ravel()

    def mesh(self, name: str) -> tuple[int, dict]:
        """Return the place of the node of a name, and the first primitive of its mesh."""
        (place,) = [i for i, node in enumerate(self.tree["nodes"]) if node["name"] == name]
        return place, self.tree["meshes"][self.tree["nodes"][place]["mesh"]]["primitives"][0]

    def displaced(self, name: str, animation: int, row: int) -> np.ndarray:
        """Return the displacements of a node's points at a row of an animation."""
        place, primitive = self.mesh(name)
        found = self.tree["animations"][animation]
        (channel,) = [one for one in found["channels"] if one["target"]["node"] == place]
        targets = [self.numbers(target["POSITION"]) for target in primitive["targets"]]
        weights = self.numbers(found["samplers"][channel["sampler"]]["output"]).reshape(-1, len(targets))
        return np.einsum("k,kij->ij", weights[row], targets)


@pytest.fixture(scope="module")
def tilted():
    """The robot at a posture, its screws of modes by `analyze`, and its model as bytes."""
    robot = Robot.at(TILTED, "ch4", CUBE, THESIS_MACHINE)
    return robot, analyze(posture=TILTED, stiffness="ch4"), glb(model_of_drawing(robot_drawing(robot, "SDelta")))


def test_trimesh_finds_the_robot_where_inverse_kinematics_puts_it(tilted):
    robot, _, content = tilted
    scene = trimesh.load(io.BytesIO(content), file_type="glb")
    assert scene.units == "meters"
    (placed, platform) = scene.graph.get("platform")
    corners = trimesh.transform_points(scene.geometry[platform].vertices, placed)
    expected = np.array(TILTED.position) + THESIS_MACHINE.mechanism.geometry.joints @ robot.kinematics.Q.T
    np.testing.assert_allclose(np.sort(corners @ UPRIGHT, axis=0), np.sort(expected, axis=0), atol=1e-8)


def test_limbs_have_the_length_and_the_tubes_the_slide_of_inverse_kinematics(tilted):
    robot, _, content = tilted
    read = Read(content)
    _, primitive = read.mesh("limbs")
    points = read.numbers(primitive["attributes"]["POSITION"])
    ends = points[read.numbers(primitive["indices"]).reshape(-1, 2)]
    limbs = robot.kinematics.limbs
    np.testing.assert_allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), limbs.length, rtol=1e-6)
    along = np.einsum("ij,ij->i", ends[:, 0] - THESIS_MACHINE.mechanism.geometry.middles, C_AXES)
    np.testing.assert_allclose(along, limbs.slide, atol=1e-8)


def test_each_mode_swings_along_its_screw(tilted):
    robot, numbers, content = tilted
    read = Read(content)
    center = robot.kinematics.position + robot.offset
    corners = read.numbers(read.mesh("platform")[1]["attributes"]["POSITION"])
    names = [animation["name"] for animation in read.tree["animations"]]
    for mode, screw in enumerate(numbers["modal_screws_C"].T):
        assert names[mode].startswith(f"mode {mode + 1}: {numbers['natural_frequencies_hz'][mode]:.4g} Hz")
        samplers = read.tree["animations"][mode]["samplers"]
        time = read.numbers(samplers[0]["input"])
        quarter = int(np.argmin(abs(time - PERIOD / 4)))
        found = read.displaced("platform", mode, quarter)
        expected = np.cross(screw[:3], corners - center) + screw[3:]
        factor = np.vdot(found, expected) / np.vdot(expected, expected)
        np.testing.assert_allclose(found, factor * expected, atol=1e-6 * np.abs(found).max())
        np.testing.assert_allclose(read.displaced("platform", mode, len(time) - 1 - quarter), -found, rtol=1e-6)
        np.testing.assert_allclose(read.displaced("platform", mode, 0), 0, atol=1e-12)


def test_tubes_are_around_the_rods_and_move_with_them(tilted):
    _, _, content = tilted
    read = Read(content)
    place, rods = read.mesh("limbs")
    _, tubes = read.tree["meshes"][place]["primitives"]
    assert (rods["mode"], tubes["mode"]) == (1, 4)
    ends = read.numbers(rods["attributes"]["POSITION"])[read.numbers(rods["indices"])]
    rings = read.numbers(tubes["attributes"]["POSITION"]).reshape(len(ends), -1, 3)
    np.testing.assert_allclose(rings.mean(axis=1), ends, atol=1e-7)
    radii = np.linalg.norm(rings - rings.mean(axis=1, keepdims=True), axis=2)
    np.testing.assert_allclose(radii, radii[0, 0], rtol=1e-4)
    for rod, tube in zip(rods["targets"], tubes["targets"], strict=True):
        moved = read.numbers(tube["POSITION"]).reshape(len(ends), -1, 3)
        expected = read.numbers(rod["POSITION"])[read.numbers(rods["indices"])]
        np.testing.assert_array_equal(moved, np.repeat(expected[:, None], moved.shape[1], axis=1))


def test_a_plane_lies_at_height_zero_and_is_drawn_once():
    read = Read(glb(model_of_drawing(stage_picture())))
    names = [node["name"] for node in read.tree["nodes"]]
    assert [names.count(name) for name in ("cranks", "couplers", "platform")] == [1, 1, 1]
    corners = read.numbers(read.mesh("platform")[1]["attributes"]["POSITION"])
    np.testing.assert_array_equal(corners[:, 2], 0)
    assert (read.tree["asset"]["extras"]["up"], read.tree["asset"]["extras"]["unit"]) == ("Y", "m")
    for node in read.tree["nodes"]:
        turned = Rotation.from_quat(node["rotation"])
        np.testing.assert_allclose(turned.as_matrix(), UPRIGHT, atol=1e-7)


def test_values_are_colours_of_the_scale():
    """White in sRGB is white; the ends of the scale are those of the pictures."""
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    panel = Panel([Layer(points, np.array([[0, 1, 2]]), name="plate", values=np.array([1.0, 3.0, 5.0]))], unit="mm")
    read = Read(glb(model_of_drawing(Drawing("Plate", [panel]))))
    _, plate = read.mesh("plate")
    np.testing.assert_allclose(read.numbers(plate["attributes"]["POSITION"]), 1e-3 * points)
    low = np.array([0x0B, 0x5F, 0xA5]) / 255
    expected = np.where(low <= 0.04045, low / 12.92, ((low + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(read.numbers(plate["attributes"]["COLOR_0"])[0], expected, rtol=1e-5)


def recorded_motion(rows: int, stop: float) -> tuple[Recorded, dict[str, np.ndarray]]:
    """Return a recording, and the signals of a robot that moves along all six coordinates."""
    time = np.linspace(0.5, 0.5 + stop, rows)
    names = [f"platform.{kind}[{i}]" for kind in ("rotation", "position") for i in (1, 2, 3)]
    signals = {name: (i + 1) * 1e-6 * np.sin(7.0 * (i + 1) * time) for i, name in enumerate(names)}
    return Recorded(None, "Run", TIME, time, signals, dict.fromkeys(signals, "m")), signals


def test_a_recorded_motion_is_played_as_it_was_magnified():
    recorded, signals = recorded_motion(400, 1.0)
    moving = robot_moving(posture=TILTED)
    moved = moving.displacements(signals)
    body = Body("robot", moving.panel, moved, list(signals.values()))
    model, sentences = model_of_run(recorded, [body])
    assert not sentences
    read = Read(glb(model))
    (animation,) = read.tree["animations"]
    facts = animation["extras"]
    assert facts["magnification of robot"] == body.magnification > 1e3
    time = read.numbers(animation["samplers"][0]["input"])
    np.testing.assert_allclose(facts["first_time"] + time / facts["slow_motion"], recorded.at, rtol=1e-6)
    assert 4 <= time[-1] <= 10
    for row in (0, 57, 399):
        expected = body.magnification * moved[3][row]
        largest = body.magnification * np.abs(moved[3]).max()
        np.testing.assert_allclose(read.displaced("robot platform", 0, row), expected, atol=3e-6 * largest)


def test_what_few_fields_do_not_hold_is_measured():
    draw = np.random.default_rng(1)
    points = draw.uniform(size=(40, 3))
    shape = Layer(points, np.arange(40)[:, None], name="dust")
    time = np.linspace(0.0, 10.0, 60)
    recorded = Recorded(None, "Dust", TIME, time, {}, {})
    moved = draw.normal(size=(60, 40, 3))
    body = Body("dust", Panel([shape]), [moved], [])
    model, (sentence,) = model_of_run(recorded, [body])
    read = Read(glb(model))
    found = np.array([read.displaced("dust dust", 0, row) for row in range(60)]) / body.magnification
    error = np.abs(found - moved).max() / np.abs(moved).max()
    assert error > 0.01
    assert f"within {100 * error:.2g} % of its largest displacement" in sentence


def test_only_a_model_of_hfsa_is_replaced(tmp_path):
    file, model = tmp_path / "rod.glb", model_of_drawing(Drawing("Rod", [ONE]))
    write_model(file, model)
    write_model(file, model)
    trimesh.Scene(trimesh.creation.box()).export(file)
    other = file.read_bytes()
    with pytest.raises(ResultsError, match="a 3D model of another program, which is not replaced"):
        write_model(file, model)
    assert file.read_bytes() == other


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(b"glTF", id="short"),
        pytest.param(b"glTF" + b"\xff" * 40, id="no-json"),
        pytest.param(b"glTF\2\0\0\0\0\0\0\0\4\0\0\0JSON[[[[", id="broken"),
        pytest.param(b"glTF\2\0\0\0\0\0\0\0\2\0\0\0JSON[]", id="list"),
    ],
)
def test_a_damaged_model_is_not_replaced(tmp_path, content):
    file = tmp_path / "rod.glb"
    file.write_bytes(content)
    with pytest.raises(ResultsError, match="which is not replaced"):
        write_model(file, model_of_drawing(Drawing("Rod", [ONE])))
    assert file.read_bytes() == content


def test_a_model_that_is_too_large_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(gltf_file, "LARGEST", gltf_file.LARGEST._replace(size=1e3))
    with pytest.raises(ResultsError, match=r"MB, expected at most 0\.001 MB"):
        write_model(tmp_path / "rod.glb", model_of_drawing(Drawing("Rod", [ONE])))
    assert not list(tmp_path.iterdir())


WRONG = {
    "no drawing": (["pd", "-o", "pd.glb"], "pd offers no picture"),
    "no length": (["beam_module", "-o", "b.glb"], "has coordinates without a unit, expected a length"),
    "no part": (["sdelt", "-o", "s.glb"], "did you mean sdelta"),
    "ending": (["sdelta", "-o", "s.gltf"], ".webp; .html is a page, .glb a 3D model"),
    "no poses": (["mass.h5", "-o", "mass.glb"], "nothing moves in the file"),
    "ending of a run": (["mass.h5", "-o", "mass.png"], "expected the ending .html or .glb"),
}


def test_wrong_usage_is_told_and_writes_nothing(hfsa, tmp_path):
    assert hfsa("run", "mass_on_spring", "--frequency", "16", "--stop", "0.01", "-o", "mass.h5")[0] == 0
    for tokens, words in WRONG.values():
        code, _, err = hfsa("view", *tokens)
        assert code == 2, err
        assert words in err
    assert [file.name for file in tmp_path.iterdir()] == ["mass.h5"]


@pytest.mark.parametrize(
    ("library", "tokens", "words"),
    [
        pytest.param("pygltflib", ["rrr_stage", "-o", "a.glb"], "pip install 'hfsa[cad]'", id="model"),
        pytest.param(
            "pygraphviz", ["mass_on_spring", "--diagram"], "pip install 'hfsa[diagram]'; the ending .dot", id="diagram"
        ),
    ],
)
def test_a_missing_extra_is_named(hfsa, tmp_path, monkeypatch, library, tokens, words):
    monkeypatch.setitem(sys.modules, library, None)
    code, _, err = hfsa("view", *tokens)
    assert code == 2
    assert words in err
    assert not list(tmp_path.iterdir())


def test_the_verb_writes_a_model_and_names_its_animations(hfsa, tmp_path):
    code, out, _ = hfsa("view", "tba_accelerometer", "-o", "sensor.glb", "--json")
    assert code == 0
    assert [name.partition(",")[0] for name in json.loads(out)["animations"]] == [
        "displaced along x",
        "displaced along y",
    ]
    assert len(Read((tmp_path / "sensor.glb").read_bytes()).tree["animations"]) == 2
