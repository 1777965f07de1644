"""The steady state of a stepped linear system under a sine: where a measurement may start, without a transient.

    starts = steady_starts(coupled, step_size=50e-6, frequency=frequency, amplitude=1e-5)
    starts[k].values              # start values of states and held outputs by full name, at phase 0 of the source

The algorithm's own periodic solution at each frequency, step and pattern of ticks follows from its one-step matrix
(`stability.py`). On a linear system it is exact, and a measurement is settled from the first window on. On others a
wrong start costs time alone, as settling is judged from the measured gains.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.analysis.window_map import StartMap, start_map


@dataclass(frozen=True)
class SteadyStart:
    """The state of a system at a communication point at which the source has phase 0.

    Attributes:
        values: states, sampled states and held outputs by full name.
        earlier: connected outputs at the two communication points before, as deviations from those at this one, (2, n).
        gain: complex amplitudes of the observed signals, relative to the sine, (signals,); `None` where they are not
            predicted.
        growth: rate [1/s] of the slowest transient, negative.
        map: linear map of the state, for corrections; `None` where it is not known.
    """

    values: Mapping[str, float]
    earlier: NDArray[np.float64]
    gain: NDArray[np.complex128] | None
    growth: float
    map: StartMap | None = None


def steady_starts(
    coupled: CoupledStep, step_size: float, frequency: NDArray[np.float64], amplitude: float
) -> Sequence[SteadyStart] | None:
    """Return the steady state at each frequency [Hz] for a source of an amplitude; `None` where no transient dies out.

    `StructureError` where the step [s] does not fit the sample times, or nothing is observed.
    """
    one = coupled.over(step_size)
    growth = one.growth()
    if growth >= 0:
        return None
    layout, linear, omega = one.layout, start_map(one), 2 * np.pi * np.asarray(frequency, float)
    vector, gain = amplitude * one.periodic(omega), amplitude * one.response(frequency)
    places = {f"{c}.{n}": layout.place[c, n] for c, block in layout.blocks.items() for n in block.values}
    point = coupled.operating_point
    found = []
    for k in range(len(omega)):
        now = vector[:, k].imag
        values = {name: point.get(name, 0.0) + float(now[place]) for name, place in places.items()}
        earlier = now[layout.past[:2]] - now[layout.bus_places] if len(layout.past[0]) else np.zeros((2, 0))
        found.append(SteadyStart(values, earlier, gain[k], growth, linear))
    return found
