"""Masses and moments of inertia of the links of the 3-RRR stage."""

import math
from dataclasses import dataclass, fields

from hfsa.components._modelling.errors import ModelError
from hfsa.components._modelling.follows import follows

_PLATFORM, _CRANK = 0.1323, 0.01416
_PLATFORM_INERTIA, _CRANK_INERTIA = 9.622e-6, 1.483e-6


@dataclass(frozen=True)
class Masses:
    """Masses of the links; by default those of the source (table D.2).

    A moment of inertia that is not given is that of the source, in proportion to the mass. None of them depends on the
    lengths of the links.

    Attributes:
        platform: M_e [kg].
        platform_inertia: I_e about the centre of the platform [kg.m2].
        crank: M_ab of a crank, with its centre halfway between A and B [kg].
        crank_inertia: I_ab of a crank about A [kg.m2].
        coupler: M_bc of a coupler, a uniform rod [kg].

    Raises:
        ModelError: a mass or inertia of the platform that is not above 0; another value below 0; one not finite.
    """

    platform: float = _PLATFORM
    platform_inertia: float = follows("platform")
    crank: float = _CRANK
    crank_inertia: float = follows("crank")
    coupler: float = 7.628e-3

    def __post_init__(self):
        if self.platform_inertia is None:
            object.__setattr__(self, "platform_inertia", _PLATFORM_INERTIA * (self.platform / _PLATFORM))
        if self.crank_inertia is None:
            object.__setattr__(self, "crank_inertia", _CRANK_INERTIA * (self.crank / _CRANK))
        for field in fields(self):
            value, is_needed = getattr(self, field.name), field.name.startswith("platform")
            if not (math.isfinite(value) and (value > 0 or (value == 0 and not is_needed))):
                least = "above 0" if is_needed else "0 or more"
                raise ModelError(f"masses.{field.name} is {value:g}, expected a finite number, {least}")


THESIS_MASSES = Masses()
"""Masses of the source."""
