"""Sample and hold: signals as a sampled instrument takes them, at its ticks, held until the next tick.

    held[i] = signal[i] at the last tick

A recording of `held[i]` at the end of a step has the value at the beginning of the step, after all sampled parts that
tick before: the samples that a lock-in amplifier takes.

Bode plot, signal to held: 0 dB at frequencies far below 1 / sample_time; as a zero-order hold a lag of half a sample
time in the mean, and images about multiples of 1 / sample_time.
"""

from hfsa.components import Model, ModelError
from hfsa.components._modelling.units import carried


def sampler(*, units: list[str] = ["1"]) -> Model:  # noqa: B006 (never changed)
    """Return one sampler.

    Args:
        units: unit of each signal, that of the connected output, any text.

    Raises:
        ModelError: no signals.
    """
    units = [carried(unit) for unit in units]
    if not units:
        raise ModelError("sampler: units is empty, expected the unit of at least one signal")
    m = Model("Sampler", "Sample and hold of signals")
    m.sample_time(1e-3)
    signals = [m.input(f"signal[{i}]", unit, f"Signal {i}") for i, unit in enumerate(units, 1)]
    for i, (signal, unit) in enumerate(zip(signals, units, strict=True), 1):
        m.sampled_output(f"held[{i}]", signal, unit, f"Signal {i} at the last tick")
    return m
