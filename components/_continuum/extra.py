"""Libraries of the extra `fem`, imported where they are needed alone."""

import importlib
from typing import Any

from hfsa.components._modelling.errors import ModelError


def library(name: str) -> Any:
    """Return a library of the extra `fem`; `ModelError` where it cannot be imported, with what to install."""
    try:
        return importlib.import_module(name)
    except (ImportError, OSError) as error:
        raise missing(name, error) from error


def missing(name: str | None, error: Exception) -> ModelError:
    """Return the error for a library of the extra `fem` that is not there."""
    return ModelError(
        f"level continuum needs scikit-fem and gmsh, and {name} cannot be imported ({error}); install them with "
        "`pip install 'hfsa[fem]'`"
    )
