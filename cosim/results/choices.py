"""The scene of a results file of either kind, the choices of its levels, order and algorithm, and its driven inputs."""

from pathlib import Path

from hfsa.cosim.results import hdf5, system_group
from hfsa.cosim.results.records import AlgorithmChoice, DrivenInput, LevelChoice, OrderChoice
from hfsa.cosim.results.store import reading


def read_scene(path: str | Path) -> str:
    """Read the text of the scene, in the form of a `.toml` file."""
    path = Path(path)
    with reading(path) as file:
        return hdf5.text(file["system"].attrs["scene"])


def read_choices(path: str | Path) -> dict[str, LevelChoice]:
    """Read the choices of levels by instance; empty where the scene names all levels."""
    path = Path(path)
    with reading(path) as file:
        return system_group.read_choices(file["system"])


def read_order(path: str | Path) -> OrderChoice | None:
    """Read the computed order of steps; `None` where the order is the scene's."""
    path = Path(path)
    with reading(path) as file:
        return system_group.read_order(file["system"])


def read_algorithm(path: str | Path) -> AlgorithmChoice | None:
    """Read the choice of `auto`; `None` where the scene names the algorithm."""
    path = Path(path)
    with reading(path) as file:
        return system_group.read_algorithm(file["system"])


def read_driven(path: str | Path) -> list[DrivenInput]:
    """Read the inputs that signals drove in a run; none where none were driven."""
    path = Path(path)
    with reading(path) as file:
        return system_group.read_driven(file["system"])
