"""SI prefixes of numbers in texts and figures: 3.39e-7 m is `339 nm`; units without prefix stay as they are."""

import math
import re

_PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}
# a first unit that is not a power: m2 and kg take no prefix, m/s2 and N.m do
_TAKES_PREFIX = re.compile(r"(m|s|rad|V|A|N|Pa|J|W|C|F|H|T|Hz|Ohm|K)(?![A-Za-z0-9])")


def prefixed(size: float, unit: str) -> tuple[float, str]:
    """Return the factor and the prefixed unit for SI values of a size."""
    if not _TAKES_PREFIX.match(unit) or not math.isfinite(size) or size == 0:
        return 1.0, unit
    exponent = 3 * math.floor(math.log10(float(f"{abs(size):.3e}")) / 3)
    if exponent not in _PREFIXES:
        return 1.0, unit
    return 10.0**-exponent, f"{_PREFIXES[exponent]}{unit}"


def readable(value: float, unit: str, digits: str = ".4g") -> str:
    """Return an SI value as text, `339.2 nm`; a value of unit 1 has no unit in the text."""
    factor, shown = prefixed(value, unit)
    return f"{factor * value:{digits}} {shown}".removesuffix(" 1")
