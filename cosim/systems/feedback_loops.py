"""Feedback loops that linearised feedback closes: a plant and a controller whose command has direct feedthrough.

    plant.output -> controller.measured -> controller.command -> plant.input

The loops follow from the connections and the FMUs' ModelStructure. A sampled controller closes none: its command is
constant between ticks.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.system import System


@dataclass(frozen=True)
class FeedbackLoop:
    """Feedback loop: the plant with its input and output, the controller with its measured input and its command."""

    plant: str
    input: str
    output: str
    controller: str
    measured: str
    command: str

    @property
    def gain(self) -> str:
        """Name of the plant's parameter for the controller gain, d command / d measured."""
        return f"feedback.gain.{self.input}.{self.output}"

    @property
    def at(self) -> str:
        """Name of the plant's input for the value of its output at the communication point."""
        return f"feedback.at.{self.output}"


def feedback_loops(system: System, connectors: Mapping[str, Mapping[str, Connector]]) -> list[FeedbackLoop]:
    """Return the feedback loops of a system; `connectors` holds the variables of each component's FMU by name.

    A plant output with direct feedthrough from an input on a loop is left out: that is an algebraic loop.
    """
    feeder = {system.split(connection.end): system.split(connection.start) for connection in system.connections}
    found = []
    for (plant, u), (controller, command) in feeder.items():
        if plant == controller or connectors[controller][command].variability == "discrete":
            continue
        followed = connectors[controller][command].dependencies
        for (target, measured), (source, y) in feeder.items():
            closes = target == controller and source == plant and (followed is None or measured in followed)
            if closes and connectors[plant][y].variability != "discrete":
                found.append(FeedbackLoop(plant, u, y, controller, measured, command))
    inputs = {(loop.plant, loop.input) for loop in found}

    def has_state_between(loop: FeedbackLoop) -> bool:
        """Whether the plant's output has no direct feedthrough from its inputs on loops."""
        direct = connectors[loop.plant][loop.output].dependencies
        return direct is not None and not any((loop.plant, name) in inputs for name in direct)

    return [loop for loop in found if has_state_between(loop)]
