"""The error-controlled communication step, where it is hard: a loop on which masters that hold inputs stall."""

import numpy as np
import pytest
from scipy.linalg import expm

from hfsa.components._model import Model
from hfsa.cosim.error_controlled import TOLERANCE, ErrorControlled
from hfsa.cosim.system import Component, Connection, System
from hfsa.fmus.export import export

LOOP = [Connection("plant.position", "pd.position"), Connection("pd.force", "plant.force")]
VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
KP, KD, TF = 400.0, 10.0, 5e-3


def servo() -> Model:
    """Follows a step of 1 m by F = Kp e + Kd de/dt, the derivative filtered with TF, its state starting at e(0)."""
    m = Model("Servo", "PD controller of a position")
    x = m.input("position", "m", "Measured position")
    w = m.state("filtered", "m", "Filtered error", start=1.0)
    e = 1.0 - x
    m.der[w] = (e - w) / TF
    m.output("force", KP * e + KD * (e - w) / TF, "N", "Force")
    return m


@pytest.fixture(scope="module")
def servos(tmp_path_factory):
    return dict(zip((2, 3), export(servo(), tmp_path_factory.mktemp("servo")), strict=True))


def exact(time: np.ndarray) -> np.ndarray:
    """Position from rest at 0, by the matrix exponential of [x, v, w, 1]."""
    A = np.array(
        [
            [0, 1, 0, 0],
            [-100 - KP - KD / TF, -0.5, -KD / TF, KP + KD / TF],
            [-1 / TF, 0, -1 / TF, 1 / TF],
            [0, 0, 0, 0],
        ]
    )
    return np.array([(expm(A * t) @ [0.0, 0.0, 1.0, 1.0])[0] for t in time])


def run(opened, files, servos, version, tolerance, points=200):
    system = System([Component("plant", "x"), Component("pd", "x")], LOOP)
    found = opened({"plant": files["Plant", version], "pd": servos[version]})
    master = ErrorControlled(found, system, 1.0 / points, tolerance)
    recording = master.record(["plant.position"], rows=points + 1)
    master.initialize()
    master.advance(points)
    error = abs(recording["plant.position"] - exact(recording.time)).max()
    return master, recording["plant.position"][-1], error


@VERSIONS
def test_the_hard_loop(opened, files, servos, version):
    assert exact(np.array([1.0]))[0] == pytest.approx(0.8034755886, abs=1e-10)
    master, end, error = run(opened, files, servos, version, TOLERANCE)
    assert error < 1e-4
    assert abs(end - 0.8034755886) < 1e-4
    assert master.taken + master.rejected < 2000


def test_the_error_follows_the_tolerance(opened, files, servos):
    found = [run(opened, files, servos, 2, tolerance, points=4) for tolerance in (1e-3, 1e-4, 1e-5)]
    errors, steps = [error for *_, error in found], [master.taken for master, *_ in found]
    assert errors[0] / errors[2] > 30
    assert steps[2] / steps[0] == pytest.approx(10, rel=0.4)  # second order
