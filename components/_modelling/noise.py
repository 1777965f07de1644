"""White noise as a function of time: nothing to remember, so that a repeated step repeats it to the last bit."""

import casadi as ca

_PRIME = 67108859
"""Largest prime below 2^26: squares of numbers below it are exact in double precision."""


def white_noise(time: ca.SX, interval: ca.SX | float, seed: ca.SX | float) -> ca.SX:
    """Return a normally distributed number of mean 0 and variance 1, a new one in each `interval` [s].

    Interval number n = floor(time / interval) and `seed` (a whole number below 2^26) are mixed by squaring modulo a
    prime; two such numbers make a normal one (Box and Muller 1958).
    """
    n = _remainder(ca.floor(time / interval + 1e-6))
    u1, u2 = _uniform(n, seed, 1), _uniform(n, seed, 2)
    return ca.sqrt(-2 * ca.log(u1)) * ca.cos(2 * ca.pi * u2)


def _uniform(n: ca.SX, seed: ca.SX | float, stream: int) -> ca.SX:
    """Return a number within (0, 1) made of counter, seed and stream."""
    k = _remainder(n + 7919 * stream)
    for _ in range(6):
        k = _remainder(k * k + 40692 * k + seed + 104729 * stream)
    return (k + 0.5) / _PRIME


def _remainder(number: ca.SX) -> ca.SX:
    """Return a whole number from 0 to 2^53 modulo the prime, exactly, and many times sooner than C's `fmod`.

    The quotient may be one off, for it is made of a rounded reciprocal; the rest is exact.
    """
    rest = number - ca.floor(number * (1 / _PRIME)) * _PRIME
    return rest + _PRIME * ((rest < 0) - (rest >= _PRIME))
