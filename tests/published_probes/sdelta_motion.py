"""Numbers of the SDelta that no analysis returns: what the platform does by motors, wrench and weight."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import scipy.linalg
from scipy.optimize import brentq

from hfsa.components import sdelta
from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC
from hfsa.components._mechanics.sdelta_inertia import CUBE, with_payload
from hfsa.components._mechanics.sdelta_kinematics import Kinematics
from hfsa.components._mechanics.sdelta_robot import Machine
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind
from hfsa.controllers import sdelta_tuning

_POSE = [f"platform/{kind}[{i}]" for kind in ("rotation", "position") for i in (1, 2, 3)]
_WRENCH = [f"wrench/{kind}[{i}]" for kind in ("torque", "force") for i in (1, 2, 3)]
_TUBES = [f"drive[{j}]/{kind}" for j in (1, 2, 3) for kind in ("slide", "angle")]


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
    rotors = Machine().drive_inertia if drives else Machine().limbs.rotor_inertia * np.eye(6)
    mass = scipy.linalg.block_diag(rotors, robot["mass_C"])
    return np.sqrt(scipy.linalg.eigh(join.T @ robot["stiffness_C"] @ join, mass, eigvals_only=True)[6:]) / (2 * np.pi)


def sdelta_motor_inertia() -> dict[str, Any]:
    """Inertia that the motors see."""
    M = sdelta_tuning.analyze()["motor_inertia"]
    return {"diagonal": np.diag(M), "eigenvalues": np.linalg.eigvalsh(M)}
