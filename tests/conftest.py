"""Shared fixtures: every part at every level, and its FMUs, exported once per session."""

from collections.abc import Callable
from pathlib import Path

import pytest

import hfsa.components
import hfsa.controllers
from hfsa.components._model import Model
from hfsa.components._parts import find
from hfsa.fmus.export import export

PARTS = {name: part for name, part in find([hfsa.components, hfsa.controllers]).items() if part.build}
VARIANTS = [(name, level) for name, part in PARTS.items() for level in part.levels or (None,)]

Exporter = Callable[[Model], dict[int, Path]]


def pytest_generate_tests(metafunc):
    """A test with an argument `variant` runs for every part at every level."""
    if "variant" in metafunc.fixturenames:
        ids = [name if level is None else f"{name}-{level}" for name, level in VARIANTS]
        metafunc.parametrize("variant", VARIANTS, ids=ids, scope="session")


@pytest.fixture(scope="session")
def part_model(variant: tuple[str, str | None]) -> Model:
    name, level = variant
    return PARTS[name].model(level=level)


@pytest.fixture(scope="session")
def exported(tmp_path_factory) -> Exporter:
    """Export a model; the files by FMI version."""

    def run(model: Model) -> dict[int, Path]:
        return dict(zip((2, 3), export(model, tmp_path_factory.mktemp(model.name)), strict=True))

    return run


@pytest.fixture(scope="session")
def part_files(part_model: Model, exported: Exporter) -> dict[int, Path]:
    return exported(part_model)


@pytest.fixture(scope="session")
def mass_on_spring_files(exported: Exporter) -> dict[int, Path]:
    return exported(PARTS["mass_on_spring"].model())
