"""What things are: one file, one part; equations become a `Model`.

Read `mass_on_spring.py` first. `_modelling/` has what models are made of, `_mechanics/` the mechanics that several
parts share. Nothing here imports `controllers`, `fmus` or `cosim`.
"""

from hfsa.components._modelling.errors import ModelError
from hfsa.components._modelling.facts import Fact, Known
from hfsa.components._modelling.joins import Join
from hfsa.components._modelling.model import Model

__all__ = ["Fact", "Join", "Known", "Model", "ModelError"]
