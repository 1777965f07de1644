"""Design studies of the SDelta: frequency, stiffness and dexterity over its dimensions and postures, and along a path.

The lowest frequency f1, the indices kappa of the stiffness and the condition number are functions of every dimension
that is an argument of `analyze sdelta`, an element of a posture by its place, `posture.position[1]`. A payload that is
the steel cube of its mass remains one. Shafts, gear and pitch are dimensions with the presets that include the shafts.

A path is a table of postures: x, y, z [m] of S and the angles rz, rx, ry [deg] of rotations about z, x, y, in turn.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Literal

import numpy as np

from hfsa.components._mechanics.elastostatics import indices
from hfsa.components._mechanics.modes import modes
from hfsa.components._mechanics.sdelta_geometry import Posture, limbs_at
from hfsa.components._mechanics.sdelta_inertia import Payload
from hfsa.components._mechanics.sdelta_kinematics import CONDITION_LIMIT, Kinematics, Mechanism
from hfsa.components._mechanics.sdelta_robot import Machine, Robot
from hfsa.components._mechanics.sdelta_stiffness import RODS_ONLY, Preset, springs_of
from hfsa.components._modelling.model import ModelError
from hfsa.components._modelling.sampled_study import Dimension, Evaluate, sampled_study
from hfsa.components._modelling.study import Study

Objective = Literal["f1", "kappa", "kappa_t", "kappa_r"]

RESPONSES = {
    "f1": ("Hz", "Lowest natural frequency"),
    "kappa": ("N", "Index of the eigenstiffnesses"),
    "kappa_t": ("N/m", "Index of the translational stiffness"),
    "kappa_r": ("N.m/rad", "Index of the torsional stiffness"),
    "condition_number": ("1", "Condition number"),
}
"""Responses of a design study with their units."""

CONDITIONS = (
    "tubes within their sides of the base",
    f"a posture that is not singular (condition number up to {CONDITION_LIMIT:g})",
    "the present assembly (no singularity between)",
    "rods shorter than the limbs",
    "dimensions that can be built",
)

_SINGULAR, _LOWEST = 1, -1.0
"""Place of the margin of singularity, and its lowest value, at which a posture has no responses."""
_UNBUILT = np.array([1.0] * (len(CONDITIONS) - 1) + [-1.0])

_FREQUENCIES = ("f1", "f2", "f3", "f4", "f5", "f6")
_ANGLES = ("rz", "rx", "ry")
_MOTORS = ("L1", "R1", "L2", "R2", "L3", "R3")
_TURN, _MOVE = 10.0, 0.05
"""Sizes of large changes of a posture [deg], [m]."""

_PARTS: Mapping[str, Mapping[str, tuple[str, str]]] = {
    "geometry": {
        "base_radius": ("m", "Circumradius of the base"),
        "platform_radius": ("m", "Circumradius of the platform"),
    },
    "rods": {
        "length": ("m", "Length of a rod"),
        "diameter": ("m", "Diameter of a rod"),
        "elastic_modulus": ("Pa", "Young's modulus of a rod"),
        "tip_stiffness": ("N/m", "Stiffness of a rod's tip"),
    },
    "shafts": {
        "length": ("m", "Length of a shaft"),
        "diameter": ("m", "Diameter of a shaft"),
        "shear_modulus": ("Pa", "Shear modulus of a shaft"),
        "coupling": ("N.m/rad", "Stiffness of a coupling"),
    },
    "platform": {"mass": ("kg", "Mass of the platform")},
}
_ON_TOP = ("rods", "shafts", "platform")


@dataclass(frozen=True)
class Design:
    """Arguments of `analyze sdelta` that a study varies."""

    posture: Posture
    preset: Preset
    payload: Payload
    machine: Machine

    def robot(self) -> Robot:
        """Return the robot; `ModelError` as `Robot.at`."""
        return Robot.at(self.posture, self.preset, self.payload, self.machine)

    def unchecked_robot(self) -> Robot:
        """Return the robot, though singular, out of reach or with rods that are too long."""
        machine, mechanism = self.machine, self.machine.mechanism
        Q, a = self.posture.matrix, np.array(self.posture.position)
        kinematics = Kinematics(mechanism, Q, a, limbs_at(mechanism.geometry, Q, a))
        springs = springs_of(self.preset, machine.rods, machine.shafts)
        return Robot(machine, kinematics, springs, machine.body(self.payload))


def design_study(design: Design, objective: Objective, title: str) -> Study:
    """Return the study of a design over its dimensions, with a response to maximise."""
    dimensions = _dimensions(design)
    ordered = {objective: RESPONSES[objective], **RESPONSES}
    together = _FREQUENCIES if objective == "f1" else ()
    return sampled_study(
        title,
        dimensions,
        ordered,
        CONDITIONS,
        _evaluate(design, list(ordered), lambda values: _changed(design, list(dimensions), values), together),
        len(together),
        ["The dimensions are free within their bounds: nothing is known of what they cost or where they collide."],
    )


def path_study(design: Design, title: str) -> Study:
    """Return the study of a design along a path: postures as x, y, z, rz, rx, ry."""
    place, turn = design.posture.position, design.posture.rotation
    dimensions = {
        **{n: Dimension(v, _MOVE, "m", f"Position of S, {n}") for n, v in zip("xyz", place, strict=True)},
        **{n: Dimension(v, _TURN, "1", f"Rotation about {n[1]} [deg]") for n, v in zip(_ANGLES, turn, strict=True)},
    }
    names = {
        **{name: ("Hz", f"Natural frequency {name[1]}") for name in _FREQUENCIES},
        **{name: texts for name, texts in RESPONSES.items() if name != "f1"},
        **{f"motor_{name}": ("rad", f"Motor angle {name}") for name in _MOTORS},
    }
    moved = lambda values: replace(design, posture=Posture(tuple(values[3:]), tuple(values[:3])))  # noqa: E731
    return sampled_study(title, dimensions, names, CONDITIONS, _evaluate(design, list(names), moved))


def _evaluate(
    design: Design, names: Sequence[str], changed: Callable[[np.ndarray], Design], together: Sequence[str] = ()
) -> Evaluate:
    """Return a function from values to responses and margins of `CONDITIONS` of a changed design.

    `names` are those of the responses, `together` of those that are maximised together.

    The assembly is that of `design`.
    """
    sign = np.sign(design.robot().kinematics.determinant)

    def evaluate(values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return responses, margins, and what is maximised together."""
        nothing = np.full(len(names), np.nan), np.full(len(together), np.nan)
        try:
            robot = changed(values).unchecked_robot()
        except ModelError:
            return nothing[0], _UNBUILT, nothing[1]
        margins = _margins(robot, sign)
        if margins[_SINGULAR] <= _LOWEST:
            return nothing[0], margins, nothing[1]
        found = _responses(robot)
        return _named(found, names), margins, _named(found, together)

    return evaluate


def _named(found: Mapping[str, float], names: Sequence[str]) -> np.ndarray:
    """Return values by name as an array."""
    return np.array([found[name] for name in names])


def _responses(robot: Robot) -> dict[str, float]:
    """Return all responses of a robot by name."""
    omega = modes(robot.mass, robot.stiffness).omega
    return {
        **dict(zip(_FREQUENCIES, omega / (2 * np.pi), strict=True)),
        **indices(robot.stiffness)._asdict(),
        "condition_number": robot.kinematics.condition_number,
        **{f"motor_{name}": value for name, value in zip(_MOTORS, robot.kinematics.motor_angles + 0.0, strict=True)},
    }


def _margins(robot: Robot, sign: float) -> np.ndarray:
    """Return the margins of `CONDITIONS`; `sign` is that of det N in the assembly of the design."""
    there, mechanism = robot.kinematics, robot.machine.mechanism
    size = mechanism.geometry.platform_radius**3
    return np.array(
        [
            1 - np.abs(there.limbs.slide).max() / mechanism.geometry.reach,
            max(1 - there.condition_number / CONDITION_LIMIT, _LOWEST),
            sign * there.determinant / size,
            1 - robot.machine.rods.length / max(there.limbs.length.min(), 1e-9),
            1.0,
        ]
    )


def _dimensions(design: Design) -> dict[str, Dimension]:
    """Return the dimensions of a design by name."""
    machine, transmission = design.machine, design.machine.mechanism.transmission
    parts = {"geometry": machine.mechanism.geometry, "rods": machine.rods, "shafts": machine.shafts}
    parts["platform"] = machine.platform
    found = {}
    for part, texts in _PARTS.items():
        if part == "shafts" and design.preset in RODS_ONLY:
            continue
        for name, (unit, text) in texts.items():
            value = getattr(parts[part], name)
            is_replaced = part == "rods" and machine.rods.tip_stiffness is not None
            if value is None or (is_replaced and name in ("diameter", "elastic_modulus")):
                continue
            found |= _elements(f"{part}.{name}", value, None, unit, text)
    if design.preset not in RODS_ONLY:
        found |= _elements("gear", transmission.gear, None, "1", "Gear reduction")
        found |= _elements("pitch", transmission.pitch, None, "m", "Pitch of a screw")
    found |= _elements("payload.mass", design.payload.mass, 1.0, "kg", "Mass of the payload")
    found |= _elements("posture.rotation", design.posture.rotation, _TURN, "1", "Rotation about z, x, y [deg]")
    return found | _elements("posture.position", design.posture.position, _MOVE, "m", "Position of S")


def _elements(name: str, value: Any, size: float | None, unit: str, text: str) -> dict[str, Dimension]:
    """Return a dimension, or one for every element of a vector; its size is its value where none is given."""
    if not isinstance(value, tuple):
        return {name: Dimension(value, size or value, unit, text)}
    return {
        f"{name}[{i}]": Dimension(item, size or item, unit, f"{text} ({i})") for i, item in enumerate(value, start=1)
    }


def _changed(design: Design, names: Sequence[str], values: np.ndarray) -> Design:
    """Return a design with the values of its dimensions; `ModelError` for one that cannot be built."""
    given: dict[str, dict[str, Any]] = {}
    for name, value in zip(names, values.tolist(), strict=True):
        part, _, field = name.rpartition(".")
        field, bracket, _ = field.partition("[")
        if bracket:
            given.setdefault(part, {}).setdefault(field, []).append(value)
        else:
            given.setdefault(part, {})[field] = value
    machine, mechanism = design.machine, design.machine.mechanism
    mechanism = Mechanism(
        replace(mechanism.geometry, **given["geometry"]), replace(mechanism.transmission, **given.get("", {}))
    )
    parts = {part: replace(getattr(machine, part), **given[part]) for part in _ON_TOP if part in given}
    return Design(
        Posture(**{name: tuple(vector) for name, vector in given["posture"].items()}),
        design.preset,
        _payload(design.payload, given["payload"]["mass"]),
        replace(machine, mechanism=mechanism, **parts),
    )


def _payload(payload: Payload, mass: float) -> Payload:
    """Return a payload of another mass; what is that of the cube of its mass remains so."""
    cube = Payload(payload.mass)
    own = {f.name: getattr(payload, f.name) for f in fields(payload) if f.name != "mass"}
    return Payload(mass, **{name: value for name, value in own.items() if value != getattr(cube, name)})
