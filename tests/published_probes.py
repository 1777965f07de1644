"""Numbers that a source states and no part's `analyze` returns: each from the parts' own functions, by name.

`published.toml` names them; every result is in SI units.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import appendix_d2
import casadi as ca
import numpy as np
import scipy.linalg
from scipy.optimize import brentq

from hfsa.components import _pzt as stack
from hfsa.components import _rrr_dynamics as dynamics
from hfsa.components import _rrr_hinge as hinge
from hfsa.components import _sdelta_stiffness, beam_module, c_drive, rrr_stage, sdelta, tba_accelerometer
from hfsa.components._beam import LENGTH_POWERS, beam
from hfsa.components._beam_assembly import ring, side_by_side
from hfsa.components._beam_module import Dimensions, Material
from hfsa.components._elastostatics import eigenscrews, twist_compliant_axes, wrench_compliant_axes
from hfsa.components._functions import functions
from hfsa.components._linearize import linearize
from hfsa.components._model import Kind
from hfsa.components._modes import modal_damping, modes
from hfsa.components._rrr_kinematics import NOMINAL, forward, jacobian
from hfsa.components._screws import axis, skew
from hfsa.components._sdelta_geometry import PLATFORM_RADIUS, SYMMETRIC, Posture
from hfsa.components._sdelta_inertia import CUBE, Payload, with_payload
from hfsa.components._sdelta_kinematics import DRIVES_MATRIX, Kinematics
from hfsa.components._sdelta_stiffness import PRESETS, limb_stiffness, stiffness
from hfsa.components._tba_design import DESIGNS
from hfsa.controllers import sdelta_tuning

_EXAMPLE = (0.005, 0.003, 0.155)
"""Position of S in the SDelta's example away from symmetry [m]."""
_POSE = [f"platform/{kind}[{i}]" for kind in ("rotation", "position") for i in (1, 2, 3)]
_WRENCH = [f"wrench/{kind}[{i}]" for kind in ("torque", "force") for i in (1, 2, 3)]
_TUBES = [f"drive[{j}]/{kind}" for j in (1, 2, 3) for kind in ("slide", "angle")]


# SDelta ---------------------------------------------------------------------------------------------------------------


def sdelta_geometry() -> dict[str, Any]:
    """At the symmetric posture: limbs, N, and T^-1 of the motors."""
    kinematics = Kinematics.at(SYMMETRIC)
    return {
        "length": kinematics.limbs.length,
        "angle": kinematics.limbs.angle,
        "pose_to_motors": np.linalg.inv(kinematics.jacobian()),
        "determinant": np.linalg.det(kinematics.rows()),
    }


def sdelta_springs(preset: str) -> dict[str, Any]:
    """Springs of a preset: rod and shaft, the shaft as felt along and about the C axis, and the limbs'."""
    springs, kinematics = PRESETS[preset], Kinematics.at(SYMMETRIC)
    slide, turn = springs.shaft / (DRIVES_MATRIX**2).sum(axis=1)[:2]
    return {
        "rod": springs.rod,
        "shaft": springs.shaft,
        "shaft_alone": _sdelta_stiffness._SHAFT,
        "slide": slide,
        "turn": turn / kinematics.limbs.length[0] ** 2,
        "limb": limb_stiffness(kinematics, springs)[:2],
    }


def sdelta_inertia(payload: bool) -> dict[str, Any]:
    """The platform with its cube or alone."""
    body = with_payload(CUBE if payload else Payload(0.0, (0, 0, 0), (0, 0, 0)))
    return {
        "mass": body.mass,
        "height": body.center[2],
        "about_C": np.diag(body.tensor),
        "about_S": np.diag(body.about(np.zeros(3))),
    }


def sdelta_at_mass_centre() -> dict[str, Any]:
    """Matrices about C: their diagonals, and the entries (1, 5) and (2, 4), the only others."""
    numbers = sdelta.analyze()
    K = numbers["stiffness_C"]
    matrices = {
        "stiffness": K,
        "frequency": numbers["frequency_matrix_C"],
        "damping": 0.01 * modal_damping(numbers["mass_C"], K),
    }
    return {name: _blocks(matrix) for name, matrix in matrices.items()}


def sdelta_compliance(preset: str) -> dict[str, Any]:
    """Compliance at S, as the matrices about C."""
    found = _blocks(np.linalg.inv(stiffness(Kinematics.at(SYMMETRIC), PRESETS[preset], np.zeros(3))))
    (rotation, about_z), (translation, along_z) = ((found[n][:2], found[n][2]) for n in ("rotation", "translation"))
    return {
        "rotation": rotation,
        "rotation_about_z": about_z,
        "translation": translation,
        "translation_along_z": along_z,
        "coupling": found["coupling"],
    }


def _blocks(matrix: np.ndarray) -> dict[str, Any]:
    diagonal = np.diag(matrix)
    return {"rotation": diagonal[:3], "translation": diagonal[3:], "coupling": [matrix[0, 4], matrix[1, 3]]}


def sdelta_meeting_point(preset: str) -> np.ndarray:
    """Height above S at which each horizontal eigenscrew and compliant axis crosses the vertical through S."""
    K = stiffness(Kinematics.at(SYMMETRIC), PRESETS[preset], np.zeros(3))
    screws = np.hstack([found(K).screws for found in (eigenscrews, wrench_compliant_axes, twist_compliant_axes)]).T
    axes = [axis(screw, PLATFORM_RADIUS) for screw in screws]
    return np.array([one.point[2] for one in axes if abs(one.direction[2]) < 1e-6])


def sdelta_modes() -> dict[str, Any]:
    """The lower (1) and upper (4) tilting mode: heights of its axis, sizes of its shape in rotation and translation."""
    numbers = sdelta.analyze()
    height = [axis(numbers["modal_screws_C"][:, i], PLATFORM_RADIUS).point[2] for i in (0, 3)]
    shapes = modes(numbers["mass_C"], numbers["stiffness_C"]).shapes
    sizes = np.linalg.norm(shapes.reshape(2, 3, 6), axis=1)[:, [0, 3]]
    return {
        "above_C": np.array(height),
        "above_S": np.array(height) + with_payload(CUBE).center[2],
        "rotation": sizes[0],
        "translation": sizes[1],
    }


def sdelta_example_with_its_slips() -> np.ndarray:
    """Natural frequencies [Hz] of the thesis' example (eqs 4.45 to 4.51), its slips put in: 10 / 180 rad, Q for Q^T."""
    posture = Posture((np.rad2deg(10 / 180), 5, 8), _EXAMPLE)
    Q, body = posture.matrix, with_payload(CUBE)
    d = Q @ body.center
    M = body.matrix(Q)
    M[:3, :3] = Q.T @ body.about(np.zeros(3)) @ Q + body.mass * skew(d) @ skew(d)
    return modes(M, stiffness(Kinematics.at(posture), PRESETS["ch4"], d)).omega / (2 * np.pi)


def sdelta_example_offset() -> np.ndarray:
    """C - S in the thesis' example."""
    return Posture((10, 5, 8), _EXAMPLE).matrix @ with_payload(CUBE).center


def sdelta_sag(preset: str) -> float:
    """Vertical displacement of S by the weight."""
    model = sdelta.sdelta(stiffness=preset)  # type: ignore[arg-type]
    f, u, p = functions(model), [q.start for q in model.of(Kind.INPUT)], [0.01, 9.81]
    still = np.zeros(12)
    rest = -np.linalg.solve(np.array(f.jacobian(0, still, [], u, p)), np.array(f.rhs(0, still, [], u, p)).ravel())
    values = np.array(f.out(0, rest, [], u, p)).ravel()
    return float(values[[q.name for q in model.of(Kind.OUTPUT)].index("platform.position[3]")])


@cache
def _from_pose(preset: str, point: str, damping_ratio: float) -> Callable[[float], tuple[np.ndarray, np.ndarray]]:
    """Frequency [Hz] to the responses of the pose of S or C to the pose that the tubes dictate and to the wrench."""
    system = linearize(sdelta.sdelta(stiffness=preset, reference_point=point), {"damping_ratio": damping_ratio})  # type: ignore[arg-type]
    offset = with_payload(CUBE).center if point == "C" else np.zeros(3)
    back = np.linalg.inv(Kinematics.at(SYMMETRIC).tubes_to_pose(offset))
    rows = [system.output_labels.index(name) for name in _POSE]
    tubes, rates, wrench = (
        [system.input_labels.index(name) for name in names]
        for names in (_TUBES, [f"{name}_rate" for name in _TUBES], _WRENCH)
    )

    def responses(frequency: float) -> tuple[np.ndarray, np.ndarray]:
        s = 2j * np.pi * frequency
        H = system.C[rows] @ np.linalg.solve(s * np.eye(12) - system.A, system.B) + system.D[rows]
        return (H[:, tubes] + s * H[:, rates]) @ back, H[:, wrench]

    return responses


def sdelta_response(frequency: float) -> dict[str, Any]:
    """From the dictated pose to the pose of S, damping 1 %: gains th_x, th_z, u_x, u_z; phases without th_z."""
    H, _ = _from_pose("ch4", "S", 0.01)(frequency)
    direct = np.diag(H)[[0, 2, 3, 5]]
    return {
        "gain": np.abs(direct),
        "cross": np.abs([H[1, 3], H[3, 1]]),
        "phase": np.angle(direct[[0, 2, 3]]),
    }


def sdelta_antiresonances(preset: str) -> dict[str, Any]:
    """Undamped zeros between the tilting modes [Hz]: by the wrench th and u at C and S, by the pose th and u."""
    low, high = sdelta.analyze(stiffness=preset)["natural_frequencies_hz"][[0, 4]]  # type: ignore[arg-type]
    found: dict[str, Any] = {"wrench": [], "pose": []}
    for i in (0, 3):
        for point in "CS":
            responses = _from_pose(preset, point, 0.0)
            for which, name in enumerate(("pose", "wrench")):
                zero = brentq(lambda f, r=responses, w=which, i=i: r(f)[w][i, i].real, 1.0001 * low, 0.9999 * high)
                found[name].append(zero)
    return found


def sdelta_free_motors(preset: str, drives: bool) -> np.ndarray:
    """Resonances with free motors [Hz], of the drives' whole inertia or of the rotors' alone."""
    robot = sdelta.analyze(stiffness=preset)  # type: ignore[arg-type]
    T = Kinematics.at(SYMMETRIC).jacobian(with_payload(CUBE).center)
    join = np.hstack([-T, np.eye(6)])
    rotors = np.kron(np.eye(3), c_drive.inertia()) if drives else c_drive.ROTOR_INERTIA * np.eye(6)
    mass = scipy.linalg.block_diag(rotors, robot["mass_C"])
    return np.sqrt(scipy.linalg.eigh(join.T @ robot["stiffness_C"] @ join, mass, eigvals_only=True)[6:]) / (2 * np.pi)


def sdelta_motor_inertia() -> dict[str, Any]:
    """Inertia that the motors see."""
    M = sdelta_tuning.analyze()["motor_inertia"]
    return {"diagonal": np.diag(M), "eigenvalues": np.linalg.eigvalsh(M)}


# 3-RRR stage ----------------------------------------------------------------------------------------------------------


def stage_geometry() -> dict[str, Any]:
    """Angles and first leg of the stage as designed, and the turn from the measurement's axes."""
    return {
        "psi": NOMINAL.psi,
        "psi3": NOMINAL.psi3,
        "A1": NOMINAL.base_hinges[0],
        "B1": NOMINAL.crank_ends[0],
        "turn": NOMINAL.psi - np.pi / 3,
    }


def stage_steps() -> dict[str, Any]:
    """What 0.01 um of one stack moves: x by stack 2, y by stack 3, the yaw by any."""
    J = 1e-8 * jacobian("nominal")
    return {"x": abs(J[0, 1]), "y": abs(J[1, 2]), "yaw": abs(J[2, 0])}


def stage_strength() -> dict[str, Any]:
    """Strength that the hinge at A needs, with a safety of 2, to turn as 12 um of elongation ask."""
    return {"needed": 2 * hinge.STRESS_PER_ANGLE * stack.STROKE_IN_USE / NOMINAL.arm}


def stage_coupler_inertia() -> float:
    """I_bc about the coupler's middle."""
    return dynamics.COUPLER_MASS * NOMINAL.coupler**2 / 12


def stage_at_rest() -> dict[str, Any]:
    """Of equal stacks and of stacks whose elongations add up to 0: mass, stiffness; stiffness with K_b as printed."""
    found, equal, opposed = rrr_stage.analyze(), np.full(3, 3**-0.5), np.array([1, -1, 0]) / np.sqrt(2)
    rounded = 40.8963 / found["hinge_stiffness"] * found["stiffness"]
    return {
        "mass": [v @ found["inertia"] @ v for v in (equal, opposed)],
        "stiffness": [v @ found["stiffness"] @ v for v in (equal, opposed)],
        "with_rounded_hinges": rounded[0, :2],
    }


def stage_as_appendix_d2() -> dict[str, Any]:
    """Numbers a, b, f, g of `appendix_d2`, our model in its functions."""
    return appendix_d2.our_numbers()


def stage_base() -> np.ndarray:
    """G at rest, forces on the stacks by the acceleration of the base, sign reversed."""
    built = dynamics.exact(NOMINAL, ca.SX.sym("p", 3), ca.SX.sym("v", 3))
    to_stacks = ca.jacobian(built.elongation, built.coordinates)
    return np.array(ca.Function("G", [built.coordinates], [ca.inv(to_stacks).T @ dynamics.terms(built).base])(0))


def stage_stress(elongation: list[float]) -> float:
    """Largest bending stress in a hinge."""
    built = dynamics.exact(NOMINAL, ca.SX.sym("p", 3), ca.SX.sym("v", 3))
    angles = ca.Function("angles", [built.coordinates], [built.hinges])(forward(NOMINAL, elongation))
    return hinge.STRESS_PER_ANGLE * np.abs(np.array(angles)).max()


def stage_linear_statics() -> dict[str, Any]:
    """(K0 + k) l = alpha V: elongation of all at 75 and 150 V, voltage for 12 um of one stack and of all."""
    K = rrr_stage.analyze()["stiffness"] + stack.TOKIN.stiffness * np.eye(3)
    volts = stack.STROKE_IN_USE * K / stack.TOKIN.coupling
    full = stack.TOKIN.coupling * np.linalg.solve(K, stack.FULL_VOLTAGE * np.eye(3))
    return {
        "at_75": full[0].sum() / 2,
        "at_150": full[0].sum(),
        "range": np.abs(jacobian("nominal") @ full).sum(axis=1),
        "one": volts[0, 0],
        "all": volts[0].sum(),
    }


# Accelerometer --------------------------------------------------------------------------------------------------------


def accelerometer_design(design: str) -> dict[str, Any]:
    """Dimensions and material of a design, and what 1 N moves it by in the plane."""
    stiffness_in_plane = tba_accelerometer.analyze(design=design)["stiffness"][0]  # type: ignore[arg-type]
    return {**DESIGNS[design].shape._asdict(), "by_one_newton": 1 / stiffness_in_plane}


def accelerometer_shares() -> dict[str, Any]:
    """Bands by the natural frequency, and the sensitivity out of the plane by that in it."""
    found = tba_accelerometer.analyze()
    sensitivity = found["static_sensitivity"]
    return {
        "bands": found["bandwidth_hz"] / found["natural_frequencies_hz"][0],
        "rejection": sensitivity["out_of_plane"] / sensitivity["in_plane"],
    }


def accelerometer_on_a_shaker() -> float:
    """Amplitude of the proof mass on a base that shakes by 1 um at 50 Hz along x."""
    system = linearize(tba_accelerometer.tba_accelerometer())
    s = 2j * np.pi * 50
    row = system.output_labels.index("proof_mass/position[1]")
    column = system.input_labels.index("base/acceleration[1]")
    inside = np.linalg.solve(s * np.eye(system.nstates) - system.A, system.B[:, column])
    return 1e-6 * float(np.abs(s**2 * (system.C[row] @ inside + system.D[row, column])))


# Beam modules ---------------------------------------------------------------------------------------------------------


def beams_to_first_order() -> dict[str, Any]:
    """Three beams, the one at (0, 0, -r) 5 % short, with its stiffness to first order in that."""
    K = beam(1e4, 0.7536)
    short = K * (1 + 0.05 * LENGTH_POWERS)
    return {"C22": side_by_side([K, short, K], ring(0.6, 0.0, 3))[1, 1]}


def beam_rotation() -> dict[str, Any]:
    """How far from the stage a tilted module turns, by how much it misses r / tan(tilt); four beams by three."""
    C = beam_module.analyze(kind="tilted")["compliance"]
    radius, center = C[1, 1] / abs(C[1, 5]), -C[1, 5] / C[5, 5]
    three, four = (beam_module.analyze(kind=kind)["compliance"] for kind in ("double_tilted", "double_tilted_four"))
    return {
        "radius": radius,
        "drift_by_force": radius - 0.6,
        "drift_by_moment": 0.6 - center,
        "four_by_three": np.linalg.norm(four) / np.linalg.norm(three),
    }


def beam_torsion() -> dict[str, Any]:
    """The torsion delta of a round beam by the constants of the examples, and with G from Poisson's ratio."""
    by_poisson = beam_module.analyze(
        dimensions=Dimensions(length=1.0, diameter=0.04), material=Material(E=69e9, nu=0.33)
    )
    usual = beam_module.analyze(dimensions=Dimensions(length=1.0, diameter=0.04), material=Material(E=69e9, G=26e9))
    found = [1 / C["compliance"][3, 3] / 3 - 12 * 0.6**2 for C in (usual, by_poisson)]
    return {"torsion": found[0], "by_poisson": found[1]}
