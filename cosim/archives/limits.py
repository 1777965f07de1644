"""Limits of what a file of somebody else may cost, each with the environment variable that changes it.

LARGEST.value                       # 2147483648, or what HFSA_LARGEST_ARCHIVE says
"""

import math
import os
from dataclasses import dataclass

from hfsa.cosim.systems.errors import StructureError


@dataclass(frozen=True)
class Limit:
    """Largest number of something: a default, and the environment variable that replaces it."""

    variable: str
    default: int

    @property
    def own(self) -> int | None:
        """The limit of the environment variable, `None` where it is not set; `StructureError` for no number."""
        text = os.environ.get(self.variable)
        if not text:
            return None
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not 0 < number < math.inf:
            raise StructureError(f"{self.variable} is {text!r}, expected a positive number such as {self.default}")
        return int(number)

    @property
    def value(self) -> int:
        """The limit that holds."""
        return self.own or self.default

    @property
    def advice(self) -> str:
        """What a sentence about the limit ends with."""
        return f"the environment variable {self.variable} changes this limit"


LARGEST = Limit("HFSA_LARGEST_ARCHIVE", 2 * 1024**3)
"""Size [bytes] of all that an archive holds."""

MOST_ENTRIES = Limit("HFSA_MOST_ENTRIES", 100_000)
"""Number of files and folders in an archive."""

MOST_VARIABLES = Limit("HFSA_MOST_VARIABLES", 2_000_000)
"""Number of variables of an FMU, each element of an array counted."""
