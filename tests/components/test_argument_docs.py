"""What docstrings say of structural arguments, and what an FMU therefore tells of its constants."""

from dataclasses import dataclass

import hfsa.components
import hfsa.controllers
from hfsa.components import Model
from hfsa.components._modelling.argument_docs import explanation_of, explanations
from hfsa.components._modelling.catalogue import find
from hfsa.components._modelling.origin import Explanation

PARTS = find([hfsa.components, hfsa.controllers])


@dataclass(frozen=True)
class Rod:
    """A rod.

    Attributes:
        length: free length l [m].
        stiffness, damping: along it, at one end [N/m] and over
            all of it [N.s/m].
        angle: about its axis in degrees.
    """

    length: float = 1.0
    stiffness: float = 2.0
    damping: float = 3.0
    angle: float = 0.0


def rods(*, count: int = 1, rod: Rod = Rod(), silent: float = 0.0, kind: str = "round") -> Model:  # noqa: D417
    """Return rods.

    Args:
        count: how many `rods` there are.
        rod: the rods.
        kind: `round` [see the
            drawing] or square.

    Raises:
        ModelError: silent: never [m].
    """
    return Model("Rods", f"{count} {rod} {silent} {kind}")


def test_entries_of_functions_and_dataclasses():
    assert explanations(rods) == {
        "count": Explanation("How many rods there are"),
        "rod.length": Explanation("Free length l", "m"),
        "rod.stiffness": Explanation("Along it, at one end [N/m] and over all of it [N.s/m]"),
        "rod.damping": Explanation("Along it, at one end [N/m] and over all of it [N.s/m]"),
        "rod.angle": Explanation("About its axis in degrees", "deg"),
        "kind": Explanation("Round [see the drawing] or square"),
    }


def test_elements_and_fields_have_what_is_said_of_the_whole():
    known = {"posture.position": Explanation("Place", "m"), "sheet": Explanation("Table")}
    assert explanation_of("posture.position[3]", known) == Explanation("Place", "m")
    assert explanation_of("sheet.beam[2].length", known) == Explanation("Table")
    assert explanation_of("posture.rotation[1]", known) is None


def test_our_own_parts_explain_their_arguments():
    found = explanations(PARTS["sdelta"].build)
    assert found["payload.mass"] == Explanation("Mass; 0 for the platform alone", "kg")
    assert found["posture.rotation"].unit == "deg"
    assert found["rods.elastic_modulus"].unit == "Pa"
    assert found["level"].unit == ""
