"""Level `continuum` of the part: its ports, its equations beside all modes, its analysis, its drawing and commands."""

import numpy as np
import pytest

pytest.importorskip("gmsh")
pytest.importorskip("skfem")

from continuum_references import SIZE, design, solved
from hypothesis import given, settings
from hypothesis import strategies as st

from hfsa.components import ModelError
from hfsa.components._continuum.drawing import field
from hfsa.components._continuum.outline import NECKS
from hfsa.components._continuum.recovery import TOLERANCE
from hfsa.components._continuum.reduced import bonded, reduced
from hfsa.components._continuum.stress import neck_stresses
from hfsa.components._mechanics.pzt import TOKIN, Stack
from hfsa.components._mechanics.rrr_design import Design
from hfsa.components._mechanics.rrr_outline import Plate
from hfsa.components._modelling.functions import functions, is_linear
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind
from hfsa.components.rrr_stage import analyze, picture, rrr_stage
from hfsa.cosim.cli import main
from hfsa.fmus.c_code import generate

UM = 1e-6
LOCKED = Plate("locked", "pin")


def ports(level: str) -> set[str]:
    return {q.name for q in rrr_stage(level=level).of(Kind.INPUT, Kind.OUTPUT)}


def test_it_has_the_ports_of_the_other_levels():
    """But the angle of the hinges: a neck that shears has none."""
    assert ports("constant_jacobian") - ports("continuum") == {"hinge.angle"}
    assert ports("continuum") < ports("constant_jacobian")


@pytest.mark.parametrize(("bolts", "states"), [("pin", 12), ("rigid", 6)])
def test_it_is_linear_and_has_few_states(bolts, states):
    model = rrr_stage(level="continuum", plate=Plate("stack", bolts))
    model.check()
    assert len(model.of(Kind.STATE)) == states
    assert is_linear(model)


class System:
    """The model about rest: A, B, C, D by names."""

    def __init__(self, plate: Plate, **values: float):
        model = rrr_stage(level="continuum", plate=plate)
        found = linearize(model, values)
        self.A, self.B, self.C, self.D = (np.asarray(part) for part in (found.A, found.B, found.C, found.D))
        self.inputs = [name.replace("/", ".") for name in found.input_labels]
        self.outputs = [name.replace("/", ".") for name in found.output_labels]

    def response(self, s: complex) -> np.ndarray:
        return self.C @ np.linalg.solve(s * np.eye(len(self.A)) - self.A, self.B) + self.D

    def rows(self, *names: str) -> list[int]:
        return [i for i, name in enumerate(self.outputs) if name.startswith(names)]


PLACE = ("stack[1].elongation", "platform.position", "platform.rotation")


@pytest.mark.parametrize(("contact", "bolts"), [("locked", "pin"), ("stack", "rigid")])
def test_it_responds_as_all_modes(contact, bolts):
    """Elongations and pose by all inputs are exact at 0 Hz; to 5 kHz the pose errs by 1.2 %, elongations by 7 %."""
    system = System(Plate(contact, bolts), **{"stack.damping": 0.0})
    stage = solved(contact, bolts).stage
    K, _, B = bonded(stage, TOKIN)
    names = [f"stack[{i}].elongation" for i in (1, 2, 3)]
    names += ["platform.position[1]", "platform.position[2]", "platform.rotation"]
    rows = [system.outputs.index(name) for name in names]
    loads = np.hstack([np.eye(len(K))[:, :6], -B])
    assert system.inputs[3:] == [
        "wrench.force[1]", "wrench.force[2]", "wrench.torque", "base.acceleration[1]", "base.acceleration[2]"
    ]  # fmt: skip
    size = np.array([1, 1, 1, 1, 1, 0.03])
    into = np.array([1, 1, 1, 1, 1, 1 / 0.03, 1, 1])
    exact = np.linalg.solve(K, loads)[:6] * size[:, None] * into
    found = system.response(0)[rows] * size[:, None] * into
    assert np.abs(found - exact).max(axis=0) == pytest.approx(0, abs=1e-9 * np.abs(exact).max())
    every = reduced(stage, TOKIN, len(K) - 1)
    for hertz in (100.0, 700.0, 2000.0, 3500.0, 5000.0):
        s = 2j * np.pi * hertz
        gains = 1 / (s**2 + 0.02 * every.omega * s + every.omega**2)
        modal = np.hstack([every.shapes * gains @ every.shapes.T, -every.shapes * gains @ every.base])
        exact = modal * size[:, None] * into
        found = system.response(s)[rows] * size[:, None] * into
        for rows_of, columns, allowed in (
            (slice(3, 6), slice(0, 3), 0.012),
            (slice(3, 6), slice(3, 6), 0.012),
            (slice(3, 6), slice(6, 8), 0.012),
            (slice(0, 3), slice(0, 6), 0.015 if hertz <= 2000 else 0.07),
        ):
            block = np.ix_(*(np.arange(8)[part] for part in (rows_of, columns)))
            assert np.linalg.norm((found - exact)[block]) < allowed * np.linalg.norm(exact[block])


def test_modes_have_the_damping_ratio_and_stacks_add_theirs():
    bare = System(LOCKED, **{"stack.damping": 0.0, "damping_ratio": 0.02})
    poles = np.linalg.eigvals(bare.A)
    np.testing.assert_allclose(-poles.real / np.abs(poles), 0.02, rtol=1e-6)
    with_stacks = np.linalg.eigvals(System(LOCKED, damping_ratio=0.02).A)
    assert np.sort(-with_stacks.real)[0] > np.sort(-poles.real)[0]


def test_rates_are_the_derivatives_of_places_but_for_the_residual():
    """J omega times the place without its feedthrough is the rate, and again the acceleration."""
    system = System(LOCKED)
    s = 2j * np.pi * 300.0
    found = system.response(s)
    for place, rate in (("platform.position", "platform.velocity"), ("platform.rotation", "platform.angular_velocity")):
        rows = system.rows(place)
        moving = s * (found[rows] - system.D[rows])
        # rates act on stacks' damping in the feedthrough alone
        np.testing.assert_allclose(found[system.rows(rate)], moving, rtol=2e-3, atol=1e-3 * np.abs(moving).max())
    for rate, acceleration in (
        ("platform.velocity", "platform.acceleration"),
        ("platform.angular_velocity", "platform.angular_acceleration"),
    ):
        expected = s * found[system.rows(rate)]
        np.testing.assert_allclose(found[system.rows(acceleration)], expected, rtol=1e-6)


def test_stacks_feel_what_they_push():
    """At rest the force on a crank is the blocking force less k l, and that is K_a l."""
    system = System(LOCKED)
    static = system.response(0).real[:, :3]
    force = static[system.rows("stack[1].force", "stack[2].force", "stack[3].force")]
    at = static[[system.outputs.index(f"stack[{i}].elongation") for i in (1, 2, 3)]]
    np.testing.assert_allclose(force, np.eye(3) - TOKIN.stiffness * at, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(force, solved("locked").stage.statics.on_stacks @ at, rtol=1e-6, atol=1e-9)


@settings(max_examples=30)
@given(st.lists(st.floats(-1, 1), min_size=6, max_size=6).filter(lambda drive: max(map(abs, drive)) > 0.01))
def test_the_stress_output_is_the_largest_of_all_corners(drive):
    """Never above it, and at most the tolerance below, whatever stacks and wrench do."""
    plan, found = design("locked"), solved("locked")
    statics = found.stage.statics
    motion = np.linalg.solve(statics.stiffness, np.array(drive) * [800, 800, 800, 200, 200, 5])
    necks = neck_stresses(*found.solution, plan.shape.material, statics.interface)
    exact = max(necks[neck].peak(leg, motion[None]).stress for neck in NECKS for leg in range(3))
    assert (1 - 2 * TOLERANCE) * exact <= largest(motion) <= exact * (1 + 1e-9)


def largest(motion: np.ndarray) -> float:
    """The stress expression of the model at elongations and pose."""
    import casadi as ca

    from hfsa.components._continuum.necks import largest_stress

    if not hasattr(largest, "function"):
        place = ca.SX.sym("place", 6)
        expression = largest_stress(design("locked"), solved("locked"), place)
        largest.function = ca.Function("stress", [place], [expression])
    return float(largest.function(motion))


def test_rest_is_rest_to_the_last_bit_and_its_derivatives_are_finite():
    model = rrr_stage(level="continuum")
    made = functions(model)
    zero = [np.zeros(len(model.of(kind))) for kind in (Kind.STATE, Kind.INPUT)]
    parameters = [q.start for q in model.of(Kind.PARAMETER)]
    assert not np.array(made.out(0, zero[0], [], zero[1], parameters)).any()
    assert np.isfinite(np.asarray(linearize(model).C)).all()


def test_it_rests_at_a_voltage():
    """The analysis gives the coordinates of the modes; there the model stays, at the pose of the voltage."""
    volts = (75.0, 20.0, 140.0)
    found = analyze(level="continuum", plate=LOCKED, voltage=volts)
    model = rrr_stage(level="continuum", plate=LOCKED)
    made, parameters = functions(model), [q.start for q in model.of(Kind.PARAMETER)]
    states = [*found["mode_at_voltage"], *np.zeros(6)]
    inputs = np.zeros(len(model.of(Kind.INPUT)))
    inputs[:3] = TOKIN.coupling * np.array(volts)
    rates = np.array(made.rhs(0, states, [], inputs, parameters)).ravel()
    assert np.abs(rates).max() < 1e-9 * np.abs(np.array(made.rhs(0, np.zeros(12), [], inputs, parameters))).max()
    put_out = np.array(made.out(0, states, [], inputs, parameters)).ravel()
    values = dict(zip([q.name for q in model.of(Kind.OUTPUT)], put_out, strict=True))
    pose = [values["platform.position[1]"], values["platform.position[2]"], values["platform.rotation"]]
    np.testing.assert_allclose(pose, found["pose_at_voltage"], rtol=1e-8)


# Analysis -------------------------------------------------------------------------------------------------------------


def test_the_analysis_answers_with_errors_that_hold():
    """Each number is nearer to the reference than its error says; values are those of pin and locked."""
    found = analyze(level="continuum", plate=LOCKED, elongation=(12 * UM, 0.0, 0.0), voltage=(150.0, 150.0, 150.0))
    error = found["mesh_error"]
    assert found["jacobian"][2, 0] == pytest.approx(-25.9617, rel=error["jacobian"])
    assert found["stiffness"][0, 0] == pytest.approx(29.600e6, rel=error["stiffness"])
    assert found["natural_frequencies_hz"][0] == pytest.approx(877.2, rel=error["natural_frequencies_hz"])
    assert found["hinge_stress"]["A1"] == pytest.approx(186.85e6, rel=error["hinge_stress"])
    assert found["peak_stress"]["A"] == pytest.approx(188.65e6, rel=error["peak_stress.A"])
    assert found["peak_stacks"]["A"] == "1, 2, 3"
    np.testing.assert_allclose(found["elongation_at_voltage"], 10.185 * UM, rtol=2e-4)
    np.testing.assert_allclose(found["range"], [33.23 * UM, 30.69 * UM, 0.9346e-3], rtol=2e-4)
    assert found["reduction_error"]["to 5 kHz"] < 0.012
    assert found["mesh_unknowns"] > 60_000
    assert max(error.values()) < 0.03
    assert not found["saturated"].any()


def test_an_elongation_and_its_pose_are_one():
    at = analyze(level="continuum", elongation=(10 * UM, 2 * UM, 5 * UM))
    back = analyze(level="continuum", pose=tuple(at["pose"].tolist()))
    np.testing.assert_allclose(back["elongation"], [10 * UM, 2 * UM, 5 * UM], rtol=1e-9)


def test_another_stack_holds_sideways_by_its_own_stiffness():
    """A stack twice as stiff and as large in cross-section moves the stage less; contact `stack`."""
    wide = Stack(blocking_force=2 * 833.0)
    moved = [analyze(level="continuum", stack=stack)["jacobian"][2, 0] for stack in (TOKIN, wide)]
    locked = analyze(level="continuum", plate=LOCKED)["jacobian"][2, 0]
    assert abs(moved[0]) > abs(moved[1]) > abs(locked)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"causality": "force"}, "causality is force, but the modes of level continuum are those of a stage on its"),
        ({"design": Design(stiffness=(3e7, 0, 0, 0, 3e7, 0, 0, 0, 3e7))}, "stiffness is given, but at level continuum"),
        ({"design": Design("measured")}, "kinematics 'measured' is a Jacobian without link dimensions"),
        ({"design": Design("calibrated")}, "outline.slot_face is 1 mm, expected more than 15.339 mm"),
        ({"plate": Plate("glued")}, "contact is 'glued'"),
        ({"plate": Plate(bolts="loose")}, "bolts is 'loose'"),
        ({"mesh": 1e-3}, "mesh is 0.001 m, expected 1e-05 to 0.00025 m"),
        ({"mesh": float("nan")}, "mesh is nan m, expected"),
    ],
    ids=["causality", "matrix", "measured", "calibrated", "contact", "bolts", "mesh", "nan"],
)
def test_what_it_cannot_do_is_refused(arguments, words):
    with pytest.raises(ModelError) as refusal:
        rrr_stage(level="continuum", **arguments)
    assert words in str(refusal.value)


def test_a_mesh_at_a_level_without_one_is_refused():
    for level in ("jacobian", "constant_jacobian", "exact"):
        with pytest.raises(ModelError, match=f"mesh is 0.0001 m, but level {level} has none"):
            rrr_stage(level=level, mesh=1e-4)
    with pytest.raises(ModelError, match=r"mesh is 0\.0001 m, but level exact has none"):
        picture(level="exact", mesh=1e-4)


def test_the_field_moves_contacts_bolts_and_holes_as_they_are_held():
    """Stack 1 pushes its contact edge by its elongation, fixed holes stay, and thirds meet on their cuts."""
    plan = design("locked")
    found = field(plan, (12 * UM, 0.0, 0.0))
    third = plan.solved(SIZE).solution.mesh
    n, stage = len(third.points), plan.solved(SIZE).stage
    for leg, expected in enumerate((12 * UM, 0.0, 0.0)):
        moved = found.displacement[third.on["contact"] + leg * n]
        np.testing.assert_allclose(moved, np.tile(expected * stage.pushes[leg], (len(moved), 1)), atol=1e-16)
        assert not found.displacement[third.on["fixed"] + leg * n].any()
    where = np.round(found.points / 1e-9).astype(int)
    places, first, number = np.unique(where, axis=0, return_index=True, return_inverse=True)
    assert len(places) < len(where)
    np.testing.assert_allclose(found.displacement, found.displacement[first][number.ravel()], atol=1e-14)
    peak = analyze(level="continuum", plate=LOCKED, elongation=(12 * UM, 0.0, 0.0))["hinge_stress"]["A1"]
    assert found.stress.max() == pytest.approx(peak, rel=1e-9)


# Commands and FMU -----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_mesh_and_picture_on_the_command_line(capsys, tmp_path):
    words = ["analyze", "rrr_stage", "--level", "continuum", "--mesh", "0.25e-3"]
    assert main(words) == 0
    assert "mesh = 0.00025 m" in capsys.readouterr().out
    file = tmp_path / "stage.png"
    assert main([*words, "-p", "contact=ball", "--picture", str(file)]) == 0
    assert file.read_bytes()[:4] == b"\x89PNG"
    assert "contact ball, bolts pin, elongations 12, 0, 0 um" in capsys.readouterr().out
    assert main(["analyze", "sdelta", "--mesh", "1e-4"]) == 2
    assert "sdelta has no argument 'mesh'" in capsys.readouterr().err


def test_the_fmu_has_nothing_of_the_mesh():
    """Neither its nodes nor its libraries: a million nodes would not fit, and nothing is imported."""
    text = repr(generate(rrr_stage(level="continuum")))
    assert not any(word in text for word in ("gmsh", "skfem", "scikit"))
    assert len(text) < 2_000_000
