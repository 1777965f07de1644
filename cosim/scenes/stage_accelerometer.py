"""The accelerometer on the piezo stage: its estimate per voltage on a stack, or per elongation of a stack.

The stage, its stacks and their bias are those of `stage_bode`; the platform shakes the sensor, without feedback.
`ideal` is a sensor without dynamics at the same place; its estimate is the true acceleration there. The response from
true acceleration to the sensor is the quotient of two recorded responses, `sensor` by `ideal`.

A volt on the first stack gives 0.053 m/s2 along x and 0.073 along y at 100 Hz, 40 dB more per decade, up to the
resonance of the shifts, 37 and 51 m/s2 at 919 Hz; from 2 kHz on it is 5 and 7 m/s2. The turn has no effect at the
centre, but 20 mm off along x the y axis shows its resonance, 77 m/s2 at 2384 Hz. With `stage=jacobian` the elongations
are excited directly, and the estimate is -omega^2 times the entry of the Jacobian.

`auto` chooses `gauss_seidel_linear`, within 0.013 %. With held inputs, `gauss_seidel`, the errors are larger: an
acceleration is the difference of the forces of stacks and stage, and held inputs set these half a step apart. A mode of
omega_n has a phase error of H omega_n^2 / (2 omega) radians, 1.5 degrees at 100 Hz, 0.7 at 200 Hz and 0.3 at 500 Hz
with the step of 1 us. The sensor steps first and holds its input, a lag of 180 H f degrees, 0.54 at 3 kHz: the only
error of the quotient, and opposite to the lead, so that from 500 Hz on the response of the sensor is within 0.3
degrees. The error is of first order: Richardson extrapolation from two steps is within 0.01 degrees.
"""

from typing import Literal

from hfsa.cosim.scenes._accelerometer import UPRIGHT, Design, Level, Mounting, accelerometer, ideal
from hfsa.cosim.scenes._biased_stage import biased_stage
from hfsa.cosim.scenes._pzt import TOKIN, Pzt
from hfsa.cosim.scenes._scale import readings
from hfsa.cosim.scenes._stage import THESIS, Stage
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System

_MOTIONS = (
    ("acceleration[1..2]", "acceleration[1..2]"),
    ("angular_velocity", "angular_velocity[3]"),
    ("angular_acceleration", "angular_acceleration[3]"),
    ("rotation", "rotation[3]"),
)
"""Outputs of the platform's planar motion, and the corresponding inputs of the sensor."""


def stage_accelerometer(
    *,
    stage: Literal["jacobian", "constant_jacobian", "exact", "flexible_hinges"] = "constant_jacobian",
    pzt: Pzt = TOKIN,
    bias: float = 75.0,
    damping_time: float = 6.02e-6,
    resistance: float = 50.0,
    design: Design = "mems",
    sensor: Level = "spatial",
    damping: float | None = None,
    mounting: Mounting = UPRIGHT,
    machine: Stage = THESIS,
) -> Scene:
    """Return the scene: estimates, true acceleration and voltages per volt, or per elongation at level `jacobian`.

    Args:
        stage: level of the stage; at `jacobian` there are no stacks, and what acts on forces alone has no effect.
        pzt: data sheet of the stacks.
        bias: voltage of all stacks, about which one of them is excited [V]; 0 to their full voltage.
        damping_time: damping time of the hinges, beta [s].
        resistance: output resistance of the amplifiers [Ohm].
        design: published dimensions and material of the sensor.
        sensor: level of the sensor.
        damping: damping ratio in the plane of the sensor (default: the design's).
        mounting: mounting of the sensor on the platform, from its centre.
        machine: design of the stage, also in models of it: the arguments `kinematics`, `links`, `hinge`, `masses`,
            `jacobian`, `stiffness` and `mass`, for level `flexible_hinges` `contact`, `bolts`, `outline` (`_stage.py`).

    Raises:
        StructureError: for a bias outside the range of the stacks.
    """
    if stage == "jacobian":
        moved = System([Component("stage", "rrr_stage", stage, machine.itself)])
        inputs, amplitude = "stage.stack[1..3].elongation", {"m": 1e-7}
    else:
        moved = biased_stage("stage_accelerometer", stage, machine, pzt, bias, damping_time, resistance)
        inputs, amplitude = "stack[1..3].command.voltage", {"V": 0.5}
    shown = [accelerometer(sensor, design, mounting, damping), ideal(mounting)]
    felt = [
        Connection(f"stage.platform.{start}", f"{shows.name}.base.{end}") for shows in shown for start, end in _MOTIONS
    ]
    return Scene(
        System([*shown, *moved.components], [*moved.connections, *felt]),
        inputs=[inputs],
        outputs=["sensor.acceleration_estimate[1..2]", "ideal.acceleration_estimate[1..2]", "sensor.voltage[1..2]"],
        band=(100.0, 3000.0),
        amplitude=amplitude,
        step_size=1e-6,
        stop_time=1.0,
        scale=readings(),
    )
