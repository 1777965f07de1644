"""The piezo stage at a bias: pose of its platform per volt on one stack, from 1 Hz to 3 kHz.

Three stacks with their amplifiers act on the stage at half of their voltage, and one is excited by 0.5 V about it. A
volt shifts the platform by up to 0.23 um and turns it by -4.1 urad, the same for each stack, up to a resonance of the
shifts, 18 dB high at 912 Hz, and one of the turn, 11 dB high at 2332 Hz. Above its own each falls by 40 dB per decade,
and by 60 above the amplifier's corner, 3.94 kHz at a stack that is held.

Driven about 0 V by ideal voltages the modes lie at 904.65 and 2225.2 Hz with 0.6 and 1.6 % of damping. The output
resistance of the amplifier limits the charge flow of a compressed stack, which adds stiffness and damping: 916.1 and
2375.6 Hz with 6 and 12 %; the bias lowers them by 0.03 to 0.04 %.

The signal passes two connections, from the source to a stack and from the stack to the stage, and each is held for a
step: `jacobi` lags by a whole step, 7.5 degrees at 2 kHz, and `gauss_seidel` would lead by as much with the stacks
first. Here the stage steps first, so that a stack leads by half a step and the stage lags by half: the error is of
second order, and with a step of 10 us it is 0.006 dB and 0.15 degrees up to 2 kHz, 0.021 dB and 0.22 degrees up to
3 kHz. The feedback, by the charge of a compressed stack, makes steps above 64.8 us (`jacobi`) and 188 us
(`gauss_seidel`) unstable.

With the step of 5 us `auto` chooses `gauss_seidel_quadratic`, with errors below a tenth of a per cent.

The current limit of the amplifiers is 0.1 A. At 2 kHz it allows an amplitude of 9.65 V, not the 5.7 V of a free stack:
between its resonances the stage moves against the voltage. Limits are evaluated at the end of a step, so that one is
reported above 10.2 V, where the response has an error of 0.1 dB.
"""

from hfsa.cosim.scenes._biased_stage import Level, biased_stage
from hfsa.cosim.scenes._pzt import TOKIN, Pzt
from hfsa.cosim.scenes._scale import stage_pose
from hfsa.cosim.scenes._stage import THESIS, Stage
from hfsa.cosim.systems.scene import Scene


def stage_bode(
    *,
    stage: Level = "constant_jacobian",
    pzt: Pzt = TOKIN,
    bias: float = 75.0,
    damping_time: float = 6.02e-6,
    resistance: float = 50.0,
    machine: Stage = THESIS,
) -> Scene:
    """Return the scene: response of the pose to each of the three voltages.

    Args:
        stage: level of the stage.
        pzt: data sheet of the stacks.
        bias: voltage of all stacks, about which one of them is excited [V]; 0 to their full voltage.
        damping_time: damping time of the hinges, beta [s].
        resistance: output resistance of the amplifiers [Ohm].
        machine: design of the stage, also in models of it: the arguments `kinematics`, `links`, `hinge`, `masses`,
            `jacobian`, `stiffness` and `mass`, for level `flexible_hinges` `contact`, `bolts`, `outline` (`_stage.py`).

    Raises:
        StructureError: for a bias outside the range of the stacks.
    """
    return Scene(
        biased_stage("stage_bode", stage, machine, pzt, bias, damping_time, resistance),
        inputs=["stack[1..3].command.voltage"],
        outputs=["stage.platform.position[1..2]", "stage.platform.rotation"],
        band=(1.0, 3000.0),
        amplitude={"V": 0.5},
        step_size=5e-6,
        stop_time=4.0,
        scale=stage_pose(),
    )
