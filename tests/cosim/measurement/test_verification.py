"""The error of a run's step, estimated by a run at half the step, against closed forms."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from algorithm_groups import ALGORITHMS, ORDERS
from mass_and_law import law, plant
from spring_loop import loop

from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.measurement.run import RunPlan, run
from hfsa.cosim.measurement.verification import check_verifiable, verify
from hfsa.cosim.results.files import SystemRecord, read_errors, read_run, read_status
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, Connection, System

STIFFNESS, DAMPING = 100.0, 1.0
"""Gains of the law that holds a mass of 1 kg [N/m], [N.s/m]."""
NAMES = ("mass.position", "mass.velocity")
OWN = {"monolithic", "monolithic_dae", "error_controlled"}
"""Algorithms that choose their steps."""

HELD_INPUTS = ["--algorithm", "gauss_seidel"]
"""An algorithm whose error is worth an estimate."""


def exact(time: np.ndarray) -> np.ndarray:
    """Position and velocity of the mass, from 1 m at rest, (points, 2)."""
    decay, omega = DAMPING / 2, np.sqrt(STIFFNESS - DAMPING**2 / 4)
    cosine, sine = np.exp(-decay * time) * np.cos(omega * time), np.exp(-decay * time) * np.sin(omega * time)
    return np.transpose([cosine + decay / omega * sine, -STIFFNESS / omega * sine])


@pytest.fixture
def held(exported, library, monkeypatch, tmp_path):
    """A mass that a law without memory holds, as a run of 1 s."""
    monkeypatch.chdir(tmp_path)
    start = {"stiffness": STIFFNESS, "damping": DAMPING}
    system = System(
        [Component("mass", "x", start={"q": 1.0}), Component("law", "x", start=start)],
        [
            *(Connection(f"mass.{name}", f"law.{name}") for name in ("position", "velocity")),
            Connection("law.force", "mass.force"),
        ],
    )
    files = {"mass": exported(plant())[2], "law": exported(law())[2]}

    def plan(algorithm: str, step_size: float, **changes) -> RunPlan:
        made = RunPlan(
            Assembly.read(system, files), NAMES, 1.0, step_size, SystemRecord("held", ""), algorithm, library
        )
        return replace(made, **changes)

    return plan


def ratios(plan: RunPlan) -> np.ndarray:
    """Return estimated by true error of a run, (names,)."""
    path = Path("it.h5")
    run(plan, path)
    assert read_errors(path) == {}  # nothing is known of a run that nobody verified
    errors = verify(plan, path).errors
    values, _ = read_run(path)
    true = np.abs(np.transpose([values[name] for name in NAMES]) - exact(values["time"]))
    found = np.array([errors[name].absolute for name in NAMES])
    assert read_errors(path) == errors
    assert read_status(path) == ("complete", "")
    for name in NAMES:
        assert errors[name].relative == errors[name].absolute / np.abs(values[name]).max()
    return found / true.max(axis=0)


@pytest.mark.parametrize("step_size", [4e-3, 1e-3])
@pytest.mark.parametrize("algorithm", [a for a in ORDERS if a != "linearized_feedback"])
def test_the_estimate_is_the_error(held, algorithm, step_size):
    """Within a fifth, where a factor of 2 would be good enough: both steps are short beside the motion."""
    assert ratios(held(algorithm, step_size)) == pytest.approx(1, abs=0.2)


def test_inputs_that_are_held_after_all_make_the_error_one_of_first_order(held, rewritten):
    """Inputs of an FMU without input derivatives are held, whatever the order of the algorithm."""
    plan = held("gauss_seidel_quadratic", 1e-3)
    files = {name: rewritten(file, 'canInterpolateInputs="true"', "") for name, file in plan.assembly.files.items()}
    plan = replace(plan, assembly=Assembly.read(plan.assembly.system, files))
    assert ratios(plan) == pytest.approx(1, abs=0.1)
    assert verify(plan, Path("it.h5")).order == 1


def test_what_the_step_does_not_change_has_no_error(files, library, monkeypatch, tmp_path):
    """A force that is held between ticks, on a mass that is solved exactly, is as exact at any step."""
    monkeypatch.chdir(tmp_path)
    system, made = loop(files, controller="SampledPd")
    plan = RunPlan(
        Assembly.read(system, made),
        ("plant.position", "pd.force"),
        1.0,
        0.005,
        SystemRecord("loop", ""),
        library=library,
    )
    run(plan, Path("it.h5"))
    assert max(error.relative for error in verify(plan, Path("it.h5")).errors.values()) < 1e-12


def test_a_step_that_would_do_does(held):
    """The sentence names the variable with the largest error; at the recommended step all are within tolerance."""
    path, plan = Path("it.h5"), held("jacobi", 2e-3)
    run(plan, path)
    verified = verify(plan, path)
    worst = max(NAMES, key=lambda name: verified.errors[name].relative)
    sentence = verified.excess(1e-3)
    assert sentence.startswith(f"{worst} errs by {100 * verified.errors[worst].relative:.3g} % at the communication")
    assert "and 1 more are above it" in sentence
    assert sentence.endswith("or an algorithm of higher order, such as jacobi_quadratic")
    number, unit = re.search(r"a step of (\S+) (\S*s) would do", sentence).groups()
    plan = replace(plan, step_size=float(number) * {"us": 1e-6, "ms": 1e-3}[unit])
    plan = replace(plan, stop_time=round(1 / plan.step_size) * plan.step_size)
    run(plan, path, force=True)
    again = verify(plan, path)
    assert 0.5e-3 < max(error.relative for error in again.errors.values()) < 1e-3
    assert again.excess(1e-3) == ""


def test_two_runs_with_nothing_in_common_propose_no_step(held):
    """The law is unstable at this step and 15 times as large at the end as it should be."""
    plan = held("jacobi_plain", 0.05)
    run(plan, Path("it.h5"))
    assert "has little in common with it" in verify(plan, Path("it.h5")).excess(1e-3)


def test_whoever_ends_a_verification_keeps_the_run(held):
    """Its file was complete before."""

    def enough(part: float) -> None:
        raise KeyboardInterrupt

    plan = held("gauss_seidel", 1e-3)
    run(plan, Path("it.h5"))
    before = read_run("it.h5")[0]
    with pytest.raises(KeyboardInterrupt):
        verify(plan, Path("it.h5"), enough)
    assert read_status("it.h5") == ("complete", "")
    assert read_errors("it.h5") == {}
    assert all(np.array_equal(values, before[name]) for name, values in read_run("it.h5")[0].items())


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_only_a_step_that_is_given_can_be_halved(held, algorithm):
    plan = held(algorithm, 1e-3)
    if algorithm not in OWN:
        check_verifiable(plan)
        return
    with pytest.raises(StructureError, match=f"--verify halves the communication step, but {algorithm} takes"):
        check_verifiable(plan)


def test_ticks_that_half_a_step_would_miss(files, library):
    """Three of them in a step."""
    system, made = loop(files, controller="SampledPd")
    plan = RunPlan(
        Assembly.read(system, made), ("plant.position",), 1.0, 0.03, SystemRecord("loop", ""), library=library
    )
    with pytest.raises(StructureError, match=r"--verify halves the communication step: pd\.sample_time is 0.01 s"):
        check_verifiable(plan)
    check_verifiable(replace(plan, step_size=0.02))


# At the command line --------------------------------------------------------------------------------------------------


def test_a_run_tells_the_error_of_its_step(hfsa):
    """The error of the base is 0, that of the mass twice the difference to a run at half the step."""
    words = ["mass_on_spring", "--frequency", "15", "--stop", "0.5"]
    code, out, err = hfsa("run", *words, "--step", "2e-4", *HELD_INPUTS, "--verify", "--json")
    assert code == 0
    assert "hfsa: mass.position errs by " in err
    _, half, _ = hfsa("run", *words, "--step", "1e-4", *HELD_INPUTS, "-o", "half.h5", "--json")
    variables = {v["name"]: v for v in json.loads(out)["variables"]}
    whole, halved = (read_run(file)[0]["mass.position"] for file in ("results/mass_on_spring_run.h5", "half.h5"))
    estimate = 2 * np.abs(whole - halved[::2]).max()
    assert variables["mass.position"]["error_estimate"] == pytest.approx(estimate, rel=1e-12)
    assert variables["mass.position"]["relative_error"] == pytest.approx(estimate / np.abs(whole).max(), rel=1e-12)
    assert variables["mass.base.position"]["relative_error"] < 1e-12
    assert {v["error_estimate"] for v in json.loads(half)["variables"]} == {None}
    code, out, _ = hfsa("run", *words, "--step", "2e-4", *HELD_INPUTS, "--verify", "--force")
    assert f"m, error {estimate:.3g} m (" in next(line for line in out.splitlines() if "  mass.position" in line)


def test_a_comparison_tells_the_largest_error_of_each_run(hfsa):
    words = ["compare", "mass_on_spring", "--over", "damping=0.5,20", "--frequency", "15", "--stop", "0.5", "-j", "1"]
    code, out, err = hfsa(*words, *HELD_INPUTS, "--verify", "--json")
    assert code == 0
    for given in json.loads(out)["runs"]:
        (group,) = given["groups"]
        (error,) = [e for name, e in read_errors(given["file"]).items() if name == "mass.position"]
        assert (group["error_estimate"], group["relative_error"]) == (error.absolute, error.relative)
        assert f"hfsa: damping={given['values']['damping']}: mass.position errs by" in err
    code, out, _ = hfsa(*words, *HELD_INPUTS, "--verify", "--force")
    assert f" {100 * error.relative:.3g} % " in out
    code, out, _ = hfsa(*words, *HELD_INPUTS, "--json", "--force")
    assert [given["groups"][0]["error_estimate"] for given in json.loads(out)["runs"]] == [None, None]


@pytest.mark.parametrize("verb", [["run"], ["compare", "--over", "box.at=0.4992"]])
def test_a_verification_that_cannot_go_on(hfsa, box, foreign, verb):
    """The FMU turns NaN in a step that begins after 0.4992 s, which is the last half step alone."""
    words = [verb[0], box(foreign[2], behaviour=6, at=0.4992), *verb[1:], "--verify", "--json"]
    code, out, err = hfsa(*words)
    assert "box: y: not finite at t = 0.5 s: in the run at half the step, 500 us, so that no error is known" in err
    assert code == (4 if verb == ["run"] else 1)
    file = "results/box_run.h5" if verb == ["run"] else json.loads(out)["runs"][0]["file"]
    assert read_status(file) == ("complete", "")
    assert np.isfinite(read_run(file)[0]["box.y"]).all()


@pytest.mark.parametrize("algorithm", ["error_controlled", "monolithic"])
@pytest.mark.parametrize("verb", [["run"], ["compare", "--over", "damping=1,2"]])
def test_what_cannot_be_verified_is_refused_before_it_runs(hfsa, verb, algorithm):
    code, out, err = hfsa(verb[0], "mass_on_spring", *verb[1:], "--algorithm", algorithm, "--verify")
    assert (code, out) == (2, "")
    assert f"but {algorithm} takes" in err
    assert not list(Path().rglob("*.h5"))
