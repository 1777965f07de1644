"""The error for what cannot be run as it is wired."""


class StructureError(ValueError):
    """A system, scene or FMU that cannot be run as it is wired; the message names the component or connection."""

    exit_code = 2
