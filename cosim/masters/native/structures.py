"""The structures of `runtime/*.h`, field by field."""

from ctypes import POINTER, Structure, c_double, c_int, c_longlong, c_size_t, c_void_p
from typing import ClassVar

from hfsa.cosim.actions.iterated import Progress

(
    VALUES_2,
    VALUES_3,
    STEP_2,
    STEP_3,
    DERIVATIVES_2,
    DIRECTIONAL_2,
    DIRECTIONAL_3,
    SAVE,
    RESTORE,
    REMEMBER,
    EXTRAPOLATE,
    LOOP,
    CONVERGE,
    GAINS,
    RATES,
    LINES,
) = range(16)
"""`Kind` of call.h."""


class Call(Structure):
    """`Call` of call.h."""

    _fields_: ClassVar = [
        ("kind", c_int),
        ("is_final", c_int),
        ("function", c_void_p),
        ("component", c_void_p),
        ("references", c_void_p),
        ("n", c_size_t),
        ("values", c_void_p),
        ("detail", c_void_p),
    ]


class Knowns(Structure):
    """`Knowns` of call.h."""

    _fields_: ClassVar = [("references", c_void_p), ("n", c_size_t), ("seed", c_void_p)]


class Remember(Structure):
    """`Remember` of extrapolation.h."""

    _fields_: ClassVar = [("bus", c_void_p), ("points", c_void_p), ("n", c_size_t)]


class Extrapolate(Structure):
    """`Extrapolate` of extrapolation.h."""

    _fields_: ClassVar = [
        ("remember", POINTER(Remember)),
        ("places", c_void_p),
        ("weights", c_void_p),
        ("derivatives", c_void_p),
        ("n", c_size_t),
        ("calls", POINTER(Call)),
        ("n_calls", c_size_t),
        ("failing", c_size_t),
    ]


class Loop(Structure):
    """`Loop` of algebraic_loop.h."""

    _fields_: ClassVar = [
        ("bus", c_void_p),
        ("places", c_void_p),
        ("inverse", c_void_p),
        ("scale", c_void_p),
        ("guess", c_void_p),
        ("change", c_void_p),
        ("n", c_size_t),
        ("calls", POINTER(Call)),
        ("n_inner", c_size_t),
        ("n_calls", c_size_t),
        ("failing", c_size_t),
        ("tolerance", c_double),
        ("rounding", c_double),
        ("passes", c_int),
    ]


class Line(Structure):
    """`Line` of iterated.h."""

    _fields_: ClassVar = [("places", c_void_p), ("values", c_void_p), ("n", c_size_t), ("is_able", c_int)]


class Past(Structure):
    """`Past` of iterated.h."""

    _fields_: ClassVar = [("times", c_void_p), ("points", c_void_p), ("known", POINTER(c_size_t)), ("n", c_size_t)]


class Converge(Structure):
    """`Converge` of iterated.h."""

    _fields_: ClassVar = [
        ("progress", POINTER(Progress)),
        ("past", Past),
        ("bus", c_void_p),
        ("guess", c_void_p),
        ("change", c_void_p),
        ("places", c_void_p),
        ("nominal", c_void_p),
        ("inverse", c_void_p),
        ("n", c_size_t),
        ("lines", POINTER(Line)),
        ("n_lines", c_size_t),
        ("calls", POINTER(Call)),
        ("n_instances", c_size_t),
        ("n_calls", c_size_t),
        ("failing", c_size_t),
        ("tolerance", c_double),
        ("rounding", c_double),
        ("reuse", c_double),
        ("passes", c_int),
    ]


class Gains(Structure):
    """`Gains` of feedback.h."""

    _fields_: ClassVar = [
        ("gains", c_void_p),
        ("n", c_size_t),
        ("derivatives", c_void_p),
        ("entries", c_void_p),
        ("places", c_void_p),
        ("n_entries", c_size_t),
        ("calls", POINTER(Call)),
        ("n_calls", c_size_t),
        ("failing", c_size_t),
    ]


class Rates(Structure):
    """`Rates` of feedback.h."""

    _fields_: ClassVar = [
        ("rates", c_void_p),
        ("feeding", c_void_p),
        ("fed", c_void_p),
        ("n_feeding", c_size_t),
        ("places", c_void_p),
        ("result", c_void_p),
        ("n", c_size_t),
        ("calls", POINTER(Call)),
        ("n_calls", c_size_t),
        ("failing", c_size_t),
    ]


class Lines(Structure):
    """`Lines` of feedback.h."""

    _fields_: ClassVar = [
        ("bus", c_void_p),
        ("before", c_void_p),
        ("rates", c_void_p),
        ("places", c_void_p),
        ("is_known", c_void_p),
        ("slopes", c_void_p),
        ("n", c_size_t),
        ("gains", c_void_p),
        ("own", c_void_p),
        ("n_own", c_size_t),
        ("calls", POINTER(Call)),
        ("n_calls", c_size_t),
        ("failing", c_size_t),
    ]


class Watch(Structure):
    """`Watch` of step.c."""

    _fields_: ClassVar = [("values", c_void_p), ("low", c_void_p), ("high", c_void_p), ("n", c_size_t)]


class Cycle(Structure):
    """`Cycle` of step.c."""

    _fields_: ClassVar = [
        ("calls", POINTER(Call)),
        ("exchange", c_size_t),
        ("record", c_size_t),
        ("end", c_size_t),
        ("bus", Watch),
        ("row", Watch),
        ("start_time", c_double),
        ("step_size", c_double),
        ("every", c_longlong),
    ]


class Run(Structure):
    """`Run` of step.c."""

    _fields_: ClassVar = [
        ("count", c_longlong),
        ("next", c_size_t),
        ("phase", c_int),
        ("status", c_int),
        ("time", c_void_p),
        ("values", c_void_p),
        ("rows", c_size_t),
        ("capacity", c_size_t),
    ]
