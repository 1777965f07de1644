"""The verb `identify`: table, JSON, exit codes, and options that are those of the function."""

import inspect
import typing

import pytest
from command_line import strict_json

from hfsa.cosim.commands.identify import identify as verb
from hfsa.cosim.experiments.identify import identify
from hfsa.cosim.results.inertia import Identification

MANOEUVRE = ["run", "sdelta_manoeuvre", "--stop", "0.2", "-o", "m.h5"]


def test_run_and_identify_work_end_to_end(hfsa):
    assert hfsa(*MANOEUVRE)[0] == 0
    code, out, err = hfsa("identify", "m.h5")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "m_inertia.h5: inertia of robot; measured motion, linear equations"
    mass = next(line for line in lines if line.startswith("m "))
    assert mass.split()[1] == mass.split()[3] == "4.4857"
    assert "mass centre" in out
    assert "28.256 mm" in out
    assert "rank 10 of 10, condition number " in out
    code, out, _ = hfsa("identify", "m.h5", "--of", "payload", "-o", "p.h5", "--json")
    data = strict_json(out)
    assert code == 0
    values = {entry["name"]: entry["value"] for entry in data["parameters"]}
    assert values["m"] == pytest.approx(3.0)
    assert values["Izz"] == pytest.approx(3.0 * 0.072**2 / 6)
    assert data["mass_center"] == pytest.approx([0, 0, 0.04225], abs=1e-12)
    assert (data["file"], data["of"], data["rank"], data["alone"]) == ("p.h5", "payload", 10, None)
    assert Identification.read("p.h5").value[0] == values["m"]


@pytest.mark.slow
def test_what_is_not_seen_is_said_with_exit_code_1(hfsa):
    assert hfsa(*MANOEUVRE, "-p", "rotation=0,0,0", "-p", "position=0,0,1e-3")[0] == 0
    code, out, _ = hfsa("identify", "m.h5")
    assert code == 1
    assert "not seen by this manoeuvre: mcz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz" in out
    assert "rank 3 of 10" in out
    code, out, _ = hfsa("identify", "m.h5", "--force", "--json")
    assert code == 1
    values = {entry["name"]: entry["value"] for entry in strict_json(out)["parameters"]}
    assert values["m"] == pytest.approx(4.4857)
    assert values["Izz"] is None


@pytest.mark.slow
def test_the_commanded_motion_comes_with_a_warning(hfsa):
    assert hfsa(*MANOEUVRE)[0] == 0
    code, _, err = hfsa("identify", "m.h5", "--motion", "commanded")
    assert code == 0
    assert "assumed to be the commanded one" in err


def test_missing_signals_are_an_error_of_usage(hfsa):
    assert hfsa("run", "sdelta_shaker", "--stop", "0.01", "-o", "s.h5")[0] == 0
    code, out, err = hfsa("identify", "s.h5")
    assert (code, out) == (2, "")
    assert "s.h5 lacks robot.platform.acceleration[1..3]" in err
    assert "hfsa run SCENE --signal robot.platform.acceleration[1..3]" in err


def test_the_options_are_those_of_the_function():
    own, theirs = (inspect.signature(function).parameters for function in (verb, identify))
    assert set(own) - {"output", "json"} == set(theirs) - {"path", "warn"}
    hints = [typing.get_type_hints(function) for function in (verb, identify)]
    for name in ("of", "motion", "regressor"):
        assert hints[0][name] == hints[1][name]
        assert own[name].default == theirs[name].default
