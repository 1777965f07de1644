"""From a model to the C that is its own: CasADi's functions, and the constant table that the runtime reads.

Everything else in an FMU is the hand-written runtime beside this file, the same for every model. `Sources.files` holds
the generated part alone; `compile.source_files` joins both.
"""

import hashlib
import math
import re
from dataclasses import dataclass
from pathlib import Path

import casadi as ca

from hfsa.components import Model
from hfsa.components._modelling.functions import ARGUMENTS, Functions, functions
from hfsa.fmus._variables import Role, Variable, solver_of, variables
from hfsa.fmus.errors import ExportError

RUNTIME = Path(__file__).parent / "runtime"

_PROLOGUE = """\
/* Equations of {name}, generated; the table of its variables follows behind them. */

#define CASADI_SYMBOL_EXPORT static
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wunused-function"
#endif

"""


@dataclass(frozen=True)
class Sources:
    """The generated C of one model, and the facts that the model description is written from.

    Attributes:
        name: model identifier, also the name of the shared library.
        files: text by file name.
        token: instantiation token (FMI 2: guid), a hash of runtime, generated code and variables.
        variables: in the order of their value references.
        solver: Co-Simulation solver, one of `components._model.SOLVERS`; also named where there are no states.
        functions: the model as CasADi functions.
    """

    name: str
    files: dict[str, str]
    token: str
    variables: list[Variable]
    solver: str
    functions: Functions

    @property
    def needs_cvode(self) -> bool:
        """Whether there is something to solve, and SUNDIALS solves it."""
        return self.solver == "cvode" and any(v.role is Role.STATE for v in self.variables)

    def listed(self, version: int) -> list[Variable]:
        """Return the variables that a version's model description has.

        FMI 2 sets derivatives of inputs with a function; FMI 3, which has none, shows them as parameters, behind all
        other variables.
        """
        return [v for v in self.variables if version == 3 or v.role is not Role.INPUT_DERIVATIVE]


def generate(model: Model) -> Sources:
    """Return the C sources of a complete model.

    Raises `ModelError` where the model is not complete, and `ExportError` where CasADi has no C for one of its
    operations or the model asks for a solver that does not suit it.
    """
    made = functions(model)
    solver = solver_of(model, made)
    if solver == "exact" and not made.is_linear:
        raise ExportError(
            f"{model.name}: solver 'exact' is for linear models; this one needs 'rosenbrock', 'rk4' or 'cvode'"
        )
    listed = variables(model, made)
    equations = _PROLOGUE.format(name=model.name) + _casadi_code(model.name, made) + '\n#include "model_table.h"\n'
    token = _token(equations, listed)
    files = {"model.c": equations, "model_table.h": _table(model.name, token, made, listed, solver)}
    return Sources(model.name, files, token, listed, solver, made)


def _casadi_code(name: str, made: Functions) -> str:
    """Return the C that CasADi generates of functions; `ExportError` for what it has no C for."""
    options = {"casadi_real": "double", "casadi_int": "int", "static_aux": True}
    generator = ca.CodeGenerator("model.c", options)
    for function in made:
        generator.add(function)
    code = generator.dump()
    refused = re.findall(r"^\s*#error\s*(.*)$", code, re.MULTILINE)
    if refused:
        reasons = "; ".join(sorted(set(refused)))
        raise ExportError(f"{name}: CasADi generates no C for an operation of this model: {reasons}")
    return code


def _token(equations: str, listed: list[Variable]) -> str:
    """Return a hash of equations, variables and runtime: the same for the same FMU."""
    digest = hashlib.sha256()
    for path in sorted(RUNTIME.glob("*.[ch]")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    digest.update(equations.encode())
    digest.update("\n".join(repr(variable) for variable in listed).encode())
    return digest.hexdigest()


def _table(name: str, token: str, made: Functions, listed: list[Variable], solver: str) -> str:
    """Return the constant table, C99 designated initialisers of `runtime/model.h`."""
    pattern = made.jacobian.sparsity_out(0)
    sizes = {role: sum(v.role is role for v in listed) for role in Role}
    sample_time = next((v.index for v in listed if v.role is Role.PARAMETER and v.name == "sample_time"), -1)
    work = [max(sizes) for sizes in zip(*[(f.sz_arg(), f.sz_res(), f.sz_iw(), f.sz_w()) for f in made], strict=True)]
    lines = [
        f"/* Table of {name}: what runtime/model.h declares. */",
        "",
        '#include "model.h"',
        "",
        "static const Variable variables[] = {",
        *[f"  {_row(v)}," for v in listed],
        "};",
        "",
        f"static const int jacobian_columns[] = {_integers(pattern.colind())};",
        f"static const int jacobian_rows[] = {_integers(pattern.row())};",
        "",
        "const Model hfsa_model = {",
        f"  .name = {_string(name)},",
        f"  .token = {_string(token)},",
        "  .variables = variables,",
        "  .size = {" + ", ".join(f"[ROLE_{role.name}] = {size}" for role, size in sizes.items() if size) + "},",
        f"  .variable_count = {len(listed)},",
        f"  .sample_time = {sample_time},",
        f"  .time_varying = {int(made.rhs.jac_sparsity(0, ARGUMENTS.index('t')).nnz() > 0)},",
        f"  .solver = {f'&hfsa_{solver}' if sizes[Role.STATE] else '0'},",
        *[f"  .{f.name()} = {f.name()}," for f in made],
        "  .jacobian_columns = jacobian_columns,",
        "  .jacobian_rows = jacobian_rows,",
        f"  .jacobian_entries = {pattern.nnz()},",
        "  .arg_size = {}, .res_size = {}, .iw_size = {}, .w_size = {},".format(*work),
        "};",
        "",
    ]
    return "\n".join(lines)


def _row(v: Variable) -> str:
    """Return a variable as a row of the table in C."""
    text = _string(v.start) if isinstance(v.start, str) else "0"
    start = v.start if isinstance(v.start, float | int) else 0.0
    low = -math.inf if v.min is None else v.min
    high = math.inf if v.max is None else v.max
    numbers = ", ".join(_number(x) for x in (start, v.nominal, low, high))
    return f"{{{_string(v.name)}, ROLE_{v.role.name}, {v.index}, {int(v.fixed)}, {numbers}, {text}}}"


def _number(value: float) -> str:
    """Return a C constant that is exactly this double."""
    if math.isinf(value):
        return "HUGE_VAL" if value > 0 else "-HUGE_VAL"
    return repr(float(value))


def _integers(values: list[int]) -> str:
    """Return an initialiser; C has no empty arrays, so an empty one holds a 0 that nothing reads."""
    return "{" + ", ".join(str(v) for v in values or [0]) + "}"


def _string(text: str) -> str:
    """Return a C string constant; bytes outside printable ASCII as octal, which ends after three digits."""
    return '"' + "".join(chr(b) if 32 <= b < 127 and b not in b'"\\?' else f"\\{b:03o}" for b in text.encode()) + '"'
