"""The part `beam_stage`: its modes by another eigenproblem, rest, base, damping, Bode plot, warning, mistakes."""

import casadi as ca
import numpy as np
import pytest
import scipy.linalg
from parts_by_name import part

from hfsa.components import Model, ModelError
from hfsa.components._mechanics.beam_kinds import KINDS
from hfsa.components._mechanics.rigid_body import Body
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind

PART = part("beam_stage")
analyze, beam_stage = PART.analysis, PART.model
KIND = pytest.mark.parametrize("kind", KINDS)
E, G, LENGTH, DIAMETER, RADIUS = 69e9, 26e9, 0.05, 2e-3, 0.03
OFF_CENTRE = Body(0.3, (2e-4, 1e-4, 3e-4), (0.01, -0.02, 0.03))


def response(system, frequency: float, input_name: str, output_name: str) -> complex:
    row, column = (
        labels.index(name.replace(".", "/"))
        for labels, name in ((system.output_labels, output_name), (system.input_labels, input_name))
    )
    inside = np.linalg.solve(2j * np.pi * frequency * np.eye(system.nstates) - system.A, system.B[:, column])
    return complex(system.C[row] @ inside + system.D[row, column])


def outputs(model: Model, x: list[float], u: list[float]) -> dict[str, float]:
    parameters = [q.start for q in model.of(Kind.PARAMETER)]
    found = np.array(functions(model).out(0.0, x, [], u, parameters)).ravel()
    return dict(zip([q.name for q in model.of(Kind.OUTPUT)], found, strict=True))


def three_beams_by_hand() -> np.ndarray:
    """K of three round beams from the deflection of each, translations before rotations."""
    area, moment = np.pi * DIAMETER**2 / 4, np.pi * DIAMETER**4 / 64
    across, tip, turn = 12 * E * moment / LENGTH**3, 6 * E * moment / LENGTH**2, 4 * E * moment / LENGTH
    stretch = E * area / LENGTH
    # A turn about Y or Z stretches the beams by their distance from it: r^2 / 2 on average
    K = np.diag([stretch, across, across, 0.0, turn + stretch * RADIUS**2 / 2, turn + stretch * RADIUS**2 / 2])
    K[3, 3] = 2 * G * moment / LENGTH + across * RADIUS**2
    K[1, 5] = K[5, 1] = -tip
    K[2, 4] = K[4, 2] = tip
    return 3 * K


def test_natural_frequencies_by_another_eigenproblem():
    M = np.diag([0.1, 0.1, 0.1, 4.5e-5, 2.25e-5, 2.25e-5])
    expected = np.sqrt(scipy.linalg.eigh(three_beams_by_hand(), M, eigvals_only=True)) / (2 * np.pi)
    np.testing.assert_allclose(analyze()["natural_frequencies_hz"], expected, rtol=1e-9)
    poles = linearize(beam_stage(), {"damping_ratio": 0.0}).poles()
    np.testing.assert_allclose(np.sort(np.abs(poles))[::2] / (2 * np.pi), expected, rtol=1e-6)


def test_mass_off_the_reference_point_has_the_energy_of_its_own_motion():
    v, w = np.array([0.3, -0.2, 0.5]), np.array([2.0, 1.0, -3.0])
    center = v + np.cross(w, OFF_CENTRE.center)
    energy = 0.3 * center @ center / 2 + w @ (np.array(OFF_CENTRE.inertia) * w) / 2
    twist = np.concatenate([v, w])
    assert twist @ analyze(platform=OFF_CENTRE)["mass"] @ twist / 2 == pytest.approx(energy)


@KIND
@pytest.mark.parametrize("ratio", [0.01, 0.2])
def test_every_mode_has_the_damping_ratio(kind, ratio):
    system = linearize(beam_stage(kind=kind, platform=OFF_CENTRE), {"damping_ratio": ratio})
    poles = system.poles()
    np.testing.assert_allclose(-poles.real / np.abs(poles), ratio, rtol=1e-5)
    frequencies = analyze(kind=kind, platform=OFF_CENTRE)["natural_frequencies_hz"]
    np.testing.assert_allclose(np.sort(np.abs(poles))[::2] / (2 * np.pi), frequencies, rtol=1e-5)


@KIND
def test_a_load_at_rest_bends_it_by_the_compliance(kind):
    found = analyze(kind=kind)
    system = linearize(beam_stage(kind=kind))
    q = system.C[:6] @ -np.linalg.solve(system.A, system.B[:, :6])
    np.testing.assert_allclose(found["stiffness"] @ q, np.eye(6), atol=1e-8)


def test_rates_are_derivatives_and_the_base_leaves_what_is_light_behind():
    system = linearize(beam_stage(platform=OFF_CENTRE))
    for first, second in (("position", "velocity"), ("rotation", "angular_velocity")):
        for column in ("wrench.force[2]", "base.angular_acceleration[3]"):
            moved, speed = (response(system, 70.0, column, f"platform.{name}[1]") for name in (first, second))
            assert speed == pytest.approx(2j * np.pi * 70.0 * moved)
    for name in ("acceleration", "angular_acceleration"):
        assert response(system, 1e7, f"base.{name}[2]", f"platform.{name}[2]") == pytest.approx(-1, rel=1e-4)


def test_an_accelerated_base_is_a_force_on_the_mass():
    system, M = linearize(beam_stage(platform=OFF_CENTRE)), analyze(platform=OFF_CENTRE)["mass"]
    np.testing.assert_allclose(system.B[:, 6:], -system.B[:, :6] @ M, atol=1e-9)


def test_bode_plot():
    """The sentence of the part's docstring."""
    system = linearize(beam_stage())

    def level(frequency: float, input_name: str, output_name: str) -> float:
        return 20 * np.log10(abs(response(system, frequency, input_name, output_name)))

    side, turn = "platform.position[2]", "platform.rotation[3]"
    for source, target, static, peak in (
        ("wrench.force[1]", "platform.position[1]", 7.69e-8, 1815.1),
        ("wrench.torque[1]", "platform.rotation[1]", 6.06e-2, 96.36),
        ("wrench.force[2]", side, 6.42e-5, 62.82),
    ):
        low = level(1e-3, source, target)
        assert 10 ** (low / 20) == pytest.approx(static, rel=1e-3)
        assert level(peak, source, target) - low == pytest.approx(34, abs=0.1)
        assert level(5 * peak, source, target) - level(20 * peak, source, target) == pytest.approx(24.1, abs=0.4)
    assert 10 ** (level(1e-3, "wrench.force[2]", turn) / 20) == pytest.approx(4.27e-6, rel=1e-3)
    for peak in (62.82, 2569.8):
        beside = [level(peak * shift, "wrench.force[2]", turn) for shift in (0.9, 1.1)]
        assert level(peak, "wrench.force[2]", turn) > max(beside) + 15
    for other in ("position[1]", "position[3]", "rotation[1]", "rotation[2]"):
        assert abs(response(system, 50.0, "wrench.force[2]", f"platform.{other}")) < 1e-18
    for target in (side, turn):
        pushed, shaken = (level(40.0, source, target) for source in ("wrench.force[2]", "base.acceleration[2]"))
        assert pushed - shaken == pytest.approx(20)


@pytest.mark.parametrize(
    ("entry", "value", "expected", "warned"),
    [(0, 4e-3, 0.08, 0), (2, -6e-3, 0.12, 1), (4, -0.09, 0.09, 0), (5, 0.11, 0.11, 1)],
)
def test_a_displacement_above_a_tenth_is_warned_of(entry, value, expected, warned):
    model = beam_stage()
    names = [q.name for q in model.of(Kind.STATE)]
    x = [0.0] * len(names)
    half, i = divmod(entry, 3)
    x[names.index(f"center.{('position', 'rotation')[half]}[{i + 1}]")] = value
    found = outputs(model, x, [0.0] * 12)
    assert found["displacement"] == pytest.approx(expected)
    assert found["displacement_warning"] == warned


def test_it_is_linear_and_rests_at_rest():
    model = beam_stage(kind="double_tilted")
    assert not any(outputs(model, [0.0] * 12, [0.0] * 12).values())
    rates = ca.vertcat(*[model.der[q.name] for q in model.of(Kind.STATE)])
    states = model.symbols(Kind.STATE)
    assert not ca.depends_on(ca.jacobian(rates, states), states)


def test_a_stage_of_other_beams():
    given = {"kind": "tilted", "tilt": "30", "dimensions.side": "3e-3", "material.E": "2e11", "material.nu": "0.3"}
    assert PART.analysis(**given)["natural_frequencies_hz"][0] > analyze()["natural_frequencies_hz"][0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"platform.mass": 0}, "platform has mass 0 kg.*mass and inertia above 0"),
        ({"platform.inertia": "1e-5,-1e-5,1e-5"}, "inertia .*expected"),
        ({"dimensions.length": 0}, "dimensions.length is 0 m, expected above 0"),
        ({"dimensions.diameter": 0.01}, "slenderness d .* is 400, expected at least 1200"),
        ({"kind": "double_tilted", "tilt": 0}, "tilt is 0 degrees, expected above 0"),
        ({"kind": "three_beams"}, "kind is 'three_beams', expected one of three_beam"),
        ({"length_error": "0,0"}, "length_error has 2 values, expected 3"),
    ],
)
def test_mistakes_are_named(arguments, message):
    with pytest.raises(ModelError, match=message):
        PART.model(**arguments)
