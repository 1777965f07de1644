"""Numbers of the 3-RRR stage that no analysis returns."""

from dataclasses import replace
from itertools import product
from typing import Any

import appendix_d2
import casadi as ca
import numpy as np
from scipy.optimize import brentq

import hfsa.components
from hfsa.components import rrr_stage
from hfsa.components._mechanics import pzt as stack
from hfsa.components._mechanics import rrr_dynamics as dynamics
from hfsa.components._mechanics.modes import modes
from hfsa.components._mechanics.rrr_hinge import THESIS_HINGE
from hfsa.components._mechanics.rrr_kinematics import CALIBRATED, NOMINAL, forward, jacobian
from hfsa.components._mechanics.rrr_masses import THESIS_MASSES
from hfsa.components._modelling.catalogue import find

_PRINTED_HINGE = 40.8963
"""K_b of table D.3 [N.m/rad]."""


def stage_geometry() -> dict[str, Any]:
    """Angles and hinges of the stage as designed, and the turn from the measurement's axes."""
    return {
        "psi": NOMINAL.psi,
        "psi3": NOMINAL.psi3,
        "A1": NOMINAL.base_hinges[0],
        "B1": NOMINAL.crank_ends[0],
        "A": NOMINAL.base_hinges,
        "B": NOMINAL.crank_ends,
        "C": NOMINAL.corners,
        "turn": NOMINAL.psi - np.pi / 3,
    }


def stage_steps() -> dict[str, Any]:
    """What 0.01 um of one stack moves: x by stack 2, y by stack 3, the yaw by any."""
    J = 1e-8 * jacobian("nominal")
    return {"x": abs(J[0, 1]), "y": abs(J[1, 2]), "yaw": abs(J[2, 0])}


def stage_strength() -> dict[str, Any]:
    """Strength that the hinge at A needs, with a safety of 2, to turn as 12 um of elongation ask; stress allowed."""
    needed = 2 * THESIS_HINGE.stress_per_angle * stack.STROKE_IN_USE / NOMINAL.arm
    return {"needed": needed, "allowed": THESIS_HINGE.allowed_stress}


def stage_calibration() -> dict[str, Any]:
    """Corner of 0 to 12 um where nominal links miss the measured pose by most, and links that meet the pose there.

    The error counts micrometres and tenths of a milliradian. At the elongations (l, 0, l) the rows of J0^-1 say

        psi = direction of (x, y),  R = -|(x, y)| / (yaw sin(psi)),  L_AB sin(psi3) = 3/2 |(x, y)| R0 / l

    which the calibrated links' other two, psi_2 and L_BC, make psi_1 and L_AB of.
    """
    corners = stack.STROKE_IN_USE * np.array(list(product((0, 1), repeat=3)))
    missed = (jacobian("nominal") - jacobian("measured")) @ corners.T * [[1.0], [1.0], [1e-2]]
    corner = corners[np.argmax(np.linalg.norm(missed, axis=0))]
    x, y, yaw = jacobian("measured") @ corner
    psi, across = np.arctan2(y, x), 1.5 * np.hypot(x, y) * CALIBRATED.arm / stack.STROKE_IN_USE

    def excess(crank: float) -> float:
        """L_AB sin(psi3) of a crank beyond the one that meets the pose."""
        return crank * np.sin(replace(CALIBRATED, crank=crank).psi3) - across

    return {
        "corner": corner,
        "psi1": psi - CALIBRATED.psi2,
        "radius": -np.hypot(x, y) / (yaw * np.sin(psi)),
        "crank": brentq(excess, 0.9 * CALIBRATED.crank, 1.1 * CALIBRATED.crank),
    }


def stage_link_inertias() -> dict[str, Any]:
    """I_ab of a rod about its end, I_bc of a rod about its middle, I_e by which D.2 was made."""
    return {
        "platform": THESIS_MASSES.platform * NOMINAL.radius**2 / 12,
        "crank": THESIS_MASSES.crank * NOMINAL.crank**2 / 3,
        "coupler": THESIS_MASSES.coupler * NOMINAL.coupler**2 / 12,
    }


def stage_at_rest() -> dict[str, Any]:
    """Of equal stacks and of stacks whose elongations add up to 0: mass, stiffness; stiffness with K_b as printed."""
    found, equal, opposed = rrr_stage.analyze(), np.full(3, 3**-0.5), np.array([1, -1, 0]) / np.sqrt(2)
    rounded = _PRINTED_HINGE / found["hinge_stiffness"] * found["stiffness"]
    return {
        "mass": [v @ found["inertia"] @ v for v in (equal, opposed)],
        "stiffness": [v @ found["stiffness"] @ v for v in (equal, opposed)],
        "with_rounded_hinges": rounded[0, :2],
    }


def stage_as_appendix_d2() -> dict[str, Any]:
    """Numbers of the functions of `appendix_d2` in our model without the yaw in the hinges' energy."""
    return appendix_d2.our_numbers()


def stage_without_yaw() -> dict[str, Any]:
    """What follows from the functions of `appendix_d2`: our model without the yaw, H(l) = -dP/dl(-l), K_b rounded."""
    ours, length = appendix_d2.our_model(), appendix_d2.length
    evaluate = ca.Function("D2", [length], [ours.K, ca.jacobian(ours.H, length), ours.H])
    mass, stiffness, _ = (np.array(matrix) for matrix in evaluate(0))
    stiffness *= _PRINTED_HINGE / THESIS_HINGE.stiffness
    return {
        "stiffness": stiffness[0, :2],
        "natural_frequencies_hz": modes(mass, stiffness).omega / (2 * np.pi),
        "force": -np.array(evaluate(-stack.STROKE_IN_USE)[2]).ravel(),
    }


def stage_pd_gains(proportional_gains: list[float], derivative_gains: list[float]) -> dict[str, Any]:
    """Time constants under PD of pairs of gains that make the error die away, and how many those are.

    The error's modes have m s^2 + Kv s + k + Kp = 0: equal stacks, and stacks whose elongations add up to 0.
    """
    rest = stage_at_rest()
    constants = []
    for Kp, Kv in zip(proportional_gains, derivative_gains, strict=True):
        poles = [np.roots([m, Kv, k + Kp]) for m, k in zip(rest["mass"], rest["stiffness"], strict=True)]
        if (slowest := -np.max(np.real(poles))) > 0:
            constants.append(1 / slowest)
    return {"converging": len(constants), "time_constants": np.array(constants)}


def stage_base() -> np.ndarray:
    """G at rest, forces on the stacks by the acceleration of the base, sign reversed."""
    built = dynamics.exact(NOMINAL, ca.SX.sym("p", 3), ca.SX.sym("v", 3))
    to_stacks = ca.jacobian(built.elongation, built.coordinates)
    return np.array(ca.Function("G", [built.coordinates], [ca.inv(to_stacks).T @ dynamics.terms(built).base])(0))


def stage_stress(elongation: list[float]) -> float:
    """Largest bending stress in a hinge."""
    built = dynamics.exact(NOMINAL, ca.SX.sym("p", 3), ca.SX.sym("v", 3))
    angles = ca.Function("angles", [built.coordinates], [built.hinges])(forward(NOMINAL, elongation))
    return THESIS_HINGE.stress_per_angle * np.abs(np.array(angles)).max()


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


def stage_finite_elements(bolts: str, modulus: float) -> dict[str, Any]:
    """Largest von Mises stress, levers held sideways: 12 um of one stack at a time and of all, and their ratio."""
    at = {"bolts": bolts, "contact": "locked", "hinge.elastic_modulus": modulus}
    part = find([hfsa.components])["rrr_stage"]

    def largest(elongation: tuple[float, float, float]) -> float:
        found = part.analysis("continuum", elongation=elongation, **at)
        return max(found["hinge_stress"].values())

    one = [largest(tuple(stack.STROKE_IN_USE * np.eye(3)[k])) for k in range(3)]
    every = largest((stack.STROKE_IN_USE,) * 3)
    return {"one": one, "all": every, "ratio": every / one[0]}
