"""Linearised feedback: the plant integrates the linearised response of its controller implicitly, however stiff it is.

    master = make_master(instances, system, "linearized_feedback", 1e-5)   # FMUs built with feedback ports

On a loop plant.y -> controller -> plant.u with direct feedthrough, u held over a step H is stable only while H is short
compared with the loop's own time constants. Here the controller's FMU provides its directional derivatives G = du/dy,
and the plant, whose solver is suited to stiff equations, steps with

    u(t) = u_k + G (y(t) - y_k) + d (t - t_k)        d: rate of u_k while y rests

through the feedback ports of its FMU (`feedback.gain.u.y`, `feedback.at.y`). All other inputs follow straight lines:
towards the newest output of a source that has stepped already, else at the rate of that output at t_k. Rates follow
from the FMUs' directional derivatives, passed on in feedthrough order. The nonlinearity of a controller within a step
and the motion of its states are of second order in H, like the lines. Coupling through the controller from one plant to
another follows lines too: it limits the step of a controller of several plants. Fused parts (`assembly/fuse.py`) are
one plant.

Plants step first, then all other continuous instances, each in the system's order; sampled instances tick before
(`master.py`), and their outputs are held. Inputs of an FMU that accepts no input derivatives are held, and so are
values on an algebraic loop.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from hfsa.cosim.actions.feedback import Feedback
from hfsa.cosim.actions.schedule import Action, discrete_first
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.linear.blocks import Block
from hfsa.cosim.linear.feedback import FeedbackLayout, with_states
from hfsa.cosim.masters.algorithm import Algorithm, Ports, Scheme
from hfsa.cosim.masters.stepped import stepped
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.feedback_loops import FeedbackLoop, feedback_loops
from hfsa.cosim.systems.system import Connection, System

NAME = "linearized_feedback"

_NO_LOOP = (
    "no output of a component returns to it by direct feedthrough of a continuous component, so there is nothing to "
    "feed back; take gauss_seidel"
)


def scheme(instances: Mapping[str, Instance], system: System) -> Scheme:
    """Return the scheme on one system; raises `StructureError` with the reason where there is no feedback loop."""
    connectors = {c.name: instances[c.name].fmu.variables for c in system.components}
    found = feedback_loops(system, connectors)
    lacking = [_lacking(loop, instances) for loop in found]
    loops = [loop for loop, words in zip(found, lacking, strict=True) if not words]
    if not loops:
        raise StructureError(f"{NAME}: {lacking[0] if found else _NO_LOOP}")
    held_outputs = dict.fromkeys(Connection(f"{o.plant}.{o.output}", f"{o.plant}.{o.at}") for o in loops)
    wiring = Wiring(System(system.components, [*system.connections, *held_outputs]), instances)
    warnings: dict[str, str] = {}
    for loop, words in zip(found, lacking, strict=True):
        if words and system[loop.plant].is_foreign:  # a part lacks only ports that no state follows
            warnings.setdefault(loop.plant, f"{words}; {loop.input} moves on a line instead")
    return Scheme(wiring, list(linearized_feedback(wiring, loops)), list(wiring.exchange()), warnings=warnings)


def linearized_feedback(wiring: Wiring, loops: Sequence[FeedbackLoop]) -> Iterator[Action]:
    """Yield the actions of a step: plants step first, then the others."""
    feedback = Feedback(wiring, loops)
    yield from discrete_first(wiring)
    yield from feedback.point
    order = sorted(wiring.continuous, key=lambda stepper: stepper.instance not in feedback.gains)
    waiting, has_stepped = [stepper.instance for stepper in order], []
    for stepper in order:
        waiting.remove(stepper.instance)
        yield from feedback.lines(stepper.instance, has_stepped)
        yield stepper
        has_stepped.append(stepper.instance)
        yield from (group for group in stepper.groups if any(t.target in waiting for t in group.transfers))


def ports(system: System, connectors: Mapping[str, Mapping[str, Connector]]) -> Ports:
    """Return the feedback ports of the plants in a system, (input, output) each, by plant."""
    loops = feedback_loops(system, connectors)
    plants = dict.fromkeys(loop.plant for loop in loops)
    return {p: tuple(dict.fromkeys((o.input, o.output) for o in loops if o.plant == p)) for p in plants}


def layout(
    system: System, instances: Mapping[str, Instance], blocks: Mapping[str, Block], *observation: Any
) -> FeedbackLayout:
    """Return the linear map of linearised feedback; it needs no feedback ports."""
    wiring = Wiring(system, instances)
    found = with_states(feedback_loops(system, wiring.connectors), blocks)
    # a component that is made of parts can be exported with ports
    loops = [o for o in found if not system[o.plant].is_foreign or o.gain in wiring.connectors[o.plant]]
    if not loops:
        raise StructureError(
            f"{NAME}: there is nothing to feed back: no output of a part returns to it by direct feedthrough of a "
            "continuous component"
        )
    return FeedbackLayout(wiring, [*discrete_first(wiring)], blocks, loops, *observation)


def _lacking(loop: FeedbackLoop, instances: Mapping[str, Instance]) -> str:
    """Return the capability that a feedback loop lacks; empty if it lacks none."""
    controller, plant = (instances[name].fmu.description for name in (loop.controller, loop.plant))
    if not controller.has_derivatives:
        return f"{loop.controller}: {controller.file.name} has no directional derivatives to feed back"
    if loop.gain not in plant.variables:
        return f"{loop.plant}: {plant.file.name} has no feedback port {loop.gain}; only parts are exported with it"
    return ""


ALGORITHMS = (
    Algorithm(
        NAME,
        "plants integrate the linearised feedback of their controllers implicitly",
        rank=110,
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
