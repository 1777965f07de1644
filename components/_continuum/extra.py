"""Libraries of the extra `fem`, imported where they are needed alone."""

import importlib
import importlib.util
from typing import Any

from hfsa.components._modelling.errors import ModelError

NAMES = ("skfem", "gmsh")
"""Modules of the extra."""

_INSTALL = "install them with `pip install 'hfsa[fem]'`"


def unavailable(level: str) -> dict[str, str]:
    """Return why a level cannot be built on this machine, by its name; empty where the extra is installed."""
    absent = [name for name in NAMES if importlib.util.find_spec(name) is None]
    return {level: f"it needs scikit-fem and gmsh; {_INSTALL}"} if absent else {}


def library(name: str) -> Any:
    """Return a library of the extra `fem`; `ModelError` where it cannot be imported, with what to install."""
    try:
        return importlib.import_module(name)
    except (ImportError, OSError) as error:
        raise missing(name, error) from error


def missing(name: str | None, error: Exception) -> ModelError:
    """Return the error for a library of the extra `fem` that is not there."""
    return ModelError(f"level continuum needs scikit-fem and gmsh, and {name} cannot be imported ({error}); {_INSTALL}")
