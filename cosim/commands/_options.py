"""Options that several verbs of the command line share: their names, types, bounds, and one help text for all."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter
from cyclopts.validators import Number

Arguments = Annotated[
    list[str] | None,
    Parameter(
        ("-p", "--parameter"),
        negative=(),
        help="NAME=VALUE, again and again: an argument or a parameter, for a scene its own argument or "
        "instance.argument, `stack[1..3].argument` of several. Numbers of a vector are separated by commas; units are "
        "SI where none is stated.",
    ),
]
DESIGN_STUDY = Group(
    "Design study",
    help="Of a part that offers one, instead of its numbers: what follows from its dimensions. One at a time.",
    sort_key=1,
)
Json = Annotated[bool, Parameter("--json", negative=(), show_default=False, help="Answer in JSON.")]
Level = Annotated[str | None, Parameter("--level", help="Level of fidelity; the part's own default without.")]
Positive = Annotated[float | None, Parameter(validator=Number(gt=0))]
NotNegative = Annotated[float | None, Parameter(validator=Number(gte=0))]
Tolerance = Annotated[
    float | None,
    Parameter(
        validator=Number(gt=0),
        help="Relative error of the response that a level chosen by `-p instance.level=auto` may make, or the "
        "communication step of `error_controlled`; the scene's without.",
    ),
]
Algorithm = Literal[
    "auto",
    "gauss_seidel",
    "jacobi",
    "jacobi_plain",
    "gauss_seidel_linear",
    "gauss_seidel_quadratic",
    "jacobi_linear",
    "jacobi_quadratic",
    "fixed_point",
    "quasi_newton",
    "error_controlled",
    "linearized_feedback",
    "monolithic",
    "monolithic_dae",
]
Loop = Annotated[
    Literal["c", "python"], Parameter("--loop", help="Stepping loop; both give the same numbers, C many times sooner.")
]
Loops = Annotated[
    Literal["solve", "refuse"],
    Parameter(
        "--loops",
        help="Outputs that follow each other without a step between, algebraic loops: solved at every communication "
        "point, or refused before anything runs.",
    ),
]
Fuse = Annotated[
    list[str] | None,
    Parameter(
        "--fuse",
        negative=(),
        help="NAME,NAME,...: components of the scene that become one FMU, so that nothing between them waits for a "
        "step; `drive[1..3]` or `drives` names all three. Again and again for several groups.",
    ),
]
Order = Annotated[
    str | None,
    Parameter(
        "--order",
        help="The order in which components step, where the algorithm has one: NAME,NAME,... take in this order the "
        "places that they have in the scene; or `computed`, the one whose response errs least at this step.",
    ),
]
Verify = Annotated[
    bool,
    Parameter(
        "--verify",
        negative=(),
        show_default=False,
        help="Estimate the error that the communication step makes in each recorded variable, by a second run at half "
        "the step, which takes twice as long as the first.",
    ),
]
Force = Annotated[
    bool,
    Parameter(
        "--force",
        negative=(),
        show_default=False,
        help="Replace results files of hfsa that are there already; without, they are an error. Whatever else is there "
        "is never replaced.",
    ),
]
Jobs = Annotated[int | None, Parameter(("-j", "--jobs"), validator=Number(gte=1))]
Names = Annotated[list[str] | None, Parameter(negative=())]
Signals = Annotated[list[str] | None, Parameter("--signal", negative=())]
Output = Annotated[Path | None, Parameter(("-o", "--output"))]
