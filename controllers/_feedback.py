"""Poles and largest stable sample time of a second-order system under feedback of position and rate.

    M x'' + C x' + K x = u,   u = -P x - (D + T E) x'     evaluated at each tick and held until the next one, T later;
                                                          with a delay it acts one tick late

M is symmetric and positive definite, the other matrices are symmetric, all of shape (n, n). Poles and limits keep their
accuracy if frequency and damping differ by many powers of ten.
"""

import numpy as np
from scipy.linalg import eigh, expm
from scipy.optimize import brentq

_BELOW = 1e-2
"""First sample time of the search, relative to the shortest time at which the hold can affect stability."""
_GROWTH = 1.2
"""Ratio of successive sample times of the search."""
_HALVINGS = 30
"""Number of sample times that approach one at which a mode of the plant is sampled twice per period."""
_DIGITS = 1e-12
"""Relative accuracy of the limit."""
_ABOVE = 1e3
"""Last sample time of the search, relative to the slowest time constant."""
_SEPARATE = 1e-3
"""Sample time * fastest rate below which the delayed command is treated as a separate fast subsystem."""
_OVERDAMPED = 1e4
"""Ratio of squared damping rates to stiffness above which fast and slow poles decouple."""
_FIXED_POINT = 6
"""Iterations for the slow subspace; each reduces the error at least by the factor `_SEPARATE`."""


def poles(M: np.ndarray, C: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Return the poles of M x'' + C x' + K x = 0, shape (2 n,) [1/s], ordered by magnitude.

    An eigenvalue solver loses a damping that is small beside the frequency. Each pole is therefore recomputed from its
    mode shape v as a root of s^2 v'Mv + s v'Cv + v'Kv = 0, which is as accurate as the three coefficients.
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
    """Return approximate poles of x'' + C x' + K x = 0, shape (2 n,), and their mode shapes, columns of (n, 2 n)."""
    n, rates = len(C), np.linalg.eigvalsh(C)
    if rates[0] ** 2 > _OVERDAMPED * np.abs(K).max():
        fast, slow = -eigh(C)[0], -eigh(K, C)[0]  # C x' balances x'' alone, or K x alone
        shapes = [eigh(C + K / s)[1][:, i] for i, s in enumerate(fast)]  # the small term selects the shape
        shapes += [eigh(K, C + s * np.eye(n))[1][:, i] for i, s in enumerate(slow)]
        return np.concatenate([fast, slow]), np.array(shapes).T
    scale = max(np.sqrt(np.abs(K).max()), rates[-1]) or 1.0
    found, vectors = np.linalg.eig(np.block([[np.zeros((n, n)), np.eye(n)], [-K / scale**2, -C / scale]]))
    return scale * found, vectors[:n]


def sample_time_limit(
    M: np.ndarray, C: np.ndarray, K: np.ndarray, P: np.ndarray, D: np.ndarray, E: np.ndarray, *, delay: bool
) -> float:
    """Return the sample time [s] below which the held feedback is stable.

    E is the rate gain per sample time of a feedback that compensates its own hold. The limit is 0 if the loop is
    unstable without sampling or its damping is below the rounding error of its frequency, and infinite if every sample
    time is stable.
    """
    s = poles(M, C + D, K + P)
    decay = -np.real(s)
    if decay.min() <= 0:
        return 0.0
    C, K, P, D, E = (_per_mass(M, matrix) for matrix in (C, K, P, D, E))
    own_rates = np.sqrt(np.maximum(np.linalg.eigvalsh(K), 0))
    margin = _Margin(C, K, P, D, E, scale=float(max(np.abs(s).max(), own_rates[-1])), delay=delay)
    undamped = np.min(2 * decay / np.abs(s) ** 2)  # sample time at which the delay of the hold cancels a pole's damping
    below = _BELOW / max(1 / undamped, own_rates[-1])
    if margin(below) > 0:
        return 0.0
    for above in _trial_times(below, _ABOVE / decay.min(), own_rates):
        if margin(above) > 0:
            return brentq(margin, below, above, xtol=_DIGITS * below, rtol=_DIGITS)  # type: ignore[return-value]
        below = above
    return np.inf


def _trial_times(below: float, end: float, own_rates: np.ndarray) -> np.ndarray:
    """Return sample times in ascending order, dense enough to find the first unstable interval.

    Under weak feedback this interval may be narrow: it ends where a mode of the plant is sampled twice per period.
    """
    even = below * _GROWTH ** np.arange(1, np.log(end / below) / np.log(_GROWTH))
    twice = np.pi / own_rates[own_rates > 0]
    times = np.concatenate([even, np.outer(twice, 1 - 0.5 ** np.arange(1, _HALVINGS)).ravel()])
    return np.sort(times[(times > below) & (times < end)])


class _Margin:
    """Stability margin as a function of the sample time T, negative for a stable one.

    With z = 1 + T d an eigenvalue of the tick map, |z| < 1 is 2 Re d + T |d|^2 < 0. The d are the eigenvalues of
    (tick map - 1) / T, computed from phi(A T) = (exp(A T) - 1) / (A T) without cancellation for small T.
    """

    def __init__(self, C, K, P, D, E, *, scale: float, delay: bool):
        n = len(C)
        self.scale, self.delay = scale, delay
        self.plant = np.block([[np.zeros((n, n)), scale * np.eye(n)], [-K / scale, -C]])  # states scale x and x'
        self.gain, self.growth = np.hstack([P / scale, D]), np.hstack([np.zeros((n, n)), E])
        self.entry = np.vstack([np.zeros((n, n)), np.eye(n)])

    def __call__(self, T: float) -> float:
        n = len(self.plant)
        whole = np.block([[self.plant * T, np.eye(n)], [np.zeros((n, 2 * n))]])
        phi = expm(whole)[:n, n:]
        gain = self.gain + T * self.growth
        states, command = phi @ (self.plant - self.entry @ gain), phi @ self.entry
        d = self._with_delay(T, gain, states, command) if self.delay else np.linalg.eigvals(states)
        return float(np.max((2 * np.real(d) + T * np.abs(d) ** 2) / np.maximum(np.abs(d), np.finfo(float).tiny)))

    def _with_delay(self, T: float, gain: np.ndarray, states: np.ndarray, command: np.ndarray) -> np.ndarray:
        """Return the eigenvalues d of the loop with a delay of one tick.

        The additional state y is the difference of the acting command and the present one, T d y = T d (gain x) - y.
        For a small T, y decays within a tick to a linear function of the states, y = S x. The eigenvalues on this slow
        subspace are more accurate than those of the full matrix, whose entries -1 / T are large.
        """
        own, driven = gain @ command - np.eye(len(gain)) / T, gain @ states
        if T * self.scale > _SEPARATE:
            return np.linalg.eigvals(np.block([[own, driven], [command, states]]))
        S = np.zeros_like(driven)
        for _ in range(_FIXED_POINT):
            S = np.linalg.solve(own, S @ (states + command @ S) - driven)
        return np.linalg.eigvals(states + command @ S)


def _per_mass(M: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return L^-1 matrix L^-T with M = L L^T, symmetric."""
    L = np.linalg.cholesky(M)
    half = np.linalg.solve(L, matrix)
    scaled = np.linalg.solve(L, half.T)
    return (scaled + scaled.T) / 2
