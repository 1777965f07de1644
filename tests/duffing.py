"""A Duffing oscillator as a part and a scene of a user's own, and its response by harmonic balance.

x'' + c x' + w0^2 x + cubic x^3 = F sin(w t),      A^2 ((w0^2 - w^2 + 3/4 cubic A^2)^2 + (c w)^2) = F^2
"""

from pathlib import Path

import numpy as np

W0, DAMPING, CUBIC = 100.0, 8.0, 1e7
_PART = f'''
"""A Duffing oscillator."""

from hfsa.components import Model


def duffing() -> Model:
    """Return a mass on a hardening spring."""
    m = Model("Duffing", "Mass on a hardening spring, driven by a force per mass")
    u = m.input("force", "m/s2", "Force per mass", nominal=1.0)
    x = m.state("mass.position", "m", "Displacement", nominal=1e-2)
    v = m.state("mass.velocity", "m/s", "Velocity", nominal=1.0)
    m.der[x] = v
    m.der[v] = u - {DAMPING} * v - {W0**2} * x - {CUBIC} * x**3
    m.output("position", x, "m", "Measured displacement", nominal=1e-2)
    return m
'''
_SCENE = """
inputs = [{inputs}]
outputs = [{outputs}]
band = [8.0, 30.0]
amplitude = {{ "m/s2" = 1.0 }}
step_size = 2e-4
stop_time = 0.1
"""
_COMPONENT = """
[[components]]
name = "{0}"
part = "./duffing.py"
"""


def duffing_scene(folder: Path, names: tuple[str, ...] = ("mass",)) -> Path:
    """Write part and scene of independent oscillators; return the path of the scene."""
    (folder / "duffing.py").write_text(_PART)
    inputs, outputs = (", ".join(f'"{name}.{port}"' for name in names) for port in ("force", "position"))
    scene = folder / "duffing.toml"
    scene.write_text(_SCENE.format(inputs=inputs, outputs=outputs) + "".join(map(_COMPONENT.format, names)))
    return scene


def balanced_amplitudes(frequency: float, force: float) -> np.ndarray:
    """Return the amplitudes of all branches at a frequency [Hz], ascending."""
    w = 2 * np.pi * frequency
    detuning, k = W0**2 - w**2, 0.75 * CUBIC
    squares = np.roots([k * k, 2 * k * detuning, detuning**2 + (DAMPING * w) ** 2, -(force**2)])
    return np.sqrt(np.sort(squares.real[(np.abs(squares.imag) < 1e-9 * np.abs(squares)) & (squares.real > 0)]))


def folds(force: float, low: float, high: float) -> tuple[float, float]:
    """Return the lowest and highest frequency [Hz] with three branches."""
    grid = np.linspace(low, high, 20_001)
    several = grid[[len(balanced_amplitudes(f, force)) == 3 for f in grid]]
    return several[0], several[-1]
