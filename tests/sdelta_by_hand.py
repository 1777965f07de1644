"""The SDelta in finite motion a second time, from the energy of its springs in world coordinates, with numpy."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from hfsa.components import Model
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.model import Kind

Z = np.array([0.0, 0.0, 1.0])


def cross_matrix(v: np.ndarray) -> np.ndarray:
    """Matrix of the cross product with a vector."""
    return np.cross(np.eye(3), v)


def rotation(vector: np.ndarray) -> np.ndarray:
    """Matrix of a rotation vector."""
    return Rotation.from_rotvec(vector).as_matrix()


@dataclass(frozen=True)
class ByHand:
    """Triangles of radii R and r [m], stiffnesses of rods [N/m] and shafts [N.m/rad], pitch [m] and gear."""

    R: float = 0.45
    r: float = 0.15
    k_r: float = 3 * 105e9 * np.pi * 0.0115**4 / 64 / 0.115**3
    k_s: float = np.inf
    pitch: float = 0.06
    gear: float = 6.0

    @cached_property
    def limbs(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
        """Middle of the side, C axis, inward normal and joint from S of each limb."""
        corners = [self.R * np.array([np.cos(a), np.sin(a), 0]) for a in np.deg2rad([210, 330, 90])]
        found = []
        for j in range(3):
            one, other = corners[j], corners[(j + 1) % 3]
            middle, along = (one + other) / 2, (other - one) / np.linalg.norm(other - one)
            found.append((middle, along, np.cross(Z, along), self.r * middle / np.linalg.norm(middle)))
        return found

    def tubes(self, Q: np.ndarray, a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Slides and angles of the tubes of a rigid machine at attitude Q and position a of S."""
        slides, angles = [], []
        for middle, e_c, inward, joint in self.limbs:
            reach = a + Q @ joint - middle
            slides.append(e_c @ reach)
            angles.append(np.arctan2(reach @ Z, reach @ inward))
        return np.array(slides), np.array(angles)

    def moving(self, Q: np.ndarray, a: np.ndarray, twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rates of slides and angles for a twist [rotation, translation of S]."""
        slide_rates, angle_rates = [], []
        spin = cross_matrix(twist[:3])
        for middle, e_c, _, joint in self.limbs:
            arm = Q @ joint
            velocity, reach = twist[3:] + spin @ arm, a + arm - middle
            limb = reach - (reach @ e_c) * e_c
            slide_rates.append(velocity @ e_c)
            angle_rates.append(velocity @ cross_matrix(e_c) @ limb / (limb @ limb))
        return np.array(slide_rates), np.array(angle_rates)

    def energy(self, Q: np.ndarray, a: np.ndarray, slides: np.ndarray, angles: np.ndarray) -> complex:
        """Energy of the springs; all arguments may be complex."""
        V = 0
        for j, (middle, e_c, inward, joint) in enumerate(self.limbs):
            d = a + Q @ joint - middle - slides[j] * e_c
            e_l = np.cos(angles[j]) * inward + np.sin(angles[j]) * Z
            e_n = np.cross(e_c, e_l)
            k_c, k_n = self.k_r, self.k_r
            if np.isfinite(self.k_s):
                k_slide, k_turn = (
                    2 * (2 * np.pi / self.pitch) ** 2 * self.k_s,
                    2 * (self.gear / (d @ e_l)) ** 2 * self.k_s,
                )
                k_c, k_n = (k * self.k_r / (k + self.k_r) for k in (k_slide, k_turn))
            V = V + (k_c * (d @ e_c) ** 2 + k_n * (d @ e_n) ** 2) / 2
        return V

    def gradient(self, Q: np.ndarray, a: np.ndarray, slides: np.ndarray, angles: np.ndarray, arm: np.ndarray):
        """Derivatives of the energy by rotation about and displacement of C = S + Q arm, slides and angles, (12,)."""
        h = 1e-30
        C, found = a + Q @ arm, []
        for k in range(12):
            step = np.zeros(12, complex)
            step[k] = 1j * h
            turned = Q + cross_matrix(step[:3]) @ Q
            moved = C + step[3:6] - turned @ arm
            found.append(self.energy(turned, moved, slides + step[6:9], angles + step[9:]).imag / h)
        return np.array(found)


class Machine:
    """A model of the robot as functions of numbers: right-hand side and outputs, by the names of its variables."""

    def __init__(self, model: Model, **parameters: float):
        self.model, self.functions = model, functions(model)
        self.states = [q.name for q in model.of(Kind.STATE)]
        self.inputs = [q.name for q in model.of(Kind.INPUT)]
        self.outputs = [q.name for q in model.of(Kind.OUTPUT)]
        self.parameters = [parameters.get(q.name, q.start) for q in model.of(Kind.PARAMETER)]

    def rhs(self, x: np.ndarray, u: np.ndarray | dict[str, float]) -> np.ndarray:
        """Derivatives of the states."""
        return np.array(self.functions.rhs(0, x, [], self._column(u), self.parameters)).ravel()

    def out(self, x: np.ndarray, u: np.ndarray | dict[str, float]) -> dict[str, float]:
        """Outputs by name."""
        values = np.array(self.functions.out(0, x, [], self._column(u), self.parameters)).ravel()
        return dict(zip(self.outputs, values.tolist(), strict=True))

    def slope(self, x: np.ndarray, u: np.ndarray | dict[str, float]) -> np.ndarray:
        """Jacobian of the derivatives by the states."""
        return np.array(self.functions.jacobian(0, x, [], self._column(u), self.parameters))

    def _column(self, u: np.ndarray | dict[str, float]) -> np.ndarray:
        return np.array([u.get(name, 0.0) for name in self.inputs]) if isinstance(u, dict) else u


def vector(values: dict[str, float], name: str) -> np.ndarray:
    """Three members of a vector, as `platform.position`."""
    return np.array([values[f"{name}[{i}]"] for i in (1, 2, 3)])


def tube_inputs(slides, angles, slide_rates=(0, 0, 0), angle_rates=(0, 0, 0)) -> dict[str, float]:
    """Inputs of the robot for a motion of its tubes."""
    columns = {"slide": slides, "angle": angles, "slide_rate": slide_rates, "angle_rate": angle_rates}
    return {f"drive[{j + 1}].{name}": column[j] for name, column in columns.items() for j in range(3)}


class Shaken:
    """The robot behind tubes that follow the exact inverse kinematics of a sine of one coordinate of S at `posture`.

    `axis` counts rotations about x, y, z, then positions.
    """

    def __init__(self, machine: Machine, hand: ByHand, posture, axis: int, amplitude: float, frequency: float):
        self.machine, self.hand, self.posture = machine, hand, posture
        self.axis, self.amplitude, self.frequency = axis, amplitude, frequency
        self.at_rest = hand.tubes(posture.matrix, np.array(posture.position))

    def inputs(self, t: float) -> np.ndarray:
        """Inputs of the robot, the rates from the first-order kinematics at the moved pose."""
        omega, unit = 2 * np.pi * self.frequency, np.eye(6)[self.axis]
        moved = self.amplitude * np.sin(omega * t) * unit
        rate = self.amplitude * omega * np.cos(omega * t) * unit
        Q = rotation(moved[:3]) @ self.posture.matrix
        a = np.array(self.posture.position) + moved[3:]
        moving = self.hand.moving(Q, a, rate)
        slides, angles = self.hand.tubes(Q, a)
        return np.concatenate([slides - self.at_rest[0], angles - self.at_rest[1], *moving, np.zeros(12)])

    def harmonics(self, most: int = 3, samples: int = 32, tolerance: float = 1e-8) -> np.ndarray:
        """Complex amplitudes of pose / A, mean to `most`-th harmonic, (most + 1, 6), of the periodic motion.

        The periodic motion is the fixed point of the map of one period, by Newton's method with the linear map.
        """
        period, nominal = 1 / self.frequency, np.repeat([1.0, 0.1, 100.0, 10.0], 3)
        A = self.machine.slope(np.zeros(12), {})
        one = np.linalg.inv(np.eye(12) - expm(A * period))
        x = np.zeros(12)
        times = np.arange(samples) * period / samples
        for _ in range(30):
            run = solve_ivp(
                lambda t, x: self.machine.rhs(x, self.inputs(t)),
                (0, period),
                x,
                method="DOP853",
                rtol=1e-9,
                atol=1e-10 * self.amplitude * nominal,
                t_eval=[*times, period],
            )
            step = one @ (run.y[:, -1] - x)
            x = x + step
            if np.abs(step / nominal).max() < tolerance * self.amplitude:
                break
        else:
            raise AssertionError("the map of one period does not converge")
        poses = []
        for t, state in zip(times, run.y.T[:-1], strict=True):
            values = self.machine.out(state, self.inputs(t))
            poses.append(np.concatenate([vector(values, "platform.rotation"), vector(values, "platform.position")]))
        spectrum = np.fft.rfft(np.array(poses), axis=0) / samples / self.amplitude
        spectrum[1:] *= 2
        return spectrum[: most + 1]
