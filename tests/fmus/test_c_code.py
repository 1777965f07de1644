"""Generated C code of an FMU: contents, dependencies, refusals."""

import re
import subprocess
import sys

import casadi as ca
import pytest

from hfsa.components import Model, ModelError
from hfsa.fmus._variables import Role
from hfsa.fmus.c_code import RUNTIME, generate
from hfsa.fmus.compile import CVODE, source_files
from hfsa.fmus.errors import ExportError


def test_the_runtime_holds_no_generated_line_and_the_model_no_other(models, model_name):
    sources = generate(models[model_name]())
    assert set(sources.files) == {"model.c", "model_table.h"}
    runtime = {path.name: path.read_text() for path in RUNTIME.glob("*.[ch]") if path.name != CVODE}
    assert {name: text for name, text in source_files(sources).items() if name in runtime} == runtime
    assert not any(sources.name in text for text in runtime.values())


def test_every_symbol_but_the_table_is_static(models, model_name):
    """Two models can be linked into one program, and nothing but FMI leaves the library."""
    code = "".join(generate(models[model_name]()).files.values())
    allowed = r"static|CASADI_SYMBOL_EXPORT|#|\s|/|\}|const Model hfsa_model"
    assert re.findall(rf"^(?!{allowed})\S.*$", code, re.MULTILINE) == []
    assert "#define CASADI_SYMBOL_EXPORT static" in code


def test_the_table_lists_the_variables(models):
    sources = generate(models["hybrid"]())
    table = sources.files["model_table.h"]
    names = re.findall(r'^  \{"([^"]+)", ROLE_(\w+), (\d+), ([01]),', table, re.MULTILINE)
    assert names == [(v.name, v.role.name, str(v.index), str(int(v.fixed))) for v in sources.variables]
    assert f'.token = "{sources.token}"' in table
    assert ".sample_time = 0," in table
    assert ".solver = &hfsa_exact," in table
    assert ".solver = 0," in generate(models["gain"]()).files["model_table.h"]


@pytest.mark.parametrize(("name", "solver"), [("hybrid", "exact"), ("pendulum", "rosenbrock"), ("van_der_pol", "rk4")])
def test_the_solver_suits_the_model(models, name, solver):
    assert generate(models[name]()).solver == solver


@pytest.mark.parametrize(("name", "varying"), [("pendulum", 1), ("two_link", 1), ("chain", 0), ("gain", 0)])
def test_the_table_says_whether_time_itself_drives_the_model(models, name, varying):
    assert f".time_varying = {varying}," in generate(models[name]()).files["model_table.h"]


def test_texts_survive_as_c_strings(compiled, models):
    """Quotes, backslashes, trigraphs and letters beyond ASCII."""
    model = models["gain"]()
    text = 'a "quoted" \\n, ??/ and µm'
    model.information["remark"] = text
    sources, _ = compiled(model)
    assert [v.start for v in sources.variables if v.role is Role.TEXT] == [text]
    literal = re.search(r'"remark", ROLE_TEXT.*, "(.*)"\}', sources.files["model_table.h"])[1]
    assert re.sub(rb"\\(\d{3})", lambda m: bytes([int(m[1], 8)]), literal.encode()).decode() == text


def test_bounds_and_starts_are_exact():
    m = Model("Exact", "Numbers")
    m.parameter("third", 1 / 3, "1", "A third", min=-1e300, max=0.1 + 0.7)
    row = re.search(r'\{"third".*\}', generate(m).files["model_table.h"])[0]
    assert row == f'{{"third", ROLE_PARAMETER, 0, 0, {1 / 3!r}, {1 / 3!r}, -1e+300, {0.1 + 0.7!r}, 0}}'


# The token ------------------------------------------------------------------------------------------------------------


def test_the_token_is_the_same_in_another_process(models):
    code = (
        "from hfsa.components.mass_on_spring import mass_on_spring as part\n"
        "from hfsa.fmus.c_code import generate\n"
        "print(generate(part()).token)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == generate(models["mass_on_spring"]()).token


def test_the_token_changes_with_every_fact():
    def token(start=1.0, factor=2.0, unit="m", description="In", level="a"):
        m = Model("Facts", "Facts")
        u = m.input("u", unit, description, start=start)
        m.output("y", factor * u, "1", "Out")
        m.information["level"] = level
        return generate(m).token

    changes = [{}, {"start": 2.0}, {"factor": 3.0}, {"unit": "s"}, {"description": "Input"}, {"level": "b"}]
    tokens = [token(**change) for change in changes]
    assert len(set(tokens)) == len(tokens)
    assert all(re.fullmatch(r"[0-9a-f]{64}", one) for one in tokens)
    assert token() == tokens[0]


# What cannot be -------------------------------------------------------------------------------------------------------


def test_an_operation_without_c_is_an_error(capfd):
    """CasADi only warns, and writes #error into the code."""
    m = Model("NoCode", "Holds an iteration that CasADi writes no C for")
    x = m.state("x", "1", "State")
    a, p = ca.MX.sym("a"), ca.MX.sym("p")
    m.der[x] = ca.rootfinder("root", "newton", {"x": a, "p": p, "g": a**3 - p})(0.5, x)
    m.output("y", x, "1", "State")
    with pytest.raises(ExportError, match=r"NoCode: CasADi generates no C .* Newton"):
        generate(m)


def test_the_exact_solver_is_for_linear_models():
    m = Model("Square", "Square")
    x = m.state("x", "1", "State")
    m.der[x] = x**2
    m.output("y", x, "1", "State")
    m.solver = "exact"
    with pytest.raises(ExportError, match="Square: solver 'exact' is for linear models"):
        generate(m)


def test_an_incomplete_model_is_refused():
    m = Model("Half", "A state without equation")
    m.state("x", "1", "State")
    with pytest.raises(ModelError, match="state x has no equation"):
        generate(m)
