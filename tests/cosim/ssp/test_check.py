"""Verb `check` on packages: those of hfsa have no problem, others are told what and where."""

from ssp_by_hand import EXPERIMENT, PLAIN

from hfsa.cosim.experiments.package import package


def test_a_package_of_ours_has_no_problem(hfsa, tmp_path):
    package("mass_on_spring", path=tmp_path / "mass.ssp", warn=lambda _: None)
    assert hfsa("check", "mass.ssp") == (0, "mass.ssp: no problem found\n", "")


def test_what_breaks_the_schema_is_told(hfsa, packages):
    packages(PLAIN.format(plant="<ssd:Surprise/>"), EXPERIMENT)
    code, out, _ = hfsa("check", "model.ssp")
    assert code == 1
    assert out.startswith("model.ssp: SystemStructure.ssd, line 3: Element")
    assert "Surprise" in out


def test_what_cannot_be_simulated_is_told(hfsa, packages):
    packages(PLAIN.format(plant="").replace("Pd.fmu", "Pdd.fmu"))
    code, out, _ = hfsa("check", "model.ssp")
    assert (code, out.count("\n")) == (1, 1)
    assert "line 4: there is no resources/Pdd.fmu in the archive" in out
