"""Actions of linearised feedback at the beginning of a step: feedback gains, output rates, input slopes.

`Gains` are the derivatives of controller commands with respect to plant outputs; the plant applies them within the
step. `Rates` are the time derivatives of outputs at the communication point. `Lines` are the slopes of an instance's
inputs: towards the newest output of a source that has stepped already, else the rate of that output, less the part that
the plant applies itself. The law is that of `masters/linearized_feedback.py`.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from hfsa.cosim.actions.action import CompositeAction, Group
from hfsa.cosim.actions.extrapolation import History
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.co_simulation import Call, Number
from hfsa.cosim.fmi.library import fails
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.feedback_loops import FeedbackLoop


class Gains(CompositeAction):
    """Feedback gains of one plant.

    Attributes:
        loops: feedback loops through the plant, one or more for each gain.
        gains: (n,); `of_loop` holds the index of the gain of each loop.
        derivatives: results of all calls but the last; derivative `entries[k]` is a summand of gain `places[k]`.
        calls: one for each controller and measured input, and the one that sets the gains.
    """

    def __init__(self, wiring: Wiring, loops: Sequence[FeedbackLoop]):
        self.loops = loops
        plant = wiring.instances[loops[0].plant]
        names = list(dict.fromkeys(loop.gain for loop in loops))
        self.gains = np.zeros(len(names))
        self.of_loop = [names.index(loop.gain) for loop in loops]
        all_commands: dict[tuple[str, str], list[str]] = {}
        for loop in loops:
            all_commands.setdefault((loop.controller, loop.measured), []).append(loop.command)
        commands = {measured: list(dict.fromkeys(found)) for measured, found in all_commands.items()}
        self.derivatives = np.zeros(sum(map(len, commands.values())))
        self.calls: list[Call] = []
        entries: list[int] = []
        places: list[int] = []
        first = 0
        for (controller, measured), found in commands.items():
            it = wiring.instances[controller]
            unknowns = it.handle(found, self.derivatives[first : first + len(found)])
            self.calls.append(it.directional(unknowns, it.handle([measured], np.ones(1))))
            for loop, gain in zip(loops, self.of_loop, strict=True):
                if (loop.controller, loop.measured) == (controller, measured):
                    entries.append(first + found.index(loop.command))
                    places.append(gain)
            first += len(found)
        self.entries, self.places = np.array(entries), np.array(places)
        self.calls.append(plant.setter(plant.handle(names, self.gains)))

    def run(self) -> int:
        """Fetch the derivatives and set the gains."""
        fetched = self._run(self.calls[:-1])
        if fails(fetched):
            return fetched
        self.gains[:] = 0.0
        for entry, place in zip(self.entries, self.places, strict=True):
            self.gains[place] += self.derivatives[entry]
        set_ = self._run(self.calls[-1:])
        return set_ if fails(set_) else fetched or set_


@dataclass(eq=False)
class Rates(CompositeAction):
    """Rates of one group's outputs, by directional derivatives along time, states and fed inputs.

    Attributes:
        group: the group; `again` returns the same with some inputs of its instance driven by signals.
        rates: rates of all connected outputs; the group's are at `places`, those that feed the instance at `feeding`.
        seed: 1 for time, then the states' derivatives, the rates of driven inputs, and those of connected ones.
        driven: the part of the seed for driven inputs.
        result: rates of the group's outputs.
    """

    group: Group
    again: Callable[[Sequence[str]], "Rates"]
    rates: np.ndarray
    places: np.ndarray
    feeding: np.ndarray
    seed: np.ndarray
    driven: np.ndarray
    result: np.ndarray
    calls: Sequence[Call] = field(repr=False)

    @property
    def fed(self) -> np.ndarray:
        """The part of the seed for connected inputs."""
        return self.seed[len(self.seed) - len(self.feeding) :]

    def run(self) -> int:
        """Compute the rates."""
        self.fed[:] = self.rates[self.feeding]
        status = self._run(self.calls)
        if status <= 1:
            self.rates[self.places] = self.result
        return status


@dataclass(eq=False)
class Lines(CompositeAction):
    """Sets the slopes of one instance's inputs for the next step.

    Attributes:
        bus, before, rates: connected outputs now and at the communication point, and their rates there.
        places: indices of the inputs on the bus, (n,); `is_known` marks those whose source has stepped already.
        slopes: (n,); `setter` sets them.
        own: (slope, gain, place of a rate) of each feedback that the plant applies itself, (m, 3); `gains` are the
            plant's.
    """

    step_size: Number
    bus: np.ndarray
    before: np.ndarray
    rates: np.ndarray
    places: np.ndarray
    is_known: np.ndarray
    slopes: np.ndarray
    setter: Call
    own: np.ndarray
    gains: np.ndarray

    def run(self) -> int:
        """Compute and set the slopes."""
        change = (self.bus[self.places] - self.before[self.places]) / self.step_size.value
        self.slopes[:] = np.where(self.is_known, change, self.rates[self.places])
        for slope, gain, place in self.own:
            self.slopes[slope] -= self.gains[gain] * self.rates[place]
        return self._run([self.setter])


class Feedback:
    """The actions of linearised feedback for the feedback loops of a system.

    Attributes:
        gains: gains by plant.
        point: actions at a communication point: record values, compute gains and rates.
    """

    def __init__(self, wiring: Wiring, loops: Sequence[FeedbackLoop]):
        self._wiring = wiring
        self._rates = np.zeros_like(wiring.bus)
        self._history = History(wiring.bus)
        plants = dict.fromkeys(loop.plant for loop in loops)
        self.gains = {plant: Gains(wiring, [o for o in loops if o.plant == plant]) for plant in plants}
        rates = [_rates(wiring, group, self._rates) for group in wiring.groups if _has_rates(wiring, group)]
        self.point = [self._history, *self.gains.values(), *rates]

    def lines(self, instance: str, stepped: Collection[str]) -> Iterator[Lines]:
        """Yield the action that sets the slopes of an instance's inputs, if its FMU accepts them.

        `stepped` names the instances that have stepped already.
        """
        wiring, it, gains = self._wiring, self._wiring.instances[instance], self.gains.get(instance)
        marks = {o.at for o in gains.loops} if gains else set()
        fed_back = {o.input for o in gains.loops} if gains else set()
        ends = [(i, c.start, *wiring.split(c.end)) for i, c in enumerate(wiring.connections)]
        moving = [
            (i, wiring.split(start)[0], name)
            for i, start, target, name in ends
            if target == instance and name not in marks and not wiring.is_sampled(start)
        ]
        names = [name for _, _, name in moving]
        if not names or not it.has_input_derivatives(names, 1):
            return
        slopes = np.zeros(len(names))
        yield Lines(
            wiring.step_size,
            wiring.bus,
            self._history.points[0],
            self._rates,
            np.array([i for i, _, _ in moving]),
            np.array([source in stepped and name not in fed_back for _, source, name in moving]),
            slopes,
            it.derivative_setter(it.handle(names, slopes), 1),
            self._own(gains, names) if gains else np.zeros((0, 3), int),
            gains.gains if gains else np.zeros(0),
        )

    def _own(self, gains: Gains, inputs: Sequence[str]) -> np.ndarray:
        """Return (slope, gain, place of a rate) of each feedback that a plant applies itself; each gain counts once."""
        ends = [(self._wiring.split(c.start), self._wiring.split(c.end)) for c in self._wiring.connections]
        found = {
            gain: (inputs.index(o.input), gain, ends.index(((o.plant, o.output), (o.plant, o.at))))
            for o, gain in zip(gains.loops, gains.of_loop, strict=True)
        }
        return np.array(list(found.values()))


def _has_rates(wiring: Wiring, group: Group) -> bool:
    """Whether a group's outputs have rates: they move, are on no algebraic loop, and the FMU differentiates them."""
    fmu = wiring.instances[group.instance].fmu
    is_moving = not all(_is_held(fmu.variables[name]) for name in group.outputs)
    return is_moving and fmu.description.has_derivatives and group.loop is None


def _rates(wiring: Wiring, group: Group, rates: np.ndarray, driven: Sequence[str] = ()) -> Rates:
    """Return the action that computes the rates of a group's outputs; `driven` are inputs that signals drive."""
    it = wiring.instances[group.instance]
    variables, description = it.fmu.variables, it.fmu.description
    moving = [(i, n) for i, n in zip(wiring.places(group), group.outputs, strict=True) if not _is_held(variables[n])]
    ends = [(i, wiring.split(connection.end)) for i, connection in enumerate(wiring.connections)]
    fed = [(i, name) for i, (target, name) in ends if target == group.instance]
    # not every foreign FMU differentiates with respect to time
    is_finished = wiring.system[group.instance].is_foreign
    time = [] if is_finished else [name for name, v in variables.items() if v.causality == "independent"]
    states = [state for state, _ in description.states]
    first, second = len(time) + len(states), len(time) + len(states) + len(driven)
    seed, result = np.zeros(second + len(fed)), np.zeros(len(moving))
    seed[: len(time)] = 1.0
    derivatives = it.handle([d for _, d in description.states], seed[len(time) : first])
    knowns = it.handle([*time, *states, *driven, *(name for _, name in fed)], seed)
    unknowns = it.handle([name for _, name in moving], result)
    calls = [*([it.getter(derivatives)] if states else []), it.directional(unknowns, knowns)]
    places, feeding = np.array([i for i, _ in moving]), np.array([i for i, _ in fed], int)
    again = partial(_rates, wiring, group, rates)
    return Rates(group, again, rates, places, feeding, seed, seed[first:second], result, calls)


def _is_held(variable: Connector) -> bool:
    """Whether a variable changes at ticks only."""
    return variable.variability == "discrete"
