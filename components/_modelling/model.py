"""Models: named quantities and the equations between them.

The function of a part calls the methods in this order:

    m = Model("MassOnSpring", "Mass on a damped spring, driven at its base")
    k = m.parameter("stiffness", 1e4, "N/m", "Spring stiffness", min=0)        # a CasADi symbol
    u = m.input("base.position", "m", "Base displacement")
    x = m.state("mass.position", "m", "Displacement of the mass")
    m.der[x] = ...                                                             # explicit form, or
    a = m.motion(v, mass=M, force=h)                                           # M der(v) = h, mass-matrix form
    m.output("position", x, "m", "Measured displacement")
    m.constant("rest.length", 0.05, "m", "Length of the spring at rest")       # a read-only variable of the FMU

A sampled model calls `m.sample_time(1e-3)`, `m.sampled_state(...)`, `m.next[z] = ...` and `m.sampled_output(...)`. At
each tick the sampled outputs are evaluated from the states and inputs before the tick, and held until the next tick.

A name with a range, `drive[1..3].slide`, declares one quantity per member; its symbol is a column vector.
"""

import html
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import casadi as ca

from hfsa.components._modelling.errors import ModelError, nearest, one_of
from hfsa.components._modelling.origin import Origin
from hfsa.components._modelling.quantity import Kind, Quantity, expand
from hfsa.components._modelling.units import unit as parse_unit

__all__ = ["SOLVERS", "Kind", "Model", "ModelError", "Motion", "Quantity", "expand", "nearest", "one_of"]

_NAME = re.compile(r"^[A-Za-z_]\w*(\[[1-9]\d*\])?(\.[A-Za-z_]\w*(\[[1-9]\d*\])?)*$")

SOLVERS = ("exact", "rosenbrock", "rk4", "cvode")
"""Names of the solvers of an exported Co-Simulation FMU; `fmus/_solvers.py` has the table of what they are."""

_STARTED = (Kind.PARAMETER, Kind.INPUT, Kind.STATE, Kind.SAMPLED_STATE)
"""Kinds of quantities that start from a value of their own."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A mass-matrix equation `mass @ acceleration = force`; `acceleration` holds the symbols of der(rates)."""

    rates: tuple[str, ...]
    acceleration: ca.SX
    mass: ca.SX
    force: ca.SX


class Model:
    """Named quantities and the equations between them.

    Attributes:
        time: symbol of the independent variable [s].
        der: `m.der[x] = expression`, the derivative of a continuous state.
        next: `m.next[z] = expression`, the value of a sampled state after a tick.
        solver: solver of the exported Co-Simulation FMU, one of `SOLVERS`; `None` chooses `exact` for a linear
            time-invariant model and `rosenbrock` for any other.
        information: structural arguments of the model, numbers or strings; constants of the FMU.
        origin: the part and variant that the model is, as its FMU tells it.
    """

    def __init__(self, name: str, description: str):
        if not re.match(r"^[A-Za-z_]\w*$", name):
            raise ModelError(f"model name {name!r} is not an identifier; names of FMUs are CamelCase, e.g. 'PztStack'")
        self.name = name
        self.description = description
        self.time = ca.SX.sym("time")
        self.der = Equations(self, Kind.STATE)
        self.next = Equations(self, Kind.SAMPLED_STATE)
        self.motions: list[Motion] = []
        self.solver: str | None = None
        self.information: dict[str, float | str] = {}
        self.origin = Origin()
        self._quantities: dict[str, Quantity] = {}

    # Declarations ---------------------------------------------------------------------------------------------------

    def parameter(
        self,
        name: str,
        start: float | Sequence[float],
        unit: str,
        description: str,
        *,
        min: float | None = None,
        max: float | None = None,
        nominal: float | None = None,
        fixed: bool = False,
    ) -> ca.SX:
        """Declare a tunable (or `fixed`) parameter and return its symbol; a range in `name` gives a column."""
        return self._symbols(name, Kind.PARAMETER, unit, description, start, nominal, min, max, fixed=fixed)

    def constant(self, name: str, value: float | Sequence[float], unit: str, description: str) -> None:
        """Declare a constant, a read-only variable of the FMU; a range in `name` takes one value per member."""
        members = expand(name)
        for member, number in zip(members, _column(name, value, len(members)), strict=True):
            self._add(Quantity(member, Kind.CONSTANT, unit, description, number, 1.0, None, None, ca.SX(number)))

    def input(
        self,
        name: str,
        unit: str,
        description: str,
        *,
        start: float | Sequence[float] = 0.0,
        min: float | None = None,
        max: float | None = None,
        nominal: float | None = None,
    ) -> ca.SX:
        """Declare an input and return its symbol; a range in `name` gives a column."""
        return self._symbols(name, Kind.INPUT, unit, description, start, nominal, min, max)

    def state(
        self,
        name: str,
        unit: str,
        description: str,
        *,
        start: float | Sequence[float] = 0.0,
        min: float | None = None,
        max: float | None = None,
        nominal: float | None = None,
    ) -> ca.SX:
        """Declare a continuous state and return its symbol; a range in `name` gives a column.

        `nominal` is the typical magnitude of the state, not its bound; it scales the tolerance of the solver.
        """
        return self._symbols(name, Kind.STATE, unit, description, start, nominal, min, max)

    def sample_time(self, start: float) -> ca.SX:
        """Declare the fixed parameter `sample_time` [s] and return its symbol; ticks are at start + n * sample_time."""
        return self.parameter("sample_time", start, "s", "Time between two ticks", min=1e-12, nominal=start, fixed=True)

    def sampled_state(
        self,
        name: str,
        unit: str,
        description: str,
        *,
        start: float | Sequence[float] = 0.0,
        min: float | None = None,
        max: float | None = None,
        nominal: float | None = None,
    ) -> ca.SX:
        """Declare a state that changes at ticks only and return its symbol; `ModelError` without a `sample_time`."""
        self._require_sampling(name)
        return self._symbols(name, Kind.SAMPLED_STATE, unit, description, start, nominal, min, max)

    def output(
        self,
        name: str,
        expression: ca.SX | float,
        unit: str,
        description: str,
        *,
        min: float | None = None,
        max: float | None = None,
        nominal: float | None = None,
    ) -> None:
        """Declare an output, evaluated at every read; a range in `name` takes a column of expressions."""
        self._expressions(name, Kind.OUTPUT, expression, unit, description, 0.0, nominal, min, max)

    def sampled_output(
        self,
        name: str,
        expression: ca.SX | float,
        unit: str,
        description: str,
        *,
        start: float | Sequence[float] = 0.0,
        min: float | None = None,
        max: float | None = None,
        nominal: float | None = None,
    ) -> None:
        """Declare an output evaluated at ticks, before the states change, and held between them.

        Its value before the first tick is `start`. Raises `ModelError` without a `sample_time`.
        """
        self._require_sampling(name)
        self._expressions(name, Kind.SAMPLED_OUTPUT, expression, unit, description, start, nominal, min, max)

    def motion(self, rate: ca.SX, *, mass: ca.SX | ca.DM, force: ca.SX) -> ca.SX:
        """Add the equation `mass @ der(rate) = force` and return the symbols of der(rate), shape (n, 1).

        `rate` is a column of n states, `mass` is (n, n), symmetric and positive definite, `force` is (n, 1). Outputs
        and other equations may use the accelerations, `mass` and `force` may not. Raises `ModelError` for other shapes.
        """
        names = self._names_of(rate, Kind.STATE, "motion")
        n, label = len(names), ", ".join(names)
        mass, force = ca.SX(mass), ca.SX(force)
        if mass.shape != (n, n) or force.shape != (n, 1):
            raise ModelError(
                f"motion of {label}: mass has shape {mass.shape}, force {force.shape}, expected ({n}, {n}) and ({n}, 1)"
            )
        acceleration = ca.vertcat(*[ca.SX.sym(f"der({name})") for name in names])
        self.der[rate] = acceleration
        self.motions.append(Motion(names, acceleration, mass, force))
        return acceleration

    # Reading --------------------------------------------------------------------------------------------------------

    def __getitem__(self, name: str) -> Quantity:
        """Return the quantity with a name; `ModelError` with the nearest names if there is none."""
        try:
            return self._quantities[name]
        except KeyError:
            raise ModelError(f"{self.name} has no quantity {name!r}{nearest(name, self._quantities)}") from None

    def __contains__(self, name: object) -> bool:
        return name in self._quantities

    def __iter__(self) -> Iterator[Quantity]:
        return iter(self._quantities.values())

    def _repr_html_(self) -> str:
        """Return what a notebook shows: name, description, and a table of all quantities but constants."""
        rows = [
            (q.kind.replace("_", " "), q.name, q.unit, f"{q.start:.6g}" if q.kind in _STARTED else "", q.description)
            for q in self
            if q.kind != Kind.CONSTANT
        ]
        cells = ["".join(f"<td>{html.escape(word)}</td>" for word in row) for row in rows]
        head = "".join(f"<th>{word}</th>" for word in ("kind", "name", "unit", "start", "description"))
        body = "".join(f"<tr>{row}</tr>" for row in cells)
        caption = f"{html.escape(self.name)}: {html.escape(self.description)}"
        return f"<table><caption>{caption}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"

    def of(self, *kinds: Kind) -> list[Quantity]:
        """Return the quantities of these kinds in the order of declaration."""
        return [q for q in self if q.kind in kinds]

    def symbols(self, *kinds: Kind) -> ca.SX:
        """Return the symbols of the quantities of these kinds as one column, shape (n, 1)."""
        return ca.vertcat(ca.SX(0, 1), *[q.expression for q in self.of(*kinds)])

    @property
    def identifier(self) -> str:
        """Name with that of the variant, where it is not the default: the name of its FMU."""
        return "_".join(word for word in (self.name, self.origin.variant) if word)

    @property
    def is_sampled(self) -> bool:
        """Whether the model has a sample time."""
        return "sample_time" in self

    def set_start(self, name: str, start: float) -> None:
        """Change the start value of a parameter, input or state; `ModelError` outside its bounds or for other kinds."""
        quantity = self[name]
        if quantity.kind is Kind.OUTPUT:
            raise ModelError(f"{self.name}: {name} is an output; it is calculated and has no start value")
        if quantity.kind is Kind.CONSTANT:
            raise ModelError(f"{self.name}: {name} is a constant, determined by the structural arguments")
        self._quantities[name] = replace(quantity, start=float(start))

    def substitute(self, symbols: ca.SX, expressions: ca.SX) -> None:
        """Replace symbols by expressions, columns of the same length, in all equations and outputs."""

        def new(expression: ca.SX) -> ca.SX:
            """Return an expression with the symbols replaced."""
            return ca.substitute(expression, symbols, expressions)

        for equations in (self.der, self.next):
            equations.update({name: new(expression) for name, expression in equations.items()})
        self.motions = [replace(m, mass=new(m.mass), force=new(m.force)) for m in self.motions]
        for q in self.of(Kind.OUTPUT, Kind.SAMPLED_OUTPUT):
            self._quantities[q.name] = replace(q, expression=new(q.expression))

    def check(self) -> None:
        """Raise `ModelError` unless every state has an equation and every equation uses symbols of this model only."""
        for equations in (self.der, self.next):
            for quantity in self.of(equations.kind):
                if quantity.name not in equations:
                    raise ModelError(
                        f"{self.name}: state {quantity.name} has no equation; write m.{equations.word}[...] = ..."
                    )
        if self.solver is not None and self.solver not in SOLVERS:
            raise ModelError(f"{self.name}: solver {self.solver!r} is not one of {', '.join(SOLVERS)}")
        base = [self.time, *[q.expression for q in self if q.kind not in (Kind.OUTPUT, Kind.SAMPLED_OUTPUT)]]
        accelerations = [motion.acceleration for motion in self.motions]
        for motion in self.motions:
            self._check_symbols(f"motion of {', '.join(motion.rates)}", ca.veccat(motion.mass, motion.force), base)
        for equations in (self.der, self.next):
            for name, expression in equations.items():
                self._check_symbols(f"{equations.word}[{name}]", expression, base + accelerations)
        for quantity in self.of(Kind.OUTPUT, Kind.SAMPLED_OUTPUT):
            self._check_symbols(quantity.name, quantity.expression, base + accelerations)

    # Frame ----------------------------------------------------------------------------------------------------------

    def _symbols(self, name, kind, unit, description, start, nominal, min, max, *, fixed=False) -> ca.SX:
        """Declare quantities represented by symbols, one per member of a range; return their column."""
        members = expand(name)
        symbols = [ca.SX.sym(member) for member in members]
        for member, symbol, value in zip(members, symbols, _column(name, start, len(members)), strict=True):
            self._add(
                Quantity(member, kind, unit, description, value, _nominal(nominal, value), min, max, symbol, fixed)
            )
        return ca.vertcat(*symbols)

    def _expressions(self, name, kind, expression, unit, description, start, nominal, min, max) -> None:
        """Declare quantities defined by expressions, one per member of a range."""
        members = expand(name)
        column = ca.SX(expression)
        if column.shape != (len(members), 1):
            raise ModelError(f"{self.name}: {name} has shape {column.shape}, expected ({len(members)}, 1)")
        starts = _column(name, start, len(members))
        for i, member in enumerate(members):
            nominal_i = _nominal(nominal, starts[i])
            self._add(Quantity(member, kind, unit, description, starts[i], nominal_i, min, max, column[i]))

    def _add(self, quantity: Quantity) -> None:
        """Add a quantity; `ModelError` for an invalid name or unit, or a name in use."""
        if not _NAME.match(quantity.name):
            raise ModelError(
                f"{self.name}: name {quantity.name!r} is not of the form terminal.member[1] with 1-based indices"
            )
        if quantity.name.startswith("solver."):
            raise ModelError(f"{self.name}: {quantity.name} begins as the names of the solver do; take another word")
        if quantity.name in self._quantities:
            raise ModelError(f"{self.name}: {quantity.name} is declared twice")
        try:
            parse_unit(quantity.unit)
        except ValueError as error:
            raise ModelError(f"{self.name}: {quantity.name}: {error}") from None
        self._quantities[quantity.name] = quantity

    def _require_sampling(self, name: str) -> None:
        """Raise `ModelError` unless the model has a sample time."""
        if not self.is_sampled:
            raise ModelError(
                f"{self.name}: {name} is sampled, but the model has no sample time; call m.sample_time(...) first"
            )

    def _names_of(self, symbols: ca.SX, kind: Kind, word: str) -> tuple[str, ...]:
        """Return the names of a column of symbols; `ModelError` for one that is not a quantity of `kind` here."""
        column = ca.SX(symbols)
        names = []
        for element in [column[i] for i in range(column.numel())]:
            name = element.name() if element.is_symbolic() else str(element)
            quantity = self._quantities.get(name)
            if quantity is None or quantity.kind is not kind or not ca.is_equal(quantity.expression, element):
                raise ModelError(f"{self.name}: {word} of {name}: not a {kind.replace('_', ' ')} of this model")
            names.append(name)
        return tuple(names)

    def _check_symbols(self, where: str, expression: ca.SX, allowed: Iterable[ca.SX]) -> None:
        """Raise `ModelError` if an expression uses a symbol that is not allowed."""
        free = ca.symvar(ca.SX(expression))
        known = {s.element_hash() for column in allowed for s in ca.symvar(column)}
        for symbol in free:
            if symbol.element_hash() not in known:
                raise ModelError(
                    f"{self.name}: {where} uses {symbol.name()}, which is not declared here or not allowed there"
                )


class Equations(dict[str, ca.SX]):
    """Equations of all states of one kind, by name; an assignment takes the symbol of the state as key."""

    def __init__(self, model: Model, kind: Kind):
        super().__init__()
        self.model = model
        self.kind = kind
        self.word = "der" if kind is Kind.STATE else "next"

    def __setitem__(self, states: ca.SX, expression: ca.SX | float) -> None:  # type: ignore[override]
        names = self.model._names_of(states, self.kind, self.word)
        column = ca.SX(expression)
        if column.shape != (len(names), 1):
            where = f"{self.model.name}: {self.word}[{', '.join(names)}]"
            raise ModelError(f"{where} has shape {column.shape}, expected ({len(names)}, 1)")
        for i, name in enumerate(names):
            if name in self:
                raise ModelError(f"{self.model.name}: {self.word}[{name}] is given twice")
            super().__setitem__(name, column[i])


def _column(name: str, value: float | Sequence[float], size: int) -> list[float]:
    """Return the start values of a range, shape (size,), from one number for all members or one per member."""
    values = [float(value)] * size if isinstance(value, int | float) else [float(v) for v in value]
    if len(values) != size:
        raise ModelError(f"{name} has {len(values)} start values, expected {size}")
    return values


def _nominal(nominal: float | None, start: float) -> float:
    """Return the nominal value, by default the magnitude of the start value, or 1 if that is 0."""
    return nominal if nominal is not None else (abs(start) or 1.0)
