"""A payload shaken on a double tilted beam module: its displacement from the base, from 10 Hz to 2 kHz.

The default is a disc of 0.1 kg with its mass centre 30 mm ahead of the stage, where the axes of all beams meet. A force
at this point shifts the payload without turning it: shaken along the module it is displaced by 3.07e-8 m per m/s2 up to
one resonance, 34 dB high at 908.1 Hz, shaken across it by 6.15e-8 up to one resonance, 34 dB high at 641.9 Hz. Above
the resonance the payload stays at rest, displaced by 1 / omega^2. With its mass centre on the stage, `-p
payload.center=0,0,0`, it is displaced 53 times as far by a shake across the module, 3.27e-6 m per m/s2 at low
frequency, turns by 1.07e-4 rad per m/s2 with it, and resonates at 79.0 and 1444.2 Hz.

With `suspension=merged` payload and beams are one part, and only the acceleration is held over a step H: a phase error
of 180 H f degrees, a lead under `gauss_seidel` and a lag under `jacobi`, 0.36 degrees at 2 kHz with the step of 1 us.
Every step is stable. For both suspensions `auto` chooses `gauss_seidel_linear`, within 0.001 % (merged) and 0.068 %
(massless). With `suspension=massless` the beams are a part beside a rigid body, and their wrench, held over a step,
acts as a negative damper: a mode loses the fraction H omega / (4 damping_ratio) of its damping. With 1 us that makes
the resonances 1.34 dB (908.1 Hz) and 0.92 dB (641.9 Hz) too high, 4.85 and 3.13 dB under `jacobi_plain`, whose wrench
is a step older; above 7.01 us (`jacobi_plain`: 2.34 us) it diverges, `-p suspension=massless --step 20e-6` shows how.
In one FMU, `--fuse suspension,payload`, the response is that of the merged suspension.
"""

from typing import Literal

from hfsa.cosim.scenes._payload import Beams, Payload, module
from hfsa.cosim.scenes._scale import beam_pose
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System

_POSE = ("position", "rotation", "velocity", "angular_velocity")
_WRENCH = ("force", "torque")

AHEAD = Payload(center=(0.03, 0.0, 0.0))
"""Payload with its mass centre where the beam axes of the default module meet."""


def beam_payload(
    *,
    suspension: Literal["merged", "massless"] = "merged",
    kind: str = "double_tilted",
    tilt: float | None = None,
    beams: Beams | None = None,
    payload: Payload = AHEAD,
    damping_ratio: float = 0.01,
) -> Scene:
    """Return the scene: pose of the payload relative to its base, per acceleration of the base.

    Args:
        suspension: `merged`, beams and payload in one part, or `massless`, beams as a part that exchanges poses and
            wrenches with the payload.
        kind: kind of module, as in `beam_module`.
        tilt: tilt of the beams, for kinds with tilted beams [deg] (default: 45).
        beams: with kind `assembly`, the .toml file that lists the beams.
        payload: mass, inertia and mass centre of the payload.
        damping_ratio: damping ratio of every mode.
    """
    beams, start = {**module(kind, tilt, beams), **payload.arguments("platform")}, {"damping_ratio": damping_ratio}
    if suspension == "merged":
        system = System([Component("payload", "beam_stage", None, beams, start)])
    else:
        # poses are relative to the base: the base pose of the suspension stays 0
        system = System(
            [
                Component("suspension", "beam_suspension", None, beams, start),
                Component("payload", "rigid_body", None, payload.arguments("body")),
            ],
            [
                *(Connection(f"payload.platform.{name}[1..3]", f"suspension.platform.{name}[1..3]") for name in _POSE),
                *(Connection(f"suspension.platform.{name}[1..3]", f"payload.wrench.{name}[1..3]") for name in _WRENCH),
            ],
        )
    return Scene(
        system,
        inputs=["payload.base.acceleration[1..3]"],
        outputs=["payload.platform.position[1..3]", "payload.platform.rotation[1..3]"],
        band=(10.0, 2000.0),
        amplitude={"m/s2": 1.0},
        step_size=1e-6,
        stop_time=1.0,
        scale=beam_pose("payload"),
    )
