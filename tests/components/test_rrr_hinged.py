"""Level `flexible_hinges` of the stage, against an assembly of its own, published figures, and its limits."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from hfsa.components import ModelError
from hfsa.components._mechanics.pzt import TOKIN, Stack
from hfsa.components._mechanics.rrr_contact import Bolts, Contact, sideways_stiffness
from hfsa.components._mechanics.rrr_design import THESIS_DESIGN, Design
from hfsa.components._mechanics.rrr_hinge import Hinge
from hfsa.components._mechanics.rrr_hinged import Hinged, hinged
from hfsa.components._mechanics.rrr_kinematics import LinkChanges
from hfsa.components._mechanics.rrr_masses import Masses
from hfsa.components._mechanics.rrr_neck import Neck
from hfsa.components._mechanics.rrr_outline import THESIS_OUTLINE, Outline, Plate
from hfsa.components._modelling.linearize import linearize
from hfsa.components.rrr_stage import analyze, rrr_stage

CONTACTS = ("locked", "slide", "ball", "stack")
JOINED = pytest.mark.parametrize(
    ("contact", "bolts"), [(c, b) for b in ("pin", "rigid") for c in CONTACTS], ids=lambda word: word
)
OTHER = Design(
    links=LinkChanges(22e-3, 9e-3, 35e-3, 1.05, 0.6, 5e-3),
    hinge=Hinge(71e9, 8e-3, 0.5e-3, 2e-3),
    masses=Masses(0.25, 3e-5, 0.02, 4.4e-6, 0.011),
)
OTHER_PLATE = Outline(drive_height=3e-3, bolt_distance=6e-3, pad_height=1.5e-3, poisson=0.33)


def profile(hinge: Hinge, poisson: float) -> np.ndarray:
    """Stiffnesses of a neck by adaptive quadrature over its profile."""
    t = lambda a: hinge.thickness + 2 * hinge.radius * (1 - np.cos(a))  # noqa: E731
    part = lambda f: quad(lambda a: f(a) * hinge.radius * np.cos(a), -np.pi / 2, np.pi / 2, epsabs=0, epsrel=1e-12)[0]  # noqa: E731
    E, b, G = hinge.elastic_modulus, hinge.width, hinge.elastic_modulus / (2 + 2 * poisson)
    along, bending = part(lambda a: 1 / (E * b * t(a))), part(lambda a: 12 / (E * b * t(a) ** 3))
    across = part(lambda a: 1.2 / (G * b * t(a)) + 12 * (hinge.radius * np.sin(a)) ** 2 / (E * b * t(a) ** 3))
    return 1 / np.array([along, across, bending])


class ByHand:
    """Energies of bodies of complex numbers: u + j phi (p - p0) is the motion of a point p of a body."""

    def __init__(self, design: Design, outline: Outline, contact: Contact, bolts: Bolts, stack: Stack):
        links = design.links_at_rest
        self.links, self.outline, self.contact, self.bolts, self.stack = links, outline, contact, bolts, stack
        self.radius, self.masses, self.neck = design.hinge.radius, design.masses, profile(design.hinge, outline.poisson)

    def legs(self, x: np.ndarray):
        """Yield the motions of one leg: points, directions, and bodies as (u, phi, p0)."""
        lengths, q, rest = x[:3], x[3:6], x[6:].reshape(3, -1)
        platform = (q[0] + 1j * q[1], q[2], 0j)
        for i in range(3):
            turn = np.exp(1j * self.offsets[i])
            C = self.links.radius * turn
            up = np.exp(1j * self.links.psi) * turn
            B = C - self.links.coupler * up
            A = B - self.links.crank * np.exp(1j * (self.links.psi - self.links.psi3)) * turn
            side = -1j * up
            D = A + self.links.arm * side + (self.outline.drive_height + self.radius) * up
            top, bolt = (
                D + (self.radius + self.outline.pad_height) * up,
                C + (self.radius + self.outline.bolt_distance) * up,
            )
            lever = (rest[i, 0] + 1j * rest[i, 1], rest[i, 2], (A + B) / 2)
            coupler = (rest[i, 3] + 1j * rest[i, 4], rest[i, 5], (B + C) / 2)
            at_bolt = platform[0] + 1j * platform[1] * bolt
            block = platform if self.bolts == "rigid" else (at_bolt, rest[i, 6], bolt)
            slide, tilt = rest[i, -2:]
            pad = (-lengths[i] * up + slide * side, tilt, top)
            yield [(None, lever, A, side), (lever, coupler, B, up), (coupler, block, C, up), (lever, pad, D, up)], pad

    offsets = (2 * np.pi / 3, 0.0, -2 * np.pi / 3)

    def potential(self, x: np.ndarray) -> float:
        energy, (k_s, k_m) = 0.0, (self.neck[:2], self.neck[2])
        for i, (necks, _) in enumerate(self.legs(x)):
            for one, other, p, axis in necks:
                moved, turned = (0j, 0.0) if one is None else (one[0] + 1j * one[1] * (p - one[2]), one[1])
                gap = (other[0] + 1j * other[1] * (p - other[2]) - moved) / axis
                energy += (k_s[0] * gap.real**2 + k_s[1] * gap.imag**2 + k_m * (other[1] - turned) ** 2) / 2
            sideways = x[6:].reshape(3, -1)[i, -2:]
            energy += sideways @ sideways_stiffness(self.contact, self.stack) @ sideways / 2
        return energy

    def kinetic(self, v: np.ndarray) -> float:
        m = self.masses
        energy = (m.platform * (v[3] ** 2 + v[4] ** 2) + m.platform_inertia * v[5] ** 2) / 2
        for rest in v[6:].reshape(3, -1):
            centre = m.crank_inertia - m.crank * self.links.crank**2 / 4
            energy += (m.crank * (rest[0] ** 2 + rest[1] ** 2) + centre * rest[2] ** 2) / 2
            rod = m.coupler * self.links.coupler**2 / 12
            energy += (m.coupler * (rest[3] ** 2 + rest[4] ** 2) + rod * rest[5] ** 2) / 2
        return energy

    def condensed(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """K, M and G on elongations and pose."""
        size = 6 + 3 * (9 if self.bolts == "pin" else 8)
        K, M = hessian(self.potential, size), hessian(self.kinetic, size)
        per_leg = (size - 6) // 3
        held = {"locked": (-2, -1), "slide": (-1,)}.get(self.contact, ())
        out = [6 + per_leg * i + per_leg + place for i in range(3) for place in held]
        inner = [i for i in range(6, size) if i not in out]
        T = np.zeros((size, 6))
        T[:6] = np.eye(6)
        T[inner] = -np.linalg.solve(K[np.ix_(inner, inner)], K[inner, :6])
        r = np.zeros((size, 2))
        for first in (3, *(6 + per_leg * i + body for i in range(3) for body in (0, 3))):
            r[first : first + 2] = np.eye(2)
        return T.T @ K @ T, T.T @ M @ T, T.T @ M @ r


def hessian(energy, size: int) -> np.ndarray:
    """Hessian of a quadratic form, by its values."""
    unit = np.eye(size)
    alone = np.array([energy(e) for e in unit])
    H = np.diag(2 * alone)
    for i in range(size):
        for j in range(i):
            H[i, j] = H[j, i] = energy(unit[i] + unit[j]) - alone[i] - alone[j]
    return H


def frequencies(K: np.ndarray, M: np.ndarray) -> np.ndarray:
    return np.sqrt(scipy.linalg.eigh(K, M, eigvals_only=True)) / (2 * np.pi)


def thesis(contact: Contact = "stack", bolts: Bolts = "pin", design: Design = THESIS_DESIGN) -> Hinged:
    return hinged(design, Plate(contact, bolts), TOKIN)


# Against arithmetic ---------------------------------------------------------------------------------------------------


@JOINED
def test_an_unpublished_stage_is_that_of_energies_by_hand(contact, bolts):
    stack = Stack(blocking_force=500.0, stroke=20e-6)
    found = hinged(OTHER, Plate(contact, bolts, OTHER_PLATE), stack)
    K, M, G = ByHand(OTHER, OTHER_PLATE, contact, bolts, stack).condensed()
    scale = np.sqrt(np.outer(np.diag(K), np.diag(K)))
    np.testing.assert_allclose(found.stiffness / scale, K / scale, atol=1e-9)
    scale = np.sqrt(np.outer(np.diag(M), np.diag(M)))
    np.testing.assert_allclose(found.mass / scale, M / scale, atol=1e-9)
    np.testing.assert_allclose(found.base, G, rtol=1e-9, atol=1e-9 * np.abs(G).max())


@given(st.floats(0.005, 5.0), st.floats(0.0, 0.49))
@settings(max_examples=20)
def test_necks_are_integrals_over_their_profile(share, poisson):
    hinge = Hinge(thickness=share * 1e-3)
    np.testing.assert_allclose(Neck(hinge, poisson).stiffness, profile(hinge, poisson), rtol=1e-9)


def test_printed_stiffnesses_of_a_neck():
    along, across, bending = Neck(Hinge(), 0.3).stiffness
    assert round(along / 1e6) == 558
    assert round(across / 1e6) == 115
    assert round(bending, 3) == 45.434


def test_the_stress_at_the_stations_is_that_of_the_whole_profile():
    neck, loads = Neck(Hinge(), 0.3), np.random.default_rng(1).normal(size=(50, 3)) * [100, 300, 0.1]
    x = np.linspace(-0.999, 0.999, 2001) * 1e-3
    t = 0.8e-3 + 2e-3 * (1 - np.sqrt(1 - (x / 1e-3) ** 2))
    for N, V, M in loads:
        whole = (abs(N) / (10e-3 * t) + 6 * np.abs(M + V * x) / (10e-3 * t**2)).max()
        assert max(neck.stresses(N, V, M)) == pytest.approx(whole, rel=0.02)
        assert max(neck.stresses(N, V, M)) <= whole * (1 + 1e-9)


# Published ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("contact", "expected"), [("slide", (61.2, 56.7, 1.68)), ("locked", (31.8, 29.4, 0.89))], ids=["free", "held"]
)
def test_ranges_of_giving_necks(contact, expected):
    found = analyze(level="flexible_hinges", plate=Plate(contact, "rigid"))["range"] * [1e6, 1e6, 1e3]
    np.testing.assert_array_equal([round(found[0], 1), round(found[1], 1), round(found[2], 2)], expected)


def test_the_measured_ranges_lie_between_the_contacts():
    measured = np.array([36.47e-6, 42.17e-6, 0.9743e-3])
    free, locked = (analyze(level="flexible_hinges", plate=Plate(c))["range"] for c in ("ball", "locked"))
    rigid = analyze()["range"]
    assert np.all(locked[[0, 2]] < measured[[0, 2]])
    assert np.all(measured < free)
    assert np.all(free < rigid)


def test_necks_of_finite_elements_give_the_figure_of_rigid_links(monkeypatch):
    """Stiffnesses of a single hinge by finite elements: 284 N/um, 73.2 N/um, 34.54 N.m/rad."""
    monkeypatch.setattr(Neck, "stiffness", np.array([284e6, 73.2e6, 34.54]))
    assert round(float(np.hypot(*thesis("locked").jacobian[:2, 0])), 3) == 1.361


# Limits and invariants ------------------------------------------------------------------------------------------------


def test_the_jacobian_tends_to_that_of_rigid_links_with_the_thickness_of_the_necks():
    J0, errors, stiffer = THESIS_DESIGN.jacobian_at_rest, [], []
    for t in 50e-6 / 2.0 ** np.arange(4):
        design = Design(hinge=Hinge(thickness=t))
        stage = thesis("ball", "rigid", design)
        errors.append(np.abs(stage.jacobian / J0 - 1)[2].max())
        stiffer.append(np.abs(stage.stiffness_on_stacks / design.stiffness_at_rest - 1).max())
    for values in (errors, stiffer):
        orders = np.log2(np.divide(values[:-1], values[1:]))
        np.testing.assert_allclose(orders, 1.0, atol=0.08)
        assert np.all(np.diff(np.abs(orders - 1)) < 0)


def test_a_bonded_stack_is_between_a_held_and_a_free_one():
    yaw = {contact: -thesis(contact).jacobian[2, 0] for contact in CONTACTS}
    assert yaw["locked"] < yaw["stack"] < yaw["slide"] < yaw["ball"]


@JOINED
def test_threefold_symmetry(contact, bolts):
    stage = thesis(contact, bolts)
    """Leg i + 1 is leg i turned by -120 degrees."""
    turn = np.eye(3)
    turn[:2, :2] = [[-0.5, np.sqrt(0.75)], [-np.sqrt(0.75), -0.5]]
    for i in range(3):
        np.testing.assert_allclose(stage.jacobian[:, (i + 1) % 3], turn @ stage.jacobian[:, i], rtol=1e-9, atol=1e-12)
    K = stage.stiffness_of_platform(TOKIN.stiffness)
    np.testing.assert_allclose(K, np.diag([K[0, 0], K[0, 0], K[2, 2]]), atol=1e-9 * K[0, 0])


def test_the_fmu_vibrates_and_moves_as_its_matrices():
    stage = thesis()
    system = linearize(rrr_stage(level="flexible_hinges", causality="force"))
    poles = np.linalg.eigvals(system.A)
    assert poles.real.max() < 0
    omega = np.sort(np.abs(poles))[::2][:3] / (2 * np.pi)
    np.testing.assert_allclose(omega, frequencies(stage.stiffness, stage.mass)[:3], rtol=1e-7)
    names = [*(f"stack[{i}].elongation" for i in (1, 2, 3)), "platform.position[1]", "platform.position[2]"]
    gain = -system.C @ np.linalg.solve(system.A, system.B) + system.D
    rows = [system.output_labels.index(name.replace(".", "/")) for name in (*names, "platform.rotation")]
    columns = [system.input_labels.index(f"stack[{i}]/force") for i in (1, 2, 3)]
    columns += [
        system.input_labels.index(name.replace(".", "/"))
        for name in ("wrench.force[1]", "wrench.force[2]", "wrench.torque")
    ]
    found = gain[np.ix_(rows, columns)] @ stage.stiffness
    np.testing.assert_allclose(found, np.eye(6), atol=1e-6)


def test_bonded_frequencies_are_those_of_stacks_and_tips():
    stage = thesis("slide")
    K, M = stage.stiffness.copy(), stage.mass.copy()
    K[:3, :3] += TOKIN.stiffness * np.eye(3)
    M[:3, :3] += TOKIN.tip_mass * np.eye(3)
    found = analyze(level="flexible_hinges", plate=Plate("slide"))["natural_frequencies_bonded_hz"]
    np.testing.assert_allclose(found, frequencies(K, M)[:3], rtol=1e-9)


def test_a_condensation_on_the_elongations_alone_is_too_stiff():
    """By 7 % on flat stacks, 36 % locked: why the platform keeps its coordinates."""
    for contact, excess in (("stack", 1.0655), ("locked", 1.3624)):
        stage = thesis(contact)
        low = frequencies(stage.stiffness_on_stacks, stage.mass_on_stacks)[0]
        assert low / frequencies(stage.stiffness, stage.mass)[0] == pytest.approx(excess, abs=1e-3)


def test_volts_hold_the_elongations():
    plate = Plate("stack")
    held = analyze(level="flexible_hinges", plate=plate, elongation=(3e-6, 5e-6, 8e-6))
    again = analyze(level="flexible_hinges", plate=plate, voltage=tuple(held["voltage"].tolist()))
    np.testing.assert_allclose(again["elongation_at_voltage"], held["elongation"], rtol=1e-9)
    np.testing.assert_allclose(again["pose_at_voltage"], held["pose"], rtol=1e-9)
    back = analyze(level="flexible_hinges", plate=plate, pose=tuple(held["pose"].tolist()))
    np.testing.assert_allclose(back["elongation"], held["elongation"], rtol=1e-9)


def test_given_matrices_are_those_of_the_stage():
    K = np.array([[3e7, -1e6, 0], [-1e6, 2e7, 1e6], [0, 1e6, 4e7]])
    M = np.diag([2.0, 3.0, 4.0])
    design = Design(stiffness=tuple(K.ravel().tolist()), mass=tuple(M.ravel().tolist()))
    found = analyze(level="flexible_hinges", design=design)
    np.testing.assert_allclose(found["stiffness"], K, atol=1e-7 * K.max())
    np.testing.assert_allclose(found["inertia"], M, atol=1e-12)


# Mistakes -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("design", "message"),
    [
        (
            replace(THESIS_DESIGN, jacobian=(1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0)),
            "a jacobian is given, but at level",
        ),
        (
            Design(links=LinkChanges(coupler=1.9e-3)),
            r"links.coupler is 0.0019 m, but the necks .* touch: .* than 0.002 m",
        ),
        (Design(masses=Masses(crank_inertia=0.0, platform=1e-9)), "mass of the stage .* not positive definite"),
    ],
    ids=["jacobian", "touching necks", "no bodies"],
)
def test_mistakes_are_named(design, message):
    with pytest.raises(ModelError, match=message):
        analyze(level="flexible_hinges", design=design)


def test_outlines_are_checked():
    with pytest.raises(ModelError, match=r"outline.poisson is 0.6, expected"):
        replace(THESIS_OUTLINE, poisson=0.6)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"plate": Plate("locked")}, "contact is given, but level constant_jacobian has rigid links"),
        ({"plate": Plate("ball", "rigid"), "level": "exact"}, "contact and bolts are given, but level exact"),
        ({"level": "flexible_hinges", "elongation": (12.0, 0.0, 0.0)}, "elongation is 12 m, .* reach 0 to 12e-6 m"),
        (
            {"level": "flexible_hinges", "design": Design(hinge=Hinge(thickness=5.0))},
            "is 5.002 m, wider than a coupler",
        ),
    ],
    ids=["contact", "contact and bolts", "metres", "thick necks"],
)
def test_what_a_level_does_not_know_is_refused(arguments, message):
    with pytest.raises(ModelError, match=message):
        analyze(**arguments)
    if "elongation" not in arguments:
        with pytest.raises(ModelError, match=message):
            rrr_stage(**arguments)


def test_a_hinge_of_no_material_is_refused():
    with pytest.raises(ModelError, match=r"hinge.elastic_modulus is 1e-300 Pa, expected 1000 to 1e\+15 Pa"):
        Hinge(elastic_modulus=1e-300)
