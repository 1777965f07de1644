"""Equilibrium of a system: the operating point of a linearisation, at which no state changes, not even at a tick.

It is found by Newton's method on the FMUs' directional derivatives, in initialization mode, where states and sampled
outputs may be set:

    der(x) = 0,      v after a tick = v

v after a tick is computed on the FMU itself, whose state is saved before and restored afterwards.
"""

import numpy as np

from hfsa.cosim.actions.exchange import Exchange
from hfsa.cosim.linear.blocks import Blocks
from hfsa.cosim.systems.errors import StructureError

NEWTON_STEPS = 20
"""Largest number of Newton steps."""

NEWTON_TOLERANCE = 1e-9
"""Largest last Newton step, relative to the size of a state or its nominal."""


def equilibrium(exchange: Exchange, blocks: Blocks) -> dict[str, float]:
    """Bring the system, in initialization mode, to an equilibrium; return x and v by full name.

    Along a free direction (a body without a spring) Newton's method takes the shortest step, in units of the nominals.
    Raises `StructureError` where no equilibrium is found.
    """
    names, nominal = (*blocks.states, *blocks.sampled), blocks.nominal
    n = len(blocks.states)
    handles = {
        component: instance.handle([name.partition(".")[2] for name in names if name.partition(".")[0] == component])
        for component, instance in blocks.instances.items()
    }
    places = {c: [i for i, name in enumerate(names) if name.partition(".")[0] == c] for c in handles}
    w = np.zeros(len(names))
    for component, handle in handles.items():
        w[places[component]] = blocks.instances[component].get(handle)
    worst = ""
    for _ in range(NEWTON_STEPS):
        closed = blocks.close()
        jacobian = np.vstack([closed.rate, closed.tick])[:, : len(names)]
        jacobian[n:, n:] -= np.eye(len(blocks.sampled))
        jacobian *= nominal
        rows = np.maximum(np.abs(jacobian).max(axis=1, initial=0.0), 1e-300)
        change = _change(blocks, w)
        step = nominal * np.linalg.lstsq(jacobian / rows[:, None], -change / rows, rcond=1e-12)[0]
        w = w + step
        for component, handle in handles.items():
            blocks.instances[component].set(handle, w[places[component]])
        exchange.settle()
        relative = np.abs(step) / np.maximum(np.abs(w), nominal)
        left = np.abs(_change(blocks, w)) / rows
        if np.all(relative <= NEWTON_TOLERANCE) and np.all(left <= NEWTON_TOLERANCE):
            return dict(zip(names, w.tolist(), strict=True))
        worst = names[int(np.argmax(np.maximum(relative, left)))]
    raise StructureError(
        f"no equilibrium found within {NEWTON_STEPS} Newton steps; {worst} keeps changing. "
        "Give start values nearer to one, or a system at rest"
    )


def _change(blocks: Blocks, w: np.ndarray) -> np.ndarray:
    """Return [der(x); change of v at a tick]."""
    derivatives = {
        f"{component}.{state}": (instance, rate)
        for component, instance in blocks.instances.items()
        for state, rate in instance.fmu.description.states
    }
    rates = []
    for name in blocks.states:
        instance, rate = derivatives[name]
        rates.append(instance.get(instance.handle([rate]))[0])
    ticked = np.zeros(len(blocks.sampled))
    for component, instance in blocks.instances.items():
        own = [i for i, name in enumerate(blocks.sampled) if name.partition(".")[0] == component]
        if own:
            ticked[own] = instance.values_after_tick([blocks.sampled[i].partition(".")[2] for i in own])
    return np.concatenate([rates, ticked - w[len(rates) :]])
