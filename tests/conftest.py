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

Files = dict[int, Path]


def pytest_generate_tests(metafunc):
    """A test with an argument `variant` runs for every part at every level, so a new part needs no new test."""
    if "variant" in metafunc.fixturenames:
        ids = [name if level is None else f"{name}-{level}" for name, level in VARIANTS]
        metafunc.parametrize("variant", VARIANTS, ids=ids, scope="session")


@pytest.fixture(scope="session")
def exported(tmp_path_factory) -> Callable[[str, Model], Files]:
    """Export a model once per session and key; the files by FMI version."""
    known: dict[str, Files] = {}

    def files(key: str, model: Model) -> Files:
        if key not in known:
            known[key] = dict(zip((2, 3), export(model, tmp_path_factory.mktemp(model.name)), strict=True))
        return known[key]

    return files


@pytest.fixture(scope="session")
def part_model(variant: tuple[str, str | None]) -> Model:
    name, level = variant
    return PARTS[name].model(level=level)


@pytest.fixture(scope="session")
def part_files(variant: tuple[str, str | None], part_model: Model, exported) -> Files:
    return exported(str(variant), part_model)


@pytest.fixture(scope="session")
def mass_on_spring_files(exported) -> Files:
    return exported(str(("mass_on_spring", None)), PARTS["mass_on_spring"].model())
