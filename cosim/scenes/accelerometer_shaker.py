"""The accelerometer on a shaker: its estimate for a base shaken in one direction and then across it.

The acceleration of the base is a sine of 1 m/s2, the output the estimate of the sensor. The response begins at 0 dB and
has one resonance, 40 dB high at 5818.9 Hz (mems) and 40 dB at 881 Hz (optimum); the polymer's higher damping leaves 24
dB at 251.6 Hz (rapid_prototype). Its natural frequency without damping, at which the phase is -90 degrees, is 251.86
Hz; published are 250.34 Hz by finite elements and 255 Hz from a vibration test, both marked. A sensor turned by `angle`
on the table shows cos(angle) on one axis and -+ sin(angle) on the other, and the same curve.

`proof_mass.position[1..3]` can be measured as well, and out of the plane `base.acceleration[3]` can be excited: one
resonance, 28 dB high at 13063.9 Hz (mems), above the default band.

The acceleration is connected directly from the source to the sensor. `auto` extrapolates it over a step, with an error
of 0.001 %. An input held for a step H has a phase error of 180 H f degrees, a lead under `gauss_seidel` and a lag under
`jacobi`: 0.42 (mems), 0.32 (optimum) and 0.45 degrees (rapid_prototype) at the end of the band, twice the natural
frequency, and at most 0.01 dB. There is no feedback, so that every step is stable.
"""

import math
from typing import NamedTuple

from hfsa.cosim.scenes._accelerometer import Design, Level, Mounting, accelerometer
from hfsa.cosim.scenes._scale import READING
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import System


class _Test(NamedTuple):
    """Shaker test of a design.

    Attributes:
        band: lowest frequency and twice the natural frequency [Hz].
        step_size: communication step size of half a degree at the latter [s].
        marks: published frequencies [Hz].
    """

    band: tuple[float, float]
    step_size: float
    marks: dict[str, float]


_TESTS = {
    "mems": _Test((50.0, 11.6e3), 0.2e-6, {}),
    "optimum": _Test((10.0, 1760.0), 1e-6, {}),
    "rapid_prototype": _Test(
        (5.0, 500.0),
        5e-6,
        {"formulas, undamped": 251.86, "published: finite elements": 250.34, "published: vibration test": 255.0},
    ),
}


def accelerometer_shaker(
    *,
    design: Design = "mems",
    sensor: Level = "spatial",
    damping: float | None = None,
    angle: float = 0.0,
) -> Scene:
    """Return the scene: response of the estimate to acceleration in the plane of the sensor.

    Args:
        design: published dimensions and material.
        sensor: level of the sensor.
        damping: damping ratio in the plane of the sensor (default: the design's).
        angle: angle of the sensor on the table, from the first direction to its x axis [deg].

    Raises:
        StructureError: for an angle that is not finite.
    """
    if not math.isfinite(angle):
        raise StructureError(f"accelerometer_shaker: angle is {angle:g} deg, expected a number")
    test = _TESTS[design]
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    turned = Mounting((c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0))
    return Scene(
        System([accelerometer(sensor, design, turned, damping)]),
        inputs=["sensor.base.acceleration[1..2]"],
        outputs=["sensor.acceleration_estimate[1..2]"],
        band=test.band,
        amplitude={"m/s2": 1.0},
        step_size=test.step_size,
        stop_time=1.0,
        marks=test.marks,
        scale={"sensor.acceleration_estimate[1..2]": READING},
    )
