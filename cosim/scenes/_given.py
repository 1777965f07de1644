"""Structured arguments of scenes, passed on to parts: only given fields, so that the parts own the defaults."""

from dataclasses import fields
from typing import Any


def given(structured: Any, name: str) -> dict[str, Any]:
    """Return the fields of a dataclass that are not `None`, as arguments `name.field` of a component."""
    values = {field.name: getattr(structured, field.name) for field in fields(structured)}
    return {f"{name}.{field}": value for field, value in values.items() if value is not None}
