"""The listing states each argument with default, unit and sentence, and what an FMU of any maker offers."""

import pytest
from command_line import strict_json

from hfsa.components._modelling.argument_texts import text_of
from hfsa.components._modelling.arguments import arguments_of
from hfsa.components.sdelta import analyze, sdelta


@pytest.fixture(scope="module")
def everything():
    from hfsa.cosim.commands._listing import listing

    return {entry["name"]: entry for entries in listing().values() for entry in entries}


def test_every_argument_of_every_part_and_scene_has_a_sentence(everything):
    lacking = [
        (name, argument["name"])
        for name, entry in everything.items()
        for argument in entry["arguments"]
        if not argument["description"]
    ]
    assert len(everything) > 30
    assert not lacking


@pytest.mark.parametrize(
    ("owner", "name", "unit", "words"),
    [
        ("sdelta", "rods.length", "m", "free length"),
        ("sdelta", "payload.inertia", "kg.m2", "moments of inertia about the payload's centre of mass"),
        ("sdelta", "gear", "", "motor turns per turn"),
        ("sdelta", "point", "m", "point of reference P"),
        ("sdelta_hfsa", "rods.length", "m", "free length"),
        ("sdelta_hfsa", "torque_limit", "N.m", "torque limit of each motor"),
        ("stage_bode", "hinge.radius", "m", "radius of the notches"),
        ("stage_closed_loop", "kinematics", "", "parameter set of the links"),
        ("mass_on_spring", "damping", "N.s/m", "damper"),
    ],
    ids=lambda value: value,
)
def test_an_argument_has_the_unit_and_the_sentence_of_the_docstring_that_declares_it(
    everything, owner, name, unit, words
):
    entry = next(argument for argument in everything[owner]["arguments"] if argument["name"] == name)
    assert entry["unit"] == unit
    assert words in entry["description"]


def test_an_entry_with_two_units_has_none():
    """The motion of a scene is a file with columns in m and rad."""

    def part(*, motion: float = 0.0) -> None:
        """Do nothing.

        Args:
            motion: columns x [m] and angle [rad].
        """

    assert text_of(arguments_of(part)["motion"]) == ("columns x [m] and angle [rad].", "")


def test_an_argument_of_the_analysis_alone_is_described_by_it():
    assert text_of(arguments_of(sdelta)["extra_inertia"]).sentence
    assert text_of(arguments_of(analyze)["extra_inertia"]).sentence == ""
    shared = text_of(arguments_of(analyze)["extra_inertia"], sdelta)
    assert shared == text_of(arguments_of(sdelta)["extra_inertia"])


def test_the_answer_shows_unit_and_sentence(hfsa):
    _, out, _ = hfsa("list", "sdelta")
    assert "-p rods.length=0.115 m  free length l_r [m]." in out
    found = strict_json(hfsa("list", "sdelta", "--json")[1])["components"][0]["arguments"]
    assert {"name": "rods.length", "default": 0.115, "unit": "m"}.items() <= next(
        argument for argument in found if argument["name"] == "rods.length"
    ).items()


@pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
def test_an_fmu_lists_what_a_scene_can_use(hfsa, version):
    assert hfsa("export", "mass_on_spring", "--fmi", version, "-o", ".")[0] == 0
    file = f"MassOnSpring.fmi{version}.fmu"
    code, out, _ = hfsa("list", file)
    assert code == 0
    assert f"FMI {version}, Co-Simulation and Model Exchange, 2 states; directional derivatives" in out
    assert "in   base.position" in out
    assert "-p stiffness=10000 N/m" in out
    entry = strict_json(hfsa("list", file, "--json")[1])["FMUs"][0]
    assert entry["interfaces"] == ["co_simulation", "model_exchange"]
    assert entry["inputs"] == [{"name": "base.position", "unit": "m", "description": "", "start": 0.0}]


def test_a_file_that_is_no_fmu_is_refused(hfsa, tmp_path):
    (tmp_path / "broken.fmu").write_text("no archive")
    code, _, err = hfsa("list", "broken.fmu")
    assert code == 2
    assert "broken.fmu is not a readable FMU" in err
