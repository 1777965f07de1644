"""Verbs on parts: list, analyze, export and check."""

import re
import zipfile
from pathlib import Path

import numpy as np
from command_line import strict_json
from fmpy import read_model_description


def test_list_names_every_part_and_scene(hfsa):
    code, out, _ = hfsa("list")
    assert code == 0
    for word in (
        "components",
        "controllers",
        "scenes",
        "sdelta (rigid, cartesian, generalized, nonlinear)",
        "drive[1..3].slide",
        "sdelta_shaker",
    ):
        assert word in out
    code, out, _ = hfsa("list", "--json")
    parts = {entry["name"]: entry for entry in strict_json(out)["components"]}
    assert parts["sdelta"]["levels"] == ["rigid", "cartesian", "generalized", "nonlinear"]
    assert parts["sdelta"]["has_analysis"]
    assert {"name": "base.position", "unit": "m"}.items() <= parts["mass_on_spring"]["inputs"][0].items()
    assert {"mass_on_spring", "sdelta_shaker"} <= {scene["name"] for scene in strict_json(out)["scenes"]}


def test_list_of_one_part_has_its_arguments(hfsa):
    code, out, _ = hfsa("list", "sdelta")
    assert code == 0
    assert "-p posture.position=0,0,0.15" in out
    assert "-p damping_ratio=0.01" in out
    assert "ch3_full, ch3_rods, ch4, ch4_full" in out
    assert "sine_source" not in out


def test_analyze_answers_with_the_keys_of_the_robot(hfsa):
    words = ["-p", "posture.rotation=10,5,8", "-p", "posture.position=0.005,0.003,0.155", "-p", "stiffness=ch4"]
    code, out, _ = hfsa("analyze", "sdelta", "--level", "cartesian", *words, "--json")
    assert code == 0
    numbers = strict_json(out)
    assert {"stiffness_S", "mass_C", "natural_frequencies_hz", "modal_points_S", "kappa", "motor_angles"} <= set(
        numbers
    )
    assert set(numbers["units"]) == set(numbers) - {"units"}
    assert numbers["units"]["stiffness_S"] == "N.m/rad, N; N, N/m"
    assert np.shape(numbers["stiffness_S"]) == (6, 6)
    assert numbers["natural_frequencies_hz"] == sorted(numbers["natural_frequencies_hz"])
    code, out, _ = hfsa("analyze", "sdelta")
    assert code == 0
    assert "natural_frequencies_hz [Hz] =\n  23.58966  23.58966  24.54538  95.92521  95.92521  161.0828\n" in out
    assert "kappa = 25304.09 N\n" in out
    # in the symmetric posture half of the entries are rounding noise
    assert "  2488.029          0         0          0  29569.96         0\n" in out
    assert not re.search(r"e-[12]\d|-0(?![.\d])", out)


def test_an_analysis_lists_its_arguments(hfsa):
    """Some arguments belong to the FMU alone, some to the analysis; a level that it does not depend on is accepted."""
    code, out, _ = hfsa("list", "rrr_stage")
    assert code == 0
    both, models, own = (
        part.splitlines() for part in re.split(r" take\n|analyze alone takes\n|the FMU alone takes\n", out)[1:]
    )
    assert any("-p stack.stiffness=" in line for line in both)
    assert any("-p kinematics=nominal" in line for line in both)
    assert {line.split("=")[0].strip() for line in own if "-p " in line} >= {"-p elongation", "-p voltage"}
    for line in (line for line in models if "-p " in line):
        name = line.split("=")[0].split()[-1]
        code, _, err = hfsa("analyze", "rrr_stage", "-p", f"{name}=1")
        assert code == 2
        assert f"rrr_stage: {name} is an argument of its FMU, which its analysis does not take" in err
        assert "kinematics" in err
        assert "voltage" in err
    code, out, _ = hfsa("list", "rrr_stage", "--json")
    (entry,) = strict_json(out)["components"]
    taken_by = {a["name"]: a["taken_by"] for a in entry["arguments"]}
    assert taken_by["kinematics"] == taken_by["causality"] == ["the FMU", "analyze"]
    assert taken_by["elongation"] == taken_by["voltage"] == ["analyze"]
    answers = [
        hfsa("analyze", "c_drive", *words)[1] for words in ((), ("--level", "ideal"), ("-p", "level=rigid_shaft"))
    ]
    assert answers[0] == answers[1] == answers[2] != ""
    code, _, err = hfsa("analyze", "c_drive", "--level", "idal")
    assert code == 2
    assert "c_drive: level is 'idal', expected one of ideal, rotor, rigid_shaft, compliant_shaft" in err
    code, _, err = hfsa("analyze", "sdelta", "--level", "rigid", "-p", "level=cartesian")
    assert code == 2
    assert "-p level is given twice: rigid and cartesian" in err


def test_variants_in_one_folder_do_not_overwrite_each_other(hfsa, tmp_path):
    for level in ("sampled", "continuous"):
        assert hfsa("export", "pd", "--level", level, "-o", tmp_path, "--fmi", 2)[0] == 0
    names = {file.name: read_model_description(file).coSimulation.modelIdentifier for file in tmp_path.iterdir()}
    assert names == {"Pd.fmi2.fmu": "Pd", "Pd_continuous.fmi2.fmu": "Pd_continuous"}


def test_export_writes_files_that_check_finds_clean(hfsa, tmp_path):
    code, out, _ = hfsa("export", "mass_on_spring", "-p", "damping=1", "-o", tmp_path / "built")
    files = [Path(line) for line in out.split()]
    assert code == 0
    assert [file.name for file in files] == ["MassOnSpring_damping_1.fmi2.fmu", "MassOnSpring_damping_1.fmi3.fmu"]
    code, out, _ = hfsa("check", *files)
    assert (code, out.count("no problem found")) == (0, 2)
    broken = tmp_path / "broken.fmu"
    broken.write_bytes(files[0].read_bytes()[:2000])
    code, out, _ = hfsa("check", broken, files[1], "--json")
    assert code == 1
    first, second = strict_json(out)
    assert first["problems"]
    assert second["problems"] == []
    code, out, _ = hfsa("export", "mass_on_spring", "--fmi", "3", "-o", tmp_path / "three", "--json")
    assert [Path(file).name for file in strict_json(out)["files"]] == ["MassOnSpring.fmi3.fmu"]


def test_reference_results_are_added_on_request(hfsa, tmp_path):
    assert hfsa("export", "mass_on_spring", "--fmi", 3, "-o", tmp_path, "--reference-results")[0] == 0
    with zipfile.ZipFile(tmp_path / "MassOnSpring.fmi3.fmu") as archive:
        assert "extra/org.fmi-standard.fmi-ls-ref/fmi-ls-manifest.xml" in archive.namelist()
    code, _, err = hfsa("export", "mass_on_spring", "--ssp", "--reference-results", "-o", tmp_path / "it.ssp")
    assert code == 2
    assert "--reference-results are of an FMU, not of a scene" in err


def test_platforms_are_named(hfsa, tmp_path):
    code, _, err = hfsa("export", "mass_on_spring", "--platforms", "win64", "-o", tmp_path)
    assert code == 2
    assert "platform 'win64' is not one of here, all, x86_64-linux" in err
    code, _, err = hfsa("export", "mass_on_spring", "--platforms", "aarch64-linux", "--fmi", 2, "-o", tmp_path)
    assert code == 2
    assert "FMI 2 has no name for aarch64-linux" in err
    code, out, _ = hfsa("export", "mass_on_spring", "--platforms", "here", "--fmi", 2, "-o", tmp_path)
    assert code == 0
    code, out, _ = hfsa("check", out.strip())
    assert re.search(r"no problem found, holds \w+, sources\n$", out)
