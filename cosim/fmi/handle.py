"""Variables and saved states of an instance, which calls read and write."""

import ctypes
from ctypes import c_void_p
from dataclasses import dataclass, field

import numpy as np

from hfsa.cosim.fmi.access import Access


@dataclass(frozen=True, eq=False)
class Handle:
    """Variables of one instance: value references, and the array (n,) that `get` writes and `set` reads.

    `access` is how they are read and set where one function for real numbers does not do.
    """

    names: tuple[str, ...]
    references: ctypes.Array
    values: np.ndarray
    arguments: tuple = field(repr=False)
    access: Access | None = field(default=None, repr=False)


@dataclass(eq=False)
class State:
    """Saved FMU state of one instance; `Instance.restore` restores it, `Instance.release` frees it."""

    pointer: c_void_p
