"""Voice coil behind a current amplifier.

    time_constant i' + i = command,    force = motor_constant i

Bode plot, command to force: motor_constant at low frequency, -3 dB at 1 / (2 pi time_constant) Hz, and -20 dB per
decade beyond.
"""

from hfsa.components import Model
from my_machine._sizes import MOTOR_CONSTANT


def voice_coil() -> Model:
    """Force follows the commanded current as fast as the amplifier allows."""
    m = Model("VoiceCoil", "Voice coil behind a current amplifier")
    constant = m.parameter("motor_constant", MOTOR_CONSTANT, "N/A", "Force per current", min=0)
    tau = m.parameter("time_constant", 1e-4, "s", "Time constant of the amplifier", min=1e-9, nominal=1e-4)
    command = m.input("command", "A", "Commanded current")
    i = m.state("current", "A", "Current in the coil")
    m.der[i] = (command - i) / tau
    m.output("force", constant * i, "N", "Force on the stage")
    return m
