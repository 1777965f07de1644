"""FMUs of hfsa in foreign tools: read, checked, and stepped with the right numbers.

Four readers of the description that share no code: fmpy and fmutool (two XML stacks), FMI Library (inside libcosim) and
CasADi. Three that run it: fmpy (both interfaces), ecos (FMI 2 and 3), libcosim (FMI 2).
"""

import logging
import zipfile
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.model_description import read_model_description
from fmpy.simulation import instantiate_fmu
from scipy.linalg import expm

from hfsa.components import Model
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.model import Kind
from hfsa.components.sine_source import sine_source

VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
STEPS = 20


def excited(model: Model) -> dict[str, float]:
    """Input values a little beside their starts, all different."""
    return {q.name: q.start + 1e-3 * q.nominal * (k + 1) for k, q in enumerate(model.of(Kind.INPUT))}


def outputs(model: Model) -> list[str]:
    return [q.name for q in model.of(Kind.OUTPUT, Kind.SAMPLED_OUTPUT)]


def step_size(file: Path) -> float:
    return float(read_model_description(file).defaultExperiment.stepSize)


class Stepped:
    """One Co-Simulation instance driven by its raw calls: what the other importers are compared with."""

    def __init__(self, file: Path, folder: Path, values: dict[str, float]):
        with zipfile.ZipFile(file) as archive:
            archive.extractall(folder)
        self.description = read_model_description(folder)
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.fmu = instantiate_fmu(folder, self.description, "CoSimulation")
        self.two = self.description.fmiMajorVersion == 2
        if self.two:
            self.fmu.setupExperiment(startTime=0.0)
        self.write(values)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def write(self, values):
        setter = self.fmu.setReal if self.two else self.fmu.setFloat64
        setter([self.references[name] for name in values], list(values.values()))

    def read(self, names):
        getter = self.fmu.getReal if self.two else self.fmu.getFloat64
        return np.array(getter([self.references[name] for name in names]))

    def run(self, names, h, steps=STEPS):
        rows = []
        for k in range(steps):
            self.fmu.doStep(k * h, h)
            rows.append(self.read(names))
        return np.array(rows)


@pytest.fixture(scope="module")
def reference(part_model, part_files, tmp_path_factory):
    """Outputs of a part after each of 20 steps, by fmpy and FMI 2."""
    instance = Stepped(part_files[2], tmp_path_factory.mktemp("reference"), excited(part_model))
    return instance.run(outputs(part_model), step_size(part_files[2]))


def test_fmi3_gives_the_same_bits_as_fmi2(part_model, part_files, reference, tmp_path):
    found = Stepped(part_files[3], tmp_path, excited(part_model)).run(outputs(part_model), step_size(part_files[3]))
    np.testing.assert_array_equal(found, reference)


# Readers ----------------------------------------------------------------------------------------------------------


@VERSIONS
def test_fmutool_finds_nothing(part_files, version, caplog):
    from fmu_manipulation_toolbox.checker import get_checkers
    from fmu_manipulation_toolbox.operations import FMU

    with caplog.at_level(logging.ERROR, "fmu_manipulation_toolbox"), FMU(str(part_files[version])) as fmu:
        for checker in get_checkers():
            fmu.apply_operation(checker())
    assert [record.message for record in caplog.records] == []


def imported(model: Model, file: Path, folder: Path) -> ca.DaeBuilder:
    """The FMU as CasADi reads it, unpacked and unchanged."""
    with zipfile.ZipFile(file) as archive:
        archive.extractall(folder)
    return ca.DaeBuilder(model.name, str(folder))


def point(model: Model) -> list[np.ndarray]:
    """A point (x, u, p) off the start, by kind."""
    rng = np.random.default_rng(0)
    columns = []
    for kind, spread in ((Kind.STATE, 0.3), (Kind.INPUT, 0.3), (Kind.PARAMETER, 0.0)):
        quantities = model.of(kind)
        start, nominal = np.array([[q.start, q.nominal] for q in quantities]).reshape(-1, 2).T
        columns.append(start + spread * 1e-3 * nominal * rng.standard_normal(len(quantities)))
    return columns


@VERSIONS
def test_casadi_imports_what_casadi_wrote(part_model, part_files, version, tmp_path):
    """Derivatives, outputs and Jacobians of the binary are those of the symbols it was made from."""
    dae = imported(part_model, part_files[version], tmp_path)
    assert list(dae.x()) == [q.name for q in part_model.of(Kind.STATE)]
    assert list(dae.u()) == [q.name for q in part_model.of(Kind.INPUT)]
    assert list(dae.y()) == outputs(part_model)

    made = functions(part_model)
    x, u, p = point(part_model)
    z = [q.start for q in part_model.of(Kind.SAMPLED_STATE)]
    tunable = np.array([not q.fixed for q in part_model.of(Kind.PARAMETER)], dtype=bool)
    rates = np.zeros(2 * len(u) if version == 3 else 0)
    here = [0.1, x, u, np.concatenate([p[tunable], rates])]
    found = dae.create("f", ["t", "x", "u", "p"], ["ode", "y"])(*here)
    close(found[0], made.rhs(0.1, x, z, u, p))
    close(found[1][: len(part_model.of(Kind.OUTPUT)), :], made.out(0.1, x, z, u, p))

    blocks = {
        "jac_ode_x": (made.rhs, 1),
        "jac_ode_u": (made.rhs, 3),
        "jac_y_x": (made.out, 1),
        "jac_y_u": (made.out, 3),
    }
    sizes = {1: len(x), 3: len(u)}
    blocks = {
        name: block for name, block in blocks.items() if sizes[block[1]]
    }  # CasADi dies of a block without columns
    for name, (function, argument) in blocks.items():
        expected = function.jacobian()(0.1, x, z, u, p, 0)
        expected = expected[argument] if isinstance(expected, tuple) else expected
        slope = dae.create("J", ["t", "x", "u", "p"], [name])(*here)
        close(slope[: expected.shape[0], :], expected)


def close(found, expected):
    found, expected = np.array(ca.DM(found)), np.array(ca.DM(expected))
    assert found.shape == expected.shape
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-10 * np.abs(expected).max(initial=0.0))


# Masters ----------------------------------------------------------------------------------------------------------


def instance_names(values):
    return {f"part::{name}": value for name, value in values.items()}


@VERSIONS
def test_a_part_steps_in_ecos(part_model, part_files, reference, ecos, version):
    system = ecos({"part": part_files[version]}, step_size(part_files[2]), instance_names(excited(part_model)))
    found = system.run([f"part::{name}" for name in outputs(part_model)], STEPS)
    np.testing.assert_allclose(found, reference, rtol=1e-9, atol=1e-12)


def test_a_part_steps_in_libcosim(part_model, part_files, reference, libcosim):
    system = libcosim({"part": part_files[2]}, step_size(part_files[2]), instance_names(excited(part_model)))
    found = system.run([f"part::{name}" for name in outputs(part_model)], STEPS)
    np.testing.assert_allclose(found, reference, rtol=1e-9, atol=1e-12)


@pytest.fixture(scope="module")
def pair(exported, mass_on_spring_files):
    """The files of a sine and of the mass on a spring that it drives, by FMI version."""
    sources = exported(sine_source(unit="m"))
    return {v: {"source": file, "mass": mass_on_spring_files[v]} for v, file in sources.items()}


PAIR_VALUES = {"source::amplitude": 1e-3, "source::frequency": 10.0}
PAIR_CONNECTIONS = (("source::value", "mass::base.position"),)


def both_at_once(files, folder, h, steps):
    """Get all, set all, step all: what ecos and libcosim do."""
    source = Stepped(files["source"], folder / "source", {"amplitude": 1e-3, "frequency": 10.0})
    mass = Stepped(files["mass"], folder / "mass", {})
    rows = []
    for k in range(steps):
        mass.write({"base.position": source.read(["value"])[0]})
        source.fmu.doStep(k * h, h)
        mass.fmu.doStep(k * h, h)
        rows.append(mass.read(["position"]))
    return np.array(rows)


@VERSIONS
def test_a_connected_pair_in_ecos(pair, ecos, version, tmp_path):
    h, steps = 1e-3, 700
    found = ecos(pair[version], h, PAIR_VALUES, PAIR_CONNECTIONS).run(["mass::position"], steps)
    expected = both_at_once(pair[version], tmp_path, h, steps)
    assert np.abs(expected).max() > 1e-3
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_a_connected_pair_in_libcosim(pair, libcosim, tmp_path):
    h, steps = 1e-3, 700
    found = libcosim(pair[2], h, PAIR_VALUES, PAIR_CONNECTIONS).run(["mass::position"], steps)
    expected = both_at_once(pair[2], tmp_path, h, steps)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


# Right numbers ----------------------------------------------------------------------------------------------------

BASE = 1e-3
STOP = 0.5


def exact(t: float) -> float:
    """Position of the mass on a spring, from rest, the base at 1 mm: the solution of its linear equation."""
    stiffness, damping, mass = 1e4, 0.5, 1.0
    A = np.array([[0, 1, 0], [-stiffness / mass, -damping / mass, stiffness / mass * BASE], [0, 0, 0]])
    return (expm(A * t) @ [0, 0, 1])[0]


@VERSIONS
@pytest.mark.parametrize(("interface", "accuracy"), [("CoSimulation", 1e-12), ("ModelExchange", 1e-5)])
def test_fmpy_simulates_the_mass_on_a_spring(mass_on_spring_files, version, interface, accuracy):
    found = simulate_fmu(
        mass_on_spring_files[version],
        fmi_type=interface,
        start_values={"base.position": BASE},
        stop_time=STOP,
        output_interval=0.005,
        relative_tolerance=1e-9,
        output=["position"],
    )
    assert len(found) == 101
    expected = np.array([exact(t) for t in found["time"]])
    np.testing.assert_allclose(found["position"], expected, rtol=0, atol=accuracy * BASE)


@VERSIONS
def test_both_interfaces_agree(part_model, part_files, version):
    """Between two ticks, so that both have had the same ones."""
    h = step_size(part_files[version])
    ends = [
        simulate_fmu(
            part_files[version],
            fmi_type=interface,
            start_values=excited(part_model),
            stop_time=10.5 * h,
            output_interval=h / 2,
            relative_tolerance=1e-8,
            output=outputs(part_model),
        )[-1]
        for interface in ("CoSimulation", "ModelExchange")
    ]
    one, other = (np.array(list(end)) for end in ends)
    np.testing.assert_allclose(one, other, rtol=1e-4, atol=1e-5 * np.abs(one).max())  # fmpy's CVODE errs by 3e-5
