"""Physical components: each file defines one part, and its function returns the equations as a `Model`.

Read `mass_on_spring.py` first. `_modelling/` contains the modelling framework, `_mechanics/` the mechanics that several
parts share, `_continuum/` the finite elements of the 3-RRR stage. No module in this package imports `controllers`,
`fmus` or `cosim`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from hfsa.components._modelling.documents import Document
from hfsa.components._modelling.errors import ModelError
from hfsa.components._modelling.facts import Fact, Known
from hfsa.components._modelling.joins import Join

if TYPE_CHECKING:
    from hfsa.components._modelling.drawing import Drawing, Layer, Moving, Panel
    from hfsa.components._modelling.model import Model

__all__ = ["Document", "Drawing", "Fact", "Join", "Known", "Layer", "Model", "ModelError", "Moving", "Panel"]

_HEAVY = {"Drawing": "drawing", "Layer": "drawing", "Model": "model", "Moving": "drawing", "Panel": "drawing"}
"""Modules with libraries that take time to load, by the names in them."""


def __getattr__(name: str) -> Any:
    """Return a name of a heavy module at its first use: what needs no model does without."""
    if name not in _HEAVY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"hfsa.components._modelling.{_HEAVY[name]}"), name)
