"""Connected models become one: what passes between them is an expression then, not a value that waits for a step.

    members = {"robot": sdelta(), "drive[1]": c_drive()}
    group = compose("Group", members, [("drive[1].tube.slide", "robot.drive[1].slide"), ...])

A quantity of the whole is called `member.quantity`. A fed input is gone: the expression of the output that feeds it
stands in its place. Mass-matrix equations stay as they are; only where an acceleration enters the force of another
member it is solved for by itself. The whole has the solver that members ask for, else its own choice; `exact` is none
to ask for, because what is joined may be linear no more.

Sampled members share one parameter, `sample_time`. At a tick they act one after the other, those first that are sampled
alone, then in the order of the members, and each sees what those before it have just put out. What a sampled output
feeds inside is kept from tick to tick in a sampled state `held.member.output`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from graphlib import CycleError, TopologicalSorter

import casadi as ca

from hfsa.components._modelling.model import Kind, Model, ModelError, Motion, Quantity, expand, nearest
from hfsa.components._modelling.units import unit

_SAMPLE_TIME = "sample_time"
_TICKING = (Kind.SAMPLED_STATE, Kind.SAMPLED_OUTPUT)


def compose(name: str, parts: Mapping[str, Model], connections: Sequence[tuple[str, str]]) -> Model:
    """Return the model of connected models.

    Args:
        name: of the whole, an identifier.
        parts: the members by name, such as `robot` or `drive[1]`.
        connections: (output, input) pairs by full name, `member.quantity`; a range joins its members pairwise.

    Raises:
        ModelError: a name that does not exist, an input fed twice, units that differ, an algebraic loop, members with
            different sample times.
    """
    for part in parts.values():
        part.check()
    return _Composition(name, dict(parts), _feeders(parts, connections)).model()


@dataclass(frozen=True)
class _End:
    """A quantity of a member."""

    member: str
    quantity: Quantity

    def __str__(self) -> str:
        return f"{self.member}.{self.quantity.name}"


@dataclass
class _Member:
    """A model on its way into the whole: what its symbols are replaced by, as far as that is known."""

    model: Model
    old: list[ca.SX] = field(default_factory=list)
    new: list[ca.SX] = field(default_factory=list)

    def put(self, old: ca.SX, new: ca.SX) -> None:
        """Replace a symbol, or a column of symbols."""
        self.old.append(old)
        self.new.append(new)

    def take(self, expression: ca.SX) -> ca.SX:
        """Return an expression of the member in the symbols of the whole."""
        return ca.substitute([expression], self.old, self.new)[0]


class _Composition:
    """One call of `compose`; `feeders` gives the output that feeds an input, by the input's full name."""

    def __init__(self, name: str, parts: Mapping[str, Model], feeders: Mapping[str, _End]):
        self.feeders = feeders
        self.whole = Model(name, f"{', '.join(parts)} as one")
        self.members = {member: _Member(part) for member, part in parts.items()}
        self.held: dict[str, ca.SX] = {}

    def model(self) -> Model:
        """Declare everything, feed the inputs in feedthrough order, then state the equations."""
        self.whole.solver = self._solver()
        self._declare()
        for node in self._order():
            if isinstance(node, str):
                self._feed(node)
            else:
                self._move(node)
        for member, joined in self.members.items():
            moved = {rate for motion in joined.model.motions for rate in motion.rates}
            for q in joined.model.of(Kind.STATE):
                if q.name not in moved:
                    self.whole.der[self._symbol(member, q)] = joined.take(joined.model.der[q.name])
            for q in joined.model.of(Kind.OUTPUT):
                facts = {"min": q.min, "max": q.max, "nominal": q.nominal}
                self.whole.output(f"{member}.{q.name}", joined.take(q.expression), q.unit, q.description, **facts)
        self._tick()
        self.whole.check()
        return self.whole

    # Declarations -----------------------------------------------------------------------------------------------------

    def _declare(self) -> None:
        """Declare the members' quantities that stay, and the held values that feed members."""
        self._share_sample_time()
        for member, joined in self.members.items():
            joined.put(joined.model.time, self.whole.time)
            for q in joined.model.of(Kind.PARAMETER, Kind.INPUT, Kind.STATE, Kind.SAMPLED_STATE):
                if q.name != _SAMPLE_TIME and f"{member}.{q.name}" not in self.feeders:
                    joined.put(q.expression, self._declared(f"{member}.{q.name}", q))
            for q in joined.model.of(Kind.CONSTANT):
                self.whole.constant(f"{member}.{q.name}", q.start, q.unit, q.description)
            arguments = joined.model.information.items()
            self.whole.information |= {f"{member}.{key}": value for key, value in arguments}
        for start in {str(end): end for end in self.feeders.values()}.values():
            if start.quantity.kind is Kind.SAMPLED_OUTPUT:
                q = start.quantity
                self.held[str(start)] = self.whole.sampled_state(
                    f"held.{start}", q.unit, q.description, start=q.start, min=q.min, max=q.max, nominal=q.nominal
                )

    def _solver(self) -> str | None:
        """Return the solver that members ask for; `ModelError` where they ask for several."""
        asked = {name: joined.model.solver for name, joined in self.members.items()}
        asked = {name: solver for name, solver in asked.items() if solver not in (None, "exact")}
        if len(set(asked.values())) > 1:
            found = ", ".join(f"{name} {solver}" for name, solver in asked.items())
            raise ModelError(f"{self.whole.name}: one model has one solver; found {found}")
        return next(iter(asked.values()), None)

    def _share_sample_time(self) -> None:
        """Declare the one sample time of the sampled members; `ModelError` where they have several."""
        sampled = {name: joined for name, joined in self.members.items() if joined.model.is_sampled}
        times = {name: joined.model[_SAMPLE_TIME].start for name, joined in sampled.items()}
        if len(set(times.values())) > 1:
            found = ", ".join(f"{name} {time:g} s" for name, time in times.items())
            raise ModelError(f"{self.whole.name}: one model has one sample time; found {found}")
        if times:
            common = self.whole.sample_time(next(iter(times.values())))
            for joined in sampled.values():
                joined.put(joined.model[_SAMPLE_TIME].expression, common)

    def _declared(self, name: str, q: Quantity) -> ca.SX:
        """Declare a quantity of a member in the whole, by another name; returns its symbol there."""
        declare = {
            Kind.PARAMETER: partial(self.whole.parameter, name, q.start, q.unit, q.description, fixed=q.fixed),
            Kind.INPUT: partial(self.whole.input, name, q.unit, q.description, start=q.start),
            Kind.STATE: partial(self.whole.state, name, q.unit, q.description, start=q.start),
            Kind.SAMPLED_STATE: partial(self.whole.sampled_state, name, q.unit, q.description, start=q.start),
        }
        return declare[q.kind](min=q.min, max=q.max, nominal=q.nominal)

    def _symbol(self, member: str, q: Quantity) -> ca.SX:
        """Return the symbol in the whole of a member's quantity."""
        return self.whole[f"{member}.{q.name}"].expression

    # Feedthrough ------------------------------------------------------------------------------------------------------

    def _order(self) -> list["str | _Moving"]:
        """Return fed inputs and mass-matrix equations, each after all that it follows; `ModelError` for a loop."""
        motions = [_Moving(name, motion) for name, m in self.members.items() for motion in m.model.motions]
        graph: dict[str | _Moving, list[str | _Moving]] = {}
        for end, start in self.feeders.items():
            is_held = start.quantity.kind is Kind.SAMPLED_OUTPUT
            graph[end] = [] if is_held else self._followed(start.member, start.quantity.expression, motions)
        for moving in motions:
            sides = ca.veccat(moving.motion.mass, moving.motion.force)
            graph[moving] = self._followed(moving.member, sides, [])
        try:
            return list(TopologicalSorter(graph).static_order())
        except CycleError as error:
            cycle = error.args[1][1:]
            labels = [str(n) if isinstance(n, _Moving) else f"{self.feeders[n]} -> {n}" for n in cycle]
            labels.append(labels[0].partition(" -> ")[0])
            raise ModelError(
                f"{self.whole.name}: algebraic loop: {' -> '.join(labels)}; each follows the one before it without a "
                "state between. Leave one of these members out, or break the loop with a state or a sampled part"
            ) from None

    def _followed(self, member: str, expression: ca.SX, motions: Sequence["_Moving"]) -> list["str | _Moving"]:
        """Return the fed inputs of a member, and of these motions its own, that an expression uses."""
        used = {symbol.element_hash() for symbol in ca.symvar(expression)}
        inputs = [q for q in self.members[member].model.of(Kind.INPUT) if q.expression.element_hash() in used]
        followed: list[str | _Moving] = [f"{member}.{q.name}" for q in inputs if f"{member}.{q.name}" in self.feeders]
        for moving in motions:
            own = {symbol.element_hash() for symbol in ca.symvar(moving.motion.acceleration)}
            if moving.member == member and own & used:
                followed.append(moving)
        return followed

    def _feed(self, end: str) -> None:
        """Put what an output says, or has held since the last tick, in the place of the input that it feeds."""
        start = self.feeders[end]
        source = self.members[start.member]
        value = self.held.get(str(start))
        member, q = _find({name: m.model for name, m in self.members.items()}, end)
        self.members[member].put(q.expression, source.take(start.quantity.expression) if value is None else value)

    def _move(self, moving: "_Moving") -> None:
        """State a mass-matrix equation; an acceleration of another member in its force is solved for by itself."""
        joined, motion = self.members[moving.member], moving.motion
        rates = ca.vertcat(*[self.whole[f"{moving.member}.{rate}"].expression for rate in motion.rates])
        sides = [joined.take(motion.mass), joined.take(motion.force)]
        for earlier in self.whole.motions:
            if any(ca.depends_on(side, earlier.acceleration) for side in sides):
                sides = ca.substitute(sides, [earlier.acceleration], [ca.solve(earlier.mass, earlier.force)])
        acceleration = self.whole.motion(rates, mass=sides[0], force=sides[1])
        joined.put(motion.acceleration, acceleration)

    # Ticks ------------------------------------------------------------------------------------------------------------

    def _tick(self) -> None:
        """State the tick map: one member after the other, each with what those before it have changed."""
        ticking = {name: joined for name, joined in self.members.items() if joined.model.of(*_TICKING)}
        before, after = ca.SX(0, 1), ca.SX(0, 1)
        for member in sorted(ticking, key=lambda name: bool(ticking[name].model.of(Kind.STATE, Kind.OUTPUT))):
            model, own = ticking[member].model, []
            for q in model.of(*_TICKING):
                rule = model.next[q.name] if q.kind is Kind.SAMPLED_STATE else q.expression
                value = ca.substitute(ticking[member].take(rule), before, after)
                own += self._ticked(member, q, value)
            before = ca.vertcat(before, *[symbol for symbol, _ in own])
            after = ca.vertcat(after, *[value for _, value in own])

    def _ticked(self, member: str, q: Quantity, value: ca.SX) -> list[tuple[ca.SX, ca.SX]]:
        """State what a sampled state or output is after a tick; return the symbols that change, with their values."""
        name = f"{member}.{q.name}"
        if q.kind is Kind.SAMPLED_STATE:
            symbol = self._symbol(member, q)
        else:
            facts = {"start": q.start, "min": q.min, "max": q.max, "nominal": q.nominal}
            self.whole.sampled_output(name, value, q.unit, q.description, **facts)
            if name not in self.held:
                return []
            symbol = self.held[name]
        self.whole.next[symbol] = value
        return [(symbol, value)]


@dataclass(frozen=True, eq=False)
class _Moving:
    """A mass-matrix equation of a member."""

    member: str
    motion: Motion

    def __str__(self) -> str:
        return f"der({self.member}.{self.motion.rates[0]})"


def _feeders(parts: Mapping[str, Model], connections: Sequence[tuple[str, str]]) -> dict[str, _End]:
    """Return the output that feeds each input, by the input's full name; errors as `compose`."""
    feeders: dict[str, _End] = {}
    for start, end in (pair for connection in connections for pair in _pairwise(*connection)):
        source, target = _End(*_find(parts, start)), _End(*_find(parts, end))
        if source.quantity.kind not in (Kind.OUTPUT, Kind.SAMPLED_OUTPUT) or target.quantity.kind is not Kind.INPUT:
            kinds = [end.quantity.kind.replace("_", " ") for end in (source, target)]
            raise ModelError(f"connection {start} -> {end} joins {' and '.join(kinds)}, expected output and input")
        if end in feeders:
            raise ModelError(f"input {end} is fed twice: by {feeders[end]} and by {start}")
        if unit(source.quantity.unit).exponents != unit(target.quantity.unit).exponents:
            units = f"{start} is in {source.quantity.unit}, but {end} in {target.quantity.unit}"
            raise ModelError(f"connection {start} -> {end}: {units}")
        feeders[end] = source
    return feeders


def _pairwise(start: str, end: str) -> list[tuple[str, str]]:
    """Return the connections between the members of two ranges, or of two names."""
    starts, ends = expand(start), expand(end)
    if len(starts) != len(ends):
        raise ModelError(f"connection {start} -> {end} joins {len(starts)} output(s) to {len(ends)} input(s)")
    return list(zip(starts, ends, strict=True))


def _find(parts: Mapping[str, Model], name: str) -> tuple[str, Quantity]:
    """Return the member and the quantity of a full name; `ModelError` with the nearest names if there is none."""
    member, _, quantity = name.partition(".")
    if member not in parts:
        raise ModelError(f"{name}: there is no member {member!r}{nearest(member, parts)}")
    return member, parts[member][quantity]
