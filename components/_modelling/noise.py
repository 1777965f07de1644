"""White noise as a function of time: without states, so a repeated step returns the same bits."""

import casadi as ca

_PRIME = 67108859
"""Largest prime below 2^26: squares of numbers below it are exact in double precision."""


def white_noise(time: ca.SX, interval: ca.SX | float, seed: ca.SX | float) -> ca.SX:
    """Return a standard normal number, mean 0 and variance 1, constant within each `interval` [s].

    Squaring modulo a prime hashes the interval number n = floor(time / interval) and `seed` (a whole number below 2^26)
    into two uniform numbers, which the Box-Muller transform (1958) maps to a normal number.
    """
    n = _remainder(ca.floor(time / interval + 1e-6))
    u1, u2 = _uniform(n, seed, 1), _uniform(n, seed, 2)
    return ca.sqrt(-2 * ca.log(u1)) * ca.cos(2 * ca.pi * u2)


def _uniform(n: ca.SX, seed: ca.SX | float, stream: int) -> ca.SX:
    """Return a uniform number within (0, 1), a hash of counter, seed and stream."""
    k = _remainder(n + 7919 * stream)
    for _ in range(6):
        k = _remainder(k * k + 40692 * k + seed + 104729 * stream)
    return (k + 0.5) / _PRIME


def _remainder(number: ca.SX) -> ca.SX:
    """Return a whole number from 0 to 2^53 modulo the prime, exactly and much faster than C's `fmod`.

    The quotient comes from a rounded reciprocal and may be off by one; the last line corrects the remainder.
    """
    rest = number - ca.floor(number * (1 / _PRIME)) * _PRIME
    return rest + _PRIME * ((rest < 0) - (rest >= _PRIME))
