"""Variables of a model description: units, types, dimensions and dependencies resolved.

found = Variables(raw, "Box.fmu")
found.connectors["y"].dependencies, found.states, found.event_indicators
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from itertools import product

from hfsa.cosim.archives.limits import MOST_VARIABLES
from hfsa.cosim.fmi.raw_description import RawDescription, RawUnknown, RawVariable
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import nearest

SAMPLE_TIME = "sample_time"
"""Parameter [s] that declares the sample time of an FMU; its discrete outputs change at ticks only."""

CONVENTIONS = "hfsa "
"""Beginning of the generation tool of FMUs whose variables' names mean what they mean in FMUs of hfsa."""

_BASE_UNIT = dict.fromkeys(("kg", "m", "s", "A", "K", "mol", "cd", "rad"), 0.0) | {"factor": 1.0, "offset": 0.0}
_PARAMETERS = ("structuralParameter", "parameter", "calculatedParameter")
_COMBINATIONS = {
    "constant": ("output", "local"),
    "fixed": (*_PARAMETERS, "local"),
    "tunable": (*_PARAMETERS, "local"),
    "discrete": ("input", "output", "local"),
    "continuous": ("input", "output", "local", "independent"),
}
"""Causalities that each variability may have."""
_CAUSALITIES = {*_PARAMETERS, "input", "output", "local", "independent"}


class Variables:
    """Variables of a sound description (`soundness.py`); `where` names it in messages.

    `StructureError` for types, dimensions and combinations that the standards do not have.
    """

    def __init__(self, raw: RawDescription, where: str):
        self._raw, self._where = raw, where
        self._units = {name: self._base_unit(name, unit) for name, unit in raw.units.items()}
        self._is_conventional = raw.attributes.get("generationTool", "").startswith(CONVENTIONS)
        self._ticks = self._is_conventional and any(
            v.name == SAMPLE_TIME and v.causality == "parameter" for v in raw.variables
        )
        self._check_count()
        self._alike: dict[tuple[str | None, ...], Connector] = {}
        outputs = [unknown for unknown in raw.unknowns if unknown.kind in ("Outputs", "Output")]
        self._dependencies = {self._of(unknown).name: self._inputs(unknown) for unknown in outputs}
        self.connectors = dict(self._connectors())

    @property
    def states(self) -> tuple[tuple[str, str], ...]:
        """The continuous states, each with the name of its derivative, in the order of ModelStructure."""
        pairs = []
        for unknown in self._raw.unknowns:
            if unknown.kind not in ("Derivatives", "ContinuousStateDerivative"):
                continue
            rate = self._of(unknown)
            if rate.derivative is None:
                continue
            states, rates = self._names(self._at(rate.derivative)), self._names(rate)
            if len(states) != len(rates):
                raise StructureError(
                    f"{self._where}, line {rate.line}: {rate.name} has {len(rates)} elements, expected {len(states)}, "
                    "as the state of which it is the derivative"
                )
            pairs += zip(states, rates, strict=True)
        return tuple(pairs)

    @property
    def event_indicators(self) -> int:
        """Number of event indicators."""
        if self._raw.version == 2:
            text = self._raw.attributes.get("numberOfEventIndicators", "0")
            count = self._whole(text, "numberOfEventIndicators")
        else:
            count = sum(
                math.prod(self._shape(self._of(unknown)))
                for unknown in self._raw.unknowns
                if unknown.kind == "EventIndicator"
            )
        if count > MOST_VARIABLES.value:
            raise StructureError(
                f"{self._where} has {count} event indicators, expected at most {MOST_VARIABLES.value}; "
                f"{MOST_VARIABLES.advice}"
            )
        return count

    def _connectors(self) -> Iterator[tuple[str, Connector]]:
        """Yield every variable, then the aliases of FMI 3, each with its name."""
        aliases = []
        for variable in self._raw.variables:
            whole = self._connector(variable)
            yield from self._elements(whole, variable)
            for alias in variable.aliases:
                aliases.append((replace(whole, name=alias), variable))
        for whole, variable in aliases:
            yield from self._elements(whole, variable)

    def _connector(self, v: RawVariable) -> Connector:
        """Return a variable, an array as a whole."""
        look = v.type, v.causality, v.variability, v.initial, v.unit, v.declared, v.nominal, v.min, v.max, v.relative
        if look not in self._alike:
            self._alike[look] = self._prototype(v)
        like = self._alike[look]
        is_held = self._ticks and like.variability == "discrete"
        return Connector(
            name=str(v.name),
            reference=int(v.reference or 0),
            causality=like.causality,
            variability=like.variability,
            type=like.type,
            unit=like.unit,
            base_unit=like.base_unit,
            start=None if v.dimensions else number(v.start),
            nominal=like.nominal,
            min=like.min,
            max=like.max,
            dependencies=() if is_held or like.causality != "output" else self._dependencies.get(str(v.name)),
            has_nominal=like.has_nominal,
            is_relative=like.is_relative,
            is_conventional=like.is_conventional,
        )

    def _prototype(self, v: RawVariable) -> Connector:
        """Return what all variables with the type, the declared type and the attributes of one have in common."""
        declared = self._type(v)
        causality, kind = v.causality or "local", str(v.type)
        variability = v.variability or self._usual_variability(causality, kind)
        self._check_combination(v, causality, variability)
        is_float = kind in ("Real", "Float64", "Float32")
        unit = (v.unit if is_float else None) or declared.get("unit")
        nominal = number((v.nominal if is_float else None) or declared.get("nominal"))
        relative = v.relative or declared.get("relativeQuantity")
        return Connector(
            name="",
            reference=0,
            causality=causality,
            variability=variability,
            type=kind,
            unit=unit,
            base_unit=self._units.get(unit) if unit else None,
            nominal=nominal or 1.0,
            min=number(v.min or declared.get("min")),
            max=number(v.max or declared.get("max")),
            has_nominal=bool(nominal),
            is_relative=relative in ("true", "1"),
            is_conventional=self._is_conventional,
        )

    def _usual_variability(self, causality: str, kind: str) -> str:
        """Return the variability of a variable that states none."""
        if self._raw.version == 2 or (kind in ("Float64", "Float32") and causality not in _PARAMETERS):
            return "continuous"
        return "fixed" if causality in _PARAMETERS else "discrete"

    def _check_combination(self, v: RawVariable, causality: str, variability: str) -> None:
        """Raise `StructureError` for a causality and variability that the standards do not have together."""
        is_known = causality in _CAUSALITIES and variability in _COMBINATIONS
        if not is_known or (v.initial is None and causality not in _COMBINATIONS[variability]):
            raise StructureError(
                f"{self._where}, line {v.line}: {v.name} has the causality {causality} and the variability "
                f"{variability}, expected a combination that FMI has"
            )

    def _type(self, v: RawVariable) -> Mapping[str, str]:
        """Return the attributes of the declared type of a variable, none where it declares none."""
        if v.declared is None:
            return {}
        if v.declared not in self._raw.types:
            raise StructureError(
                f"{self._where}, line {v.line}: {v.name} has the declared type {v.declared!r}, expected one of "
                f"TypeDefinitions{nearest(v.declared, self._raw.types)}"
            )
        return self._raw.types[v.declared]

    def _elements(self, array: Connector, variable: RawVariable) -> Iterator[tuple[str, Connector]]:
        """Yield a scalar, or the elements of an array, `x[1]` or `x[2,3]`; a single start value is that of all."""
        if not variable.dimensions:
            yield array.name, array
            return
        names = _indexed(array.name, self._shape(variable))
        starts = [number(word) for word in (variable.start or "").split()]
        starts = starts * len(names) if len(starts) == 1 else starts
        each: list[float | None] = [*starts] if len(starts) == len(names) else [None] * len(names)
        for i, (name, start) in enumerate(zip(names, each, strict=True)):
            yield name, replace(array, name=name, start=start, element=i, size=len(names))

    def _inputs(self, unknown: RawUnknown) -> tuple[str, ...] | None:
        """Return the inputs that an unknown depends on, `None` where they are not declared."""
        if unknown.dependencies is None:
            return None
        knowns = (self._at(word) for word in unknown.dependencies.split())
        return tuple(name for known in knowns if known.causality == "input" for name in self._names(known))

    def _names(self, variable: RawVariable) -> list[str]:
        """Return the names of the elements of an array, row by row; that of a scalar is its own."""
        return _indexed(str(variable.name), self._shape(variable))

    def _shape(self, variable: RawVariable) -> tuple[int, ...]:
        """Return the dimensions of a variable, none for a scalar."""
        return tuple(self._dimension(variable, word, text) for word, text in variable.dimensions)

    def _dimension(self, variable: RawVariable, word: str, text: str) -> int:
        """Return one dimension of an array: a number, or the start value of another variable."""
        what = f"the dimension of {variable.name} (line {variable.line})"
        if word == "start":
            return self._whole(text, what)
        if text not in self._by_reference:
            raise StructureError(f"{self._where}: {what} is valueReference {text}, which no variable has")
        return self._whole(self._by_reference[text].start, what)

    def _whole(self, text: str | None, what: str) -> int:
        """Return a whole number that is not negative."""
        if text is None or not (text.strip().isdecimal() and len(text) <= 20):
            raise StructureError(f"{self._where}: {what} is {text}, expected a whole number from 0")
        return int(text)

    def _check_count(self) -> None:
        """Raise `StructureError` for arrays of more elements than can be held."""
        most, count = MOST_VARIABLES.value, 0
        for variable in self._raw.variables:
            count += (math.prod(self._shape(variable)) if variable.dimensions else 1) * (1 + len(variable.aliases))
            if count > most:
                raise StructureError(
                    f"{self._where}, line {variable.line}: with the elements of {variable.name} there are {count:,} "
                    f"variables, expected at most {most:,}; {MOST_VARIABLES.advice}"
                )

    def _of(self, unknown: RawUnknown) -> RawVariable:
        """Return the variable of an unknown."""
        return self._at(str(unknown.reference))

    def _at(self, reference: str) -> RawVariable:
        """Return the variable of a reference in the description: an index of FMI 2, a value reference of FMI 3."""
        if self._raw.version == 2:
            return self._raw.variables[int(reference) - 1]
        return self._by_reference[reference.strip()]

    @cached_property
    def _by_reference(self) -> dict[str, RawVariable]:
        """Variables by value reference."""
        return {str(v.reference).strip(): v for v in self._raw.variables}

    def _base_unit(self, name: str, unit: Mapping[str, str] | None) -> tuple[float, ...] | None:
        """Return exponents, factor and offset of a unit, `None` where it declares none."""
        if unit is None:
            return None
        try:
            return tuple(float(unit.get(word, usual)) for word, usual in _BASE_UNIT.items())
        except ValueError as error:
            raise StructureError(f"{self._where}: the unit {name!r} has no numbers as exponents: {error}") from None


def number(text: str | float | None) -> float | None:
    """Return a number of the description, `None` where it is missing or not a number; true is 1."""
    if text in ("true", "false"):
        return float(text == "true")
    try:
        return None if text is None else float(text)
    except ValueError:
        return None


def _indexed(name: str, shape: tuple[int, ...]) -> list[str]:
    """Return the names of the elements of an array."""
    if not shape:
        return [name]
    return [f"{name}[{','.join(map(str, index))}]" for index in product(*(range(1, n + 1) for n in shape))]
