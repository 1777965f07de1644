"""Misuse of the model core is an error that names the quantity; good use keeps every fact."""

import casadi as ca
import pytest

from hfsa.components import Model, ModelError
from hfsa.components._modelling.model import Kind, expand


@pytest.fixture
def m() -> Model:
    model = Model("Example", "One state, one input")
    x = model.state("mass.position", "m", "Position", nominal=1e-3)
    u = model.input("drive[1..3].slide", "m", "Slides", start=[1.0, 2.0, 3.0])
    model.parameter("stiffness", 5.0, "N/m", "Stiffness", min=0)
    model.der[x] = u[0] - x
    model.output("y", x, "m", "Output")
    return model


def test_a_range_declares_one_based_members(m):
    assert expand("motor[1..3].angle") == ["motor[1].angle", "motor[2].angle", "motor[3].angle"]
    assert [(q.name, q.start) for q in m.of(Kind.INPUT)] == [
        ("drive[1].slide", 1.0),
        ("drive[2].slide", 2.0),
        ("drive[3].slide", 3.0),
    ]
    m.check()


@pytest.mark.parametrize(
    ("misuse", "message"),
    [
        (lambda m: m.input("y", "m", "again"), "y is declared twice"),
        (lambda m: m.input("u", "N*m", "bad unit"), "u: unit 'N\\*m'.*Modelica"),
        (lambda m: m.input("u", "Nm", "bad unit"), "u: unit 'Nm'"),
        (lambda m: m.input("x[0]", "m", "zero based"), "x\\[0\\].*1-based"),
        (lambda m: m.parameter("p", -1.0, "m", "below", min=0), "p is -1 m, expected 0 to inf m"),
        (lambda m: m.parameter("p", float("nan"), "m", "nan"), "p has start value nan"),
        (lambda m: m.state("s", "m", "no scale", nominal=0.0), "s has nominal value 0"),
        (lambda m: m.input("v[1..2]", "m", "sizes", start=[1.0]), "v\\[1..2\\] has 1 start values, expected 2"),
        (lambda m: m.output("z[1..2]", m.time, "m", "sizes"), "z\\[1..2\\] has shape \\(1, 1\\), expected \\(2, 1\\)"),
        (lambda m: m.der.__setitem__(m["drive[1].slide"].expression, 0), "der of drive\\[1\\].slide: not a state"),
        (lambda m: m.der.__setitem__(ca.SX.sym("mass.position"), 0), "der of mass.position: not a state"),
        (lambda m: m.der.__setitem__(m["mass.position"].expression, 0), "der\\[mass.position\\] is given twice"),
        (lambda m: m.sampled_state("k", "1", "no ticks"), "k is sampled.*sample_time"),
        (lambda m: m["stifness"], "no quantity 'stifness'; did you mean stiffness"),
        (lambda m: m.set_start("stiffness", -2.0), "stiffness is -2 N/m, expected 0 to inf"),
        (lambda m: m.set_start("y", 1.0), "y is an output"),
    ],
)
def test_misuse_names_the_quantity(m, misuse, message):
    with pytest.raises(ModelError, match=message):
        misuse(m)


def test_an_incomplete_model_is_refused():
    m = Model("Incomplete", "A state without an equation")
    m.state("angle", "rad", "Angle")
    with pytest.raises(ModelError, match=r"state angle has no equation; write m\.der"):
        m.check()


def test_a_foreign_symbol_is_refused(m):
    m.output("foreign", ca.SX.sym("stiffness"), "N/m", "Same name, another model's symbol")
    with pytest.raises(ModelError, match="foreign uses stiffness"):
        m.check()


def test_a_mass_matrix_of_the_wrong_shape_is_refused():
    m = Model("Motion", "Two rates, a 1x1 mass")
    v = m.state("rate[1..2]", "rad/s", "Rates")
    with pytest.raises(ModelError, match=r"motion of rate\[1\], rate\[2\].*\(2, 2\) and \(2, 1\)"):
        m.motion(v, mass=ca.SX(1.0), force=-v)


def test_a_mass_may_not_depend_on_its_own_acceleration():
    m = Model("Motion", "Mass that depends on acceleration")
    v = m.state("rate", "m/s", "Rate")
    k = ca.SX.sym("der(rate)")
    m.motion(v, mass=1 + k, force=-v)
    with pytest.raises(ModelError, match="motion of rate"):
        m.check()
