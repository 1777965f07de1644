"""A run of very many steps: drift of amplitude and phase against the exact motion, and growth of memory."""

import resource
import sys
from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path

import numpy as np

from extreme_rows.row import Accuracy, Found, Row
from hfsa.cosim import load_scene
from hfsa.cosim.assembly.build import build
from hfsa.cosim.assembly.native_loop import stepping_library
from hfsa.cosim.masters.algorithms import open_master

OMEGA = 100.0
"""Of the mass on a spring [rad/s]."""
STATES = ["mass.mass.position", "mass.mass.velocity"]
SHORT, LONG = 10**7, 10**9
"""Numbers of steps, by default and with `--long`."""
PRESENT = Path("/proc/self/statm")
MEMORY = 1.0
"""Most growth of memory [MiB]: none that depends on the number of steps, and what a library takes once."""


def rows(is_long: bool = False) -> Iterator[Row]:
    """Yield the rows."""
    steps = LONG if is_long else SHORT
    step_size = load_scene("mass_on_spring").step_size
    tried = f"`mass_on_spring`, no damping, released, {steps:.0e} steps of {step_size:g} s"
    bound = steps * np.finfo(float).eps
    yield Row(
        "duration",
        tried,
        Accuracy("amplitude and phase [rad] at the end", "cos(omega t), a rounding for each step", bound),
        partial(drift, steps, step_size),
    )
    yield Row(
        "duration",
        tried,
        Accuracy("growth of memory, in MiB,", "none", MEMORY),
        partial(growth, steps, step_size),
    )


def drift(steps: int, step_size: float) -> Found:
    """Return the larger error of amplitude and phase after some steps, and both."""
    turned = run(steps, step_size)[0]
    amplitude, phase = abs(turned) - 1, np.angle(turned)
    return Found(max(abs(amplitude), abs(phase)), f"amplitude {amplitude:+.2g}, phase {phase:+.2g} rad")


def growth(steps: int, step_size: float) -> Found:
    """Return the growth of the memory of the process over the last nine tenths of the steps [MiB]."""
    return Found(run(steps, step_size)[1])


@cache
def run(steps: int, step_size: float) -> tuple[complex, float]:
    """Return the complex amplitude at the end, turned back by the exact phase, and the growth of memory [MiB]."""
    scene = load_scene("mass_on_spring", {"damping": 0.0})
    master = open_master(build(scene.system), "gauss_seidel", step_size, stepping_library())
    try:
        master.initialize(starts={STATES[0]: 1.0})
        master.advance(steps // 10)
        before = _memory()
        master.advance(steps - steps // 10)
        after = _memory()
        position, velocity = master.read(STATES)
    finally:
        master.close()
    # omega t as a fraction: a double has no digits left for it after 1e9 steps
    whole = np.longdouble(OMEGA) * np.longdouble(steps) * np.longdouble(str(step_size))
    phase = float(np.fmod(whole, 2 * np.longdouble("3.14159265358979323846264338327950288")))
    return complex(position, -velocity / OMEGA) * np.exp(-1j * phase), float(np.max(np.subtract(after, before)))


def _memory() -> list[float]:
    """Return the largest memory of the process until now, and where the system tells the present one [MiB].

    The largest alone does not grow while earlier rows have taken more.
    """
    unit = 1 if sys.platform == "darwin" else 1024
    found = [resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**20]
    if PRESENT.exists():
        found.append(int(PRESENT.read_text().split()[1]) * resource.getpagesize() / 2**20)
    return found
