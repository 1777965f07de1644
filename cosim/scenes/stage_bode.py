"""The piezo stage at a bias: how far its platform moves and turns per volt on one stack, from 1 Hz to 3 kHz.

Three stacks with their amplifiers push on the stage at half of their voltage, and one of them swings by 0.5 V about it.
A volt shifts the platform by up to 0.23 um and turns it by -4.1 urad, the same for each stack, up to a resonance of the
shifts, 18 dB high at 912 Hz, and one of the turn, 11 dB high at 2332 Hz. Above its own each falls by 40 dB per decade,
and by 60 above the amplifier's corner, 3.94 kHz at a stack that is held.

Driven about 0 V by ideal voltages the modes lie at 904.65 and 2225.2 Hz with 0.6 and 1.6 % of damping. The amplifier's
resistance holds back charge from a stack that is squeezed, which stiffens and damps: 916.1 and 2375.6 Hz with 6 and 12
%; the bias takes 0.03 to 0.04 % off.

A force is passed on twice, from the source to a stack and on to the stage, and each time held for a step: `jacobi` lags
by a whole step, 7.5 degrees at 2 kHz, and `gauss_seidel` would lead by as much with the stacks first. The stage goes
first here, so that a stack leads by half a step and the stage lags by half: the error is of the second order, and a
step of 10 us costs 0.006 dB and 0.15 degrees up to 2 kHz, 0.021 dB and 0.22 degrees up to 3 kHz. What is fed back, the
charge of a stack that is squeezed, makes steps above 64.8 us (`jacobi`) and 188 us (`gauss_seidel`) unstable.

With the step of 5 us `auto` takes `gauss_seidel_quadratic`, and no response errs by a tenth of a per cent.

The amplifiers give 0.1 A. At 2 kHz that is an amplitude of 9.65 V, not the 5.7 V that a stack takes which moves freely:
between its resonances the stage gives way against the voltage. Limits are seen at the end of a step, so that one is
told of above 10.2 V, where the response is off by 0.1 dB.
"""

from hfsa.cosim.scenes._biased_stage import Kinematics, Level, biased_stage
from hfsa.cosim.scenes._pzt import TOKIN, Pzt
from hfsa.cosim.scenes._scale import stage_pose
from hfsa.cosim.systems.scene import Scene


def stage_bode(
    *,
    stage: Level = "constant_jacobian",
    kinematics: Kinematics = "nominal",
    pzt: Pzt = TOKIN,
    bias: float = 75.0,
    damping_time: float = 6.02e-6,
    resistance: float = 50.0,
) -> Scene:
    """The pose's response to each of the three voltages.

    Args:
        stage: level of the stage.
        kinematics: parameter set of the stage's links.
        pzt: the stacks by their data sheet.
        bias: voltage of all stacks, about which one of them swings [V]; 0 to their full voltage.
        damping_time: of the hinges, beta [s].
        resistance: of the amplifiers' outputs [Ohm].

    Raises:
        StructureError: a bias that the stacks cannot have.
    """
    return Scene(
        biased_stage("stage_bode", stage, kinematics, pzt, bias, damping_time, resistance),
        inputs=["stack[1..3].command.voltage"],
        outputs=["stage.platform.position[1..2]", "stage.platform.rotation"],
        band=(1.0, 3000.0),
        amplitude={"V": 0.5},
        step_size=5e-6,
        stop_time=4.0,
        scale=stage_pose(),
    )
