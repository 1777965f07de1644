"""Facts that several parts of a system know: what must agree, and where a part has it.

    PAYLOAD = Fact("payload of the SDelta")                                    # beside what the parts share

    FACTS = {PAYLOAD: Known("payload"), DAMPING: Known("damping_ratio", levels=("elastic",))}      # in a part's file

A part declares as `FACTS`, beside its function, what it knows of facts that have one value in a system. What differs on
purpose, such as the model that a controller is built on, is none.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Fact:
    """What has one value in a system although several parts know it.

    Attributes:
        name: as messages say it.
        unit: of a number, if it has one.
        terminal: of the ports by which two parts share it; without, all parts share it that are wired together.
    """

    name: str
    unit: str = ""
    terminal: str = ""


@dataclass(frozen=True)
class Known:
    """Where a part has a fact: under a name that its model or its analysis has, or both.

    Attributes:
        name: of an argument, also of a dataclass as a whole, or of a variable with a start value.
        per: another such name; the fact is the quotient.
        plus: another such name; the fact is the sum.
        levels: at which the part makes use of it; all without.
        results: of the part's analysis that follow from it; all without.
        unfed: an input without which the part makes use of it; fed, the input takes its place.
    """

    name: str
    per: str = ""
    plus: str = ""
    levels: tuple[str, ...] = ()
    results: tuple[str, ...] = ()
    unfed: str = ""
