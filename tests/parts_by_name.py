"""Parts called by the names of their arguments, whatever groups these are in: `links`, `rods`, `gear`."""

from hfsa import components, controllers
from hfsa.components._modelling.catalogue import find
from hfsa.components._modelling.parts import Part

_PARTS = find([components, controllers])


def part(name: str) -> Part:
    """Return a part that comes with hfsa."""
    return _PARTS[name]
