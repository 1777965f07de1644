"""A second-order system under feedback of position and rate: its poles, and how slowly the feedback may be sampled.

    M x'' + C x' + K x = u,   u = -P x - (D + T E) x'     taken at each tick and held until the next one, T later,
                                                          or, with a delay, put out one tick late

M is symmetric and positive definite, the others are symmetric, all of shape (n, n). Poles and limits keep their digits
where frequency and damping are many powers of ten apart.
"""

import numpy as np
from scipy.linalg import eigh, expm
from scipy.optimize import brentq

_BELOW = 1e-2
"""Where the search begins, relative to the shortest time that the hold may matter at."""
_GROWTH = 1.2
"""From one sample time of the search to the next."""
_HALVINGS = 30
"""Sample times of the search towards one at which a mode of the plant is sampled twice per period."""
_DIGITS = 1e-12
"""Relative accuracy of the limit."""
_ABOVE = 1e3
"""Where the search ends, relative to the slowest time constant."""
_SEPARATE = 1e-3
"""Sample time, relative to the fastest rate, below which the delayed command is a fast part of its own."""
_OVERDAMPED = 1e4
"""Square of a loop's rates over its stiffness above which its fast poles know nothing of its slow ones."""
_FIXED_POINT = 6
"""Iterations that then find it: each gains a factor `_SEPARATE` at least."""


def poles(M: np.ndarray, C: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Return the poles of M x'' + C x' + K x = 0, shape (2 n,) [1/s], ordered by size.

    Eigenvalues of a matrix lose a damping that is small beside the frequency. So each mode shape v is put into the
    equation: s^2 v'Mv + s v'Cv + v'Kv = 0, whose roots are as exact as the three numbers.
    """
    C, K = _per_mass(M, C), _per_mass(M, K)
    guesses, shapes = _modes(C, K)
    shapes = shapes / np.linalg.norm(shapes, axis=0)
    half, square = (np.einsum("ik,ij,jk->k", shapes.conj(), matrix, shapes).real for matrix in (C / 2, K))
    fast = -(half + np.sqrt(half**2 - square + 0j))
    slow = np.divide(square, fast, out=np.zeros_like(fast), where=fast != 0)
    roots = np.where(np.abs(fast - guesses) < np.abs(slow - guesses), fast, slow) + 0.0
    return roots[np.lexsort((roots.imag, np.abs(roots)))]


def _modes(C: np.ndarray, K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the poles of x'' + C x' + K x = 0 roughly, (2 n,), and their shapes, columns of (n, 2 n)."""
    n, rates = len(C), np.linalg.eigvalsh(C)
    if rates[0] ** 2 > _OVERDAMPED * np.abs(K).max():
        fast, slow = -eigh(C)[0], -eigh(K, C)[0]  # C x' is held by x'' alone, or by K x alone
        shapes = [eigh(C + K / s)[1][:, i] for i, s in enumerate(fast)]  # what was left out turns alike modes far
        shapes += [eigh(K, C + s * np.eye(n))[1][:, i] for i, s in enumerate(slow)]
        return np.concatenate([fast, slow]), np.array(shapes).T
    scale = max(np.sqrt(np.abs(K).max()), rates[-1]) or 1.0
    found, vectors = np.linalg.eig(np.block([[np.zeros((n, n)), np.eye(n)], [-K / scale**2, -C / scale]]))
    return scale * found, vectors[:n]


def sample_time_limit(
    M: np.ndarray, C: np.ndarray, K: np.ndarray, P: np.ndarray, D: np.ndarray, E: np.ndarray, *, delay: bool
) -> float:
    """Return the sample time [s] below which the held feedback is stable.

    E is for feedback that makes up for its own sampling. 0 where the loop is not stable without sampling, or its
    damping is lost in the rounding of its frequency; infinite where every sample time is stable.
    """
    s = poles(M, C + D, K + P)
    decay = -np.real(s)
    if decay.min() <= 0:
        return 0.0
    C, K, P, D, E = (_per_mass(M, matrix) for matrix in (C, K, P, D, E))
    own_rates = np.sqrt(np.maximum(np.linalg.eigvalsh(K), 0))
    margin = _Margin(C, K, P, D, E, scale=float(max(np.abs(s).max(), own_rates[-1])), delay=delay)
    undamped = np.min(2 * decay / np.abs(s) ** 2)  # where the hold alone takes the damping of a pole
    below = _BELOW / max(1 / undamped, own_rates[-1])
    if margin(below) > 0:
        return 0.0
    for above in _trial_times(below, _ABOVE / decay.min(), own_rates):
        if margin(above) > 0:
            return brentq(margin, below, above, xtol=_DIGITS * below, rtol=_DIGITS)  # type: ignore[return-value]
        below = above
    return np.inf


def _trial_times(below: float, end: float, own_rates: np.ndarray) -> np.ndarray:
    """Sample times in ascending order that no unstable interval slips through.

    Under weak feedback the first one may be narrow: it ends where a mode of the plant is sampled twice per period.
    """
    even = below * _GROWTH ** np.arange(1, np.log(end / below) / np.log(_GROWTH))
    twice = np.pi / own_rates[own_rates > 0]
    times = np.concatenate([even, np.outer(twice, 1 - 0.5 ** np.arange(1, _HALVINGS)).ravel()])
    return np.sort(times[(times > below) & (times < end)])


class _Margin:
    """Whether a sample time T is stable: negative there.

    With z = 1 + T d an eigenvalue of the tick map, |z| < 1 is 2 Re d + T |d|^2 < 0. The d are the eigenvalues of
    (tick map - 1) / T, which phi(A T) = (exp(A T) - 1) / (A T) gives without a difference, for T however small.
    """

    def __init__(self, C, K, P, D, E, *, scale: float, delay: bool):
        n = len(C)
        self.scale, self.delay = scale, delay
        self.plant = np.block([[np.zeros((n, n)), scale * np.eye(n)], [-K / scale, -C]])  # of scale x and x'
        self.gain, self.growth = np.hstack([P / scale, D]), np.hstack([np.zeros((n, n)), E])
        self.entry = np.vstack([np.zeros((n, n)), np.eye(n)])

    def __call__(self, T: float) -> float:
        n = len(self.plant)
        whole = np.block([[self.plant * T, np.eye(n)], [np.zeros((n, 2 * n))]])
        phi = expm(whole)[:n, n:]
        gain = self.gain + T * self.growth
        states, command = phi @ (self.plant - self.entry @ gain), phi @ self.entry
        d = self._late(T, gain, states, command) if self.delay else np.linalg.eigvals(states)
        return float(np.max((2 * np.real(d) + T * np.abs(d) ** 2) / np.maximum(np.abs(d), np.finfo(float).tiny)))

    def _late(self, T: float, gain: np.ndarray, states: np.ndarray, command: np.ndarray) -> np.ndarray:
        """Eigenvalues d over the states and y, by how much the command that acts differs from the one due now.

        What is due changes by the gain times the change of the states: T d y = T d (gain x) - y. For a small T most of
        y is gone at the next tick, and what remains follows the states, y = S x; then the eigenvalues of the
        states alone keep the digits that -1 / T beside them would take.
        """
        own, driven = gain @ command - np.eye(len(gain)) / T, gain @ states
        if T * self.scale > _SEPARATE:
            return np.linalg.eigvals(np.block([[own, driven], [command, states]]))
        S = np.zeros_like(driven)
        for _ in range(_FIXED_POINT):
            S = np.linalg.solve(own, S @ (states + command @ S) - driven)
        return np.linalg.eigvals(states + command @ S)


def _per_mass(M: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """L^-1 matrix L^-T with M = L L^T, symmetric again."""
    L = np.linalg.cholesky(M)
    half = np.linalg.solve(L, matrix)
    scaled = np.linalg.solve(L, half.T)
    return (scaled + scaled.T) / 2
