"""Physical components: each file defines one part, and its function returns the equations as a `Model`.

Read `mass_on_spring.py` first. `_modelling/` contains the modelling framework, `_mechanics/` the mechanics that several
parts share. No module in this package imports `controllers`, `fmus` or `cosim`.
"""

from hfsa.components._modelling.documents import Document
from hfsa.components._modelling.drawing import Drawing, Layer, Panel
from hfsa.components._modelling.errors import ModelError
from hfsa.components._modelling.facts import Fact, Known
from hfsa.components._modelling.joins import Join
from hfsa.components._modelling.model import Model

__all__ = ["Document", "Drawing", "Fact", "Join", "Known", "Layer", "Model", "ModelError", "Panel"]
