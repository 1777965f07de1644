"""Error of a system that cannot run."""


class StructureError(ValueError):
    """Error of a system, scene or FMU that cannot run as described; the message names the component or connection."""

    exit_code = 2
