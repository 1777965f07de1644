"""The piece with its contacts, its bolts and its platform: matrices on elongations and pose, statics of the stage.

The pose q is x, y and yaw of the platform at O, in the axes of the stage. A `pin` lets the bolt of a leg turn, a
`rigid` joint turns it with the platform; a contact holds s and phi of a contact edge, leaves them free, or joins them
to the stack's stiffness. Without loads on the coordinates f that are left free,

    K_c = K_cc - K_cf K_ff^-1 K_fc = [[K_ll, K_lq], [K_ql, K_qq]]        on l (3) and q (3)
    J = -K_qq^-1 K_ql,   K_a = K_ll + K_lq J                             with the platform free
    K_qq - K_ql (K_ll + k 1)^-1 K_lq                                     seen by the platform, stacks of stiffness k
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from hfsa.components._continuum.piece import COORDINATES, Piece, turn
from hfsa.components._mechanics.pzt import Stack
from hfsa.components._mechanics.rrr_contact import Bolts, Contact, held, sideways_stiffness
from hfsa.components._mechanics.rrr_kinematics import OFFSETS, Links
from hfsa.components._mechanics.rrr_masses import Masses

_SIZE = len(COORDINATES)


class Joints(NamedTuple):
    """How a stage is held: contacts with its stacks, bolts of its platform, and the stacks themselves."""

    contact: Contact
    bolts: Bolts
    stack: Stack


class Stage:
    """Stage of a piece; l and q are the first six of its coordinates, then those left free, then modes of the piece.

    Attributes:
        interface: interface coordinates of the piece by l, q and those left free, shape (18, 6 + f).
        stiffness: K, shape (n, n) [N/m; N, N.m for angles], without the stacks along their axes.
        mass: M, shape (n, n) [kg; kg.m, kg.m2 for angles], with the platform.
        momentum: M times unit velocities of the base along x and y, shape (n, 2) [kg].
        pushes: unit vectors along the pushes of the stacks in the axes of the stage, shape (3, 2).
    """

    def __init__(self, piece: Piece, bolt: tuple[float, float], links: Links, masses: Masses, joints: Joints):
        """Join a piece, whose bolt is at `bolt` [m] in the frame of leg 2, to platform and contacts."""
        axes = links.psi - np.pi / 2 + OFFSETS
        self.pushes = np.column_stack([np.sin(axes), -np.cos(axes)])
        self.interface = _interface(axes, bolt, joints)
        modes = len(piece.omega)
        whole = np.block(
            [
                [self.interface, np.zeros((len(self.interface), modes))],
                [np.zeros((modes, self.interface.shape[1])), np.eye(modes)],
            ]
        )
        elastic = piece.stiffness + np.kron(np.eye(3), _sideways(joints))
        n = self.interface.shape[1] + modes
        self.stiffness = np.zeros((n, n))
        self.stiffness[:-modes, :-modes] = self.interface.T @ elastic @ self.interface
        self.stiffness[-modes:, -modes:] = np.diag(piece.omega**2)
        self.mass = whole.T @ piece.mass @ whole
        self.mass[3:6, 3:6] += np.diag([masses.platform, masses.platform, masses.platform_inertia])
        self.momentum = whole.T @ piece.momentum @ turn(axes[1]).T
        self.momentum[3:5] += masses.platform * np.eye(2)

    @cached_property
    def statics(self) -> "Statics":
        """Statics on elongations and pose."""
        free = slice(6, self.interface.shape[1])
        K = self.stiffness
        follow = np.linalg.solve(K[free, free], K[free, :6])
        condensed = K[:6, :6] - K[:6, free] @ follow
        return Statics((condensed + condensed.T) / 2, self.interface[:, :6] - self.interface[:, free] @ follow)


class Statics(NamedTuple):
    """Statics of a stage.

    Attributes:
        stiffness: K_c on l and q, shape (6, 6) [N/m; N, N.m].
        interface: interface coordinates of the piece by l and q, shape (18, 6).
    """

    stiffness: np.ndarray
    interface: np.ndarray

    @property
    def jacobian(self) -> np.ndarray:
        """J from elongations to pose, platform free, shape (3, 3) [m/m; m/m; rad/m]."""
        return -np.linalg.solve(self.stiffness[3:, 3:], self.stiffness[3:, :3])

    @property
    def on_stacks(self) -> np.ndarray:
        """K_a, stiffness on the elongations, platform free, shape (3, 3) [N/m]."""
        K = self.stiffness[:3, :3] + self.stiffness[:3, 3:] @ self.jacobian
        return (K + K.T) / 2

    def on_platform(self, stack_stiffness: float) -> np.ndarray:
        """Return the stiffness on the pose, with stacks of a stiffness [N/m], shape (3, 3) [N/m; N, N.m]."""
        K = self.stiffness
        return K[3:, 3:] - K[3:, :3] @ np.linalg.solve(K[:3, :3] + stack_stiffness * np.eye(3), K[:3, 3:])

    @property
    def blocked(self) -> np.ndarray:
        """Stiffness on the pose at elongations of zero, shape (3, 3) [N/m; N, N.m]."""
        return self.stiffness[3:, 3:]


def _interface(axes: np.ndarray, bolt: tuple[float, float], joints: Joints) -> np.ndarray:
    """Return the interface coordinates by l, q and those left free; `axes` are the polar angles of the x' (3,)."""
    by_pose = np.zeros((3, _SIZE, 3))
    x, y = bolt
    for leg, axis in enumerate(axes):
        along_x, along_y = turn(-axis)
        by_pose[leg, 3] = [*-along_y, -x]
        by_pose[leg, 4] = [*along_x, -y]
        by_pose[leg, 5, 2] = float(joints.bolts == "rigid")
    holds_side, holds_turn = held(joints.contact)
    is_free = {"s": not holds_side, "phi": not holds_turn, "theta": joints.bolts == "pin"}
    unit = np.eye(_SIZE)
    free = [unit[:, [COORDINATES.index(name)]] for name, is_left in is_free.items() if is_left]
    columns = [np.kron(np.eye(3), unit[:, :1]), by_pose.reshape(3 * _SIZE, 3)]
    return np.hstack([*columns, *(np.kron(np.eye(3), column) for column in free)])


def _sideways(joints: Joints) -> np.ndarray:
    """Return the stiffness of a contact on the interface coordinates of its leg, shape (6, 6)."""
    stiffness = np.zeros((_SIZE, _SIZE))
    stiffness[1:3, 1:3] = sideways_stiffness(joints.contact, joints.stack)
    return stiffness
