"""Composition of connected models into one model: connected inputs become expressions, without a communication delay.

    members = {"robot": sdelta(), "drive[1]": c_drive()}
    group = compose("Group", members, [("drive[1].tube.slide", "robot.drive[1].slide"), ...])

The quantities of the composed model are named `member.quantity`. A connected input is replaced by the expression of the
output that feeds it. Mass-matrix equations keep their form; an acceleration that enters the force of another member is
eliminated by a linear solve. The composed model has the solver that its members request, otherwise the default choice.
A request of `exact` is ignored, because the composed model may be nonlinear.

Sampled members share one parameter, `sample_time`. At a tick the members are evaluated one after the other, purely
sampled members first, otherwise in the order of the members; each uses the new outputs of those before it. A sampled
output that feeds an input is stored from tick to tick in a sampled state `held.member.output`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from graphlib import CycleError, TopologicalSorter

import casadi as ca

from hfsa.components._modelling.model import Kind, Model, ModelError, Motion, Quantity, expand, nearest
from hfsa.components._modelling.origin import Origin, shared
from hfsa.components._modelling.units import are_alike
from hfsa.components._modelling.variants import hashed

_SAMPLE_TIME = "sample_time"
_TICKING = (Kind.SAMPLED_STATE, Kind.SAMPLED_OUTPUT)


def compose(name: str, parts: Mapping[str, Model], connections: Sequence[tuple[str, str]]) -> Model:
    """Return the composition of connected models.

    Args:
        name: name of the composed model, an identifier.
        parts: members by name, such as `robot` or `drive[1]`.
        connections: pairs (output, input) of full names `member.quantity`; two ranges are connected pairwise.

    Raises:
        ModelError: an unknown name; an input with two connections; a connection of different units; an algebraic loop;
            members with different sample times or solvers.
    """
    for part in parts.values():
        part.check()
    whole = _Composition(name, dict(parts), _feeders(parts, connections)).model()
    whole.origin = _origin(parts, connections)
    return whole


def _origin(parts: Mapping[str, Model], connections: Sequence[tuple[str, str]]) -> Origin:
    """Return the origin of a composition; its variant depends on all members and connections."""
    members = [[name, part.identifier] for name, part in parts.items()]
    return Origin(
        hashed([members, [[start, end] for start, end in connections]]),
        {title: text for part in parts.values() for title, text in part.origin.documents.items()},
        shared(part.origin.credits for part in parts.values()),
        {f"{name}.{key}": said for name, part in parts.items() for key, said in part.origin.explained.items()},
    )


@dataclass(frozen=True)
class _Endpoint:
    """One end of a connection: a quantity of a member."""

    member: str
    quantity: Quantity

    def __str__(self) -> str:
        return f"{self.member}.{self.quantity.name}"


@dataclass
class _Member:
    """A member and the substitutions of its symbols by expressions of the composed model, as far as they are known."""

    model: Model
    old: list[ca.SX] = field(default_factory=list)
    new: list[ca.SX] = field(default_factory=list)

    def substitute(self, old: ca.SX, new: ca.SX) -> None:
        """Add the substitution of a symbol, or of a column of symbols."""
        self.old.append(old)
        self.new.append(new)

    def translated(self, expression: ca.SX) -> ca.SX:
        """Return an expression of the member in symbols of the composed model."""
        return ca.substitute([expression], self.old, self.new)[0]


class _Composition:
    """The state of one call of `compose`; `feeders` maps the full name of an input to the output that feeds it."""

    def __init__(self, name: str, parts: Mapping[str, Model], feeders: Mapping[str, _Endpoint]):
        self.feeders = feeders
        self.whole = Model(name, f"{', '.join(parts)} as one")
        self.members = {member: _Member(part) for member, part in parts.items()}
        self.held: dict[str, ca.SX] = {}

    def model(self) -> Model:
        """Return the composed model: declare its quantities, substitute inputs in feedthrough order, add equations."""
        self.whole.solver = self._solver()
        self._declare()
        for node in self._order():
            if isinstance(node, str):
                self._substitute_input(node)
            else:
                self._add_motion(node)
        for member, joined in self.members.items():
            moved = {rate for motion in joined.model.motions for rate in motion.rates}
            for q in joined.model.of(Kind.STATE):
                if q.name not in moved:
                    self.whole.der[self._symbol(member, q)] = joined.translated(joined.model.der[q.name])
            for q in joined.model.of(Kind.OUTPUT):
                facts = {"min": q.min, "max": q.max, "nominal": q.nominal}
                self.whole.output(f"{member}.{q.name}", joined.translated(q.expression), q.unit, q.description, **facts)
        self._add_tick_map()
        self.whole.check()
        return self.whole

    # Declarations -----------------------------------------------------------------------------------------------------

    def _declare(self) -> None:
        """Declare the quantities of the members, and a sampled state for each sampled output that feeds an input."""
        self._share_sample_time()
        for member, joined in self.members.items():
            joined.substitute(joined.model.time, self.whole.time)
            for q in joined.model.of(Kind.PARAMETER, Kind.INPUT, Kind.STATE, Kind.SAMPLED_STATE):
                if q.name != _SAMPLE_TIME and f"{member}.{q.name}" not in self.feeders:
                    joined.substitute(q.expression, self._declare_quantity(f"{member}.{q.name}", q))
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
        """Return the solver that members request, if any; `ModelError` if they request different ones."""
        requested = {name: joined.model.solver for name, joined in self.members.items()}
        requested = {name: solver for name, solver in requested.items() if solver not in (None, "exact")}
        if len(set(requested.values())) > 1:
            found = ", ".join(f"{name} {solver}" for name, solver in requested.items())
            raise ModelError(f"{self.whole.name}: one model has one solver; found {found}")
        return next(iter(requested.values()), None)

    def _share_sample_time(self) -> None:
        """Declare the sample time of the sampled members; `ModelError` if they have different ones."""
        sampled = {name: joined for name, joined in self.members.items() if joined.model.is_sampled}
        times = {name: joined.model[_SAMPLE_TIME].start for name, joined in sampled.items()}
        if len(set(times.values())) > 1:
            found = ", ".join(f"{name} {time:g} s" for name, time in times.items())
            raise ModelError(f"{self.whole.name}: one model has one sample time; found {found}")
        if times:
            common = self.whole.sample_time(next(iter(times.values())))
            for joined in sampled.values():
                joined.substitute(joined.model[_SAMPLE_TIME].expression, common)

    def _declare_quantity(self, name: str, q: Quantity) -> ca.SX:
        """Declare a quantity of a member in the composed model as `name` and return its symbol there."""
        declare = {
            Kind.PARAMETER: partial(self.whole.parameter, name, q.start, q.unit, q.description, fixed=q.fixed),
            Kind.INPUT: partial(self.whole.input, name, q.unit, q.description, start=q.start),
            Kind.STATE: partial(self.whole.state, name, q.unit, q.description, start=q.start),
            Kind.SAMPLED_STATE: partial(self.whole.sampled_state, name, q.unit, q.description, start=q.start),
        }
        return declare[q.kind](min=q.min, max=q.max, nominal=q.nominal)

    def _symbol(self, member: str, q: Quantity) -> ca.SX:
        """Return the symbol of a member's quantity in the composed model."""
        return self.whole[f"{member}.{q.name}"].expression

    # Feedthrough ------------------------------------------------------------------------------------------------------

    def _order(self) -> list["str | _MemberMotion"]:
        """Return connected inputs and mass-matrix equations in the order of their dependencies.

        Raises `ModelError` for an algebraic loop.
        """
        motions = [_MemberMotion(name, motion) for name, m in self.members.items() for motion in m.model.motions]
        graph: dict[str | _MemberMotion, list[str | _MemberMotion]] = {}
        for end, start in self.feeders.items():
            is_held = start.quantity.kind is Kind.SAMPLED_OUTPUT
            graph[end] = [] if is_held else self._dependencies(start.member, start.quantity.expression, motions)
        for moving in motions:
            sides = ca.veccat(moving.motion.mass, moving.motion.force)
            graph[moving] = self._dependencies(moving.member, sides, [])
        try:
            return list(TopologicalSorter(graph).static_order())
        except CycleError as error:
            cycle = error.args[1][1:]
            labels = [str(n) if isinstance(n, _MemberMotion) else f"{self.feeders[n]} -> {n}" for n in cycle]
            labels.append(labels[0].partition(" -> ")[0])
            raise ModelError(
                f"{self.whole.name}: algebraic loop: {' -> '.join(labels)}; each depends on the one before it without "
                "a state between. Leave one of these members out, or break the loop with a state or a sampled part"
            ) from None

    def _dependencies(
        self, member: str, expression: ca.SX, motions: Sequence["_MemberMotion"]
    ) -> list["str | _MemberMotion"]:
        """Return the connected inputs and the `motions` of a member that an expression depends on."""
        used = {symbol.element_hash() for symbol in ca.symvar(expression)}
        inputs = [q for q in self.members[member].model.of(Kind.INPUT) if q.expression.element_hash() in used]
        found: list[str | _MemberMotion] = [
            f"{member}.{q.name}" for q in inputs if f"{member}.{q.name}" in self.feeders
        ]
        for moving in motions:
            own = {symbol.element_hash() for symbol in ca.symvar(moving.motion.acceleration)}
            if moving.member == member and own & used:
                found.append(moving)
        return found

    def _substitute_input(self, end: str) -> None:
        """Substitute a connected input by the expression of its output, or by the state that holds a sampled output."""
        start = self.feeders[end]
        source = self.members[start.member]
        value = self.held.get(str(start))
        if value is None:
            value = source.translated(start.quantity.expression)
        member, q = _find({name: m.model for name, m in self.members.items()}, end)
        self.members[member].substitute(q.expression, value)

    def _add_motion(self, moving: "_MemberMotion") -> None:
        """Add a mass-matrix equation; accelerations of other members in its sides are replaced by linear solves."""
        joined, motion = self.members[moving.member], moving.motion
        rates = ca.vertcat(*[self.whole[f"{moving.member}.{rate}"].expression for rate in motion.rates])
        sides = [joined.translated(motion.mass), joined.translated(motion.force)]
        for earlier in self.whole.motions:
            if any(ca.depends_on(side, earlier.acceleration) for side in sides):
                sides = ca.substitute(sides, [earlier.acceleration], [ca.solve(earlier.mass, earlier.force)])
        acceleration = self.whole.motion(rates, mass=sides[0], force=sides[1])
        joined.substitute(motion.acceleration, acceleration)

    # Ticks ------------------------------------------------------------------------------------------------------------

    def _add_tick_map(self) -> None:
        """Add the tick map: one member after the other, each with the new values of those before it."""
        ticking = {name: joined for name, joined in self.members.items() if joined.model.of(*_TICKING)}
        before, after = ca.SX(0, 1), ca.SX(0, 1)
        for member in sorted(ticking, key=lambda name: bool(ticking[name].model.of(Kind.STATE, Kind.OUTPUT))):
            model, own = ticking[member].model, []
            for q in model.of(*_TICKING):
                rule = model.next[q.name] if q.kind is Kind.SAMPLED_STATE else q.expression
                value = ca.substitute(ticking[member].translated(rule), before, after)
                own += self._add_tick_equation(member, q, value)
            before = ca.vertcat(before, *[symbol for symbol, _ in own])
            after = ca.vertcat(after, *[value for _, value in own])

    def _add_tick_equation(self, member: str, q: Quantity, value: ca.SX) -> list[tuple[ca.SX, ca.SX]]:
        """Add the value of a sampled state or output after a tick; return changed symbols with their new values."""
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
class _MemberMotion:
    """A mass-matrix equation of a member."""

    member: str
    motion: Motion

    def __str__(self) -> str:
        return f"der({self.member}.{self.motion.rates[0]})"


def _feeders(parts: Mapping[str, Model], connections: Sequence[tuple[str, str]]) -> dict[str, _Endpoint]:
    """Return the output that feeds each input, by the full name of the input; errors as in `compose`."""
    feeders: dict[str, _Endpoint] = {}
    for start, end in (pair for connection in connections for pair in _pairwise(*connection)):
        source, target = _Endpoint(*_find(parts, start)), _Endpoint(*_find(parts, end))
        if source.quantity.kind not in (Kind.OUTPUT, Kind.SAMPLED_OUTPUT) or target.quantity.kind is not Kind.INPUT:
            kinds = [end.quantity.kind.replace("_", " ") for end in (source, target)]
            raise ModelError(f"connection {start} -> {end} joins {' and '.join(kinds)}, expected output and input")
        if end in feeders:
            raise ModelError(f"input {end} is fed twice: by {feeders[end]} and by {start}")
        if not are_alike(source.quantity.unit, target.quantity.unit):
            units = f"{start} is in {source.quantity.unit}, but {end} in {target.quantity.unit}"
            raise ModelError(f"connection {start} -> {end}: {units}")
        feeders[end] = source
    return feeders


def _pairwise(start: str, end: str) -> list[tuple[str, str]]:
    """Return the pairs of names that a connection of two ranges, or of two names, stands for."""
    starts, ends = expand(start), expand(end)
    if len(starts) != len(ends):
        raise ModelError(f"connection {start} -> {end} joins {len(starts)} output(s) to {len(ends)} input(s)")
    return list(zip(starts, ends, strict=True))


def _find(parts: Mapping[str, Model], name: str) -> tuple[str, Quantity]:
    """Return the member and the quantity with a full name; `ModelError` with the nearest names if there is none."""
    member, _, quantity = name.partition(".")
    if member not in parts:
        raise ModelError(f"{name}: there is no member {member!r}{nearest(member, parts)}")
    return member, parts[member][quantity]
