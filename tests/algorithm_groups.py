"""Names of algorithms by their treatment of inputs, from the table of algorithms."""

from hfsa.cosim.masters import algorithms

ALGORITHMS = tuple(algorithms.ALGORITHMS)
ORDERS = {name: row.order for name, row in algorithms.ALGORITHMS.items() if row.order is not None}
MONOLITHIC, MONOLITHIC_DAE, ERROR_CONTROLLED = "monolithic", "monolithic_dae", "error_controlled"


def _steps(inputs: str) -> tuple[str, ...]:
    """Return the algorithms with fixed steps and a treatment of inputs."""
    return tuple(name for name, row in algorithms.ALGORITHMS.items() if row.is_limited and row.inputs == inputs)


HELD, EXTRAPOLATED, ITERATED = map(_steps, ("held", "extrapolated", "iterated"))
