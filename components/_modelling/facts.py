"""Shared facts: values that must be equal in all parts of a system, and the argument or variable of each part.

    PAYLOAD = Fact("payload of the SDelta")                                    # in the mechanics that the parts share

    FACTS = {PAYLOAD: Known("payload"), DAMPING: Known("damping_ratio", levels=("elastic",))}      # in a part's file

A part declares the shared facts that it uses as `FACTS`, beside its function. A value that may differ on purpose, such
as the model of a model-based controller, is not a shared fact.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Fact:
    """A value that is the same in all parts of a system that use it.

    Attributes:
        name: name in messages.
        unit: unit of a number, empty for other values.
        terminal: terminal whose connection makes two parts share the fact; empty if any connection does.
    """

    name: str
    unit: str = ""
    terminal: str = ""


@dataclass(frozen=True)
class Known:
    """The argument or variable of a part that holds a fact, in its model, its analysis or both.

    Attributes:
        name: name of an argument, a dataclass included, or of a variable with a start value.
        per: name of a divisor; the fact is the quotient `name` / `per`.
        plus: name of a summand; the fact is the sum `name` + `plus`.
        levels: levels at which the part uses the fact; empty for all.
        results: results of the analysis that depend on the fact; empty for all.
        unfed: input that replaces the fact when it is connected.
        when: argument and the value of it with which the model uses the fact; empty for all.
        of_analysis: whether the analysis alone uses the fact, not the model.
    """

    name: str
    per: str = ""
    plus: str = ""
    levels: tuple[str, ...] = ()
    results: tuple[str, ...] = ()
    unfed: str = ""
    when: tuple[str, str] = ("", "")
    of_analysis: bool = False
