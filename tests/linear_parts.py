"""Linear parts with free coefficients, of which tests make rings at random; the same rings stand in plain numpy.

A ring's part i has x' = A x + B u + [push; 0], y = C x, and follows the part before it, u_i = y_(i-1); the last feeds
the first. In a sampled ring the last part is a law without states, w = k u, held from tick to tick.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np

from hfsa.components import Model
from hfsa.cosim.systems.system import Component, Connection, System


def linear() -> Model:
    """One part of a ring."""
    m = Model("Linear", "Two states with free coefficients")
    a = m.parameter("a[1..4]", [0.0, 1.0, -1.0, -1.0], "1/s", "Matrix A, by rows")
    b = m.parameter("b[1..2]", 0.0, "1/s", "Column B")
    c = m.parameter("c[1..2]", 0.0, "1", "Row C")
    u, push = m.input("u", "1", "Input"), m.input("push", "1/s", "Push on the first state")
    x = m.state("x[1..2]", "1", "State")
    m.der[x] = ca.reshape(a, 2, 2).T @ x + b * u + ca.vertcat(push, 0)
    m.output("y", c.T @ x, "1", "Output")
    return m


def held_law() -> Model:
    """The law of a sampled ring."""
    m = Model("HeldLaw", "Gain, sampled and held")
    m.sample_time(0.01)
    k, u = m.parameter("k", 1.0, "1", "Gain"), m.input("u", "1", "Input")
    m.sampled_output("y", k * u, "1", "Output")
    return m


@dataclass(frozen=True)
class Ring:
    """Parts (A, B, C), and the law (k, sample time [s]) that closes them; without one they close themselves."""

    parts: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]
    law: tuple[float, float] | None = None

    def system(self) -> System:
        """Return the ring as components `part[i]` and `law`."""
        names = [f"part[{i}]" for i in range(1, len(self.parts) + 1)]
        components = [
            Component(
                name,
                "linear",
                start={"a[1..4]": A.ravel().tolist(), "b[1..2]": B.tolist(), "c[1..2]": C.tolist()},
            )
            for name, (A, B, C) in zip(names, self.parts, strict=True)
        ]
        if self.law is not None:
            components.append(Component("law", "held_law", start={"k": self.law[0], "sample_time": self.law[1]}))
            names.append("law")
        fed = [Connection(f"{a}.y", f"{b}.u") for a, b in zip([names[-1], *names[:-1]], names, strict=True)]
        return System(components, fed)

    def files(self, linear: Path, law: Path) -> Mapping[str, Path]:
        """Return the FMU of each component."""
        return {c.name: law if c.part == "held_law" else linear for c in self.system().components}

    def growth(self) -> float:
        """Return the rate [1/s] of the fastest mode without communication steps."""
        A, B, C = self._chain()
        if self.law is None:
            return float(np.linalg.eigvals(A + B @ C).real.max())
        k, sample_time = self.law
        return float(np.log(np.abs(np.linalg.eigvals(_held(A, B, sample_time) @ _closed(k * C))).max()) / sample_time)

    def shifted(self, rate: float) -> "Ring":
        """Return the ring whose parts all decay more slowly by a rate [1/s]."""
        return Ring([(A + rate * np.eye(2), b, c) for A, b, c in self.parts], self.law)

    def stepped_growth(self, step_size: float) -> float:
        """Return that of Gauss-Seidel with held inputs; the step [s] is the sample time where there is one."""
        n = 2 * len(self.parts)
        state = np.eye(n)
        law = self.law[0] * self._chain()[2] if self.law else self._chain()[2]
        fed = law @ state
        for i, (A, B, C) in enumerate(self.parts):
            rows = slice(2 * i, 2 * i + 2)
            moved = _held(A, B[:, None], step_size)
            state[rows] = moved[:, :2] @ state[rows] + moved[:, 2:] @ fed
            fed = C[None, :] @ state[rows]
        return float(np.log(np.abs(np.linalg.eigvals(state)).max()) / step_size)

    def _chain(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return (A, B, C) of the parts in a row, from the first input to the last output."""
        n = 2 * len(self.parts)
        A, B, C = np.zeros((n, n)), np.zeros((n, 1)), np.zeros((1, n))
        for i, (own, b, _) in enumerate(self.parts):
            A[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = own
            if i:
                A[2 * i : 2 * i + 2, 2 * i - 2 : 2 * i] = np.outer(b, self.parts[i - 1][2])
        B[:2, 0] = self.parts[0][1]
        C[0, -2:] = self.parts[-1][2]
        return A, B, C


def _held(A: np.ndarray, B: np.ndarray, step: float) -> np.ndarray:
    """Return [x; u] -> x after a step with u held."""
    n, m = B.shape
    generator = np.zeros((n + m, n + m))
    generator[:n] = np.hstack([A, B]) * step
    values, vectors = np.linalg.eig(generator)
    return (vectors * np.exp(values) @ np.linalg.inv(vectors)).real[:n]


def _closed(K: np.ndarray) -> np.ndarray:
    """Return x -> [x; K x]."""
    return np.vstack([np.eye(K.shape[1]), K])


def random_ring(rng: np.random.Generator, growth: float | None = None) -> tuple[Ring, float]:
    """Return a ring of two or three parts, and a step [s]; some are sampled, at the step.

    With a growth [1/s] all rates are shifted so that the fastest mode has about that.
    """
    count, is_sampled = int(rng.integers(1, 4)), bool(rng.integers(2))
    count = max(count, 1 if is_sampled else 2)
    fastest = 10 ** rng.uniform(0, 3)
    step = 10 ** rng.uniform(-2, -0.5) / fastest
    parts = []
    for _ in range(count):
        omega, zeta = fastest * rng.uniform(0.2, 1), 10 ** rng.uniform(-3, 0)
        A = np.array([[0, omega], [-omega, -2 * zeta * omega]])
        parts.append((A, np.array([0, omega * rng.uniform(0.2, 1)]), rng.normal(size=2) * rng.uniform(0.2, 1)))
    ring = Ring(parts, (float(rng.normal()), step) if is_sampled else None)
    return ring if growth is None else ring.shifted(growth - ring.growth()), step
