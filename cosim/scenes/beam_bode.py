"""A platform on a compliant beam module: its pose under forces and torques, from 10 Hz to 5.2 kHz.

The default is a disc of 0.1 kg on three aluminium beams, 50 mm long and 2 mm thick on a circle of 30 mm, with 1 % of
damping in every mode. Loads along and about the axis of the module are decoupled: 7.69e-8 m/N up to one resonance at
1815.1 Hz, and 6.06e-2 rad/(N.m) up to one at 96.36 Hz. A force across it shifts the platform by 6.42e-5 m/N and turns
it by 4.27e-6 rad/N, a torque about the same axis turns it by 1.71e-4 rad/(N.m) and shifts it by 4.27e-6 m/(N.m): both
have resonances at 62.82 and 2569.8 Hz. Single resonances are 34 dB high, and the other entries are zero.

The load is connected directly from the source to the stage. `auto` extrapolates it over a step, with an error of 0.002
%. A load held for a step H has a phase error of 180 H f degrees, a lead under `gauss_seidel` and a lag under `jacobi`:
0.47 degrees at the end of the band, twice the highest mode, and 1e-4 dB. There is no feedback, so that every step is
stable: for a lower band `--to 520 --step 5e-6` is as accurate.
"""

from hfsa.cosim.scenes._payload import Beams, Payload, module
from hfsa.cosim.scenes._scale import beam_pose
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, System

DISC = Payload()


def beam_bode(
    *,
    kind: str = "three_beam",
    tilt: float | None = None,
    beams: Beams | None = None,
    platform: Payload = DISC,
    damping_ratio: float = 0.01,
) -> Scene:
    """Return the scene: six responses of the pose to each of the six loads.

    Args:
        kind: kind of module, as in `beam_module`.
        tilt: tilt of the beams, for kinds with tilted beams [deg] (default: 45).
        beams: with kind `assembly`, the .toml file that lists the beams.
        platform: mass, inertia and mass centre of the platform.
        damping_ratio: damping ratio of every mode.
    """
    arguments = {**module(kind, tilt, beams), **platform.arguments("platform")}
    return Scene(
        System([Component("stage", "beam_stage", None, arguments, {"damping_ratio": damping_ratio})]),
        inputs=["stage.wrench.force[1..3]", "stage.wrench.torque[1..3]"],
        outputs=["stage.platform.position[1..3]", "stage.platform.rotation[1..3]"],
        band=(10.0, 5200.0),
        amplitude={"N": 0.1, "N.m": 0.01},
        step_size=0.5e-6,
        stop_time=1.0,
        scale=beam_pose("stage"),
    )
