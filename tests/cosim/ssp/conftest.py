"""The FMUs of the loop of `spring_loop`, and packages that hold them."""

from collections.abc import Callable
from pathlib import Path

import pytest
from spring_loop import controller, plant
from ssp_by_hand import packed, structure

from hfsa.cosim.assembly.packages import package_of
from hfsa.cosim.ssp.read import Package


@pytest.fixture(scope="session")
def loop_files(exported) -> dict[str, Path]:
    """FMUs of the loop by their names in a package."""
    return {"resources/Plant.fmu": exported(plant())[2], "resources/Pd.fmu": exported(controller())[2]}


@pytest.fixture
def packages(loop_files, tmp_path) -> Callable[..., Path]:
    """Write a package of the loop: the content of its system, what is beside that, and further files."""

    def written(system: str, *beside: str, **further: str | bytes | Path) -> Path:
        files = {name.replace("__", "/").replace("_dot_", "."): item for name, item in further.items()}
        return packed(
            tmp_path / "model.ssp", {"SystemStructure.ssd": structure(system, *beside), **loop_files, **files}
        )

    return written


@pytest.fixture
def read(packages) -> Callable[..., Package]:
    """The scene of a package of the loop."""
    return lambda *args, **kwargs: package_of(packages(*args, **kwargs))


@pytest.fixture
def in_tmp(tmp_path, monkeypatch) -> Path:
    """Work in a folder of the test's own."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
