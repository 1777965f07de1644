"""A multisine has the responses of one sine at a time and the distortion of the system; a run resumes whole."""

from dataclasses import replace

import h5py
import numpy as np
import pytest

from hfsa.cosim import load_scene, read, sweep
from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.results.records import ResultsError, Status
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, System

LINEAR = [
    ("mass_on_spring", {"damping": 50}, {}),
    ("sdelta_shaker", {}, {"inputs": ["command.position[1..3]"], "together": True}),
    ("sdelta_hfsa", {}, {"inputs": ["command.position[3]"]}),
    ("sdelta_hfsa", {"law": "ctc", "delay": "true"}, {"inputs": ["command.position[1..2]"], "together": True}),
    ("beam_payload", {}, {"inputs": ["payload.base.acceleration[3]"], "phases": "random", "seed": 3}),
]


LABELS = ["free", "three together", "sampled", "delay together", "random phases"]
QUICK = ("free", "sampled")


def stepping(name, arguments, frequency, inputs, outputs, algorithm) -> np.ndarray:
    """The response that a stepped sweep measures on a linear scene, (frequencies, outputs, inputs)."""
    scene = load_scene(name, arguments)
    variants = Variants(scene)
    found = []
    for excited in inputs:
        whole = variants.instrumented(excited, outputs)
        with whole.open() as instances:
            coupled = CoupledStep(whole.system, instances, algorithm, source="source", lock_in="lock_in")
            found.append(coupled.over(scene.step_size).response(frequency))
    return np.stack(found, axis=2)


@pytest.mark.parametrize(
    ("name", "arguments", "more"),
    [
        pytest.param(*case, id=label, marks=() if label in QUICK else pytest.mark.slow)
        for label, case in zip(LABELS, LINEAR, strict=True)
    ],
)
def test_a_linear_scene_has_the_response_of_one_sine_at_a_time(tmp_path, name, arguments, more):
    """To 1e-9 of the largest, whichever lines are excited with it; settled after one window."""
    bode = sweep(name, arguments, method="multisine", points=6, path=tmp_path / "m.h5", warn=lambda _: None, **more)
    assert set(np.unique(bode.status)) <= {Status.DONE, Status.NOT_EXCITED}
    assert not any(bode.message.ravel())
    inputs, outputs = ([signal.name for signal in side] for side in (bode.inputs, bode.outputs))
    expected = stepping(name, arguments, bode.frequency, inputs, outputs, bode.settings["algorithm"])
    done = np.broadcast_to((bode.status == Status.DONE)[:, None, :], expected.shape)
    assert np.array_equal(np.isfinite(bode.response), done)
    largest = np.abs(expected).max(axis=(0, 1))
    assert np.nanmax(np.abs(bode.response - expected) / largest) < 1e-9
    assert np.nanmax(bode.remaining_transient) < 1e-3
    # a linear system puts nothing on lines that are not excited
    strong = np.abs(bode.response) > 1e-3 * largest
    assert np.max(bode.harmonic_distortion[strong & done], initial=0.0) < 1e-8
    for k in range(len(inputs)):
        assert (bode.status[:, k] == Status.DONE).sum() >= 2
    window = round(bode.settings["window"] / bode.settings["step_size"])
    assert bode.steps.sum() == window * (1 if more.get("together") else len(inputs))


@pytest.mark.slow
def test_stepped_and_multisine_measure_the_same(tmp_path, hfsa):
    words = ["sweep", "sdelta_hfsa", "--input", "command.position[1]", "-j", "1"]
    assert hfsa(*words, "--method", "multisine", "--points", 5, "--from", 10, "-o", "m.h5")[0] == 0
    many = read("m.h5")
    low = many.frequency[1]
    assert hfsa(*words, "--from", low, "--to", low, "-o", "s.h5")[0] == 0
    one = read("s.h5")
    scale = np.abs(one.response[0]).max()
    assert np.abs(many.response[1] - one.response[0]).max() / scale < 1e-9


@pytest.mark.slow
def test_from_rest_it_waits_until_windows_repeat(tmp_path):
    """Within the settling tolerance, without a prediction."""
    rest, steady = (
        sweep(
            "mass_on_spring",
            {"damping": 20},
            method="multisine",
            points=6,
            low=5.0,
            start=start,
            path=tmp_path / f"{start}.h5",
            warn=lambda _: None,
        )
        for start in ("rest", "steady")
    )
    assert np.all(rest.status == Status.DONE)
    assert np.max(np.abs(rest.response / steady.response - 1)) < 1e-3
    assert np.max(np.abs(rest.response / steady.response - 1)) > 1e-14  # it has not started there


def test_a_settling_time_that_is_too_short_is_a_status_of_each_line(tmp_path):
    bode = sweep(
        "mass_on_spring",
        method="multisine",
        points=6,
        low=5.0,
        start="rest",
        settling_time=0.2,
        measurement_periods=1,
        path=tmp_path / "m.h5",
        warn=lambda _: None,
    )
    assert np.any(bode.status == Status.NOT_SETTLED)
    place = tuple(np.argwhere(bode.status == Status.NOT_SETTLED)[0])
    assert "has not settled after" in bode.message[place]


CUBIC = """
from hfsa.components import Model


def cubic(*, coefficient: float = 0.0) -> Model:
    \"\"\"Return a static cubic.\"\"\"
    m = Model("Cubic", "Static cubic")
    c = m.parameter("coefficient", 2e-2, "1", "Coefficient of the cube")
    u = m.input("force", "N", "Input")
    m.output("position", u + c * u**3, "N", "Output")
    return m
"""


def cubic_scene(folder) -> Scene:
    part = folder / "cubic.py"
    part.write_text(CUBIC)
    return Scene(
        System([Component("it", str(part))]),
        inputs=["it.force"],
        outputs=["it.position"],
        band=(1.0, 40.0),
        amplitude={"N": 2.0},
        step_size=1e-3,
        stop_time=1.0,
        algorithm="gauss_seidel",
    )


def test_the_distortion_of_a_cubic_is_the_analytic_one(tmp_path):
    """The spectrum of u + c u^3 is that of u, convolved with itself."""
    path = tmp_path / "m.h5"
    bode = sweep(
        cubic_scene(tmp_path), method="multisine", points=10, measurement_periods=3, path=path, warn=lambda _: None
    )
    with h5py.File(path) as file:
        amplitude, phase = file["bode/line_amplitude"][:, 0], file["bode/line_phase"][:, 0]
        assert (file["bode/line_phase"].attrs["units"], file["bode/line_amplitude"].attrs["units"]) == ("rad", "N")
        assert file["theory/response"].attrs["units"] == file["bode/response"].attrs["units"] == "1"
        assert file["bode/crest_factor"][0] == pytest.approx(2.0 / np.sqrt(np.sum(amplitude**2) / 2), rel=0.01)
    lines = np.rint(bode.frequency / bode.settings["spacing"]).astype(int)
    size = 4 * lines.max()
    two_sided = np.zeros(2 * size + 1, complex)  # line k at size + k
    two_sided[size + lines] = amplitude * np.exp(1j * phase) / 2j
    two_sided[size - lines] = np.conj(two_sided[size + lines])
    square = np.convolve(two_sided, two_sided)[size:-size]
    cube = np.convolve(square, two_sided)[size:-size]
    whole = 2j * (two_sided + 2e-2 * cube)[size:]  # relative to sines
    expected = whole[lines] / (amplitude * np.exp(1j * phase))
    np.testing.assert_allclose(bode.response[:, 0, 0], expected, rtol=1e-9)
    odd = {k + way * step for k in lines for way in (-1, 1) for step in range(2, 80, 2)} - set(lines)
    loud = np.array(sorted(k for k in odd if k > 0))
    below = [loud[loud < k].max(initial=0) for k in lines]
    above = [loud[loud > k].min() for k in lines]
    for row, (k, one, other) in enumerate(zip(lines, below, above, strict=True)):
        right = np.abs(whole[other]) ** 2
        left = np.abs(whole[one]) ** 2 if one else right
        part = (k - one) / (other - one) if one else 0.0
        level = np.sqrt((1 - part) * left + part * right)
        assert bode.harmonic_distortion[row, 0, 0] == pytest.approx(level / np.abs(whole[k]), rel=1e-6)
    assert bode.harmonic_distortion.max() > 1e-3


@pytest.mark.slow
def test_it_resumes_whole_runs(tmp_path):
    """A file with one input pending measures the run of that input again, and no other."""
    path = tmp_path / "m.h5"
    ask = {"method": "multisine", "points": 5, "inputs": ["command.position[2..3]"], "path": path, "jobs": 1}
    first = sweep("sdelta_shaker", warn=lambda _: None, **ask)
    with h5py.File(path, "r+") as file:
        file["bode/status"][2, 1] = Status.PENDING
        file["bode/response"][:, :, 1] = np.nan
        file["bode/response"][0, 0, 0] = 7.0
    again = sweep("sdelta_shaker", warn=lambda _: None, resume=True, **ask)
    assert np.array_equal(again.response[:, :, 1], first.response[:, :, 1])
    assert again.response[0, 0, 0] == 7.0
    assert np.all(again.status == Status.DONE)


@pytest.mark.slow
def test_it_runs_on_what_the_scene_needs(tmp_path):
    """The response is that of the whole scene, and a file of the one is not resumed with the FMUs of the other."""
    only = {"inputs": ["command.position[3]"], "outputs": ["platform.position[3]"], "points": 4, "low": 10.0}
    ask = {"method": "multisine", "jobs": 1, "warn": lambda _: None, **only}
    whole, needed = (sweep("sdelta_shaker", keep=keep, path=tmp_path / keep, **ask) for keep in ("all", "needed"))
    assert np.max(np.abs(needed.response / whole.response - 1)) < 1e-11
    with h5py.File(tmp_path / "needed") as file, h5py.File(tmp_path / "all") as other:
        assert "robot: 10 of 12 states" in file["system"].attrs["left_out"]
        assert "left_out" not in other["system"].attrs
    with pytest.raises(ResultsError, match="the FMU of robot is another"):
        sweep("sdelta_shaker", keep="all", resume=True, path=tmp_path / "needed", **ask)


REFUSED = [
    (["--points", "1"], "a multisine has two lines or more"),
    (["--from", "10", "--to", "10.5", "--points", "5", "--measurement-periods", "1"], "no room for two lines"),
    (["--to", "5000"], "steps of 0.0001 s in a period"),
    (["--inputs", "together"], "excites several inputs in one run; there is one"),
]


@pytest.mark.parametrize(("more", "words"), REFUSED, ids=["one point", "no room", "beyond the step", "one input"])
def test_what_cannot_be_measured_is_refused(hfsa, more, words):
    code, _, err = hfsa("sweep", "mass_on_spring", "--method", "multisine", *more)
    assert code == 2
    assert words in err


@pytest.mark.parametrize("method", ["stepped", "linear"])
@pytest.mark.parametrize(
    "option", [["--phases", "random"], ["--seed", "1"], ["--inputs", "together"]], ids=lambda option: option[0]
)
def test_options_of_a_multisine_need_it(hfsa, method, option):
    code, _, err = hfsa("sweep", "mass_on_spring", "--method", method, *option)
    assert code == 2
    assert f"{option[0]} would have no effect" in err
    assert "--method multisine" in err


def test_the_same_in_python():
    with pytest.raises(StructureError, match="--seed would have no effect"):
        sweep("mass_on_spring", seed=3)


def test_a_source_of_its_own_kind_is_refused(tmp_path):
    scene = replace(load_scene("mass_on_spring"), source=Component("source", "stage_reference"))
    with pytest.raises(StructureError, match="the scene has stage_reference"):
        Variants(scene).multisine(["mass.base.position"], ["mass.position"], 8)
