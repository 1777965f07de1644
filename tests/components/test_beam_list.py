"""Beams as one assembles them: frames by another method, cut beams, other axes, the kinds as lists, and mistakes."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from parts_by_name import part
from scipy.spatial.transform import Rotation

from hfsa.components import ModelError
from hfsa.components._mechanics.beam_section import torsion_constant

PART = part("beam_module")
analyze = PART.analysis
STEEL, BRASS = {"E": 210e9, "nu": 0.3}, {"E": 1.0e11, "G": 37e9}
MATERIALS = {"steel": STEEL, "brass": BRASS}


def found(beams: list[dict], **more) -> np.ndarray:
    """The compliance of listed beams in SI units, shape (6, 6)."""
    table = {"material": MATERIALS, "beam": beams, **more}
    return PART.analysis(kind="assembly", beams=table)["compliance_dimensional"]


# Frames by another method ---------------------------------------------------------------------------------------------


def rigidities(beam: dict) -> tuple[float, float, float, float]:
    """EA, GJ, and EI of bending along the second and the third axis."""
    m = {"steel": STEEL, "brass": BRASS}[beam["material"]]
    E, G = m["E"], m.get("G") or m["E"] / 2 / (1 + m["nu"])
    if "diameter" in beam:
        radius = beam["diameter"] / 2
        return E * math.pi * radius**2, G * math.pi * radius**4 / 2, *[E * math.pi * radius**4 / 4] * 2
    t, w = (beam["side"], beam["side"]) if "side" in beam else (beam["thickness"], beam["width"])
    if beam.get("sheet"):
        nu = m.get("nu", E / 2 / G - 1)
        return E * t * w, G * w * t**3 / 3, E / (1 - nu**2) * w * t**3 / 12, E * t * w**3 / 12
    # Saint-Venant, from the other side of the section: both series are of the same function
    a, b = w / 2, t / 2
    series = sum(math.tanh(n * math.pi * a / 2 / b) / n**5 for n in range(1, 100, 2))
    J = 16 / 3 * a * b**3 * (1 - 192 * b / a / math.pi**5 * series) if w >= t else math.nan
    return E * t * w, G * J, E * w * t**3 / 12, E * t * w**3 / 12


def frame_element(length: float, EA: float, GJ: float, along_y: float, along_z: float) -> np.ndarray:
    """Stiffness of a beam with both ends free, (u v w thx thy thz) of one end and of the other, shape (12, 12)."""
    K = np.zeros((12, 12))
    for pair, value in (((0, 6), EA / length), ((3, 9), GJ / length)):
        K[np.ix_(pair, pair)] += value * np.array([[1, -1], [-1, 1]])
    L = length
    cubic = np.array([[12, 6 * L, -12, 6 * L], [6 * L, 4 * L * L, -6 * L, 2 * L * L]])
    cubic = np.vstack([cubic, -cubic[0], [6 * L, 2 * L * L, -6 * L, 4 * L * L]]) / L**3
    for rows, EI, sign in (((1, 5, 7, 11), along_y, 1), ((2, 4, 8, 10), along_z, -1)):
        turned = np.diag([1, sign, 1, sign])
        K[np.ix_(rows, rows)] += EI * turned @ cubic @ turned
    return K


def frame(beams: list[dict], reference: np.ndarray) -> np.ndarray:
    """Compliance of the platform by the direct stiffness method: bodies are nodes with rigid arms, shape (6, 6)."""
    names = sorted({name for beam in beams for name in beam["joins"]} - {"base"})
    K = np.zeros((6 * len(names), 6 * len(names)))
    for beam in beams:
        start, end = np.array(beam["start"]), np.array(beam["end"])
        along = (end - start) / np.linalg.norm(end - start)
        wide = np.array(beam["wide"]) - along * (along @ beam["wide"])
        wide /= np.linalg.norm(wide)
        axes = np.array([along, np.cross(wide, along), wide])
        local = frame_element(float(np.linalg.norm(end - start)), *rigidities(beam))
        B = np.zeros((12, len(K)))
        for row, point, name in ((0, start, beam["joins"][0]), (6, end, beam["joins"][1])):
            if name != "base":
                arm = point - reference
                cross = np.array([[0, arm[2], -arm[1]], [-arm[2], 0, arm[0]], [arm[1], -arm[0], 0]])
                move = np.block([[np.eye(3), cross], [np.zeros((3, 3)), np.eye(3)]])
                column = 6 * names.index(name)
                B[row : row + 6, column : column + 6] = np.kron(np.eye(2), axes) @ move
        K += B.T @ local @ B
    place = 6 * names.index("platform")
    return np.linalg.inv(K)[place : place + 6, place : place + 6]


def without_wide(beams: list[dict]) -> list[dict]:
    """The beams as a file has them: `wide` beside a width alone."""
    return [{k: v for k, v in beam.items() if k != "wide" or "width" in beam} for beam in beams]


coordinates = st.floats(-0.1, 0.1)
points = st.tuples(coordinates, coordinates, coordinates).map(list)


@st.composite
def random_beams(draw, thickest: float = 0.05) -> list[dict]:
    """Beams of all sections and materials, between base, two other bodies, and platform."""
    chain = [("base", "one"), ("one", "platform"), ("base", "two"), ("two", "platform")]
    more = draw(
        st.lists(st.sampled_from([*chain, ("base", "platform"), ("one", "two"), ("platform", "one")]), max_size=4)
    )
    beams = []
    for joins in [*chain, *more]:
        seed = draw(st.integers(0, 2**32 - 1))
        axes = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
        start, length = np.array(draw(points)), draw(st.floats(0.02, 0.1))
        thin = length * draw(st.floats(0.008, thickest))
        section = draw(
            st.sampled_from(
                [
                    {"diameter": thin},
                    {"side": thin},
                    {"thickness": thin, "width": 1.7 * thin},
                    {"thickness": thin, "width": 0.4 * length, "sheet": True},
                ]
            )
        )
        # the wide side is given askew: its part along the beam has no effect
        places = {"start": list(start), "end": list(start + length * axes[0]), "wide": list(axes[2] + 0.7 * axes[0])}
        beams.append({**places, **section, "joins": list(joins), "material": draw(st.sampled_from(sorted(MATERIALS)))})
    return beams


@given(random_beams(), points)
@settings(max_examples=60)
def test_listed_beams_are_the_frame_of_the_direct_stiffness_method(beams, reference):
    expected = frame(beams, np.array(reference))
    C = found(without_wide(beams), reference=reference)
    size = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(C / np.outer(size, size), expected / np.outer(size, size), atol=1e-6)


@given(random_beams(thickest=0.011), st.floats(0.2, 0.8))
@settings(max_examples=20)
def test_a_beam_cut_by_a_body_is_the_same_beam(beams, share):
    """A body without load at a place of a beam changes nothing, whichever way the halves are written."""
    first = beams[0]
    middle = list((1 - share) * np.array(first["start"]) + share * np.array(first["end"]))
    halves = [
        {**first, "end": middle, "joins": ["base", "cut"]},
        {**first, "start": first["end"], "end": middle, "joins": ["one", "cut"]},
    ]
    cut = found(without_wide([*halves, *beams[1:]]))
    whole = found(without_wide(beams))
    size = np.sqrt(np.diag(whole))
    np.testing.assert_allclose(cut / np.outer(size, size), whole / np.outer(size, size), atol=1e-6)


@given(random_beams(), st.integers(0, 2**32 - 1), points)
@settings(max_examples=20)
def test_a_turned_and_shifted_list_is_the_same_module(beams, seed, shift):
    rotation = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    moved = [
        {
            **beam,
            **{name: list(rotation @ beam[name] + shift) for name in ("start", "end")},
            "wide": list(rotation @ beam["wide"]),
        }
        for beam in beams
    ]
    here, there = (
        PART.analysis(kind="assembly", beams={"material": MATERIALS, "beam": without_wide(some)})
        for some in (beams, moved)
    )
    turn = np.kron(np.eye(2), rotation)
    expected = turn @ here["compliance"] @ turn.T
    np.testing.assert_allclose(there["compliance"], expected, atol=1e-6 * np.abs(expected).max())
    assert there["separation"] == pytest.approx(here["separation"], rel=1e-5)


# Sections and kinds ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("ratio", "factor"),
    [(1.0, 0.1406), (1.5, 0.196), (2.0, 0.229), (3.0, 0.263), (5.0, 0.291), (10.0, 0.312)],
    ids=lambda value: f"{value:g}",
)
def test_torsion_of_a_rectangle_is_that_of_the_tables(ratio, factor):
    """J / (w t^3) as tables of the theory of elasticity print it."""
    assert torsion_constant(2e-3, ratio * 2e-3) == pytest.approx(factor * ratio * 2e-3**4, abs=6e-4 * ratio * 2e-3**4)
    assert torsion_constant(ratio, 1.0) == torsion_constant(1.0, ratio)


def test_torsion_of_a_wide_rectangle_tends_to_that_of_a_sheet():
    apart = [1 - torsion_constant(1.0, w) / (w / 3) for w in (20.0, 40.0)]
    assert apart[0] / apart[1] == pytest.approx(2, rel=1e-6)
    assert apart[1] == pytest.approx(0.630 / 40, rel=1e-3)


def ring(radius: float, count: int, ahead: float, back: float = 0.0, turn: float = 0.0) -> list[tuple]:
    """Tips at x = `ahead` on a circle and, `back` behind them, starts at the same place of it."""
    angles = turn + 2 * np.pi * np.arange(count) / count
    return [
        ([back, radius * np.sin(a), radius * np.cos(a)], [ahead, radius * np.sin(a), radius * np.cos(a)])
        for a in angles
    ]


def test_kinds_of_beams_are_lists_of_their_beams():
    length, diameter, radius, outer = 0.05, 2e-3, 0.03, 0.045
    section = {"diameter": diameter, "material": "steel"}
    inner = [{"start": a, "end": b, **section} for a, b in ring(radius, 5, 0.0, -length)]
    back = [{"start": b, "end": a, **section} for a, b in ring(outer, 5, 0.0, -length)]
    joined = [{**beam, "joins": ["ring", "platform"]} for beam in inner] + [
        {**beam, "joins": ["base", "ring"]} for beam in back
    ]
    more = {"dimensions.length": length, "dimensions.diameter": diameter, "dimensions.radius": radius, "count": 5}
    more |= {"material.E": STEEL["E"], "material.nu": STEEL["nu"]}
    for kind, beams, own in (("three_beam", inner, {}), ("double", joined, {"dimensions.outer_radius": outer})):
        expected = PART.analysis(kind=kind, **more, **own)
        C = found(beams)
        np.testing.assert_allclose(C, expected["compliance_dimensional"], atol=1e-9 * C.max())
        listed = PART.analysis(kind="assembly", beams={"material": MATERIALS, "beam": beams})
        np.testing.assert_allclose(listed["compliance"], expected["compliance"], atol=1e-9)


@pytest.mark.parametrize("count", [3, 4, 7])
def test_sheets_on_one_circle_are_the_list_of_their_sheets(count):
    """Figure B.2b has four per body: those that run back stand between those that run out."""
    length, t, u, w = 0.05, 1e-3, 0.02, 0.05
    m = {"E": 70e9, "nu": 0.3}

    def sheets(places: list[tuple], joins: list[str], is_back: bool) -> list[dict]:
        """Radially wide sheets."""
        ends = [(b, a) if is_back else (a, b) for a, b in places]
        section = {"thickness": t, "width": u, "sheet": True, "joins": joins, "material": "it"}
        return [{"start": a, "end": b, "wide": [0.0, b[1], b[2]], **section} for a, b in ends]

    out = ring(w / 2, count, 0.0, -length)
    back = ring(w / 2, count, 0.0, -length, np.pi / count)
    lists = {
        "sheet_ring": sheets(out, ["base", "platform"], False),
        "double_sheet_ring": sheets(out, ["middle", "platform"], False) + sheets(back, ["base", "middle"], True),
    }
    for kind, beams in lists.items():
        table = {"material": {"it": m}, "beam": beams}
        listed = PART.analysis(kind="assembly", beams=table)
        named = PART.analysis(kind=kind, count=count)
        np.testing.assert_allclose(named["compliance"], listed["compliance"], atol=1e-9, err_msg=kind)
        assert named["mobility"] == 1


def test_eight_sheets_on_one_circle_twist_twice_as_far_as_four_without_moving_along_the_axis():
    """Figure B.2b: the stage stays at the height of the base, and the compliance in torsion doubles."""
    four, eight = (analyze(kind=kind)["compliance"] for kind in ("sheet_ring", "double_sheet_ring"))
    np.testing.assert_allclose(four, analyze(kind="four_sheet")["compliance"], rtol=1e-12)
    assert eight[3, 3] == pytest.approx(2 * four[3, 3])
    assert eight[0, 0] == pytest.approx(2 * four[0, 0])


def test_two_tilts_are_two_modules_that_turn_about_one_point():
    """The source's series of a tilted and an inverted module, C + J C' J^T, at two different tilts."""
    r, inner, outer = 0.6, 35.0, 55.0
    C, other = analyze(kind="tilted", tilt=inner)["compliance"], analyze(kind="inverted", tilt=outer)["compliance"]
    meet, foot = r / math.tan(math.radians(inner)), (r + math.sin(math.radians(outer))) / math.tan(math.radians(outer))
    J = np.eye(6)
    J[1, 5], J[2, 4] = -(meet + foot), meet + foot
    whole = analyze(kind="double_tilted", tilt=inner, outer_tilt=outer)
    np.testing.assert_allclose(whole["compliance"], C + J @ other @ J.T, atol=1e-12)
    assert whole["compliance_center"][0] == pytest.approx(meet, abs=0.02)
    np.testing.assert_array_equal(
        analyze(kind="double_tilted", tilt=inner, outer_tilt=inner)["compliance"],
        analyze(kind="double_tilted", tilt=inner)["compliance"],
    )


# Mistakes -------------------------------------------------------------------------------------------------------------

GOOD = {"start": [0, 0, 0], "end": [0.05, 0, 0], "diameter": 1e-3}
FLAT = {"start": [0, 0, 0], "end": [0.05, 0, 0], "thickness": 1e-3, "width": 4e-3, "wide": [0, 0, 1]}


@pytest.mark.parametrize(
    ("table", "words"),
    [
        pytest.param({"beam": []}, r"beam is empty, expected one beam", id="none"),
        pytest.param(
            {"beam": [{**GOOD, "joins": ["ring", "platform"]}]}, r"no beam joins the base; .* name base in", id="base"
        ),
        pytest.param(
            {"beam": [{**GOOD, "joins": ["base", "plate"]}]},
            r"no beam joins the platform; they join base and",
            id="stage",
        ),
        pytest.param(
            {"beam": [{**GOOD, "joins": ["base", "one"]}, {**GOOD, "joins": ["two", "platform"]}]},
            r"do not join base and platform: base and one are joined, and so are two and .*\[\"base\", \"two\"\]",
            id="apart",
        ),
        pytest.param(
            {"beam": [GOOD, {**GOOD, "joins": ["platform", "arm"]}]},
            r"arm is joined to platform alone, so that beam\[2\] carry no load",
            id="dangling",
        ),
        pytest.param(
            {"beam": [GOOD, *({**GOOD, "joins": list(j)} for j in (["platform", "a"], ["a", "b"], ["b", "platform"]))]},
            r"a is joined to platform alone, so that beam\[2\], beam\[3\] carry no load",
            id="loop",
        ),
        pytest.param({"beam": [{**GOOD, "joins": ["base", "base"]}]}, r"beam\[1\]: joins base to itself", id="itself"),
        pytest.param(
            {"beam": [{"end": [1, 0, 0], "side": 0.01}]}, r"has its end alone, expected start, or direct", id="end"
        ),
        pytest.param({"beam": [{**GOOD, "length": 1.0}]}, r"has start and length, expected start, or", id="twice"),
        pytest.param(
            {"beam": [{**GOOD, "end": [0, 0, 0]}]}, r"start and end are both \[0\.0, 0\.0, 0\.0\]", id="point"
        ),
        pytest.param({"beam": [{**GOOD, "end": [0, 0, math.nan]}]}, r"end is \[0\.0, 0\.0, nan\]", id="nan"),
        pytest.param({"beam": [{**GOOD, "diameter": 0.0}]}, r"diameter is 0 m, expected above 0", id="zero"),
        pytest.param(
            {"beam": [{**GOOD, "diameter": 6e-3}]},
            r"diameter is 0\.12 of its length, expected at most 0\.1$",
            id="thick",
        ),
        pytest.param({"beam": [{**GOOD, "side": 1e-3}]}, r"has diameter and side, expected one of", id="sections"),
        pytest.param(
            {"beam": [{"start": [0, 0, 0], "end": [1, 0, 0]}]}, r"has no section, expected one of", id="no section"
        ),
        pytest.param(
            {"beam": [{**GOOD, "sheet": True}]}, r"has sheet with diameter, expected it with width", id="round sheet"
        ),
        pytest.param(
            {"beam": [{**FLAT, "width": 0.02}]}, r"width is 0\.4 of its length.*a sheet.* has sheet = true", id="wide"
        ),
        pytest.param(
            {"beam": [{**FLAT, "sheet": True, "width": 1e-3}]}, r"expected more than the thickness, 0\.001 m", id="thin"
        ),
        pytest.param({"beam": [{**FLAT, "wide": [2, 0, 0]}]}, r"wide is .* which is along the beam", id="along"),
        pytest.param(
            {"beam": [{k: v for k, v in FLAT.items() if k != "wide"}]}, r"lacks wide, the direction", id="no wide"
        ),
        pytest.param(
            {"beam": [{**GOOD, "material": "stel"}], "material": MATERIALS},
            r"beam\[1\]\.material is 'stel'; did you mean steel",
            id="material",
        ),
        pytest.param(
            {"beam": [GOOD], "material": {"it": {"G": 1e9}}}, r"material\.it has G, expected E and one of", id="E"
        ),
        pytest.param({"beam": [GOOD], "reference": [0, 0]}, r"reference has 2 values, expected 3", id="reference"),
    ],
)
def test_a_wrong_list_is_named(table, words):
    with pytest.raises(ModelError, match=words):
        PART.analysis(kind="assembly", beams=table)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        pytest.param(
            {"kind": "assembly"}, r"assembly lacks beams, the list of them; give beams=FILE\.toml", id="no list"
        ),
        pytest.param(
            {"kind": "assembly", "beams": {"beam": [GOOD]}, "radius": 1}, r"assembly has no radius", id="radius"
        ),
        pytest.param(
            {"beams": {"beam": [GOOD]}}, r"beams is given with kind three_beam.*kind=assembly takes a list", id="kind"
        ),
    ],
)
def test_a_list_goes_with_its_kind_alone(arguments, words):
    with pytest.raises(ModelError, match=words):
        PART.analysis(**arguments)
