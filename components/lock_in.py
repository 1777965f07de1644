"""A lock-in amplifier: mean, fundamental and two harmonics of each signal by least squares, window after window.

Over a window of N = round(window / sample_time) samples it fits, to each signal y,

    y = mean + a sin + b cos + a2 sin2 + b2 cos2 + a3 sin3 + b3 cos3

where sin and cos are the inputs `sine` and `cosine`; the harmonics are computed from them (sin2 = 2 sin cos, ...). The
fit requires neither an integer number of samples per period nor an integer number of periods per window. Results are
latched at the end of each window:

    gain.real = a,  gain.imaginary = b      so that gain = a + j b is the complex amplitude relative to sin
    harmonic.second.real = a2, .imaginary = b2, harmonic.third.real = a3, .imaginary = b3
    residual = rms of the residual

The sample at time start + n sample_time is number n; window k = 1, 2, ... contains the samples (k - 1) N to k N - 1.

Bode plot, complex amplitude of a signal to its gain: 0 dB and 0 degrees at the reference frequency f, zeros of
transmission at 0, 2 f and 3 f, and elsewhere the sidelobes of a rectangular window, which decay as
1 / (pi |f_signal - f| N sample_time).
"""

import casadi as ca

from hfsa.components import Model, ModelError
from hfsa.components._modelling.units import carried


def lock_in(*, units: list[str] = ["1"]) -> Model:  # noqa: B006 (never changed)
    """Return one lock-in amplifier.

    Args:
        units: unit of each signal, that of the connected output, any text.

    Raises:
        ModelError: no signals.
    """
    units = [carried(unit) for unit in units]
    if not units:
        raise ModelError("lock_in: units is empty, expected the unit of at least one signal")
    m = Model("LockIn", "Lock-in amplifier: complex gain and harmonics of signals, window by window")
    sample_time = m.sample_time(1e-3)
    window = m.parameter("window", 1.0, "s", "Length of one measurement window", min=1e-12)
    sine = m.input("sine", "1", "Phase reference, sine")
    cosine = m.input("cosine", "1", "Phase reference, cosine", start=1.0)
    signals = [m.input(f"signal[{i}]", unit, f"Signal {i}") for i, unit in enumerate(units, 1)]

    basis = _basis(sine, cosine)
    k = basis.shape[0]
    count = m.sampled_state("count", "1", "Samples taken in this window")
    windows = m.sampled_state("completed", "1", "Windows completed")
    gram = m.sampled_state(f"gram[1..{k * (k + 1) // 2}]", "1", "Sums of products of basis functions, lower triangle")
    first = count < 0.5
    complete = count + 1 > ca.fmax(ca.floor(window / sample_time + 0.5), k + 1) - 0.5
    gram_now = ca.if_else(first, 0, gram) + _lower(basis @ basis.T)
    m.next[gram] = gram_now
    m.next[count] = ca.if_else(complete, 0, count + 1)
    m.next[windows] = windows + complete
    factor = ca.ldl(ca.if_else(complete, _symmetric(gram_now, k), ca.SX.eye(k)))

    m.sampled_output("windows", windows + complete, "1", "Number of windows completed")
    for i, (signal, unit) in enumerate(zip(signals, units, strict=True), 1):
        _channel(m, i, signal, unit, basis, factor, first, complete, count + 1)
    return m


def _channel(m: Model, i: int, signal, unit: str, basis, factor, first, complete, samples) -> None:
    """Add the fit of one signal; sums are of deviations from its first sample, so a large mean costs no digits."""
    k = basis.shape[0]
    offset = m.sampled_state(f"offset[{i}]", unit, f"First sample of the window, signal {i}")
    moment = m.sampled_state(f"moment{i}[1..{k}]", unit, f"Sums of basis functions times signal {i}")
    square = m.sampled_state(f"square[{i}]", "1", f"Sum of squares of signal {i}, in its unit squared")
    offset_now = ca.if_else(first, signal, offset)
    deviation = signal - offset_now
    moment_now = ca.if_else(first, 0, moment) + basis * deviation
    square_now = ca.if_else(first, 0, square) + deviation**2
    m.next[offset], m.next[moment], m.next[square] = offset_now, moment_now, square_now

    fit = ca.ldl_solve(moment_now, *factor)
    left = ca.fmax(square_now - ca.dot(fit, moment_now), 0)
    results = (
        (f"gain[{i}].real", fit[1], f"In phase with sine, signal {i}"),
        (f"gain[{i}].imaginary", fit[2], f"In phase with cosine, signal {i}"),
        (f"mean[{i}]", offset_now + fit[0], f"Mean of signal {i}"),
        (f"harmonic[{i}].second.real", fit[3], f"In phase with sine of twice the phase, signal {i}"),
        (f"harmonic[{i}].second.imaginary", fit[4], f"In phase with cosine of twice the phase, signal {i}"),
        (f"harmonic[{i}].third.real", fit[5], f"In phase with sine of three times the phase, signal {i}"),
        (f"harmonic[{i}].third.imaginary", fit[6], f"In phase with cosine of three times the phase, signal {i}"),
        (f"residual[{i}]", ca.sqrt(left / samples), f"Root mean square of the residual, signal {i}"),
    )
    for name, value, description in results:
        held = m.sampled_state(f"latched.{name}", unit, f"{description}, last window")
        m.next[held] = ca.if_else(complete, value, held)
        m.sampled_output(name, ca.if_else(complete, value, held), unit, description)


def _basis(s: ca.SX, c: ca.SX) -> ca.SX:
    """Return 1, and sine and cosine of one, two and three times the phase, shape (7, 1), by multiple-angle formulas."""
    return ca.vertcat(1, s, c, 2 * s * c, c * c - s * s, s * (3 - 4 * s * s), c * (4 * c * c - 3))


def _lower(matrix: ca.SX) -> ca.SX:
    """Return the lower triangle of a symmetric matrix as a column, row by row."""
    return ca.vertcat(*[matrix[i, j] for i in range(matrix.shape[0]) for j in range(i + 1)])


def _symmetric(lower: ca.SX, k: int) -> ca.SX:
    """Return the symmetric matrix (k, k) with a lower triangle, given as a column."""
    matrix = ca.SX(k, k)
    for i in range(k):
        for j in range(i + 1):
            matrix[i, j] = matrix[j, i] = lower[i * (i + 1) // 2 + j]
    return matrix
