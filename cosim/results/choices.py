"""Choices of levels, order and algorithm, and driven inputs, read from a results file of either kind."""

from pathlib import Path

from hfsa.cosim.results import system_group
from hfsa.cosim.results.records import AlgorithmChoice, DrivenInput, LevelChoice, OrderChoice
from hfsa.cosim.results.store import open_file, translate_errors


def read_choices(path: str | Path) -> dict[str, LevelChoice]:
    """Read the choices of levels by instance; empty where the scene names all levels."""
    path = Path(path)
    file = open_file(path)
    with file, translate_errors(path, "read"):
        return system_group.read_choices(file["system"])


def read_order(path: str | Path) -> OrderChoice | None:
    """Read the computed order of steps; `None` where the order is the scene's."""
    path = Path(path)
    file = open_file(path)
    with file, translate_errors(path, "read"):
        return system_group.read_order(file["system"])


def read_algorithm(path: str | Path) -> AlgorithmChoice | None:
    """Read the choice of `auto`; `None` where the scene names the algorithm."""
    path = Path(path)
    file = open_file(path)
    with file, translate_errors(path, "read"):
        return system_group.read_algorithm(file["system"])


def read_driven(path: str | Path) -> list[DrivenInput]:
    """Read the inputs that signals drove in a run; none where none were driven."""
    path = Path(path)
    file = open_file(path)
    with file, translate_errors(path, "read"):
        return system_group.read_driven(file["system"])
