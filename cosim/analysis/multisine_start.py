"""The steady state of a stepped linear system under a multisine: that of its lines, superposed.

    start = multisine_start(base, system, instances, {"source": (frequency, gain)}, SAMPLER, step_size=50e-6)

Each line has the periodic solution of the algorithm's one-step matrix (`steady_start.py`), and a linear system under
several lines and sources is in the sum of them.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.analysis.steady_start import SteadyStart
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.linear.cycle import Source
from hfsa.cosim.systems.system import System


def multisine_start(
    base: CoupledStep,
    system: System,
    instances: Mapping[str, Instance],
    sources: Mapping[str, tuple[NDArray[np.float64], NDArray[np.complex128]]],
    sampler: str,
    step_size: float,
) -> SteadyStart | None:
    """Return the steady state at time 0, its gains being those of the lines, (all lines, signals); `None` if unstable.

    `base` is the step of the algorithm on the scene's system, `system` that with sources and a sampler, which
    `instances` contain as well. `sources` holds frequencies [Hz] and complex amplitudes of the lines of each source,
    the latter relative to sines of phase 0. `StructureError` where the step [s] does not fit the sample times.
    """
    for name in sources:
        instances[name].start()  # a source is linearised too where it is not the one that excites
    values: dict[str, float] = {}
    earlier, gains, growth = np.zeros((2, 0)), [], -np.inf
    for source, (frequency, amplitude) in sources.items():
        one = base.excited(system, instances, Source(source), lock_in=sampler).over(step_size)
        growth = one.growth()
        if growth >= 0:
            return None
        layout = one.layout
        now = (one.periodic(2 * np.pi * frequency) @ amplitude).imag
        gains.append(one.response(frequency) * amplitude[:, None])
        for (component, name), place in layout.place.items():
            if component in layout.blocks and name in layout.blocks[component].values:
                full = f"{component}.{name}"
                values[full] = values.get(full, base.operating_point.get(full, 0.0)) + float(now[place])
        if len(layout.past[0]):
            earlier = (earlier if earlier.size else 0.0) + now[layout.past[:2]] - now[layout.bus_places]
    return SteadyStart(values, earlier, np.concatenate(gains), float(growth))
