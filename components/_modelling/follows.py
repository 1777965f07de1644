"""Dependent fields of a dataclass argument: a field that is computed from others unless it is set itself.

    @dataclass(frozen=True)
    class Payload:
        mass: float = 3.0
        inertia: Triple = follows("mass")          # __post_init__ replaces None by the inertia of a cube of that mass

If a caller changes `payload.mass` of the default `Payload()`, the inertia of the default mass is no longer valid.
`changed` therefore recomputes every dependent field whose origin is given.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar

_FROM = "follows"

T = TypeVar("T")


def follows(*fields: str) -> Any:
    """Declare a dependent field, `None` until `__post_init__` computes it from the fields with these names."""
    return dataclasses.field(default=None, metadata={_FROM: fields})


def changed(instance: T, given: Mapping[str, Any]) -> T:
    """Return a copy of a dataclass instance with the given fields; fields that depend on them are recomputed."""
    assert dataclasses.is_dataclass(instance)
    fields = {field.name: set(field.metadata.get(_FROM, ())) for field in dataclasses.fields(instance)}
    fresh = {name: None for name, origins in fields.items() if name not in given and origins & given.keys()}
    return dataclasses.replace(instance, **{**fresh, **given})  # type: ignore[type-var]
