"""A loop of Co-Simulation steps with moving inputs, by an instance of ours: what other tools are compared with."""

from pathlib import Path

import numpy as np

from hfsa.cosim.fmi.co_simulation import Fmu, Instance


def trajectory(
    file: Path, inputs: list[str], outputs: list[str], values: np.ndarray, step: float, *, linear: bool
) -> np.ndarray:
    """Return the outputs after each step by an instance of ours, (steps, outputs).

    `values` are the inputs at the communication points, (steps + 1, inputs), held over each step or linear in it.
    """
    instance = Instance(Fmu.load(file), "fmu")
    try:
        instance.start()
        entry, rates, exits = instance.handle(inputs), instance.handle(inputs), instance.handle(outputs)
        slope = instance.derivative_setter(rates, 1) if linear and inputs else None
        rows = []
        for k in range(len(values) - 1):
            instance.set(entry, values[k])
            if slope is not None:
                rates.values[:] = (values[k + 1] - values[k]) / step
                instance.check(slope, slope.run())
            instance.step(k * step, step)
            if slope is not None:
                instance.set(entry, values[k + 1])
            rows.append(instance.get(exits).copy())
    finally:
        instance.close()
    return np.array(rows)
