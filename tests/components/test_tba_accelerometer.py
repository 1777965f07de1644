"""The part `tba_accelerometer`: numbers at home, rest, energy, limits between the levels, Bode plot, mistakes."""

from functools import cache

import casadi as ca
import numpy as np
import pytest
from published_probes.accelerometer import accelerometer_on_a_shaker

import hfsa.components
from hfsa.components import Model, ModelError
from hfsa.components._mechanics import tba_design as designs
from hfsa.components._mechanics.polygon import polygon_area, torsion_constant
from hfsa.components._mechanics.tba_base import Mounting
from hfsa.components._modelling.catalogue import find
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind
from hfsa.components.tba_accelerometer import GRAVITY, analyze, tba_accelerometer

PART = find([hfsa.components])["tba_accelerometer"]
DESIGN = pytest.mark.parametrize("design", designs.DESIGNS)
LEVEL = pytest.mark.parametrize("level", PART.levels)
DYNAMIC = pytest.mark.parametrize("level", PART.levels[1:])
INPUTS = ("acceleration", "angular_velocity", "angular_acceleration", "rotation")
SIGNALS = 15
"""Number of inputs: three of each of these and the force on the proof mass."""
TILTED = Mounting(rotation=(0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6), lever=(0.03, -0.01, 0.02))


def start(model: Model, kind: Kind) -> np.ndarray:
    return np.array([q.start for q in model.of(kind)])


def outputs(model: Model, x: np.ndarray, u: np.ndarray, time: float = 0.0) -> dict[str, float]:
    found = functions(model).out(time, x, [], u, start(model, Kind.PARAMETER))
    return dict(zip([q.name for q in model.of(Kind.OUTPUT)], np.array(found).ravel(), strict=True))


@cache
def linear(level: str = "spatial", gravity: float = 0.0, undamped: bool = False, **arguments):
    """The linearisation at home."""
    model = tba_accelerometer(level=level, **arguments)
    ratios = [f"damping_ratio.{plane}" for plane in ("in_plane", "out_of_plane")] if undamped else []
    return linearize(model, {"gravity": gravity, **dict.fromkeys(ratios, 0.0)})


def response(system, frequency: float, input_name: str, output_name: str) -> complex:
    """Of a linearisation, from and to signals by name."""
    column = system.input_labels.index(input_name.replace(".", "/"))
    row = system.output_labels.index(output_name.replace(".", "/"))
    inside = np.linalg.solve(2j * np.pi * frequency * np.eye(system.nstates) - system.A, system.B[:, column])
    return complex(system.C[row] @ inside + system.D[row, column])


# Numbers at home ------------------------------------------------------------------------------------------------------


def test_springs_in_series_are_softer_out_of_the_plane():
    """By a third, and the same in the plane."""
    series, published = (analyze(k_out_rule=rule)["stiffness"] for rule in ("plus", "minus"))
    assert 0.65 < series[2] / published[2] < 0.7
    assert np.array_equal(series[:2], published[:2])


@DESIGN
def test_the_flat_band_is_the_stated_share_of_the_natural_frequency(design):
    found = analyze(design=design)
    shares = found["bandwidth_hz"] / found["natural_frequencies_hz"][0]
    np.testing.assert_allclose(1 / (1 - shares**2), [1.01, 1.05, 1.1])
    assert found["frequency_ratio"] == found["natural_frequencies_hz"][2] / found["natural_frequencies_hz"][0]


def test_a_base_drives_more_than_the_modal_mass():
    """2.4 % more for mems, up to 4 % for the others."""
    shares = [analyze(design=d)["driven_mass"] / analyze(design=d)["mass"][0] - 1 for d in designs.DESIGNS]
    assert 0.023 < min(shares) < max(shares) < 0.04


def test_sensitivities_are_the_slopes_of_the_frequency_ratio():
    """By central differences; the powers of all lengths add up to none, for a ratio knows no unit."""
    found = analyze()["sensitivity"]
    assert list(found) == [*"asebcd", "tm", "l", "w"]
    for name, slope in found.items():
        value, step = getattr(designs.DESIGNS["mems"].shape, name), 1e-5
        ratios = [
            PART.analysis(**{f"dimensions.{name}": value * (1 + sign * step)})["frequency_ratio"] for sign in (1, -1)
        ]
        assert slope == pytest.approx(np.log(ratios[0] / ratios[1]) / (2 * step), abs=1e-8), name
    assert sum(found.values()) == pytest.approx(0, abs=1e-12)


def test_the_optimums_stiffness_follows_its_dimensions_as_the_formulas_do():
    as_designed = analyze(design="optimum")
    thicker = PART.analysis(design="optimum", **{"dimensions.tm": "33e-6"})
    ratio = thicker["formula_stiffness"] / as_designed["formula_stiffness"]
    np.testing.assert_allclose(thicker["stiffness"] / as_designed["stiffness"], ratio, rtol=1e-12)
    assert ratio[0] == pytest.approx(1.1**3)


def test_other_feet_would_give_the_optimum_its_stiffness_by_finite_elements():
    """15.2 um thick and 59.5 um long, where table 2 has 30 and 94.051 um; with these the formulas come to 1.51."""
    feet = PART.analysis(design="optimum", **{"dimensions.tm": "15.2e-6", "dimensions.l": "59.5e-6"})
    np.testing.assert_allclose(feet["formula_stiffness"], analyze(design="optimum")["stiffness"], rtol=0.015)
    assert feet["formula_frequency_ratio"] == pytest.approx(2.88, abs=0.01)
    assert analyze(design="optimum")["frequency_ratio"] == pytest.approx(2.88, abs=0.01)


# Rest and response ----------------------------------------------------------------------------------------------------


@LEVEL
@DESIGN
def test_rest_stays_rest_to_the_last_bit(level, design):
    model = tba_accelerometer(level=level, design=design, mounting=TILTED)
    x, u = start(model, Kind.STATE), start(model, Kind.INPUT)
    assert not np.array(functions(model).rhs(0, x, [], u, start(model, Kind.PARAMETER))).any()
    assert not any(outputs(model, x, u).values())


@LEVEL
def test_nothing_feeds_through_but_at_level_static(level):
    D = linearize(tba_accelerometer(level=level)).D
    assert D.any() == (level == "static")
    assert functions(tba_accelerometer(level=level)).is_linear == (level != "nonlinear")


@DYNAMIC
@DESIGN
def test_response_is_that_of_the_stated_equation(level, design):
    """-Gamma / (M s^2 + D s + K) along each axis, up to twice the natural frequency."""
    system, found = linear(level, design=design), analyze(design=design)
    inside, out = designs.DESIGNS[design].damping_ratio
    for axis in range(2 if level == "planar" else 3):
        M, K = found["mass"][axis], found["stiffness"][axis]
        for share in (0.1, 1.0, 2.0):
            frequency = share * found["natural_frequencies_hz"][axis]
            s = 2j * np.pi * frequency
            stated = -found["driven_mass"] / (M * s**2 + 2 * (inside, inside, out)[axis] * np.sqrt(K * M) * s + K)
            got = response(system, frequency, f"base.acceleration[{axis + 1}]", f"proof_mass.position[{axis + 1}]")
            assert got == pytest.approx(stated, rel=1e-6)


@LEVEL
def test_a_platform_that_shakes_by_a_micrometre_at_50_hz(level):
    """The published displacement at every level but the static one, which is 0.007 % less."""
    amplitude = 1e-6 * (100 * np.pi) ** 2
    moved = amplitude * abs(response(linear(level), 50, "base.acceleration[1]", "proof_mass.position[1]"))
    assert moved / accelerometer_on_a_shaker() == pytest.approx(0.999926 if level == "static" else 1, abs=1e-6)


@pytest.mark.parametrize(
    ("design", "resonance", "height"), [("mems", 5818.9, 40), ("optimum", 881.0, 40), ("rapid_prototype", 251.9, 24)]
)
@DYNAMIC
def test_bode_plot_is_as_the_docstring_says(level, design, resonance, height):
    system = linear(level, design=design)

    def estimate(frequency, axis=1):
        return response(system, frequency, "base.acceleration[1]", f"acceleration_estimate[{axis}]")

    assert estimate(resonance / 1e4) == pytest.approx(1, abs=1e-4)
    at, beside = abs(estimate(resonance)), [abs(estimate(share * resonance)) for share in (0.95, 1.05)]
    assert 20 * np.log10(at) == pytest.approx(height, abs=0.5)
    assert at > 2 * max(beside) or design == "rapid_prototype"
    assert at > max(beside)
    assert abs(estimate(20 * resonance) / estimate(200 * resonance)) == pytest.approx(100, rel=0.01)
    assert abs(np.angle(estimate(200 * resonance), deg=True)) == pytest.approx(180, abs=0.1)
    assert abs(estimate(resonance, axis=2)) < 1e-12 * at


@pytest.mark.parametrize("level", ["spatial", "nonlinear"])
def test_bode_plot_out_of_the_plane_is_as_the_docstring_says(level):
    system = linear(level)

    def moved(frequency):
        return abs(response(system, frequency, "base.acceleration[3]", "proof_mass.position[3]"))

    assert moved(1.0) == pytest.approx(1.60e-10, abs=5e-13)
    assert 20 * np.log10(moved(13063.9) / moved(1.0)) == pytest.approx(28, abs=0.5)
    assert moved(13063.9) > max(moved(13063.9 * 0.98), moved(13063.9 * 1.02))


@pytest.mark.parametrize("axis", [1, 3])
def test_damping_by_films_is_that_of_analyze(axis):
    """The resonance is 1 / (2 zeta) high, zeta by one gap; a wider gap damps less."""
    for gap in (None, 20e-6):
        system, found = linear(damping="film", gap=gap), analyze(gap=gap)
        zeta = found["film_damping_ratio"]["in_plane" if axis == 1 else "out_of_plane"]
        still, at = (
            response(system, frequency, f"base.acceleration[{axis}]", f"proof_mass.position[{axis}]")
            for frequency in (0.0, found["natural_frequencies_hz"][axis - 1])
        )
        assert abs(at / still) == pytest.approx(1 / (2 * zeta), rel=1e-6)
    ratios = [analyze(gap=gap)["film_damping"] for gap in (10e-6, 20e-6)]
    assert ratios[0]["in_plane"] / ratios[1]["in_plane"] == pytest.approx(2)
    assert ratios[0]["out_of_plane"] / ratios[1]["out_of_plane"] == pytest.approx(8)


# Limits between the levels --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments",
    [
        {},
        {"design": "optimum"},
        {"mass": (4e-6, 4.1e-6, 3e-6), "driven_mass": 5e-6},
        {"limbs": 4},
        {"limbs": 7, "design": "optimum"},
    ],
    ids=["mems", "optimum", "masses", "four limbs", "seven limbs"],
)
def test_nonlinear_is_spatial_to_first_order(arguments):
    """All matrices, with a tilted mounting and a lever arm."""
    systems = [linear(level, mounting=TILTED, **arguments) for level in ("spatial", "nonlinear")]
    for name in "ABCD":
        exact, found = (getattr(system, name) for system in systems)
        np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-12 * np.abs(exact).max(initial=0), err_msg=name)


def test_nonlinear_tends_to_spatial_with_second_order():
    """The acceleration of the proof mass, as displacement, rate and everything the base does get smaller together."""
    models = [tba_accelerometer(level=level, mounting=TILTED) for level in ("spatial", "nonlinear")]
    rng = np.random.default_rng(5)
    x = rng.standard_normal(6) * [q.nominal for q in models[0].of(Kind.STATE)] * 1e3
    u = rng.standard_normal(SIGNALS) * [q.nominal for q in models[0].of(Kind.INPUT)] * 1e3

    def difference(size: float) -> np.ndarray:
        rhs = [functions(m).rhs(0, size * x, [], size * u, start(m, Kind.PARAMETER)) for m in models]
        return np.array(rhs[1] - rhs[0]).ravel()[3:]

    np.testing.assert_allclose(difference(1.0) / difference(0.5), 4, rtol=0.03)


def test_spatial_is_planar_in_the_plane():
    planar, spatial = (linear(level, mounting=TILTED) for level in ("planar", "spatial"))
    for output in ("proof_mass.position[1]", "proof_mass.position[2]", "voltage[1]", "acceleration_estimate[2]"):
        for name in INPUTS:
            both = [response(system, 5000.0, f"base.{name}[2]", output) for system in (planar, spatial)]
            assert both[0] == pytest.approx(both[1], rel=1e-12)
    assert response(planar, 5000.0, "base.acceleration[3]", "proof_mass.position[3]") == 0


@DESIGN
def test_planar_tends_to_static_with_the_frequency_squared(design):
    """1, 5 and 10 % at the ends of the bands, without damping, and the square far below."""
    static, planar = (linear(level, design=design, undamped=True) for level in ("static", "planar"))
    band = analyze(design=design)["bandwidth_hz"]

    def difference(frequency: float) -> float:
        pair = [response(m, frequency, "base.acceleration[1]", "acceleration_estimate[1]") for m in (static, planar)]
        return abs(pair[1] / pair[0] - 1)

    np.testing.assert_allclose([difference(f) for f in band], [0.01, 0.05, 0.1], rtol=1e-6)
    assert difference(band[0] / 5) / difference(band[0] / 10) == pytest.approx(4, rel=1e-3)


def test_static_is_the_gain_of_analyze():
    found = analyze()["static_sensitivity"]["in_plane"]
    gain = response(linear("static"), 0.0, "base.acceleration[1]", "proof_mass.position[1]")
    assert gain.real * GRAVITY == pytest.approx(-found)
    assert response(linear("static"), 0.0, "base.acceleration[3]", "proof_mass.position[3]") == 0


# Force on the proof mass, and numbers of limbs ------------------------------------------------------------------------


@LEVEL
@DESIGN
def test_a_force_on_the_proof_mass_moves_it_by_its_stiffness(level, design):
    """Sec 5.3 with 1 N; also against gravity of the base's acceleration, Gamma a."""
    system, found = linear(level, design=design, mounting=TILTED), analyze(design=design)
    for axis in (1, 2, 3) if level in ("spatial", "nonlinear") else (1, 2):
        moved = response(system, 0.0, f"proof_mass.force[{axis}]", f"proof_mass.position[{axis}]")
        assert moved == pytest.approx(1 / found["stiffness"][axis - 1], rel=1e-9)
    frequency = 1.3 * found["natural_frequencies_hz"][0]
    Q = np.reshape(TILTED.rotation, (3, 3))
    by_base = [response(system, frequency, f"base.acceleration[{i}]", "proof_mass.position[1]") for i in (1, 2, 3)]
    by_force = response(system, frequency, "proof_mass.force[1]", "proof_mass.position[1]")
    np.testing.assert_allclose(
        by_base, -found["driven_mass"] * by_force * Q[:, 0], rtol=1e-9, atol=1e-12 * abs(by_force)
    )


def test_one_newton_moves_the_prototype_by_twice_the_printed_displacement():
    """7.59 um by the source's own stiffness of 131711 N/m; it prints 3.8721 um."""
    moved = response(linear(design="rapid_prototype"), 0.0, "proof_mass.force[1]", "proof_mass.position[1]").real
    assert moved == pytest.approx(1 / 131711, rel=1e-4)
    assert moved / 3.8721e-6 == pytest.approx(1.96, abs=0.01)


def by_hand(n: int, a: float, s: float) -> dict[str, float]:
    """Masses and stiffnesses of a polymer sensor with n limbs from the motion of each body, in the plane and out of it.

    A shift u of the proof mass turns the lower link of limb i by alpha, the upper by beta: with its links at 135 and 45
    degrees, u = h (-s135 alpha - s45 beta, c135 alpha + c45 beta) in its frame.
    """
    e, b, c, d, tm, foot_length, w, E, nu, rho = 8e-3, 20e-3, 6e-3, 4e-3, 1e-3, 3e-3, 10e-3, 2e9, 0.35, 1200.0
    angles = 2 * np.pi * np.arange(n) / n
    corners = a / (2 * np.sin(np.pi / n)) * np.array([np.cos(angles), np.sin(angles)])
    following = np.roll(corners, -1, axis=1)
    area = 0.5 * abs(np.sum(corners[0] * following[1] - following[0] * corners[1]))
    apart = (s - a) / 2 / np.tan(np.pi / n)  # of the middles of two sides, two links at 45 degrees
    h = apart / np.sqrt(2)
    leg, bar = rho * e * w * c / np.sqrt(2), rho * b * d * w
    about_z, about_x, about_y = leg / 12 * (e**2 + c**2), leg / 12 * (e**2 + w**2), leg / 12 * (w**2 + c**2)
    k = E * w * tm**3 / foot_length
    G = E / 2 / (1 + nu)
    foot, stem = (G * w * t * (w**2 + t**2) / 12 / length for t, length in ((tm, foot_length), (c / np.sqrt(2), e)))
    twist = 1 / (2 / foot + 1 / stem)
    mass, stiffness, driven = (np.diag([rho * area * w, rho * area * w]) * sign for sign in (1, 0, 1))
    for angle in angles:
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        links = h * np.array([[-np.sin(x), np.cos(x)] for x in np.radians([135, 45])]).T
        rates = np.linalg.inv(links) @ turn.T
        first, second = (np.outer(links[:, i], rates[i]) for i in (0, 1))
        for m, move, spin in [
            (bar, first, None),
            *[(leg, first / 2, rates[0])] * 2,
            *[(leg, first + second / 2, rates[1])] * 2,
        ]:
            mass = mass + m * move.T @ move + (0 if spin is None else about_z * np.outer(spin, spin))
            driven = driven + m * turn @ move
        stiffness = stiffness + 2 * k * (np.outer(rates[0], rates[0]) + np.outer(rates[1], rates[1]))
    tilt = 1 / (np.sqrt(2) * h)  # of both links, by a unit shift out of the plane
    lever = h / np.sqrt(2)
    out = rho * area * w + n * (bar * (lever * tilt) ** 2 + bar / 12 * (d**2 + w**2) * tilt**2)
    out += n * 2 * leg * ((lever / 2 * tilt) ** 2 + (3 / 2 * lever * tilt) ** 2)
    out += n * 4 * tilt**2 * (about_x + about_y) / 2  # a leg stands at 45 degrees to the axis of the tilt
    return {
        "mass": np.array([mass[0, 0], mass[1, 1], out]),
        "stiffness": np.array([stiffness[0, 0], stiffness[1, 1], n * 4 * twist * tilt**2]),
        "driven_mass": driven[0, 0],
        "skew": [mass[0, 1], stiffness[0, 1], driven[0, 1]],
        "area": area,
    }


@pytest.mark.parametrize("limbs", [3, 4, 5, 6, 9])
def test_a_sensor_with_any_number_of_limbs_is_the_sum_of_its_bodies(limbs):
    """A design that nobody published, isotropic in the plane as the source says of the triangle."""
    a, s = 50e-3, 120e-3
    expected = by_hand(limbs, a, s)
    lengths = {"a": a, "s": s, "e": 8e-3, "b": 20e-3, "c": 6e-3, "d": 4e-3, "tm": 1e-3, "l": 3e-3, "w": 10e-3}
    words = {f"dimensions.{name}": value for name, value in {**lengths, "E": 2e9, "nu": 0.35, "rho": 1200.0}.items()}
    words |= {"design": "rapid_prototype", "k_out_rule": "plus", "limbs": str(limbs)}
    found = PART.analysis(**words)
    for name in ("mass", "stiffness", "driven_mass"):
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-12, err_msg=name)
    np.testing.assert_allclose(expected["skew"], 0, atol=1e-12 * expected["driven_mass"] * expected["stiffness"][0])
    # the gas slides over the proof mass: mu A / gap
    assert found["film_damping"]["in_plane"] == pytest.approx(1.85e-5 * expected["area"] / 0.5e-3)
    model = PART.model("nonlinear", **words)
    free = linearize(model, {"damping_ratio.in_plane": 0.0, "damping_ratio.out_of_plane": 0.0})
    frequencies = np.sort(np.abs(free.poles()))[::2] / (2 * np.pi)
    np.testing.assert_allclose(frequencies, np.sort(found["natural_frequencies_hz"]), rtol=1e-9)


def test_the_film_between_polygons_is_their_torsion():
    """J of a triangle, of a square (Saint-Venant), and, for many sides, of a circle, from which it falls by area^2."""
    assert torsion_constant(2.0, 3) == pytest.approx(np.sqrt(3) / 80 * 16, rel=1e-12)
    odd = np.arange(1, 40, 2)
    square = 1 / 3 - 64 / np.pi**5 * np.sum(np.tanh(odd * np.pi / 2) / odd**5)
    assert torsion_constant(1.0, 4) == pytest.approx(square, rel=2e-7)
    assert torsion_constant(1.0, 6) == pytest.approx(0.1154 * 3**2, rel=4e-3)  # of tables, 0.1154 d^4 between flats
    shares = [torsion_constant(1.0, n) / (polygon_area(1.0, n) ** 2 / (2 * np.pi)) for n in (20, 40)]
    assert shares[0] < shares[1] < 1
    assert shares[1] > 0.9998


def test_fewer_than_three_limbs_are_refused():
    for call in (PART.analysis, PART.model, PART.design_study):
        with pytest.raises(ModelError, match="tba_accelerometer: limbs is 2, expected 3 or more, one at each side"):
            call(limbs="2")


# The base -------------------------------------------------------------------------------------------------------------


@LEVEL
def test_a_turned_and_shifted_mounting_sees_what_it_should(level):
    """Estimates of a sensor with its x along world Z and a lever along X, at rest in its frame."""
    mounting = Mounting(rotation=(0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0), lever=(0.1, 0.0, 0.0))
    axes = (1, 2, 3)

    def slow(name: str, axis: int, gravity: float = 0.0) -> list[float]:
        system = linear(level, gravity, mounting=mounting)
        found = [response(system, 0.0, f"base.{name}[{axis}]", f"acceleration_estimate[{i}]").real for i in (1, 2)]
        return [round(value, 4) + 0.0 for value in found]

    assert [slow("acceleration", axis) for axis in axes] == [[0, 1], [0, 0], [1, 0]]
    # w' along Y accelerates a point on X along -Z.
    assert [slow("angular_acceleration", axis) for axis in axes] == [[0, 0], [-0.1, 0], [0, 0]]
    assert [slow("rotation", axis) for axis in axes] == [[0, 0]] * 3
    # Turned about Y, the sensor's y looks down, against what holds it up.
    assert [slow("rotation", axis, 9.81) for axis in axes] == [[0, 0], [0, -9.81], [0, 0]]


def test_a_turning_base_is_felt_at_the_nonlinear_level_only():
    """The centrifugal acceleration of a lever arm of 0.1 m at 3 rad/s."""
    mounting = Mounting(lever=(0.1, 0.0, 0.0))
    u = np.zeros(SIGNALS)
    u[5] = 3.0
    for level, felt in (("spatial", 0.0), ("nonlinear", 0.9)):
        model = tba_accelerometer(level=level, mounting=mounting)
        rhs = np.array(functions(model).rhs(0, np.zeros(6), [], u, start(model, Kind.PARAMETER))).ravel()
        pushed = analyze()["driven_mass"] / analyze()["mass"][0] * felt
        np.testing.assert_allclose(rhs[3:], [pushed, 0, 0], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("arguments", [{}, {"stiffness": (5e3, 6e3, 2e4), "mass": (4e-6, 4.1e-6, 5e-6)}])
def test_without_damping_no_power_is_lost(arguments):
    """Velocity terms do the work of the changing inertia, the rest of the force is a gradient; also as given."""
    model = tba_accelerometer(level="nonlinear", **arguments)
    motion, x = model.motions[0], model.symbols(Kind.STATE)
    q, v = x[:3], x[3:]
    undamped = [0.0 if q.name.startswith("damping_ratio") else q.start for q in model.of(Kind.PARAMETER)]
    given = ca.vertcat(model.symbols(Kind.INPUT), model.symbols(Kind.PARAMETER))
    force = ca.substitute(motion.force, given, ca.DM([*np.zeros(SIGNALS), *undamped]))
    elastic = ca.substitute(force, v, ca.SX.zeros(3))
    numbers = ca.Function(
        "numbers",
        [x],
        [v.T @ (force - elastic), v.T @ ca.jtimes(motion.mass @ v, q, v) / 2, ca.jacobian(elastic, q)],
    )
    by_velocity, by_inertia, K = numbers([30e-6, -20e-6, 10e-6, 1.0, 0.5, -0.3])
    assert float(by_velocity) == pytest.approx(-float(by_inertia), rel=1e-9)
    np.testing.assert_allclose(np.array(K), np.array(K).T, rtol=0, atol=1e-10 * np.abs(np.array(K)).max())


# The reading ----------------------------------------------------------------------------------------------------------


@LEVEL
@DESIGN
def test_a_reading_stops_at_the_travel_and_says_so(level, design):
    model = tba_accelerometer(level=level, design=design)
    found, travel = analyze(design=design), model["travel"].start
    for share, shown, flag in ((0.9, 0.9, 0), (-1.1, -1.0, 1)):
        moved = share * travel
        x = np.zeros(len(model.of(Kind.STATE)))
        u = np.zeros(SIGNALS)
        if level == "static":
            u[1] = -moved * found["stiffness"][1] / found["driven_mass"]
        else:
            x[1] = moved
        at = outputs(model, x, u)
        assert at["proof_mass.position[2]"] == pytest.approx(moved)
        assert at["voltage[2]"] == pytest.approx(5.0 * shown)
        estimate = -shown * travel * found["stiffness"][1] / found["driven_mass"]
        assert at["acceleration_estimate[2]"] == pytest.approx(estimate)
        assert at["saturated"] == flag
        assert at["voltage[1]"] == 0


def test_noise_is_white_of_its_density_and_costs_nothing_when_off():
    quiet, noisy = tba_accelerometer(), tba_accelerometer(noise=True)
    assert not any(q.name.startswith("noise") for q in quiet)
    interval = noisy["noise.interval"].start
    out = functions(noisy).out.map(4000)
    times = np.arange(4000)[None, :] * interval
    estimates = np.array(
        out(times, np.zeros((6, 1)), [], np.zeros((SIGNALS, 1)), start(noisy, Kind.PARAMETER)[:, None])
    )
    rows = [q.name for q in noisy.of(Kind.OUTPUT)]
    found = estimates[[rows.index("acceleration_estimate[1]"), rows.index("acceleration_estimate[2]")]]
    variance = noisy["noise.density"].start / (2 * interval)
    np.testing.assert_allclose(found.var(axis=1), variance, rtol=0.1)
    together = found[:, 1:] @ found[:, :-1].T / 4000
    assert abs(np.mean(found[0] * found[1])) < 0.05 * variance
    assert np.abs(np.diag(together)).max() < 0.05 * variance
    assert not estimates[rows.index("proof_mass.position[1]")].any()


@LEVEL
def test_nominals_are_the_sizes_of_what_one_metre_per_second_squared_does(level):
    for design, size in (("mems", 7.66e-10), ("rapid_prototype", 4.15e-7)):
        model = tba_accelerometer(level=level, design=design)
        assert model["proof_mass.position[1]"].nominal == pytest.approx(size, rel=0.01)
        if level != "static":
            assert model["center.position[1]"].nominal == pytest.approx(size, rel=0.01)


# Mistakes -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"design": "memms"}, "design is 'memms', expected one of .* mems"),
        ({"level": "spatal"}, "level is 'spatal', expected one of .*did you mean spatial"),
        ({"k_out_rule": "times"}, "k_out_rule is 'times', expected one of minus, plus"),
        ({"damping": "films"}, "damping is 'films', .*did you mean film"),
        ({"dimensions.s": "1e-3"}, "dimensions.s is 0.001 m, but the frame must be larger .* 0.003333 m; .* 0.010398"),
        ({"dimensions.w": "-3e-4"}, "dimensions.w is -0.0003 m, expected a number above 0; the design has 0.0003"),
        ({"dimensions.tm": "nan"}, "dimensions.tm is nan m, expected a number above 0"),
        ({"dimensions.nu": "0.5"}, "dimensions.nu is 0.5 1, expected a number between -1 and 0.5; .* 0.222"),
        ({"dimensions.tn": "1e-5"}, "no argument 'dimensions.tn'; did you mean dimensions.nu|dimensions.tm"),
        ({"dimensions.c": "1e-5"}, "legs twist more easily than their feet.*k_out_rule=plus"),
        ({"stiffness": "1,2,0"}, "stiffness is .1.0, 2.0, 0.0. N/m, expected above 0"),
        ({"mass": "0,0,0"}, "mass is .0.0, 0.0, 0.0. kg, expected above 0"),
        ({"driven_mass": "0"}, "driven_mass is 0.0 kg, expected above 0"),
        ({"gap": "-1e-6"}, "gap is -1e-06 m, expected above 0"),
        ({"mounting.rotation": "1,0,0,0,1,0,0,0,-1"}, "mounting.rotation is a reflection"),
        ({"mounting.rotation": "1,0,0,0,2,0,0,0,1"}, "mounting.rotation is no rotation: .* the nearest is 1,0,0,0,1"),
        ({"mounting.rotation": "0,0,90"}, "mounting.rotation has 3 values, expected 9"),
    ],
)
def test_mistakes_are_named(arguments, message):
    with pytest.raises(ModelError, match=message):
        PART.model(**arguments)


def test_a_design_by_a_program_is_checked_too():
    with pytest.raises(ModelError, match="design is 'memms'; did you mean mems"):
        tba_accelerometer(design="memms")  # type: ignore[arg-type]
    with pytest.raises(ModelError, match="level is 'flat'"):
        analyze(level="flat")  # type: ignore[arg-type]
