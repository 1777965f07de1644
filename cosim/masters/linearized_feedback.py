"""Linearised feedback: a plant integrates what a controller answers to it implicitly, however stiff that is.

    master = LinearizedFeedback(instances, system, step_size=1e-5)      # of build.files_for(system, ALGORITHM)

On a loop plant.y -> controller -> plant.u without a state between, u held over a step H is stable only while H is
short beside the loop's own time constants. Here the controller's FMU gives its directional derivatives G = du/dy beside
u, and the plant, whose solver takes stiff equations, steps with

    u(t) = u_k + G (y(t) - y_k) + d (t - t_k)        d: rate of u_k while y rests

by the ports that its FMU was exported with (`feedback.gain.u.y`, `feedback.at.y`). All other inputs move on lines: to
where the instance that feeds them has stepped already, else at the rate that its output has at t_k. Rates follow from
the FMUs' directional derivatives, passed on in feedthrough order. What a nonlinear controller bends within a step, and
what its own states do meanwhile, is of second order in H, like the lines. On lines is also what crosses through the
controller from one plant to another: under one controller for several, the step is limited by that, and parts that are
fused (`assembly/fuse.py`) are one plant.

Plants step first, then the others, each in the system's order; sampled instances tick before (`masters/master.py`), and
what they put out is held. Inputs of an FMU that takes no input derivatives are held; so is what is on an algebraic
loop.
"""

from collections.abc import Iterator, Mapping

from hfsa.cosim.actions.feedback import Feedback
from hfsa.cosim.actions.schedule import Action
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.masters.master import Master, sampled_first
from hfsa.cosim.systems.feedback_loops import ALGORITHM, Loop, feedback_loops
from hfsa.cosim.systems.system import ALGORITHMS, Connection, StructureError, System

_NO_LOOP = (
    "no output of a component comes back to it through a continuous one without a state between, so there is nothing "
    f"to feed back; take {ALGORITHMS[0]}"
)


class LinearizedFeedback(Master):
    """A master that steps plants with their controllers linearised.

    Raises `StructureError` where no loop can be closed so, and why.
    """

    def __init__(self, instances: Mapping[str, Instance], system: System, step_size: float = 1e-3):
        connectors = {c.name: instances[c.name].fmu.variables for c in system.components}
        found = feedback_loops(system, connectors)
        lacking = [_lacking(loop, instances) for loop in found]
        self._loops = [loop for loop, words in zip(found, lacking, strict=True) if not words]
        if not self._loops:
            raise StructureError(f"{ALGORITHM}: {lacking[0] if found else _NO_LOOP}")
        marks = dict.fromkeys(Connection(f"{o.plant}.{o.output}", f"{o.plant}.{o.at}") for o in self._loops)
        joined = System(system.components, [*system.connections, *marks])
        super().__init__(instances, joined, ALGORITHMS[0], step_size)
        self.algorithm = ALGORITHM
        for loop, words in zip(found, lacking, strict=True):
            if words and system[loop.plant].part.endswith(".fmu"):  # a part lacks only ports that no state follows
                self.warnings.setdefault(loop.plant, f"{words}; {loop.input} moves on a line instead")

    def _step(self) -> Iterator[Action]:
        """Yield the actions of a step: plants first, then the others."""
        feedback = Feedback(self.wiring, self._loops)
        yield from sampled_first(self.wiring)
        yield from feedback.point
        order = sorted(self.wiring.others, key=lambda stepper: stepper.instance not in feedback.gains)
        waiting, stepped = [stepper.instance for stepper in order], []
        for stepper in order:
            waiting.remove(stepper.instance)
            yield from feedback.lines(stepper.instance, stepped)
            yield stepper
            stepped.append(stepper.instance)
            yield from (group for group in stepper.groups if any(t.target in waiting for t in group.transfers))


def _lacking(loop: Loop, instances: Mapping[str, Instance]) -> str:
    """Return what keeps a loop from being closed so; empty where nothing does."""
    controller, plant = (instances[name].fmu.description for name in (loop.controller, loop.plant))
    if not controller.has_derivatives:
        return f"{loop.controller}: {controller.file.name} has no directional derivatives to feed back"
    if loop.gain not in plant.variables:
        return f"{loop.plant}: {plant.file.name} has no port {loop.gain}, with which only parts are exported"
    return ""
