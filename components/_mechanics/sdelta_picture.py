"""Picture of the SDelta at a posture: base, tubes, limbs and platform, each mode with its screw, and elastic axes.

Tubes stand still in a mode, and limb j ends at the displaced joint S_j + theta x (S_j - C) + d, with the modal screw
[theta; d] about C.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from hfsa.components._mechanics.cartesian_numbers import modal_numbers, static_numbers
from hfsa.components._mechanics.sdelta_geometry import C_AXES
from hfsa.components._mechanics.sdelta_robot import Robot
from hfsa.components._modelling.drawing import Drawing, Layer, Moving, Panel, Role, columns, named

_SHIFT = 0.35
"""Largest displacement of a joint drawn, relative to the radius of the platform."""
_AXIS = 1.4
"""Half the length of an axis, relative to the radius of the platform."""
_TUBE = 0.3
"""Half the length of a tube as drawn, relative to the farthest that it slides."""
_FACE = np.array([[0, 1, 2]])
_LINES = np.arange(6).reshape(2, 3).T
"""Cells of three lines between two rows of three points."""
_TO_TUBE, _FROM_TUBE = np.array([0, 3]), np.array([3, 6])
"""Shifts of those cells among corner, corner, end and end of a tube on each side of the base."""
_MODES = 6


def robot_drawing(robot: Robot, title: str) -> Drawing:
    """Return the drawing of a robot at its posture, and of its six modes with held tubes."""
    radius = robot.machine.mechanism.geometry.platform_radius
    found = modal_numbers(robot.mass, robot.stiffness, {"_C": np.zeros(3)}, "_C", radius)
    words = ("limbs", "platform")
    first = [*_base(robot, "base, C axes", "tubes"), *_limbs(robot, joints(robot), "body", words), *_centers(robot)]
    panels = [Panel(first, title="posture", kind="posture")]
    axes = []
    for i in range(_MODES):
        kind, pitch = found["modal_kinds"][i], found["modal_pitches"][i]
        heading = f"mode {i + 1}: {found['natural_frequencies_hz'][i]:.4g} Hz, {kind}"
        heading += f", pitch {1e3 * pitch:.3g} mm" if kind == "screw" else ""
        place = found["modal_directions"][:, i], found["modal_points_C"][:, i]
        # modes 3 and 6 of the symmetric posture have one axis: texts are at either end in turn
        text = f"{i + 1}, {kind}"
        axes.append(_axis(robot, *place, [text, ""] if i % 2 else ["", text]))
        moved = displaced_joints(robot, found["modal_screws_C"][:, i])
        layers = [
            *_base(robot),
            *_limbs(robot, joints(robot), "rest"),
            *_limbs(robot, moved, "moved"),
            _axis(robot, *place),
        ]
        panels.append(Panel(layers, title=heading, kind="modes"))
    screws = [*_base(robot), *_limbs(robot, joints(robot), "rest"), *_centers(robot), *axes]
    panels.append(Panel(screws, title="modal screws", kind="modal_screws"))
    return Drawing(title, [*panels, *_elastic_axes(robot)])


def robot_in_motion(robot: Robot, reference_point: str) -> Moving:
    """Return the robot as its platform moves, with a pose of `reference_point` from the posture; tubes stand still."""
    words = ("limbs", "platform")
    layers = [*_base(robot, "base, C axes", "tubes"), *_limbs(robot, joints(robot), "body", words)]
    from scipy.spatial.transform import Rotation  # loaded where a run is drawn

    S = robot.kinematics.position
    pivot = S if reference_point == "S" else S + robot.offset
    arms = joints(robot) - pivot

    def displacements(signals: Mapping[str, np.ndarray]) -> list[np.ndarray | None]:
        """Return the displacements: of the joints, and of the ends of the limbs."""
        turned = Rotation.from_rotvec(columns(signals, "platform.rotation", 3)).as_matrix() - np.eye(3)
        shift = np.einsum("nij,kj->nki", turned, arms) + columns(signals, "platform.position", 3)[:, None]
        return [None, None, np.concatenate([np.zeros_like(shift), shift], axis=1), shift]

    signals = [*named("platform.rotation", 3), *named("platform.position", 3)]
    return Moving(Panel(layers, title="SDelta"), signals, displacements)


def joints(robot: Robot) -> np.ndarray:
    """Return the joints S_j of the platform at the posture, rows in world axes, shape (3, 3) [m]."""
    return robot.kinematics.position + robot.machine.mechanism.geometry.joints @ robot.kinematics.Q.T


def feet(robot: Robot) -> np.ndarray:
    """Return the middles of the tubes, from which the limbs rise, rows in world axes, shape (3, 3) [m]."""
    return robot.machine.mechanism.geometry.middles + robot.kinematics.limbs.slide[:, None] * C_AXES


def displaced_joints(robot: Robot, screw: np.ndarray) -> np.ndarray:
    """Return the joints displaced along a small screw about C (6,), at a visible scale, shape (3, 3) [m]."""
    at_rest = joints(robot)
    center = robot.kinematics.position + robot.offset
    shifts = np.cross(screw[:3], at_rest - center) + screw[3:]
    largest = np.linalg.norm(shifts, axis=1).max()
    return at_rest + _SHIFT * robot.machine.mechanism.geometry.platform_radius / largest * shifts


def _base(robot: Robot, base: str = "", tubes: str = "") -> list[Layer]:
    """Return the triangle of the base, whose sides are the C axes, and the tubes on them; texts are their names."""
    geometry, middles = robot.machine.mechanism.geometry, feet(robot)
    side, half = geometry.reach * C_AXES, _TUBE * geometry.reach * C_AXES
    corners, ends = np.vstack([geometry.middles - side, geometry.middles + side]), [middles - half, middles + half]
    return [
        Layer(np.vstack([corners, *ends]), np.vstack([_LINES + _TO_TUBE, _LINES + _FROM_TUBE]), "mark", base),
        Layer(np.vstack(ends), _LINES, "moved" if tubes else "rest", tubes, notes=_tube_notes(robot)),
    ]


def _tube_notes(robot: Robot) -> list[str]:
    """Return the notes on the tubes."""
    limbs = robot.kinematics.limbs
    pairs = zip(1e3 * limbs.slide, np.rad2deg(limbs.angle), strict=True)
    return [f"tube {j}: slide {slide:.4g} mm, angle {angle:.4g} deg" for j, (slide, angle) in enumerate(pairs, 1)]


def _limbs(robot: Robot, ends: np.ndarray, role: Role, words: tuple[str, str] = ("", "")) -> list[Layer]:
    """Return the limbs from their tubes to given joints, and the platform between the joints; `words` are names."""
    at_rest = joints(robot) if role == "moved" else None
    below = None if at_rest is None else np.vstack([feet(robot), at_rest])
    lengths = [f"limb {j}: {1e3 * length:.4g} mm" for j, length in enumerate(robot.kinematics.limbs.length, 1)]
    return [
        Layer(np.vstack([feet(robot), ends]), _LINES, role, words[0], notes=lengths, rest=below),
        Layer(ends, _FACE, role, words[1], notes=[_platform_note(robot)], rest=at_rest),
    ]


def _platform_note(robot: Robot) -> str:
    """Return the note on the platform."""
    radius = robot.machine.mechanism.geometry.platform_radius
    return f"platform: radius {1e3 * radius:.4g} mm, {robot.mass[5, 5]:.4g} kg with the payload"


def _centers(robot: Robot) -> list[Layer]:
    """Return the points S and C."""
    S = robot.kinematics.position
    return [Layer(np.array([S, S + robot.offset]), np.array([[0], [1]]), "mark", "", texts=["S", "C"])]


def _elastic_axes(robot: Robot) -> list[Panel]:
    """Return the panels of the compliant axes and of the eigenscrews of the stiffness."""
    found = static_numbers(robot.stiffness, {"_C": np.zeros(3)}, robot.machine.mechanism.geometry.platform_radius)
    forces = [f"{k:.4g} N/m" for k in found["translational_stiffness"]]
    moments = [f"{k:.4g} N.m/rad" for k in found["torsional_stiffness"]]
    screws = [f"{k:.4g} N" for k in found["eigenstiffness"]]
    # rotations and translations, and eigenscrews of either sign, may have one axis: each has an end of its own
    kinds = {
        "compliant axes": [
            ("wrench_compliant", [["", k] for k in forces]),
            ("twist_compliant", [[k, ""] for k in moments]),
        ],
        "eigenscrews": [("eigenscrew", [[k, ""] if k.startswith("-") else ["", k] for k in screws])],
    }
    panels = []
    for title, axes in kinds.items():
        layers = [*_base(robot), *_limbs(robot, joints(robot), "rest"), *_centers(robot)]
        for kind, texts in axes:
            directions, points = found[f"{kind}_directions"], found[f"{kind}_points_C"]
            layers += [_axis(robot, directions[:, i], points[:, i], text) for i, text in enumerate(texts)]
        panels.append(Panel(layers, title=title, kind=title.replace(" ", "_")))
    return panels


def _axis(robot: Robot, direction: np.ndarray, point: np.ndarray, texts: Sequence[str] = ()) -> Layer:
    """Return the axis of a screw through a point relative to C, with texts at its ends."""
    through = robot.kinematics.position + robot.offset + point
    half = _AXIS * robot.machine.mechanism.geometry.platform_radius * direction
    return Layer(np.array([through - half, through + half]), np.array([[0, 1]]), "axis", texts=texts)
