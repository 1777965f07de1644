"""The one error of this room."""


class ExportError(RuntimeError):
    """A model that could not become an FMU: what was tried, what was found, what would help."""

    exit_code = 3
