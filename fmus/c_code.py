"""Generated C code of a model: CasADi's functions, and the constant table for the runtime.

All other code of an FMU is the hand-written runtime in `runtime/`, the same for every model. `Sources.files` contains
the generated code only; `compile.source_files` adds the runtime.
"""

import hashlib
import math
import re
from dataclasses import dataclass
from pathlib import Path

import casadi as ca

from hfsa.components import Model
from hfsa.components._modelling.functions import ARGUMENTS, Functions, functions
from hfsa.fmus._solvers import SOLVERS
from hfsa.fmus._variables import Role, Variable, solver_of, variables
from hfsa.fmus.errors import ExportError

RUNTIME = Path(__file__).parent / "runtime"

_UNLISTED = {2: Role.INPUT_DERIVATIVE, 3: Role.TEXT}
"""Role of the variables that the description of an FMI version leaves out."""

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
    """The generated C code of one model, and the data of its model description.

    Attributes:
        name: model identifier, also the name of the shared library.
        files: text of the generated files by file name.
        token: instantiation token (FMI 2: guid), a hash of runtime, generated code and variables.
        variables: variables in the order of their value references.
        solver: Co-Simulation solver, one of `SOLVERS`, also for a model without states.
        functions: CasADi functions of the model.
    """

    name: str
    files: dict[str, str]
    token: str
    variables: list[Variable]
    solver: str
    functions: Functions

    @property
    def needs_cvode(self) -> bool:
        """Whether the model has states and the solver CVODE."""
        return self.solver == "cvode" and any(v.role is Role.STATE for v in self.variables)

    def listed(self, version: int) -> list[Variable]:
        """Return the variables in the model description of an FMI version.

        FMI 2 has a function to set derivatives of inputs. FMI 3 has none, so they are parameters. Texts are variables
        of FMI 2 and annotations of FMI 3, because some tools that import FMI 3 know no variable of type String.
        """
        return [v for v in self.variables if v.role is not _UNLISTED[version]]


def generate(model: Model) -> Sources:
    """Return the C sources of a complete model.

    Raises:
        ModelError: an incomplete model.
        ExportError: an operation without a C implementation in CasADi; solver `exact` for a nonlinear model.
    """
    model_functions = functions(model)
    solver = solver_of(model, model_functions)
    if solver == "exact" and not model_functions.is_linear:
        *others, last = (repr(name) for name in SOLVERS if name != "exact")
        needs = f"{', '.join(others)} or {last}"
        raise ExportError(f"{model.name}: solver 'exact' is for linear models; this one needs {needs}")
    listed = variables(model, model_functions)
    equations = (
        _PROLOGUE.format(name=model.identifier)
        + _casadi_code(model.name, model_functions)
        + '\n#include "model_table.h"\n'
    )
    token = _token(equations, listed)
    files = {"model.c": equations, "model_table.h": _table(model.name, token, model_functions, listed, solver)}
    return Sources(model.identifier, files, token, listed, solver, model_functions)


def _casadi_code(name: str, model_functions: Functions) -> str:
    """Return the C code of CasADi functions; `ExportError` for operations without a C implementation in CasADi."""
    options = {"casadi_real": "double", "casadi_int": "int", "static_aux": True}
    generator = ca.CodeGenerator("model.c", options)
    for function in model_functions:
        generator.add(function)
    code = generator.dump()
    refused = re.findall(r"^\s*#error\s*(.*)$", code, re.MULTILINE)
    if refused:
        reasons = "; ".join(sorted(set(refused)))
        raise ExportError(f"{name}: CasADi generates no C for an operation of this model: {reasons}")
    return code


def _token(equations: str, listed: list[Variable]) -> str:
    """Return a hash of equations, variables and runtime, equal for equal FMUs."""
    digest = hashlib.sha256()
    for path in sorted(RUNTIME.glob("*.[ch]")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    digest.update(equations.encode())
    digest.update("\n".join(repr(variable) for variable in listed).encode())
    return digest.hexdigest()


def _table(name: str, token: str, model_functions: Functions, listed: list[Variable], solver: str) -> str:
    """Return the constant table as C99 designated initialisers of the structures in `runtime/model.h`."""
    pattern = model_functions.jacobian.sparsity_out(0)
    sizes = {role: sum(v.role is role for v in listed) for role in Role}
    sample_time = next((v.index for v in listed if v.role is Role.PARAMETER and v.name == "sample_time"), -1)
    work = [
        max(sizes)
        for sizes in zip(*[(f.sz_arg(), f.sz_res(), f.sz_iw(), f.sz_w()) for f in model_functions], strict=True)
    ]
    lines = [
        f"/* Constant table of {name}, declared in runtime/model.h. */",
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
        f"  .time_varying = {int(model_functions.rhs.jac_sparsity(0, ARGUMENTS.index('t')).nnz() > 0)},",
        f"  .solver = {f'&hfsa_{solver}' if sizes[Role.STATE] else '0'},",
        *[f"  .{f.name()} = {f.name()}," for f in model_functions],
        "  .jacobian_columns = jacobian_columns,",
        "  .jacobian_rows = jacobian_rows,",
        f"  .jacobian_entries = {pattern.nnz()},",
        "  .arg_size = {}, .res_size = {}, .iw_size = {}, .w_size = {},".format(*work),
        "};",
        "",
    ]
    return "\n".join(lines)


def _row(v: Variable) -> str:
    """Return the initialiser of a variable in the constant table."""
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
    """Return an initialiser of an integer array; C has no empty arrays, so an empty one contains an unused 0."""
    return "{" + ", ".join(str(v) for v in values or [0]) + "}"


def _string(text: str) -> str:
    """Return a C string constant; bytes outside printable ASCII become octal escapes, which end after three digits."""
    return '"' + "".join(chr(b) if 32 <= b < 127 and b not in b'"\\?' else f"\\{b:03o}" for b in text.encode()) + '"'
