"""Units in Modelica notation: SI exponents and display units.

A unit is a product of symbols with integer exponents: `N.m`, `m/s2`, `kg.m2`, `1/s`, `N.m/rad`. A `/` divides by the
product that follows it; parentheses group a divisor of several factors: `N/(m.s)`. `1` is the dimensionless unit.

Instruments measure variables of foreign FMUs, whose units may be any text: `carried("degC")` is such a text. It has a
name and no exponents, and equals itself alone.
"""

import difflib
import re
from dataclasses import dataclass
from functools import cache

BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
"""The base units of FMI's `BaseUnit`, in the order of `Unit.exponents`."""

_SYMBOLS: dict[str, dict[str, int]] = {
    "1": {},
    **{base: {base: 1} for base in BASE},
    "Hz": {"s": -1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "C": {"A": 1, "s": 1},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "F": {"kg": -1, "m": -2, "s": 4, "A": 2},
    "Ohm": {"kg": 1, "m": 2, "s": -3, "A": -2},
    "H": {"kg": 1, "m": 2, "s": -2, "A": -2},
    "T": {"kg": 1, "s": -2, "A": -1},
}

_DISPLAY: dict[str, tuple[tuple[str, float], ...]] = {
    "m": (("mm", 1e3), ("um", 1e6)),
    "m/s": (("mm/s", 1e3),),
    "rad": (("deg", 57.29577951308232), ("mrad", 1e3)),
    "rad/s": (("deg/s", 57.29577951308232),),
    "s": (("ms", 1e3), ("us", 1e6)),
    "N/m": (("N/um", 1e-6),),
    "Pa": (("MPa", 1e-6),),
}

_FACTOR = re.compile(r"^(1|[A-Za-z]+)(-?\d+)?$")


@dataclass(frozen=True)
class Unit:
    """One unit: exponents of the base units `BASE`, and display units as pairs (name, factor from the unit).

    A carried unit has the exponents `None`.
    """

    name: str
    exponents: tuple[int, ...] | None
    display: tuple[tuple[str, float], ...] = ()


class Carried(str):
    """Text of a unit that is not in Modelica notation and is carried as it is."""

    __slots__ = ()


def carried(name: str) -> str:
    """Return the text of a unit, as `Carried` where it is not in Modelica notation."""
    try:
        unit(name)
    except ValueError:
        return Carried(name)
    return name


def unit(name: str) -> Unit:
    """Return the unit with a Modelica name, or that of a carried text.

    Raises:
        ValueError: an unknown symbol or notation; the message names the nearest symbols.
    """
    return Unit(name, None) if isinstance(name, Carried) else _parsed(name)


def are_alike(one: str, other: str) -> bool:
    """Whether values in two units can be joined as they are: equal exponents, or one carried text."""
    exponents = unit(one).exponents, unit(other).exponents
    return one == other if None in exponents else exponents[0] == exponents[1]


@cache
def _parsed(name: str) -> Unit:
    """Return the unit with a Modelica name; errors as of `unit`."""
    powers: dict[str, int] = dict.fromkeys(BASE, 0)
    head, *divisors = _split(name)
    for sign, product in [(1, head)] + [(-1, d) for d in divisors]:
        for text in product.split("."):
            match = _FACTOR.match(text)
            if match is None or match[1] not in _SYMBOLS:
                raise ValueError(f"unit {name!r}: {_advice(text)}")
            for base, power in _SYMBOLS[match[1]].items():
                powers[base] += sign * power * int(match[2] or 1)
    return Unit(name, tuple(powers[base] for base in BASE), _DISPLAY.get(name, ()))


def rate_unit(unit: str) -> str:
    """Return the unit of a time derivative in Modelica notation: `m` -> `m/s`, `rad/s` -> `rad/s2`, `1` -> `1/s`.

    That of a carried text is carried as well: `degC` -> `degC/s`.
    """
    kind = type(unit)
    if unit.endswith("/s"):
        return kind(unit + "2")
    head, slash, below = unit.partition("/")
    if slash:
        below = below[1:-1] if below.startswith("(") else below
        return kind(f"{head}/({below}.s)")
    return kind(f"{unit}/s")


def quotient_unit(above: str, below: str) -> str:
    """Return the unit of a quotient in Modelica notation: `N` over `m/s` -> `N.s/m`, `m` over `m` -> `1`."""
    if above == below:
        return "1"
    (numerator, *divisors), (divisor, *factors) = _split(above), _split(below)
    head = ".".join(factor for factor in (numerator, *factors) if factor != "1") or "1"
    under = [factor for factor in (*divisors, divisor) if factor != "1"]
    if not under:
        return head
    return f"{head}/({'.'.join(under)})" if "." in "".join(under) or len(under) > 1 else f"{head}/{under[0]}"


def _split(name: str) -> list[str]:
    """Return numerator and divisors of a unit, divisors without parentheses."""
    head, *divisors = name.split("/")
    return [head] + [d[1:-1] if d.startswith("(") and d.endswith(")") else d for d in divisors]


def _advice(text: str) -> str:
    """Return the error in the notation of a unit, or the nearest symbols."""
    if "^" in text or "*" in text:
        return f"{text!r} is not Modelica notation; write exponents as m2 and products as N.m"
    near = difflib.get_close_matches(text, _SYMBOLS, n=3, cutoff=0.5)
    return f"no symbol {text!r}" + (f"; did you mean {', '.join(near)}?" if near else "; products are written N.m")
