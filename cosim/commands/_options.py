"""Options shared by several verbs: names, types, bounds, and one help text for all."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Group, Parameter
from cyclopts.validators import Number

from hfsa.cosim.masters.algorithms import ALGORITHMS
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import AUTO

Arguments = Annotated[
    list[str] | None,
    Parameter(
        ("-p", "--parameter"),
        negative=(),
        help="NAME=VALUE, repeatable: an argument or a parameter; for a scene its own argument or "
        "instance.argument, `stack[1..3].argument` for several. Numbers of a vector are separated by commas; units are "
        "SI unless stated.",
    ),
]
Level = Annotated[str | None, Parameter("--level", help="Level of fidelity (default: the part's own).")]
Force = Annotated[
    bool,
    Parameter(
        "--force",
        negative=(),
        show_default=False,
        help="Replace existing results files of hfsa (default: they are an error). No other file is ever replaced.",
    ),
]
Fuse = Annotated[
    list[str] | None,
    Parameter(
        "--fuse",
        negative=(),
        help="NAME,NAME,...: components of the scene compiled into one FMU, without communication steps between them; "
        "`drive[1..3]` or `drives` stands for all three. Repeatable, one group each.",
    ),
]
Jobs = Annotated[
    int | None,
    Parameter(
        ("-j", "--jobs"), validator=Number(gte=1), help="Number of threads or processes (default: one per processor)."
    ),
]
Scheduler = Annotated[
    str | None,
    Parameter(
        "--scheduler",
        help="Address of a scheduler of dask.distributed, `tcp://host:8786`: its workers compute instead of this "
        "machine. They have the same hfsa installed, and receive FMUs from here (needs the extra `cluster`).",
    ),
]
Names = Annotated[list[str] | None, Parameter(negative=())]
Signals = Annotated[list[str] | None, Parameter("--signal", negative=())]
Drives = Annotated[list[str] | None, Parameter("--drive", negative=())]
Output = Annotated[Path | None, Parameter(("-o", "--output"))]
Positive = Annotated[float | None, Parameter(validator=Number(gt=0))]
TimeLimit = Annotated[
    float | None,
    Parameter(
        "--time-limit",
        validator=Number(gt=0),
        help="Longest time [s] that a run, or a point of a sweep, may take: beyond it, it has failed, and what is "
        "recorded stays (default: none).",
    ),
]
if TYPE_CHECKING:
    Choice = str
else:
    Choice = Literal[(AUTO, *ALGORITHMS)]
AlgorithmName = Annotated[
    Choice | None,
    Parameter(
        "--algorithm",
        help="Co-simulation algorithm (default: the scene's). `auto` chooses the cheapest one with a predicted error "
        "within the tolerance.",
    ),
]
OrderOfSteps = Annotated[
    str | None,
    Parameter(
        "--order",
        help="Order of steps of the components, where the algorithm has one (default: the scene's): NAME,NAME,... are "
        "permuted among their places in the scene; `computed` is the order with the least error of the response.",
    ),
]
Step = Annotated[
    float | None,
    Parameter("--step", validator=Number(gt=0), help="Communication step size [s] (default: the scene's)."),
]
Tuned = Annotated[
    Path | None,
    Parameter(
        "--tuned",
        help="Results file of `hfsa trade` for this scene: its answer determines levels, groups, algorithm and step.",
    ),
]
Keep = Annotated[
    Literal["needed", "all"] | None,
    Parameter(
        "--keep",
        help="States and outputs of the parts that run: those that reach a recorded output or a limit flag, or all "
        "(default: needed). The responses are the same.",
    ),
]
Verify = Annotated[
    bool,
    Parameter(
        "--verify",
        negative=(),
        show_default=False,
        help="Estimate the error of each recorded variable due to the communication step, by a second run at half "
        "the step, which takes twice as long.",
    ),
]
DESIGN_STUDY = Group(
    "Design study",
    help="Effect of the dimensions of a part with a design study, instead of its numbers. One option at a time.",
    sort_key=1,
)


@Parameter(name="*")
@dataclass(frozen=True)
class SteppingOptions:
    """Options of the co-simulation: step, algorithm, fused groups, order, tolerance, backend and pruning."""

    step: Step = None
    algorithm: AlgorithmName = None
    fuse: Fuse = None
    order: OrderOfSteps = None
    tolerance: Annotated[
        float | None,
        Parameter(
            validator=Number(gt=0),
            help="Largest relative error of the response for levels chosen by `-p instance.level=auto`, for algorithm "
            "`auto`, and for the steps of `error_controlled` (default: the scene's).",
        ),
    ] = None
    algebraic_loops: Annotated[
        Literal["solve", "refuse"] | None,
        Parameter(
            "--algebraic-loops",
            help="Algebraic loops between FMUs: solve them at every communication point, or refuse the scene before "
            "anything runs (default: solve).",
        ),
    ] = None
    backend: Annotated[
        Literal["c", "python"] | None,
        Parameter("--backend", help="Stepping loop (default: c). Both give the same numbers; C is many times faster."),
    ] = None
    keep: Keep = None

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of an experiment for the options that are given."""
        chosen = ALGORITHMS.get(self.algorithm or "")
        if self.backend is not None and chosen is not None and chosen.is_model_exchange:
            raise StructureError(f"--backend: {self.algorithm} takes no steps and has no stepping loop")
        return given({"step_size" if name == "step" else name: value for name, value in asdict(self).items()})


@Parameter(name="*")
@dataclass(frozen=True)
class SineOptions:
    """Options of a sine at one input."""

    input: Annotated[str | None, Parameter(help="Input of the sine (default: the scene's first, if it has one).")] = (
        None
    )
    frequency: Annotated[
        float | None,
        Parameter(validator=Number(gt=0), help="Frequency of the sine [Hz] (default: lower end of the scene's band)."),
    ] = None
    amplitude: Annotated[
        float | None,
        Parameter(
            validator=Number(gte=0),
            help="Amplitude of the sine in the unit of its input, 0 for no excitation (default: the scene's).",
        ),
    ] = None

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of an experiment for the options that are given."""
        return given(asdict(self))


def given(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that have a value; the others keep the defaults of the experiment."""
    return {name: value for name, value in options.items() if value is not None}


def refuse(options: Mapping[str, Any], reason: str) -> None:
    """Raise `StructureError`, with the reason, for a given option that would have no effect."""
    found = [name for name, value in options.items() if value not in (None, False)]
    if found:
        raise StructureError(f"{', '.join(found)} would have no effect: {reason}")
