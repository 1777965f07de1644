"""The part `rrr_stage`: statics, rest, energy, the limit between the levels, the Bode plot, mistakes."""

import casadi as ca
import numpy as np
import pytest
from published_probes.stage import stage_base, stage_linear_statics, stage_stress

import hfsa.components
from hfsa.components import Model, ModelError
from hfsa.components._mechanics import rrr_dynamics as dynamics
from hfsa.components._mechanics.rrr_design import Design
from hfsa.components._mechanics.rrr_kinematics import CALIBRATED, NOMINAL, forward, jacobian
from hfsa.components._modelling.catalogue import find
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind
from hfsa.components.rrr_stage import analyze, rrr_stage

PARTS = find([hfsa.components])
UM = 1e-6
DYNAMIC = pytest.mark.parametrize("level", ["constant_jacobian", "exact"])
CAUSALITY = pytest.mark.parametrize("causality", ["source", "force"])
EQUAL, OPPOSED = np.array([1.0, 1.0, 1.0]), np.array([1.0, -1.0, 0.0])
BOX = 12 * UM * np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1)
POSE = ["platform/position[1]", "platform/position[2]", "platform/rotation"]


def start(model: Model, kind: Kind) -> np.ndarray:
    """Start values of a kind in the order of declaration."""
    return np.array([q.start for q in model.of(kind)])


def outputs(model: Model, x: np.ndarray, u: np.ndarray | None = None) -> dict[str, float]:
    u = start(model, Kind.INPUT) if u is None else u
    found = functions(model).out(0, x, [], u, start(model, Kind.PARAMETER))
    return dict(zip([q.name for q in model.of(Kind.OUTPUT)], np.array(found).ravel(), strict=True))


def mechanism(level: str) -> tuple[dynamics.Mechanism, dynamics.Terms]:
    built = getattr(dynamics, level)(NOMINAL, ca.SX.sym("p", 3), ca.SX.sym("v", 3))
    return built, dynamics.terms(built)


# Statics --------------------------------------------------------------------------------------------------------------


def test_levels_agree_at_rest():
    constant, exact = (analyze(level=level) for level in ("constant_jacobian", "exact"))
    for key in ("inertia", "stiffness", "jacobian", "natural_frequencies_hz", "natural_frequencies_bonded_hz"):
        np.testing.assert_allclose(constant[key], exact[key], rtol=1e-9, err_msg=key)
    np.testing.assert_allclose(constant["jacobian"], jacobian("nominal"), rtol=1e-10)
    np.testing.assert_allclose(constant["range"], analyze(level="jacobian")["range"], rtol=1e-12)
    np.testing.assert_allclose(constant["range"], np.ptp(jacobian("nominal") @ BOX, axis=1), rtol=1e-12)


@DYNAMIC
def test_a_moving_base_couples_alike_at_both_levels(level):
    built, terms = mechanism(level)
    to_stacks = ca.jacobian(built.elongation, built.coordinates)
    G = ca.Function("G", [built.coordinates], [ca.inv(to_stacks).T @ terms.base])(0)
    np.testing.assert_allclose(np.array(G), stage_base(), rtol=1e-10)


@DYNAMIC
def test_full_voltage_does_not_reach_12_um(level):
    """And voltages are those of linear statics to 0.3 %, the curvature of the hinges' force."""
    linear = stage_linear_statics()
    one = analyze(level=level, elongation=(12e-6, 0.0, 0.0))["voltage"]
    every = analyze(level=level, elongation=(12e-6, 12e-6, 12e-6), voltage=(150.0, 150.0, 150.0))
    np.testing.assert_allclose(one[0], linear["one"], rtol=3e-3)
    np.testing.assert_allclose(every["voltage"], linear["all"], rtol=3e-3)
    np.testing.assert_allclose(every["elongation_at_voltage"], linear["at_150"], rtol=3e-3)
    assert every["elongation_at_voltage"].max() < 12e-6


@DYNAMIC
@pytest.mark.parametrize("kinematics", ["nominal", "calibrated"])
def test_another_stack_is_in_frequencies_volts_and_rest(level, kinematics):
    """M + m 1 and K + k 1 give the modes; k l + H = alpha V holds at rest, and wherever volts are asked for."""
    k, force, mass = 125e6, 2000.0, 4e-3
    words = {"stack.stiffness": "125e6", "stack.tip_mass": "4e-3", "stack.full_voltage": "200"}
    found = PARTS["rrr_stage"].analysis(level, design=Design(kinematics), voltage="30,60,190", **words)
    K, M, one = found["stiffness"], found["inertia"], np.eye(3)
    omega = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M + mass * one, K + k * one)).real))
    np.testing.assert_allclose(2 * np.pi * found["natural_frequencies_bonded_hz"], omega, rtol=1e-9)
    rest = found["elongation_at_voltage"]
    held = analyze(level=level, design=Design(kinematics), elongation=tuple(rest.tolist()))["force"]
    np.testing.assert_allclose(held + k * rest, force / 200 * np.array([30, 60, 190]), rtol=1e-9)
    at_rest = {"elongation": tuple(rest.tolist()), "level": level, "kinematics": kinematics}
    volts = PARTS["rrr_stage"].analysis(**at_rest, **words)["voltage"]
    np.testing.assert_allclose(volts, [30, 60, 190], rtol=1e-9)
    assert not found["saturated"].any()


@DYNAMIC
def test_half_voltage_rests_at_the_static_point(level):
    """The one of linear statics, which the curvature of the hinges' force moves by less than 0.1 %."""
    found = analyze(level=level, voltage=(75.0, 75.0, 75.0))["elongation_at_voltage"]
    np.testing.assert_allclose(found, stage_linear_statics()["at_75"], rtol=1e-3)
    again = analyze(level=level, elongation=tuple(found.tolist()))
    np.testing.assert_allclose(again["voltage"], 75, rtol=1e-9)


@DYNAMIC
def test_a_voltage_outside_the_range_saturates_and_says_so(level):
    found = analyze(level=level, voltage=(200.0, 75.0, -3.0))
    limited = analyze(level=level, voltage=(150.0, 75.0, 0.0))
    assert found["saturated"].tolist() == [1, 0, 1]
    assert limited["saturated"].tolist() == [0, 0, 0]
    assert found["elongation_at_voltage"].tolist() == limited["elongation_at_voltage"].tolist()


@DYNAMIC
def test_the_pose_at_a_voltage_is_that_of_its_elongations(level):
    found = analyze(level=level, voltage=(75.0, 20.0, 0.0))
    there = analyze(level=level, elongation=tuple(found["elongation_at_voltage"].tolist()))
    np.testing.assert_allclose(found["pose_at_voltage"], there["pose"], rtol=1e-9)


@pytest.mark.parametrize(("elongation", "warns"), [((12, 0, 0), 0), ((12, 12, 12), 1), ((12, 12, 0), 1)])
def test_a_hinge_that_bends_too_much_warns(elongation, warns):
    found = outputs(rrr_stage(), np.array([*elongation, 0, 0, 0]) * UM)
    assert found["hinge.stress"] == pytest.approx(stage_stress([x * UM for x in elongation]), rel=2e-3)
    assert found["hinge.overload"] == warns


# Motion ---------------------------------------------------------------------------------------------------------------


@DYNAMIC
@CAUSALITY
def test_rest_stays_rest_to_the_last_bit(level, causality):
    model = rrr_stage(level=level, causality=causality)
    x, u = start(model, Kind.STATE), start(model, Kind.INPUT)
    assert not np.array(functions(model).rhs(0, x, [], u, start(model, Kind.PARAMETER))).any()
    assert not any(outputs(model, x).values())


@DYNAMIC
def test_without_damping_energy_is_kept(level):
    """The power into T + P vanishes along the motion, at points of large and fast motion."""
    model = rrr_stage(level=level, causality="force")
    model.set_start("damping_time", 0.0)
    built, terms = mechanism(level)
    p, v = built.coordinates, built.rates
    energy = v.T @ terms.mass @ v / 2 + dynamics.potential(built)
    slope = ca.Function("slope", [p, v], [ca.gradient(energy, p), ca.gradient(energy, v)])
    rng = np.random.default_rng(1)
    for _ in range(5):
        at, rates = np.array([q.nominal for q in model.of(Kind.STATE)]).reshape(2, 3) * 10 * rng.standard_normal((2, 3))
        rhs = functions(model).rhs(0, [*at, *rates], [], start(model, Kind.INPUT), start(model, Kind.PARAMETER))
        shares = np.array(ca.vertcat(*slope(at, rates))).ravel() * np.array(rhs).ravel()
        assert abs(shares.sum()) < 1e-10 * np.abs(shares).max()


@DYNAMIC
def test_platform_rates_are_the_derivatives_of_its_pose(level):
    """Position, velocity and acceleration outputs, along the motion at one point."""
    model = rrr_stage(level=level)
    made, parameters = functions(model), start(model, Kind.PARAMETER)
    x = np.array([q.nominal for q in model.of(Kind.STATE)]) * [3, -2, 1, 2, 1, -3]
    u = np.array([q.nominal for q in model.of(Kind.INPUT)])
    rhs = np.array(made.rhs(0, x, [], u, parameters)).ravel()
    still = [np.zeros(n) for n in (1, 0, len(u), len(parameters))]
    slope = made.fwd(0, x, [], u, parameters, still[0], rhs, still[1], still[2], still[3])[1]
    slope = dict(zip([q.name for q in model.of(Kind.OUTPUT)], np.array(slope).ravel(), strict=True))
    found = outputs(model, x, u)
    pairs = [(f"platform.position[{i}]", f"platform.velocity[{i}]") for i in (1, 2)]
    pairs += [(f"platform.velocity[{i}]", f"platform.acceleration[{i}]") for i in (1, 2)]
    pairs += [("platform.rotation", "platform.angular_velocity")]
    pairs += [("platform.angular_velocity", "platform.angular_acceleration")]
    pairs += [(f"stack[{i}].elongation", f"stack[{i}].elongation_rate") for i in (1, 2, 3)]
    for quantity, rate in pairs:
        assert slope[quantity] == pytest.approx(found[rate], rel=1e-9), quantity


def test_exact_tends_to_constant_jacobian_with_second_order():
    """Every output, as elongations, rates and forces get smaller together; the inertia with first order."""
    models = {level: rrr_stage(level=level, causality="force") for level in ("constant_jacobian", "exact")}

    def differences(size):
        elongation, rate = size * np.array([4e-6, 1.2e-6, 2.4e-6]), size * np.array([1e-2, -5e-3, 8e-3])
        J = analyze(level="exact", elongation=tuple(elongation.tolist()))["jacobian"]
        states = {
            "constant_jacobian": np.array([*elongation, *rate]),
            "exact": np.array([*forward(NOMINAL, elongation.tolist()), *(J @ rate)]),
        }
        u = size * np.array([100.0, -50.0, 70.0, 3.0, -2.0, 0.1, 0.5, -0.4])
        found = {level: outputs(model, states[level], u) for level, model in models.items()}
        names = [name for name in found["exact"] if name.startswith(("platform", "hinge.angle", "hinge.stress"))]
        return np.array([found["exact"][name] - found["constant_jacobian"][name] for name in names])

    np.testing.assert_allclose(differences(1) / differences(0.5), 4, rtol=0.01)

    def statics(size):
        at = tuple(size * np.array([1.0, 0.3, 0.6]))
        numbers = [analyze(level=level, elongation=at) for level in ("constant_jacobian", "exact")]
        return np.array([np.linalg.norm(numbers[0][key] - numbers[1][key]) for key in ("force", "inertia")])

    np.testing.assert_allclose(statics(4e-6) / statics(2e-6), [4, 2], rtol=0.02)


def test_levels_differ_as_stated_within_the_box():
    at = [analyze(level=level, elongation=(12e-6,) * 3) for level in ("constant_jacobian", "exact")]
    for key, bound in (("inertia", 0.007), ("force", 0.004)):
        assert np.abs(at[1][key] / at[0][key] - 1).max() < bound


def test_source_causality_is_force_causality_with_the_stack_outside():
    """The same accelerations when the stack's force, as the source stage puts it out, drives the other stage."""
    source, force = rrr_stage(causality="source"), rrr_stage(causality="force")
    x = np.array([3e-6, -1e-6, 2e-6, 1e-3, 2e-3, -1e-3])
    u = np.array([100.0, -50.0, 70.0, 3.0, -2.0, 0.1, 0.5, -0.4])
    inside = outputs(source, x, u)
    outside = outputs(force, x, np.array([*[inside[f"stack[{i}].force"] for i in (1, 2, 3)], *u[3:]]))
    for name, value in outside.items():
        assert value == pytest.approx(inside[name], rel=1e-9), name


@DYNAMIC
def test_a_stack_that_would_have_to_pull_says_so(level):
    """A base that accelerates lifts the platform off a stack; a preload keeps it there, and noise is no lift."""
    model = rrr_stage(level=level)
    names = np.array([q.name for q in model.of(Kind.INPUT)])

    def lost(name: str, value: float) -> list[float]:
        found = outputs(model, start(model, Kind.STATE), value * (names == name))
        return [found[f"stack[{i}].contact_lost"] for i in (1, 2, 3)]

    assert lost("stack[1].blocking_force", 100.0)[0] == 0
    assert lost("wrench.torque", 0.0) == lost("wrench.torque", 1e-7) == lost("wrench.torque", -1e-7) == [0, 0, 0]
    assert lost("wrench.torque", 1.0) != lost("wrench.torque", -1.0)
    assert 0 < sum(lost("base.acceleration[1]", 1e3)) < 3
    model.set_start("stack.preload", 100.0)
    assert lost("base.acceleration[1]", 1e3) == [0, 0, 0]


def test_jacobian_level_follows_the_elongations():
    model = rrr_stage(level="jacobian", design=Design("measured"))
    u = np.arange(1.0, 10.0)
    found = np.array(list(outputs(model, np.zeros(0), u).values()))
    J = jacobian("measured")
    np.testing.assert_allclose(found, np.concatenate([J @ u[:3], J @ u[3:6], J @ u[6:]]), rtol=1e-14)


def test_calibrated_links_change_the_stage():
    np.testing.assert_allclose(analyze(design=Design("calibrated"))["jacobian"], CALIBRATED.jacobian)
    frequencies = analyze(design=Design("calibrated"), level="exact")["natural_frequencies_hz"]
    np.testing.assert_allclose(frequencies, analyze(design=Design("calibrated"))["natural_frequencies_hz"], rtol=1e-9)
    assert np.abs(frequencies / analyze()["natural_frequencies_hz"] - 1).min() > 0.05


# Bode plot ------------------------------------------------------------------------------------------------------------


@DYNAMIC
@pytest.mark.parametrize(
    ("causality", "direction", "resonance", "height"),
    [
        ("source", EQUAL, 2225.2, 30),
        ("source", OPPOSED, 904.65, 38),
        ("force", EQUAL, 1334.7, 26),
        ("force", OPPOSED, 529.05, 34),
    ],
)
def test_bode_plot_is_as_the_docstring_says(level, causality, direction, resonance, height):
    system = linearize(rrr_stage(level=level, causality=causality))
    port = "blocking_force" if causality == "source" else "force"
    columns = [system.input_labels.index(f"stack[{i}]/{port}") for i in (1, 2, 3)]
    rows = [system.output_labels.index(name) for name in POSE]

    def response(frequency):
        inside = np.linalg.solve(2j * np.pi * frequency * np.eye(6) - system.A, system.B[:, columns] @ direction)
        return np.abs(system.C[rows] @ inside)

    moved, unmoved = ([2], [0, 1]) if direction is EQUAL else ([0, 1], [2])
    size = {f: np.linalg.norm(response(f)[moved]) for f in (0, 0.99 * resonance, resonance, 1.01 * resonance)}
    assert 20 * np.log10(size[resonance] / size[0]) == pytest.approx(height, abs=0.5)
    assert size[resonance] > max(size[0.99 * resonance], size[1.01 * resonance])
    # Lengths against angles: a corner of the platform is 30 mm from its centre.
    scale = np.array([1, 1, NOMINAL.radius])
    both = response(100.0) * scale
    assert both[unmoved].max() < 1e-9 * both[moved].max()
    assert response(2e4)[moved] / response(2e5)[moved] == pytest.approx(100, rel=0.03)
    if causality == "source" and direction is EQUAL:
        assert size[0] == pytest.approx(2.2e-6, rel=0.02)


# Mistakes -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"level": "exacct"}, "level is 'exacct'; did you mean exact"),
        ({"causality": "forces"}, "causality is 'forces'; did you mean force"),
        (
            {"design": Design("measured")},
            "without link dimensions and valid at level jacobian only",
        ),
        ({"design": Design("nominall")}, "kinematics is 'nominall'; did you mean nominal"),
        ({"voltage": (0.0, float("nan"), 0.0)}, "voltage is .* V, expected three finite numbers"),
        ({"elongation": (0.0, float("inf"), 0.0)}, "elongation is .* m, expected three finite numbers"),
        ({"level": "exact", "elongation": (0.02, 0.0, 0.0)}, "no pose has the elongations .* reach 0 to 12e-6 m"),
        ({"elongation": (0.02, 0.0, 0.0)}, "no pose has the elongations"),
    ],
)
def test_mistakes_are_named(arguments, message):
    with pytest.raises(ModelError, match=message):
        analyze(**arguments)
