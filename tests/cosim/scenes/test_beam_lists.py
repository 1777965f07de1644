"""Scenes on listed beams: a bent pair of beams under a disc, by the theorem of Castigliano, in one part and in two."""

from pathlib import Path

import numpy as np
import pytest

from hfsa.cosim.assembly.fmu_cache import key_of
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.cli import main
from hfsa.cosim.experiments.sweep import sweep
from hfsa.cosim.systems.system import Component

E, NU, D, FIRST, SECOND = 2e11, 0.3, 1.5e-3, 0.04, 0.03
G, AREA, MOMENT = E / 2 / (1 + NU), np.pi * D**2 / 4, np.pi * D**4 / 64
BENT = f"""
# a beam along x from the base, and one along y on its end, through a body without mass
[material.steel]
E = {E}
nu = {NU}

[[beam]]
start = [0, 0, 0]
end = [{FIRST}, 0, 0]
diameter = {D}
material = "steel"
joins = ["base", "elbow"]

[[beam]]
start = [{FIRST}, 0, 0]
end = [{FIRST}, {SECOND}, 0]
diameter = {D}
material = "steel"
joins = ["elbow", "platform"]
"""


@pytest.fixture
def file(tmp_path, monkeypatch) -> Path:
    """The list of the beams, in the working folder."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "bent.toml"
    path.write_text(BENT)
    return path


def compliance() -> np.ndarray:
    """Compliance at the end of the second beam from the strain energy of six unit loads, shape (6, 6)."""
    C = np.zeros((6, 6))
    nodes, weights = np.polynomial.legendre.leggauss(4)
    end = np.array([FIRST, SECOND, 0.0])
    for start, along, length in (((0, 0, 0), 0, FIRST), ((FIRST, 0, 0), 1, SECOND)):
        for node, weight in zip(nodes, weights, strict=True):
            place = np.array(start, dtype=float)
            place[along] += length * (1 + node) / 2
            moments = np.array([np.cross(end - place, load[:3]) + load[3:] for load in np.eye(6)])
            stretch = np.array([load[along] for load in np.eye(6)])
            bends = np.delete(moments, along, axis=1)
            energy = bends @ bends.T / (E * MOMENT) + np.outer(stretch, stretch) / (E * AREA)
            energy += np.outer(moments[:, along], moments[:, along]) / (G * 2 * MOMENT)
            C += weight * length / 2 * energy
    return C


def test_the_response_is_that_of_the_strain_energy_in_one_part_and_in_two(file):
    K, M = np.linalg.inv(compliance()), np.diag([0.1, 0.1, 0.1, 4.5e-5, 2.25e-5, 2.25e-5])
    undamped = {"kind": "assembly", "beams": str(file), "damping_ratio": 0.0}
    options = {"method": "linear", "low": 5.0, "high": 300.0, "points": 5, "grid": "log", "force": True}
    loaded = sweep("beam_bode", parameters=undamped, **options)
    # an acceleration of the base is a load in the other direction
    shaken = [
        sweep("beam_payload", parameters={**undamped, "payload.center": (0, 0, 0), "suspension": suspension}, **options)
        for suspension in ("merged", "massless")
    ]
    for k, frequency in enumerate(loaded.frequency):
        H = np.linalg.inv(K - (2 * np.pi * frequency) ** 2 * M)
        np.testing.assert_allclose(loaded.response[k], H, atol=1e-7 * np.abs(H).max(), err_msg=f"{frequency} Hz")
        for found in shaken:
            np.testing.assert_allclose(found.response[k], -(H @ M)[:, :3], atol=1e-6 * np.abs(H @ M).max())


def test_a_path_in_a_component_gives_the_fmu_of_the_content(file):
    """Also in one process, which keeps the keys of parts that come with hfsa."""
    component = Component("stage", "beam_stage", None, {"kind": "assembly", "beams": str(file)})
    same = Component("stage", "beam_stage", None, {"kind": "assembly", "beams": "bent.toml"})
    of_scene = load_scene("beam_bode", {"kind": "assembly", "beams": "bent.toml"}).system["stage"]
    before = key_of(component)
    assert key_of(same) == before
    file.write_text(BENT.replace(f"diameter = {D}", "diameter = 1.4e-3", 1))
    assert key_of(component) != before
    assert key_of(of_scene) == key_of(
        load_scene("beam_bode", {"kind": "assembly", "beams": of_scene.arguments["beams"]}).system["stage"]
    )
    file.write_text(f"# the same\n{BENT}")
    assert key_of(component) == before


def test_the_fmu_of_a_list_is_checked_and_shows_it(file, capsys):
    assert main(["export", "beam_stage", "-p", "kind=assembly", "-p", f"beams={file}", "-o", "."]) == 0
    assert main(["check", *capsys.readouterr().out.split()]) == 0
    capsys.readouterr()
    assert main(["export", "beam_stage", "-p", "kind=assembly", "-o", "."]) == 2
    assert "assembly lacks beams, the list of them; give beams=FILE.toml" in capsys.readouterr().err
