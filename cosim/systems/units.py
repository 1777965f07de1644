"""Units of foreign FMUs: what a text means that its FMU does not define, and the conversion between two units.

    conversion(known_base("mm"), known_base("m"))     # (0.001, 0.0)

A base unit is the tuple of `Connector.base_unit`: exponents of kg, m, s, A, K, mol, cd, rad, then factor and offset, so
that base value = factor value + offset. The definition in an FMU counts before the table here, which has the texts that
mean one thing only; any other text is carried as it is.
"""

import math

BaseUnit = tuple[float, ...]
"""Exponents of the eight base units, factor, offset."""

_EXPONENTS: dict[str, tuple[int, ...]] = {
    "1": (0, 0, 0, 0, 0, 0, 0, 0),
    "kg": (1, 0, 0, 0, 0, 0, 0, 0),
    "m": (0, 1, 0, 0, 0, 0, 0, 0),
    "s": (0, 0, 1, 0, 0, 0, 0, 0),
    "A": (0, 0, 0, 1, 0, 0, 0, 0),
    "K": (0, 0, 0, 0, 1, 0, 0, 0),
    "mol": (0, 0, 0, 0, 0, 1, 0, 0),
    "cd": (0, 0, 0, 0, 0, 0, 1, 0),
    "rad": (0, 0, 0, 0, 0, 0, 0, 1),
    "m/s": (0, 1, -1, 0, 0, 0, 0, 0),
    "m/s2": (0, 1, -2, 0, 0, 0, 0, 0),
    "rad/s": (0, 0, -1, 0, 0, 0, 0, 1),
    "rad/s2": (0, 0, -2, 0, 0, 0, 0, 1),
    "Hz": (0, 0, -1, 0, 0, 0, 0, 0),
    "m2": (0, 2, 0, 0, 0, 0, 0, 0),
    "m3": (0, 3, 0, 0, 0, 0, 0, 0),
    "m3/s": (0, 3, -1, 0, 0, 0, 0, 0),
    "kg/s": (1, 0, -1, 0, 0, 0, 0, 0),
    "N": (1, 1, -2, 0, 0, 0, 0, 0),
    "N.m": (1, 2, -2, 0, 0, 0, 0, 0),
    "N/m": (1, 0, -2, 0, 0, 0, 0, 0),
    "Pa": (1, -1, -2, 0, 0, 0, 0, 0),
    "J": (1, 2, -2, 0, 0, 0, 0, 0),
    "W": (1, 2, -3, 0, 0, 0, 0, 0),
    "C": (0, 0, 1, 1, 0, 0, 0, 0),
    "V": (1, 2, -3, -1, 0, 0, 0, 0),
    "Ohm": (1, 2, -3, -2, 0, 0, 0, 0),
}

_DERIVED: dict[str, tuple[str, float]] = {
    "Nm": ("N.m", 1.0),
    "N*m": ("N.m", 1.0),
    "N·m": ("N.m", 1.0),
    "m/s^2": ("m/s2", 1.0),
    "rad/s^2": ("rad/s2", 1.0),
    "1/s": ("Hz", 1.0),
    "km": ("m", 1e3),
    "cm": ("m", 1e-2),
    "mm": ("m", 1e-3),
    "um": ("m", 1e-6),
    "µm": ("m", 1e-6),
    "nm": ("m", 1e-9),
    "mm/s": ("m/s", 1e-3),
    "km/h": ("m/s", 1 / 3.6),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "min": ("s", 60.0),
    "g": ("kg", 1e-3),
    "mA": ("A", 1e-3),
    "mV": ("V", 1e-3),
    "kV": ("V", 1e3),
    "kHz": ("Hz", 1e3),
    "mN": ("N", 1e-3),
    "kN": ("N", 1e3),
    "N/mm": ("N/m", 1e3),
    "N/um": ("N/m", 1e6),
    "kPa": ("Pa", 1e3),
    "MPa": ("Pa", 1e6),
    "bar": ("Pa", 1e5),
    "mbar": ("Pa", 1e2),
    "kJ": ("J", 1e3),
    "mW": ("W", 1e-3),
    "kW": ("W", 1e3),
    "deg": ("rad", math.pi / 180),
    "mrad": ("rad", 1e-3),
    "deg/s": ("rad/s", math.pi / 180),
    "rpm": ("rad/s", math.pi / 30),
    "%": ("1", 1e-2),
    "l/min": ("m3/s", 1e-3 / 60),
    "m3/h": ("m3/s", 1 / 3600),
}
"""Unit and factor to it, by text."""


def known_base(text: str | None) -> BaseUnit | None:
    """Return the base unit of a text, `None` where the text is not in the table."""
    if text == "degC":
        return (*map(float, _EXPONENTS["K"]), 1.0, 273.15)
    unit, factor = _DERIVED.get(text or "", (text or "", 1.0))
    return (*map(float, _EXPONENTS[unit]), factor, 0.0) if unit in _EXPONENTS else None


def conversion(start: BaseUnit | None, end: BaseUnit | None, is_relative: bool = False) -> tuple[float, float] | None:
    """Return (factor, offset) from values in one unit to values in the other; `None` where they do not agree.

    `is_relative` is for differences of values, which have no offset.
    """
    if start is None or end is None or start[:8] != end[:8] or not end[8]:
        return None
    return start[8] / end[8], 0.0 if is_relative else (start[9] - end[9]) / end[8]
