"""The example's scene: a mass on a spring, shaken at its base from 1 to 100 Hz.

One resonance at 15.9 Hz, 46 dB high with the default damping, and -40 dB per decade above it. Copy this file for a
first scene of your own.
"""

from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, System


def mass_on_spring(*, damping: float = 0.5) -> Scene:
    """Return the scene: response of the mass to its base.

    Args:
        damping: coefficient of the damper [N.s/m].
    """
    return Scene(
        System([Component("mass", "mass_on_spring", start={"damping": damping})]),
        inputs=["mass.base.position"],
        outputs=["mass.position"],
        band=(1.0, 100.0),
        amplitude={"m": 1e-3},
        step_size=100e-6,
        stop_time=5.0,
        scale={"mass.position": 0.2},  # response at the resonance: 200 times the amplitude
    )
