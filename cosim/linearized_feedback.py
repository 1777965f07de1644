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
fused (`_fuse.py`) are one plant.

Plants step first, then the others, each in the system's order; sampled instances tick before (`master.py`), and what
they put out is held. Inputs of an FMU that takes no input derivatives are held; so is what is on an algebraic loop.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hfsa.cosim._feedback_loops import ALGORITHM, Loop, feedback_loops
from hfsa.cosim.actions.action import Group, Work
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.instance import Call, Instance
from hfsa.cosim.master import Master, sampled_first
from hfsa.cosim.system import ALGORITHMS, Connection, StructureError, System

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

    def _step(self) -> Iterator[Any]:
        self.extrapolation = None
        wiring, plants = self.wiring, {loop.plant for loop in self._loops}
        point = _Point(wiring, self._loops)
        yield from sampled_first(wiring)
        yield point
        order = sorted(wiring.others, key=lambda stepper: stepper.instance not in plants)
        waiting, stepped = [stepper.instance for stepper in order], []
        for stepper in order:
            waiting.remove(stepper.instance)
            yield from point.lines(stepper.instance, stepped)
            yield stepper
            stepped.append(stepper.instance)
            yield from (group for group in stepper.groups if any(t.target in waiting for t in group.transfers))


class _Point(Work):
    """What is known at a communication point: values and rates on the bus, and the plants' gains.

    Attributes:
        values, rates: of the connected outputs, and what they change by per second, (n,) as the bus.
        gains: by plant.
    """

    def __init__(self, wiring: Wiring, loops: Sequence[Loop]):
        self.wiring = wiring
        self.values, self.rates = np.zeros_like(wiring.bus), np.zeros_like(wiring.bus)
        plants = dict.fromkeys(loop.plant for loop in loops)
        self.gains = {plant: _Gains(wiring, [o for o in loops if o.plant == plant]) for plant in plants}
        self._rates = [rate for group in wiring.groups for rate in _rates(wiring, group, self.rates)]

    def run(self) -> int:
        """Take values, set the plants' gains, and find the rates in feedthrough order."""
        self.values[:] = self.wiring.bus
        for work in (*self.gains.values(), *self._rates):
            if status := work.run():
                self.failing = work.failing
                if status > 1:
                    return status
        return 0

    def lines(self, instance: str, stepped: Collection[str]) -> list["_Lines"]:
        """Return the action that lets an instance's inputs move, if it can; `stepped` have stepped already."""
        wiring, it = self.wiring, self.wiring.instances[instance]
        ends = [(i, wiring.split(c.start), wiring.split(c.end)) for i, c in enumerate(wiring.connections)]
        marks = {f"feedback.at.{o.output}" for o in self.gains[instance].loops} if instance in self.gains else set()
        moving = [
            (i, source, name)
            for i, (source, _), (target, name) in ends
            if target == instance and name not in marks and not wiring.is_sampled(wiring.connections[i].start)
        ]
        names = [name for _, _, name in moving]
        if not names or not it.has_input_derivatives(names, 1):
            return []
        slopes = np.zeros(len(names))
        gains = self.gains.get(instance)
        fed_back = [gains is not None and any(o.input == name for o in gains.loops) for name in names]
        is_known = [source in stepped and not fed for (_, source, _), fed in zip(moving, fed_back, strict=True)]
        return [
            _Lines(
                self,
                np.array([i for i, _, _ in moving]),
                np.array(is_known),
                names,
                slopes,
                gains,
                it.derivative_setter(it.handle(names, slopes), 1),
            )
        ]


@dataclass(eq=False)
class _Lines(Work):
    """Gives the inputs of one instance their slopes for the step that follows.

    Attributes:
        places: of the inputs on the bus, (n,); `is_known` says of which the end of the step is known.
        names: of the inputs; `slopes` are handed over by `setter`.
        gains: of a plant: what it follows of itself is none of the slopes.
    """

    point: _Point
    places: np.ndarray
    is_known: np.ndarray
    names: Sequence[str]
    slopes: np.ndarray
    gains: "_Gains | None"
    setter: Call

    def run(self) -> int:
        """Work the slopes out and hand them over."""
        point, places = self.point, self.places
        change = (point.wiring.bus[places] - point.values[places]) / point.wiring.step_size.value
        self.slopes[:] = np.where(self.is_known, change, point.rates[places])
        if self.gains is not None:
            own = self.gains.following(point.rates)
            for k, name in enumerate(self.names):
                self.slopes[k] -= own.get(name, 0.0)
        return self._run([self.setter])


class _Gains(Work):
    """The gains of one plant: derivatives of what its controllers command with respect to what it puts out.

    `loops` are the ways around, one or more for each gain.
    """

    def __init__(self, wiring: Wiring, loops: Sequence[Loop]):
        self.loops = loops
        plant = wiring.instances[loops[0].plant]
        names = list(dict.fromkeys(loop.gain for loop in loops))
        self._values = np.zeros(len(names))
        self._setter = plant.setter(plant.handle(names, self._values))
        self._of_loop = [names.index(loop.gain) for loop in loops]
        ends = [(wiring.split(c.start), wiring.split(c.end)) for c in wiring.connections]
        self._marks = [ends.index(((o.plant, o.output), (o.plant, o.at))) for o in loops]
        controllers = dict.fromkeys(loop.controller for loop in loops)
        self._slopes = [_Slopes(wiring.instances[c], [o for o in loops if o.controller == c]) for c in controllers]
        self._places = [[k for k, o in enumerate(loops) if o.controller == c] for c in controllers]

    def run(self) -> int:
        """Fetch the derivatives and set the gains."""
        self._values[:] = 0.0
        for slopes, places in zip(self._slopes, self._places, strict=True):
            if status := slopes.run():
                self.failing = slopes.failing
                if status > 1:
                    return status
            for k, value in zip(places, slopes.values, strict=True):
                self._values[self._of_loop[k]] += value
        return self._run([self._setter])

    def following(self, rates: np.ndarray) -> dict[str, float]:
        """Return by input the part of its rate that comes from the plant's own outputs; `rates` as the bus."""
        found: dict[str, float] = {}
        counted: set[int] = set()
        for loop, gain, mark in zip(self.loops, self._of_loop, self._marks, strict=True):
            if gain not in counted:
                counted.add(gain)
                found[loop.input] = found.get(loop.input, 0.0) + self._values[gain] * rates[mark]
        return found


class _Slopes(Work):
    """Derivatives of a controller's commands, `values[k]` that of loop k."""

    def __init__(self, controller: Instance, loops: Sequence[Loop]):
        knowns = list(dict.fromkeys(loop.measured for loop in loops))
        unknowns = list(dict.fromkeys(loop.command for loop in loops))
        self._seed, self._result = np.zeros(len(knowns)), np.zeros(len(unknowns))
        seed, result = controller.handle(knowns, self._seed), controller.handle(unknowns, self._result)
        self._call = controller.directional(result, seed)
        self._entries = [
            [(k, unknowns.index(o.command)) for k, o in enumerate(loops) if o.measured == name] for name in knowns
        ]
        self.values = np.zeros(len(loops))

    def run(self) -> int:
        """Fetch the derivatives with respect to one measured value after the other."""
        for j, entries in enumerate(self._entries):
            self._seed[:] = 0.0
            self._seed[j] = 1.0
            if status := self._run([self._call]):
                return status
            for k, row in entries:
                self.values[k] = self._result[row]
        return 0


@dataclass(eq=False)
class _Rates(Work):
    """Rates of outputs of one instance at one feedthrough level, from time, its states and its fed inputs.

    Attributes:
        bus_rates: of all connected outputs; the group's are at `places`, those that feed the instance at `feeding`.
        seed: 1 for time, then the states' derivatives, then the fed inputs' rates; `result` are the outputs' rates.
    """

    bus_rates: np.ndarray
    places: np.ndarray
    feeding: np.ndarray
    seed: np.ndarray
    result: np.ndarray
    calls: Sequence[Call] = field(repr=False)

    def run(self) -> int:
        """Find the rates."""
        self.seed[len(self.seed) - len(self.feeding) :] = self.bus_rates[self.feeding]
        status = self._run(self.calls)
        if status <= 1:
            self.bus_rates[self.places] = self.result
        return status


def _rates(wiring: Wiring, group: Group, bus_rates: np.ndarray) -> list[_Rates]:
    """Return what finds the rates of a group's outputs: nothing where they are held or the FMU does not tell."""
    it = wiring.instances[group.instance]
    variables, description = it.fmu.variables, it.fmu.description
    moving = [(i, n) for i, n in zip(wiring.places(group), group.outputs, strict=True) if not _is_held(variables[n])]
    if not moving or not description.has_derivatives or group.loop is not None:
        return []
    ends = [(i, wiring.split(connection.end)) for i, connection in enumerate(wiring.connections)]
    fed = [(i, name) for i, (target, name) in ends if target == group.instance]
    # not every maker takes time for something to derive by
    is_finished = wiring.system[group.instance].part.endswith(".fmu")
    time = [] if is_finished else [name for name, v in variables.items() if v.causality == "independent"]
    states = [state for state, _ in description.states]
    seed, result = np.zeros(len(time) + len(states) + len(fed)), np.zeros(len(moving))
    seed[: len(time)] = 1.0
    derivatives = it.handle([d for _, d in description.states], seed[len(time) : len(time) + len(states)])
    knowns = it.handle([*time, *states, *(name for _, name in fed)], seed)
    unknowns = it.handle([name for _, name in moving], result)
    calls = [*([it.getter(derivatives)] if states else []), it.directional(unknowns, knowns)]
    return [
        _Rates(bus_rates, np.array([i for i, _ in moving]), np.array([i for i, _ in fed], int), seed, result, calls)
    ]


def _is_held(variable) -> bool:
    return variable.variability == "discrete"


def _lacking(loop: Loop, instances: Mapping[str, Instance]) -> str:
    """Return what keeps a loop from being closed so; empty where nothing does."""
    controller, plant = (instances[name].fmu.description for name in (loop.controller, loop.plant))
    if not controller.has_derivatives:
        return f"{loop.controller}: {controller.file.name} has no directional derivatives to feed back"
    if loop.gain not in plant.variables:
        return f"{loop.plant}: {plant.file.name} has no port {loop.gain}, with which only parts are exported"
    return ""
