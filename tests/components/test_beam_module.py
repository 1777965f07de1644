"""The part `beam_module`: closed forms, beams integrated along their length, symmetries, length errors, mistakes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from parts_by_name import part
from scipy.spatial.transform import Rotation

from hfsa.components import ModelError
from hfsa.components._mechanics.beam import LENGTH_POWERS, beam, of_length
from hfsa.components._mechanics.beam_arguments import Dimensions, Normalised
from hfsa.components._mechanics.beam_assembly import at_point, compliance, ring
from hfsa.components._mechanics.beam_kinds import KINDS
from hfsa.components._mechanics.beam_module import compliant_module
from hfsa.components._mechanics.beam_reading import LOADS
from hfsa.components._mechanics.beam_section import Material
from hfsa.components._mechanics.elastostatics import eigenscrews
from hfsa.components._mechanics.screws import GAMMA, skew

PART = part("beam_module")
analyze = PART.analysis
KIND = pytest.mark.parametrize("kind", KINDS)
E, G, NU = 69e9, 26e9, 0.33
few = settings(max_examples=30)

radii, tilts = st.floats(0.1, 3), st.floats(5, 90)
slendernesses = st.floats(1200, 1e5)
seeds = st.integers(0, 2**32 - 1)


@st.composite
def modules(draw) -> dict:
    """Arguments of any kind of module, with beams of unequal length."""
    kind = draw(st.sampled_from(list(KINDS)))
    drawn = {
        "radius": draw(radii),
        "tilt": draw(tilts),
        "outer_tilt": draw(tilts),
        "count": draw(st.integers(3, 6)),
        "slenderness": draw(slendernesses) * 1.3,
        "torsion": draw(st.floats(0.5, 1)),
        "spacing": draw(radii),
        "thickness": draw(st.floats(0.005, 0.08)),
        "width": draw(st.floats(0.1, 1)),
        "poisson": draw(st.floats(0, 0.45)),
    }
    drawn |= {f"outer_{name}": drawn[name] * draw(st.floats(1.1, 3)) for name in ("radius", "spacing")}
    elements = {"beam": ("slenderness", "torsion"), "sheet": ("thickness", "width", "poisson")}
    names = (*KINDS[kind].arguments, *elements[KINDS[kind].element])
    chosen = {name: drawn[name] for name in names}
    beams = KINDS[kind].layers * chosen.get("count", KINDS[kind].count)
    chosen["length_error"] = draw(st.tuples(*[st.floats(-0.1, 0.1)] * beams))
    return {"kind": kind, **chosen}


# Beams integrated along their length ----------------------------------------------------------------------------------


def along(tip: np.ndarray, axes: np.ndarray, length: float, flexibility: list[float]) -> np.ndarray:
    """Compliance at the origin, shape (6, 6), of a beam that ends at `tip` along the first row of `axes`.

    `flexibility` of a unit of its length: stretch by force, turn by moment about the rows of `axes`. Each slice turns
    what is ahead of it: the sum over all slices, of second degree in their place, by Gauss with three points.
    """
    C = np.zeros((6, 6))
    nodes, weights = np.polynomial.legendre.leggauss(3)
    for node, weight in zip(nodes, weights, strict=True):
        place = tip - axes[0] * length * (1 + node) / 2
        density = np.zeros((6, 6))
        density[:3, :3] = flexibility[0] * np.outer(axes[0], axes[0])
        density[3:, 3:] = axes.T @ np.diag(flexibility[1:]) @ axes
        # A turn about `place` moves the origin by turn x (0 - place)
        to_origin = np.block([[np.eye(3), skew(place)], [np.zeros((3, 3)), np.eye(3)]])
        C += weight * length / 2 * to_origin @ density @ to_origin.T
    return C


def beams_between(radius: float, inwards: float, ahead: float, side: float, lengths) -> np.ndarray:
    """Compliance at the origin of three beams with tips on a circle at x = `ahead`, from bases at `side` < 0 or > 0.

    Each goes towards its stage and inwards by the angle `inwards`.
    """
    K = 0
    for degrees, length in zip((120, 0, -120), lengths, strict=True):
        angle = np.radians(degrees)
        out = np.array([0.0, np.sin(angle), -np.cos(angle)])
        first = -np.sign(side) * np.cos(inwards) * np.eye(3)[0] - np.sin(inwards) * out
        second = np.cross(out, first)
        second /= np.linalg.norm(second)
        axes = np.array([first, second, np.cross(first, second)])
        tip = radius * out + [ahead, 0, 0]
        K = K + np.linalg.inv(along(tip, axes, length, [1e-4, 1 / 0.7536, 1.0, 1.0]))
    return np.linalg.inv(K)


@pytest.mark.parametrize("errors", [(0.0,) * 6, (0.03, -0.05, 0.08, -0.02, 0.1, 0.0)])
def test_modules_are_their_beams_integrated_along_their_length(errors):
    beta, r, lengths = np.radians(30), 0.7, 1 + np.array(errors)
    inner, outer = lengths[:3], lengths[3:]
    both = -(2 * r / np.tan(beta) + np.cos(beta))
    expected = {
        "three_beam": beams_between(r, 0.0, 0.0, -1, inner),
        "tilted": beams_between(r, beta, 0.0, -1, inner),
        "inverted": beams_between(r + np.sin(beta), -beta, 0.0, -1, inner),
        "double": beams_between(r, 0.0, 0.0, -1, inner) + beams_between(1.1, 0.0, -1.0, 1, outer),
        "double_tilted": beams_between(r, beta, 0.0, -1, inner)
        + beams_between(r + np.sin(beta), -beta, -both, -1, outer),
    }
    for kind, C in expected.items():
        given = {"radius": r, "length_error": errors[: 3 * KINDS[kind].layers]}
        given |= {"outer_radius": 1.1} if kind == "double" else {}
        given |= {"tilt": 30.0} if "tilt" in KINDS[kind].arguments else {}
        np.testing.assert_allclose(analyze(kind=kind, **given)["compliance"], C, atol=1e-12 * C.max(), err_msg=kind)


def sheets_between(places, ahead: float, side: float, wide: str) -> np.ndarray:
    """Compliance at the origin of sheets 0.03 thick, 0.5 wide, nu = 0.25, wide along Z or radially."""
    t, u, nu = 0.03, 0.5, 0.25
    # By E' I / L^2 and so on: E A / (E' I), G J with J = u t^3 / 3, E I of bending in its plane
    axial, torsion, stiff = 12 * (1 - nu**2) / t**2, 2 * (1 - nu), (1 - nu**2) * (u / t) ** 2
    K = 0
    for place in places:
        first = -np.sign(side) * np.eye(3)[0]
        along_width = np.eye(3)[2] if wide == "z" else np.array(place) / np.linalg.norm(place)
        axes = np.array([first, along_width, np.cross(first, along_width)])
        tip = np.add(place, [ahead, 0, 0])
        K = K + np.linalg.inv(along(tip, axes, 1.0, [1 / axial, 1 / torsion, 1.0, 1 / stiff]))
    return np.linalg.inv(K)


def test_modules_of_sheets_are_their_sheets_integrated_along_their_length():
    def round_about(half: float) -> list:
        return [(0, half, 0), (0, 0, -half), (0, -half, 0), (0, 0, half)]

    expected = {
        "parallelogram": sheets_between([(0, 0.4, 0), (0, -0.4, 0)], 0.0, -1, "z"),
        "four_sheet": sheets_between(round_about(0.4), 0.0, -1, "radial"),
        "double_four_sheet": sheets_between(round_about(0.4), 0.0, -1, "radial")
        + sheets_between(round_about(1.0), -1.0, 1, "radial"),
    }
    for kind, C in expected.items():
        given = {"outer_spacing": 2.0} if kind == "double_four_sheet" else {}
        found = analyze(kind=kind, thickness=0.03, width=0.5, poisson=0.25, spacing=0.8, **given)["compliance"]
        np.testing.assert_allclose(found, C, atol=1e-12 * C.max(), err_msg=kind)


# Closed forms and symmetries ------------------------------------------------------------------------------------------


@given(r=radii, d=slendernesses, delta=st.floats(0.5, 1))
@few
def test_three_beams_in_closed_form(r, d, delta):
    C = analyze(radius=r, slenderness=d, torsion=delta)["compliance"]
    stretch = r**2 * d + 2
    expected = np.diag(
        [1 / (3 * d), *[(stretch + 6) / (36 * stretch)] * 2, 1 / (3 * delta + 36 * r**2), *[2 / (3 * stretch)] * 2]
    )
    expected[1, 5] = expected[5, 1] = 1 / (3 * stretch)
    expected[2, 4] = expected[4, 2] = -1 / (3 * stretch)
    np.testing.assert_allclose(C, expected, rtol=1e-9)


@given(arguments=modules(), seed=seeds)
@settings(max_examples=60)
def test_every_module_is_symmetric_definite_and_the_same_in_every_frame(arguments, seed):
    """The eigenvalues of GAMMA K are those of the spring, whatever the axes and the reference point."""
    C = analyze(**arguments)["compliance"]
    np.testing.assert_array_equal(C, C.T)
    assert np.linalg.eigvalsh(C)[0] > 0
    rng = np.random.default_rng(seed)
    X = at_point(rng.uniform(-2, 2, 3), Rotation.random(rng=rng).as_matrix())
    here, there = (eigenscrews(GAMMA @ np.linalg.inv((M + M.T) / 2) @ GAMMA).stiffness for M in (C, X @ C @ X.T))
    np.testing.assert_allclose(there, here, rtol=1e-5)


@pytest.mark.parametrize("kind", ["three_beam", "tilted", "inverted", "double_tilted"])
@given(r=radii, tilt=tilts, n=st.integers(4, 12))
@settings(max_examples=10)
def test_compliance_is_inverse_to_the_number_of_beams(kind, r, tilt, n):
    given = {"kind": kind, "radius": r} | ({"tilt": tilt} if kind != "three_beam" else {})
    three, many = (analyze(count=count, **given)["compliance"] for count in (3, n))
    np.testing.assert_allclose(n * many, 3 * three, rtol=1e-9, atol=1e-11 * three.max())


def test_four_beams_in_a_double_tilted_module_are_that_kind():
    four = analyze(kind="double_tilted_four")["compliance"]
    np.testing.assert_array_equal(analyze(kind="double_tilted", count=4)["compliance"], four)


@pytest.mark.parametrize("kind", ["tilted", "inverted"])
def test_beams_that_are_hardly_tilted_are_parallel(kind):
    parallel = analyze()["compliance"]
    apart = [np.abs(analyze(kind=kind, tilt=tilt)["compliance"] - parallel).max() for tilt in (1e-3, 1e-4)]
    assert apart[0] / apart[1] == pytest.approx(10, rel=0.2)
    assert apart[1] < 1e-2 * parallel.max()


# Length errors --------------------------------------------------------------------------------------------------------


def to_first_order(errors: np.ndarray) -> np.ndarray:
    """Compliance of three beams by eq C.4: each stiffness to first order in its length error."""
    K = beam(1e4, 0.7536)
    return compliance(ring(0.6, 0.0, 3), [K * (1 - error * LENGTH_POWERS) for error in errors])


@pytest.mark.parametrize("errors", [(0, -0.05, 0), (0.02, -0.01, 0.03), (0.05, 0.05, 0.05)])
def test_first_order_misses_the_exact_length_errors_by_second_order(errors):
    """Half the errors, a quarter of the difference: within 10 %, and better the smaller they are."""
    missed = []
    for half in range(5):
        small = np.array(errors) / 2**half
        exact = analyze(length_error=tuple(small))["compliance"]
        missed.append(np.linalg.norm(to_first_order(small) - exact) / np.linalg.norm(exact))
    rates = np.log2(np.array(missed[:-1]) / missed[1:])
    assert np.all(np.abs(rates - 2) < 0.15)
    assert abs(rates[-1] - 2) < min(0.02, abs(rates[0] - 2))


@given(d=slendernesses, error=st.floats(-0.3, 0.5))
@few
def test_a_longer_beam_has_the_stiffness_of_its_own_length(d, error):
    """Brought to its own length, it is the beam of its own slenderness d (1 + e)^2."""
    length = 1 + error
    by_own = np.array([length] * 3 + [1.0] * 3)
    K = of_length(beam(d, 0.7536), length) * np.outer(by_own, by_own) * length
    np.testing.assert_allclose(K, beam(d * length**2, 0.7536), rtol=1e-12)


# Dimensions -----------------------------------------------------------------------------------------------------------


def test_dimensional_compliance_of_three_round_beams():
    length, diameter, r = 0.05, 2e-3, 0.03
    area, moment = np.pi * diameter**2 / 4, np.pi * diameter**4 / 64
    dimensions = Dimensions(length=length, diameter=diameter, radius=r)
    found = analyze(dimensions=dimensions)
    np.testing.assert_allclose(found["compliance"], analyze(torsion=2 * G / E)["compliance"], rtol=1e-9)
    C = found["compliance_dimensional"]
    assert C[0, 0] == pytest.approx(length / (3 * E * area))
    assert 1 / C[3, 3] == pytest.approx(3 * G * 2 * moment / length + 3 * r**2 * 12 * E * moment / length**3)
    K = compliant_module("three_beam", dimensions=dimensions).dimensional_stiffness()
    assert K[1, 1] == pytest.approx(36 * E * moment / length**3)
    assert K[1, 5] == pytest.approx(-18 * E * moment / length**2)
    np.testing.assert_allclose(K @ C, np.eye(6), atol=1e-9)


def test_dimensional_stiffness_of_two_sheets():
    length, t, u = 0.05, 1e-3, 0.02
    module = compliant_module(
        "parallelogram",
        Normalised(spacing=1.0),
        Material(E=E, nu=NU),
        Dimensions(length=length, thickness=t, width=u),
    )
    K = module.dimensional_stiffness()
    assert K[0, 0] == pytest.approx(2 * E * u * t / length)
    assert K[1, 1] == pytest.approx(2 * E / (1 - NU**2) * u * t**3 / length**3)
    assert K[2, 2] == pytest.approx(2 * E * t * u**3 / length**3)


def test_a_square_beam_is_slender_and_stiff_in_torsion_as_its_section():
    square = analyze(dimensions=Dimensions(length=0.05, side=2e-3), material=Material(E=E, G=G))
    by_hand = analyze(slenderness=12 * 25**2, torsion=1.687 * G / E)
    # 1.687 is rounded
    np.testing.assert_allclose(square["compliance"], by_hand["compliance"], rtol=1e-5)


def test_the_material_has_the_missing_one_of_its_constants():
    dimensions = Dimensions(length=0.05, diameter=2e-3)
    by_nu, by_G = (
        analyze(dimensions=dimensions, material=material)["compliance_dimensional"]
        for material in (Material(E=E, nu=NU), Material(E=E, G=E / (2 * (1 + NU))))
    )
    np.testing.assert_allclose(by_nu, by_G, rtol=1e-12)


@KIND
@given(size=st.floats(1e-3, 1e3))
@settings(max_examples=5)
def test_a_module_is_normalised_alike_in_every_size(kind, size):
    section = {"diameter": 0.04 * size} if KINDS[kind].element == "beam" else {}
    found = analyze(kind=kind, dimensions=Dimensions(length=size, **section), material=Material(E=1.0, nu=0.3))
    once = analyze(
        kind=kind, dimensions=Dimensions(length=1.0, **dict.fromkeys(section, 0.04)), material=Material(1.0, nu=0.3)
    )
    np.testing.assert_allclose(found["compliance"], once["compliance"], rtol=1e-9)
    scale = np.array([1.0] * 3 + [1 / size] * 3)
    expected = once["compliance_dimensional"] * np.outer(scale, scale) / size
    np.testing.assert_allclose(found["compliance_dimensional"], expected, rtol=1e-9)


# Answers and mistakes -------------------------------------------------------------------------------------------------


def test_the_answer_has_its_keys():
    keys = ["compliance", "mobility", "freedoms", "compliance_center", "separation"]
    keys += ["compliance_as_read", "motions_as_read", "screws"]
    found = PART.analysis(kind="tilted", radius="0.6", tilt="45")
    assert list(found) == keys
    assert list(found["freedoms"][0]) == ["type", "pitch", "point", "direction"]
    dimensional = PART.analysis(**{"dimensions.length": "0.05", "dimensions.diameter": "2e-3"})
    assert list(dimensional) == ["compliance", "compliance_dimensional", *keys[1:]]


def test_a_tilted_module_is_read_as_the_source_reads_it():
    """Eq 23, and the screws of eqs 24 to 26: pitches 0, radii 0.607 and 0.5954."""
    found = analyze(kind="tilted")
    read = 1e3 * found["compliance_as_read"]
    assert np.flatnonzero(read).tolist() == [7, 11, 14, 16, 21, 26, 28, 31, 35]
    np.testing.assert_allclose(
        read[[1, 2, 3, 4, 5], [5, 4, 3, 4, 5]], [-11.504, 11.504, 28.277, 19.32, 19.32], atol=5e-4
    )
    assert found["motions_as_read"] == ["y", "z", "thx", "thy", "thz"]
    assert [screw["load"] for screw in found["screws"]] == ["fy", "fz", "mx", "my", "mz"]
    assert [screw["pitch"] for screw in found["screws"]] == [0.0] * 5
    assert [round(screw["radius"], 4) for screw in found["screws"]] == [0.607, 0.607, 0.0, 0.5954, 0.5954]
    directions = [[0, 0, -1], [0, 1, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    np.testing.assert_allclose([screw["direction"] for screw in found["screws"]], directions, atol=1e-12)


def test_three_beams_are_read_as_the_source_reads_them():
    """Eq 10: two translations and the torsion, of which a force makes a translation alone."""
    found = analyze()
    np.testing.assert_allclose(1e3 * found["compliance_as_read"], np.diag([0, 27.824, 27.824, 65.7, 0, 0]), atol=5e-4)
    assert found["motions_as_read"] == ["y", "z", "thx"]
    assert [(screw["load"], screw["radius"]) for screw in found["screws"]] == [("fy", None), ("fz", None), ("mx", 0.0)]


@given(arguments=modules())
@few
def test_screws_are_the_motions_of_the_columns(arguments):
    """Pitch and distance of the axis by the vector of its closest point."""
    found = analyze(**arguments)
    for screw in found["screws"]:
        v, w = np.split(found["compliance_as_read"][:, LOADS.index(screw["load"])], 2)
        if screw["pitch"] is None:
            assert not np.any(w)
            continue
        n = np.array(screw["direction"])
        closest = screw["radius"] * np.cross(n, v) / (np.linalg.norm(np.cross(n, v)) or 1.0)
        np.testing.assert_allclose(np.cross(closest, w) + screw["pitch"] * w, v, atol=1e-8 * np.linalg.norm([*v, *w]))


def test_no_clear_separation_is_said():
    found = PART.analysis(kind="parallelogram", width="0.2")
    assert found["mobility"] == "no clear separation"
    assert found["freedoms"] == []
    assert 1 < found["separation"] < 10


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"kind": "tited"}, "kind is 'tited', expected one of three_beam, .*did you mean tilted"),
        ({"dimensions.length": 0, "dimensions.diameter": 1e-3}, "dimensions.length is 0 m, expected above 0"),
        ({"length_error": "0,-1,0"}, "length of beam 2 is 0 of L, expected a length_error above -1"),
        ({"length_error": "0,nan,0"}, "length of beam 2 is nan"),
        ({"length_error": "0,0.1"}, "length_error has 2 values, expected 3, one per beam"),
        ({"kind": "double", "length_error": "0,0.1,0"}, "length_error has 3 values, expected 6"),
        ({"slenderness": 100}, "slenderness d .* is 100, expected at least 1200"),
        ({"slenderness": 1500, "length_error": "-0.3,0,0"}, "is 735, expected at least 1200"),
        ({"dimensions.length": 0.01, "dimensions.diameter": 2e-3}, "is 400, expected at least 1200"),
        ({"kind": "tilted", "tilt": 0}, "tilt is 0 degrees, expected above 0 and up to 90.*three_beam has parallel"),
        ({"kind": "double_tilted", "tilt": -30}, "tilt is -30 degrees.*inverted tilts them the other way"),
        ({"kind": "inverted", "tilt": 91}, "tilt is 91 degrees"),
        ({"kind": "tilted", "tilt": "nan"}, "tilt is nan, expected a finite number"),
        ({"radius": 0}, "radius is 0 .* expected above 0"),
        ({"kind": "double", "radius": 1.2}, "outer_radius is 1, expected more than the radius, 1.2"),
        ({"torsion": -1}, "torsion is -1, expected above 0"),
        ({"count": 2}, "count is 2, expected three beams or more"),
        ({"kind": "double_tilted_four", "count": 3}, "double_tilted_four has no count; it has radius, tilt"),
        ({"spacing": 1}, "three_beam has no spacing; it has radius"),
        ({"dimensions.length": 0.05, "dimensions.width": 0.01}, "three_beam has no dimensions.width; it has length"),
        ({"kind": "four_sheet", "thickness": 0.2}, "thickness is 0.2 of the length, expected at most 0.1"),
        ({"kind": "four_sheet", "width": 0.01}, "width is 0.01, expected more than the thickness"),
        ({"kind": "four_sheet", "poisson": 1}, "poisson is 1, expected from 0 to below 0.5"),
        ({"dimensions.radius": 0.03}, "dimensions.radius is given without dimensions.length"),
        ({"material.E": 69e9}, "material.E is given without dimensions.length"),
        ({"dimensions.length": 0.05}, "expected one of dimensions.diameter and dimensions.side"),
        ({"dimensions.length": 0.05, "dimensions.diameter": 2e-3, "slenderness": 1e4}, "and no slenderness"),
        ({"dimensions.length": 1, "dimensions.radius": 0.5, "radius": 0.5}, "radius is given twice"),
        ({"dimensions.length": 1, "dimensions.side": 0.01, "material.G": 1e9}, "material has G, expected E and one of"),
    ],
)
def test_mistakes_are_named(arguments, message):
    with pytest.raises(ModelError, match=message):
        PART.analysis(**arguments)


def test_a_module_without_dimensions_has_no_stiffness_in_si_units():
    with pytest.raises(ModelError, match=r"without dimensions\.length"):
        compliant_module("tilted").dimensional_stiffness()
