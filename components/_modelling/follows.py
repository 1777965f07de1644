"""Fields of a dataclass argument that follow from others: new values of these leave the old ones of those behind.

    @dataclass(frozen=True)
    class Payload:
        mass: float = 3.0
        inertia: Triple = follows("mass")          # __post_init__ puts the cube's of that mass in the place of None

A part whose default is `Payload()` and that is given `payload.mass` alone must not keep the inertia of the default's
mass: `changed` lets whatever follows from a field that is given follow again.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar

_FROM = "follows"

T = TypeVar("T")


def follows(*fields: str) -> Any:
    """Declare a field that follows from others of these names where it is not given itself, `None` until then."""
    return dataclasses.field(default=None, metadata={_FROM: fields})


def changed(instance: T, given: Mapping[str, Any]) -> T:
    """Return a dataclass instance with the given fields; what follows from one of them, and is not given, follows."""
    assert dataclasses.is_dataclass(instance)
    fields = {field.name: set(field.metadata.get(_FROM, ())) for field in dataclasses.fields(instance)}
    fresh = {name: None for name, origins in fields.items() if name not in given and origins & given.keys()}
    return dataclasses.replace(instance, **{**fresh, **given})  # type: ignore[type-var]
