"""Physical components: each file defines one part, and its function returns the equations as a `Model`.

Read `mass_on_spring.py` first. `_modelling/` contains the modelling framework, `_mechanics/` the mechanics that several
parts share, `_continuum/` the finite elements of the 3-RRR stage. No module in this package imports `controllers`,
`fmus` or `cosim`.
"""

from typing import TYPE_CHECKING, Any

from hfsa.components._modelling.errors import ModelError
from hfsa.components._modelling.facts import Fact, Known
from hfsa.components._modelling.joins import Join

if TYPE_CHECKING:
    from hfsa.components._modelling.model import Model

__all__ = ["Fact", "Join", "Known", "Model", "ModelError"]


def __getattr__(name: str) -> Any:
    """Return `Model` at its first use: its library is heavy, and what needs no model does without."""
    if name != "Model":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from hfsa.components._modelling.model import Model

    return Model
