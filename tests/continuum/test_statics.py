"""Statics of the elastic stage: references of another program, symmetry, stiffness, and the limit of thin necks."""

import numpy as np
import pytest

pytest.importorskip("gmsh")
pytest.importorskip("skfem")

from continuum_references import LABELS, PLATFORM, ROWS, SIZE, design, printed_axes, solved

from hfsa.components._continuum.outline import NECKS
from hfsa.components._continuum.stress import neck_stresses
from hfsa.components._mechanics.pzt import TOKIN
from hfsa.components._mechanics.rrr_hinge import Hinge
from hfsa.components._mechanics.rrr_kinematics import NOMINAL, jacobian
from hfsa.components._mechanics.rrr_outline import Outline

UM = 1e-6
CASES = {"one": [(1, 0, 0), (0, 1, 0), (0, 0, 1)], "two": [(1, 1, 0), (0, 1, 1), (1, 0, 1)], "all": [(1, 1, 1)]}


def peaks(contact, bolts) -> dict[str, list[float]]:
    """Largest von Mises stress [MPa] in every case of stacks at 12 um."""
    found, plan = solved(contact, bolts), design(contact, bolts)
    statics = found.stage.statics
    necks = neck_stresses(*found.solution, plan.shape.material, statics.interface)

    def largest(elongations) -> float:
        at = 12 * UM * np.array(elongations, dtype=float)
        motion = np.concatenate([at, statics.jacobian @ at])[None]
        return max(necks[neck].peak(leg, motion).stress for neck in NECKS for leg in range(3)) / 1e6

    return {name: [largest(case) for case in cases] for name, cases in CASES.items()}


@pytest.mark.parametrize("row", ROWS, ids=LABELS)
def test_motion_and_stiffness_are_those_of_the_references(row):
    """C and yaw to 1e-4, the angle to its last digit, K_a to 5e-4."""
    statics = solved(row.contact, row.bolts).stage.statics
    x, y, yaw = printed_axes(statics.jacobian)[:, 0]
    assert np.hypot(x, y) == pytest.approx(row.c, rel=1e-4)
    assert np.degrees(np.arctan2(y, x)) == pytest.approx(row.angle, abs=1.5e-3)
    assert yaw == pytest.approx(row.yaw, rel=1e-4)
    assert statics.on_stacks[0, 0] / 1e6 == pytest.approx(row.own, rel=5e-4)
    assert statics.on_stacks[0, 1] / 1e6 == pytest.approx(row.other, abs=1e-3)


@pytest.mark.parametrize("row", ROWS, ids=LABELS)
def test_stresses_are_those_of_the_references(row):
    """To 0.6 % of one stack, the worst pair, and all; and the cases of one stack are alike."""
    found = peaks(row.contact, row.bolts)
    for expected, stresses in zip(row.stresses, found.values(), strict=True):
        assert max(stresses) == pytest.approx(expected, rel=6e-3)
    np.testing.assert_allclose(found["one"], found["one"][0], rtol=1e-6)


@pytest.mark.parametrize(("bolts", "ratio", "within"), [("pin", 1.0098, 3e-4), ("rigid", 1.0123, 4e-4)])
def test_the_ratio_of_all_to_one_hardly_depends_on_the_mesh(bolts, ratio, within):
    """The source prints 201.185 / 199.265 = 1.0096."""
    found = peaks("locked", bolts)
    assert found["all"][0] / found["one"][0] == pytest.approx(ratio, abs=within)


def test_three_single_stacks_are_alike():
    """Turned by 120 degrees, to rounding."""
    J = solved("locked").stage.statics.jacobian
    columns = [complex(*J[:2, k]) * np.exp(-2j * np.pi * turn / 3) for k, turn in enumerate((1, 0, -1))]
    np.testing.assert_allclose(columns, columns[0], rtol=1e-12)
    np.testing.assert_allclose(J[2], J[2, 0], rtol=1e-12)


@pytest.mark.parametrize("contact", ["locked", "stack"])
@pytest.mark.parametrize("bolts", ["pin", "rigid"])
def test_the_platform_is_isotropic_and_as_stiff_as_the_references(contact, bolts):
    """With stacks free, bonded and blocked; kxx = kyy, and translation and yaw are apart."""
    statics = solved(contact, bolts).stage.statics
    found = (statics.on_platform(0.0), statics.on_platform(TOKIN.stiffness), statics.blocked)
    for K, (translation, yaw) in zip(found, PLATFORM[bolts, contact], strict=True):
        assert K[0, 0] / 1e6 == pytest.approx(translation, rel=7e-4)
        assert K[2, 2] == pytest.approx(yaw, rel=7e-4)
        scale = np.sqrt(np.outer(np.diag(K), np.diag(K)))
        assert np.abs(K / scale - np.eye(3)).max() < 1e-8
        assert K[0, 0] == pytest.approx(K[1, 1], rel=1e-8)


def test_voltages_are_those_of_the_references():
    """150 V on all and what 12 um take."""
    for (contact, bolts), (length, one, every) in {
        ("locked", "pin"): (10.185, 176.5, 176.7),
        ("locked", "rigid"): (9.967, 180.5, 180.6),
        ("stack", "pin"): (13.294, 136.2, 135.4),
        ("stack", "rigid"): (11.863, 151.2, 151.7),
    }.items():
        K = solved(contact, bolts).stage.statics.on_stacks + TOKIN.stiffness * np.eye(3)
        np.testing.assert_allclose(np.linalg.solve(K, np.full(3, 833.0)) / UM, length, rtol=2e-4)
        volts = 12 * UM / TOKIN.coupling * (K @ np.array([[1, 0, 0], [1, 1, 1]]).T)
        np.testing.assert_allclose(volts[0], [one, every], rtol=5e-4)


def test_condensed_matrices_are_those_of_the_references():
    """Own leg, own leg to the pose and to the next leg, pin bolts, in N/mm, N and N mm, in the axes of leg 1."""
    stage = solved("ball", "pin").stage
    K = stage.stiffness[:15, :15].copy()
    free = slice(12, 15)  # the rotations of the bolts
    K = K[:12, :12] - K[:12, free] @ np.linalg.solve(K[free, free], K[free, :12])
    leg = [0, 6, 9]  # l, s and phi of leg 1; q are 3 to 5
    along, across = stage.pushes[0], np.array([-stage.pushes[0][1], stage.pushes[0][0]])
    to_leg = np.array([[*along, 0], [*across, 0], [0, 0, 1]])
    scale = np.array([1e-3, 1e-3, 1.0])  # to N/mm and N
    rotation = np.array([1.0, 1.0, 1e3])  # a moment in N mm
    own = K[np.ix_(leg, leg)] * np.outer(rotation, scale)
    np.testing.assert_allclose(own[0], [63783, 9784.1, 28721.5], rtol=1e-3)
    np.testing.assert_allclose(own[1, 1:], [39301.1, 119213.5], rtol=1e-3)
    assert own[2, 2] == pytest.approx(395798, rel=1e-3)
    pose = K[leg, 3:6] @ to_leg.T * np.outer(rotation, scale)
    expected = [[-16306.0, 145.84, 441094], [-13362.4, -47.56, 360587], [-38335.4, -143.26, 1034460]]
    np.testing.assert_allclose(pose, expected, rtol=1.5e-3, atol=0.2)
    other = K[np.ix_(leg, [1, 7, 10])] * np.outer(rotation, scale)
    swapped = K[np.ix_([1, 7, 10], leg)] * np.outer(rotation, scale)
    printed = np.array([[146.6, -127.2, -381.4], [-67.8, 67.4, 202.2], [-201.6, 200.6, 602.2]])
    errors = [np.abs(found - printed).max() for found in (other, swapped)]
    assert min(errors) < 3


def test_the_jacobian_of_the_condensed_stiffness_is_that_of_all_equations():
    """Held elongations and a free platform: the whole matrix, solved at once, and energy equal to the work."""
    for contact, bolts in (("locked", "pin"), ("stack", "rigid")):
        stage = solved(contact, bolts).stage
        n = stage.interface.shape[1]
        K, free = stage.stiffness[:n, :n], np.arange(3, n)
        whole = -np.linalg.solve(K[np.ix_(free, free)], K[free, :3])
        np.testing.assert_allclose(whole[:3], stage.statics.jacobian, rtol=1e-9)
        moved = np.vstack([np.eye(3), whole])
        np.testing.assert_allclose(moved.T @ K @ moved, stage.statics.on_stacks, rtol=1e-7)


def test_a_rigid_motion_of_bolts_and_contacts_against_the_body_strains_it():
    """K of the piece is symmetric and positive definite: the holes on the cuts hold it."""
    K = solved().solution.piece.stiffness
    np.testing.assert_array_equal(K, K.T)
    assert np.linalg.eigvalsh(K)[0] > 0


# Change of c, K_a11 and the stress of one stack in %, `locked`, `pin`
SENSITIVITIES = {
    "plane strain": ({}, {"plane": "strain"}, (0.6, 8.4, -4.1)),
    "thinner": ({"thickness": 0.75e-3}, {}, (0.43, -4.8, 2.3)),
    "thicker": ({"thickness": 0.85e-3}, {}, (-0.43, 4.6, -2.3)),
    "wider notch": ({"radius": 1.1e-3}, {}, (-1.2, -4.7, -3.9)),
    "other ratio": ({}, {"poisson": 0.34}, (0.2, -0.4, -0.3)),
    "deeper slot": ({}, {"slot_face": 0.0}, (-0.1, 0.6, 0.6)),
    "wider block": ({}, {"block_left": 8e-3}, (0.0, 0.0, 0.0)),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SENSITIVITIES)
def test_other_dimensions_move_the_results_as_the_references(name):
    """To the last digit; stresses to what meshes leave of them."""
    hinge, outline, expected = SENSITIVITIES[name]
    size = 0.15e-3

    def results(hinge: Hinge, outline: Outline) -> np.ndarray:
        plan = design("locked", "pin", size, outline, hinge=hinge)
        found = plan.solved(size)
        statics = found.stage.statics
        at = np.array([12 * UM, 0, 0])
        motion = np.concatenate([at, statics.jacobian @ at])[None]
        necks = neck_stresses(*found.solution, plan.shape.material, statics.interface)
        peak = max(necks[neck].peak(0, motion).stress for neck in NECKS)
        return np.array([np.hypot(*statics.jacobian[:2, 0]), statics.on_stacks[0, 0], peak])

    change = 100 * (results(Hinge(**hinge), Outline(**outline)) / results(Hinge(), Outline()) - 1)
    np.testing.assert_allclose(change[:2], expected[:2], atol=0.06)
    assert change[2] == pytest.approx(expected[2], abs=0.8)


@pytest.mark.slow
def test_thin_necks_tend_to_the_linkage():
    """The distance of c to J0 falls 2.2 to 2.7 times where the necks are halved; contact `ball`, bolts `pin`."""
    exact = np.hypot(*jacobian("nominal")[:2, 0])
    found = []
    for thickness, expected in ((0.8, 2.7628), (0.4, 3.0609), (0.2, 3.1705), (0.1, 3.2100), (0.05, 3.2255)):
        plan = design("ball", "pin", max(thickness / 8, 0.01) * 1e-3, hinge=Hinge(thickness=thickness * 1e-3))
        c = np.hypot(*plan.solved(plan.size).stage.statics.jacobian[:2, 0])
        assert c == pytest.approx(expected, rel=2e-4)
        found.append(exact - c)
    assert exact == pytest.approx(3.23809, rel=1e-5)
    falls = np.array(found[:-1]) / found[1:]
    assert np.all((falls > 2.2) & (falls < 2.75))


@pytest.mark.slow
def test_finer_meshes_tend_to_the_extrapolated_values():
    """For c 1.39371, yaw 25.9617 rad/m, K_a 29.600 N/um."""
    fine, coarse = (design("locked", "pin").solved(size).stage.statics for size in (SIZE / 2, SIZE))
    for expected, value in (
        (1.39371, lambda found: np.hypot(*found.jacobian[:2, 0])),
        (-25.9617, lambda found: found.jacobian[2, 0]),
        (29.600e6, lambda found: found.on_stacks[0, 0]),
    ):
        assert abs(value(fine) - expected) < abs(value(coarse) - expected) + 2e-5 * abs(expected)
        assert value(fine) == pytest.approx(expected, rel=3e-4)


def test_the_links_are_those_of_the_linkage():
    """A stage whose bodies give moves in the directions of the linkage, 14 to 60 % less."""
    for row in ROWS:
        J = solved(row.contact, row.bolts).stage.statics.jacobian
        share = np.linalg.norm(J[:2]) / np.linalg.norm(NOMINAL.jacobian[:2])
        assert 0.4 < share < 0.86
