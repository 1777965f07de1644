"""The error of this package."""


class ExportError(RuntimeError):
    """A failed export; the message names the attempted operation, its result and a remedy."""

    exit_code = 3
