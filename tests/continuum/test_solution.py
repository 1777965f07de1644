"""Solved pieces in the cache: meshed once, made anew where they are damaged, and what is missing is named."""

import sys
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("gmsh")
pytest.importorskip("skfem")

from hfsa.components import ModelError
from hfsa.components._continuum import design as designs
from hfsa.components._continuum import extra, solution
from hfsa.components._continuum.solution import Shape
from hfsa.components._mechanics.rrr_hinge import Hinge
from hfsa.components._mechanics.rrr_kinematics import NOMINAL
from hfsa.components._mechanics.rrr_outline import Outline
from hfsa.components.rrr_stage import LADDER, rrr_stage

SHAPE, SIZE = Shape(NOMINAL, Hinge(), Outline()), 0.25e-3


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache, and a count of the meshes made."""
    monkeypatch.setenv("HFSA_CACHE", str(tmp_path / "cache"))
    made, mesh = [], solution.mesh

    def counted(*arguments):
        made.append(arguments)
        return mesh(*arguments)

    monkeypatch.setattr(solution, "mesh", counted)
    return tmp_path / "cache/continuum", made


def equal(one, other) -> bool:
    return all(
        np.array_equal(getattr(one.piece, name), getattr(other.piece, name)) for name in one.piece._fields
    ) and np.array_equal(one.mesh.points, other.mesh.points)


@pytest.mark.slow
def test_the_second_use_does_not_mesh(cache, monkeypatch):
    _, made = cache
    first = solution.solution(SHAPE, SIZE)
    assert len(made) == 1
    monkeypatch.setitem(sys.modules, "gmsh", None)  # an import fails
    assert equal(solution.solution(SHAPE, SIZE), first)
    assert len(made) == 1


@pytest.mark.slow
def test_a_damaged_entry_is_made_anew(cache):
    folder, made = cache
    first = solution.solution(SHAPE, SIZE)
    (file,) = folder.glob("*.npz")
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    assert equal(solution.solution(SHAPE, SIZE), first)
    assert len(made) == 2
    assert equal(solution._read(file), first)
    assert [entry.name for entry in folder.iterdir()] == [file.name]


@pytest.mark.parametrize(
    "other",
    [
        SHAPE._replace(hinge=Hinge(thickness=0.7e-3)),
        SHAPE._replace(outline=Outline(block_left=6e-3)),
        SHAPE._replace(links=replace(NOMINAL, crank=17.8e-3)),
    ],
    ids=["hinge", "outline", "links"],
)
def test_other_dimensions_have_another_entry_and_strength_has_not(other, monkeypatch):
    assert solution._key(other, SIZE) != solution._key(SHAPE, SIZE) != solution._key(SHAPE, 0.2e-3)
    strong = SHAPE._replace(hinge=Hinge(yield_strength=400e6))
    assert solution._key(strong, SIZE) == solution._key(SHAPE, SIZE)
    before = solution._key(SHAPE, SIZE)
    monkeypatch.setattr(solution, "version", lambda name: "0")
    assert solution._key(SHAPE, SIZE) != before


def test_a_missing_library_is_named_with_what_to_install(cache, monkeypatch):
    monkeypatch.setitem(sys.modules, "gmsh", None)
    with pytest.raises(ModelError, match=r"needs scikit-fem and gmsh, and gmsh cannot .* `pip install 'hfsa\[fem\]'`"):
        solution.solution(SHAPE, SIZE)


def test_without_the_distribution_the_level_is_refused_and_no_step_of_the_ladder(monkeypatch):
    def absent(name):
        raise solution.PackageNotFoundError(name)

    monkeypatch.setattr(solution, "version", absent)
    designs._solution.cache_clear()
    with pytest.raises(ModelError, match=r"and scikit-fem cannot be imported .*install them with"):
        rrr_stage(level="continuum")
    rrr_stage(level="constant_jacobian")
    assert extra.unavailable("continuum") == {}
    monkeypatch.setattr(extra.importlib.util, "find_spec", lambda name: None)
    assert "pip install 'hfsa[fem]'" in extra.unavailable("continuum")["continuum"]
    assert LADDER[-1] == "continuum"


def test_a_shape_that_cannot_be_built_is_refused_before_the_cache(cache):
    folder, made = cache
    with pytest.raises(ModelError, match=r"outline\.foot is 1 mm"):
        solution.solution(SHAPE._replace(outline=Outline(foot=1e-3)), SIZE)
    assert not folder.exists()
    assert not made
