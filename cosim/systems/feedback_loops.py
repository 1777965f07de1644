"""Loops that linearised feedback closes: what a plant puts out comes back to it without a state between.

    plant.output -> controller.measured -> controller.command -> plant.input

They are found from the connections and the FMUs' ModelStructure. A controller that is sampled closes none: its command
is held from tick to tick.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.system import System


@dataclass(frozen=True)
class FeedbackLoop:
    """One way around: names of the plant with its input and output, and of the controller with those that they join."""

    plant: str
    input: str
    output: str
    controller: str
    measured: str
    command: str

    @property
    def gain(self) -> str:
        """Name of the plant's parameter for d command / d measured."""
        return f"feedback.gain.{self.input}.{self.output}"

    @property
    def at(self) -> str:
        """Name of the plant's input for the output at the communication point."""
        return f"feedback.at.{self.output}"


def feedback_loops(system: System, connectors: Mapping[str, Mapping[str, Connector]]) -> list[FeedbackLoop]:
    """Return the loops of a system; `connectors` holds the variables of each component's FMU by name.

    An output that follows one of the plant's inputs on a loop without a state between is none to feed back: that is an
    algebraic loop.
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
        """Whether the plant's output follows none of its inputs on a loop at once."""
        direct = connectors[loop.plant][loop.output].dependencies
        return direct is not None and not any((loop.plant, name) in inputs for name in direct)

    return [loop for loop in found if has_state_between(loop)]
