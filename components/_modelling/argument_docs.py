"""What docstrings say of structural arguments, as an FMU tells it of its constants: a sentence and a unit."""

import re
from collections.abc import Callable, Mapping
from typing import Any

from hfsa.components._modelling.argument_texts import Text, text_of
from hfsa.components._modelling.arguments import arguments_of
from hfsa.components._modelling.origin import Explanation

DEGREE = "deg"
"""Unit of angles in degrees, which quantities of a model do not have."""


def explanations(function: Callable[..., Any] | None) -> dict[str, Explanation]:
    """Return what is said of each argument of a function, by full name, as far as something is said."""
    texts = {name: text_of(argument) for name, argument in arguments_of(function).items()}
    return {name: _explanation(text) for name, text in texts.items() if text.sentence}


def explanation_of(name: str, known: Mapping[str, Explanation]) -> Explanation | None:
    """Return what is said of a constant: of the argument of its name, or of that which it is an element or field of."""
    while name and name not in known:
        name = name[: max(name.rfind("."), name.rfind("["), 0)]
    return known.get(name)


def _explanation(text: Text) -> Explanation:
    """Return a text as a sentence without its unit and its marks of code."""
    unit = text.unit or (DEGREE if re.search(r"\bin degrees\b", text.sentence) else "")
    sentence = text.sentence.replace(f" [{unit}]", "") if unit else text.sentence
    sentence = sentence.replace("`", "").strip().removesuffix(".")
    is_symbol = sentence[1:2] == "_"
    return Explanation(sentence if is_symbol else sentence[:1].upper() + sentence[1:], unit)
