"""Linearised feedback: a plant integrates what a controller answers to it implicitly, however stiff that is.

    master = make_master(instances, system, "linearized_feedback", 1e-5)   # of assembly.build with its ports

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

Plants step first, then the others, each in the system's order; sampled instances tick before (`master.py`), and
what they put out is held. Inputs of an FMU that takes no input derivatives are held; so is what is on an algebraic
loop.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from hfsa.cosim.actions.feedback import Feedback
from hfsa.cosim.actions.schedule import Action, sampled_first
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.linear.blocks import Block
from hfsa.cosim.linear.feedback import FeedbackLayout, followed
from hfsa.cosim.masters.algorithm import Algorithm, Ports, Scheme
from hfsa.cosim.masters.stepped import stepped
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.feedback_loops import FeedbackLoop, feedback_loops
from hfsa.cosim.systems.system import Connection, System

NAME = "linearized_feedback"

_NO_LOOP = (
    "no output of a component comes back to it through a continuous one without a state between, so there is nothing "
    "to feed back; take gauss_seidel"
)


def scheme(instances: Mapping[str, Instance], system: System) -> Scheme:
    """Return the scheme on one system; `StructureError` where no loop can be closed so, and why."""
    connectors = {c.name: instances[c.name].fmu.variables for c in system.components}
    found = feedback_loops(system, connectors)
    lacking = [_lacking(loop, instances) for loop in found]
    loops = [loop for loop, words in zip(found, lacking, strict=True) if not words]
    if not loops:
        raise StructureError(f"{NAME}: {lacking[0] if found else _NO_LOOP}")
    marks = dict.fromkeys(Connection(f"{o.plant}.{o.output}", f"{o.plant}.{o.at}") for o in loops)
    wiring = Wiring(System(system.components, [*system.connections, *marks]), instances)
    warnings: dict[str, str] = {}
    for loop, words in zip(found, lacking, strict=True):
        if words and system[loop.plant].part.endswith(".fmu"):  # a part lacks only ports that no state follows
            warnings.setdefault(loop.plant, f"{words}; {loop.input} moves on a line instead")
    return Scheme(wiring, list(linearized_feedback(wiring, loops)), list(wiring.exchange()), warnings=warnings)


def linearized_feedback(wiring: Wiring, loops: Sequence[FeedbackLoop]) -> Iterator[Action]:
    """Plants step first, then the others."""
    feedback = Feedback(wiring, loops)
    yield from sampled_first(wiring)
    yield from feedback.point
    order = sorted(wiring.others, key=lambda stepper: stepper.instance not in feedback.gains)
    waiting, has_stepped = [stepper.instance for stepper in order], []
    for stepper in order:
        waiting.remove(stepper.instance)
        yield from feedback.lines(stepper.instance, has_stepped)
        yield stepper
        has_stepped.append(stepper.instance)
        yield from (group for group in stepper.groups if any(t.target in waiting for t in group.transfers))


def ports(system: System, connectors: Mapping[str, Mapping[str, Connector]]) -> Ports:
    """Return the inputs of plants that are to follow their outputs within a step, (input, output) each, by plant."""
    loops = feedback_loops(system, connectors)
    plants = dict.fromkeys(loop.plant for loop in loops)
    return {p: tuple(dict.fromkeys((o.input, o.output) for o in loops if o.plant == p)) for p in plants}


def layout(
    system: System, instances: Mapping[str, Instance], blocks: Mapping[str, Block], *observation: Any
) -> FeedbackLayout:
    """Return its linear map, which the FMUs' blocks suffice for: no ports are asked of them."""
    wiring = Wiring(system, instances)
    found = followed(feedback_loops(system, wiring.connectors), blocks)
    # a component that is made of parts can be exported with ports
    loops = [o for o in found if not system[o.plant].part.endswith(".fmu") or o.gain in wiring.connectors[o.plant]]
    if not loops:
        raise StructureError(
            f"{NAME}: there is nothing to feed back: no part has an output that comes back to it through a continuous "
            "component without a state between"
        )
    return FeedbackLayout(wiring, [*sampled_first(wiring)], blocks, loops, *observation)


def _lacking(loop: FeedbackLoop, instances: Mapping[str, Instance]) -> str:
    """Return what keeps a loop from being closed so; empty where nothing does."""
    controller, plant = (instances[name].fmu.description for name in (loop.controller, loop.plant))
    if not controller.has_derivatives:
        return f"{loop.controller}: {controller.file.name} has no directional derivatives to feed back"
    if loop.gain not in plant.variables:
        return f"{loop.plant}: {plant.file.name} has no port {loop.gain}, with which only parts are exported"
    return ""


ALGORITHMS = (
    Algorithm(
        NAME,
        "plants integrate what a controller answers to them implicitly, by the controllers' derivatives",
        rank=11,
        inputs="fed back",
        order=2,
        scheme=scheme,
        make=stepped,
        is_ordered=True,
        is_advised=True,
        ports=ports,
        layout=layout,
    ),
)
