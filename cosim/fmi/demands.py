"""Demands of an FMU on the tool that runs it: capability flags of FMI 2 and 3, and its default experiment.

demands.check_step("plant", 1e-3)           # StructureError where its own steps do not fit into the communication step
demands.refuse_variable_steps("plant")      # StructureError where it takes communication steps of one size only
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from hfsa.cosim.systems.errors import StructureError

TRUE = ("true", "1")
"""Texts of a flag that is set."""


@dataclass(frozen=True)
class Demands:
    """Demands of one interface of an FMU.

    Attributes:
        file: the `.fmu` file.
        tool: name of the tool that made it, empty where it is not named.
        needs_constant_step: whether all communication steps of a run must have one size.
        internal_step: step size [s] of its own solver (FMI 3), of which a communication step must be a multiple; `None`
            where it declares none.
        is_once_per_process: whether a process can have only one instance of it.
        needs_tool: whether it runs only where the tool that made it is installed.
        tolerance: relative tolerance of its default experiment, which it gets at initialization; `None` without one.
    """

    file: Path
    tool: str
    needs_constant_step: bool
    internal_step: float | None
    is_once_per_process: bool
    needs_tool: bool
    tolerance: float | None

    def check_step(self, name: str, step_size: float) -> None:
        """Raise `StructureError` where a communication step [s] is no multiple of the instance's own step."""
        own = self.internal_step
        if own is None or abs(step_size / own - max(1, round(step_size / own))) <= 1e-9 * step_size / own:
            return
        fitting = own * max(1, round(step_size / own))
        raise StructureError(
            f"{name}: {self.file.name} takes steps of its own of {own:.9g} s (fixedInternalStepSize), and the "
            f"communication step is {step_size:.9g} s: expected a multiple; the nearest one is {fitting:.9g} s"
        )

    def refuse_variable_steps(self, name: str) -> None:
        """Raise `StructureError` for an instance that does not take communication steps of any size."""
        if self.needs_constant_step:
            flag = "canHandleVariableCommunicationStepSize is false"
            raise StructureError(
                f"{name}: {self.file.name} takes communication steps of one size only ({flag}), but this algorithm "
                "chooses them; algorithms with a constant step are gauss_seidel, jacobi and quasi_newton"
            )
        if self.internal_step is not None:
            raise StructureError(
                f"{name}: {self.file.name} takes steps of its own of {self.internal_step:.9g} s "
                "(fixedInternalStepSize), but this algorithm chooses its communication steps; algorithms with a "
                "constant step are gauss_seidel, jacobi and quasi_newton"
            )

    def second_instance(self, name: str, first: str) -> StructureError:
        """Return the error for another instance in a process where the FMU has one."""
        return StructureError(
            f"{name}: {self.file.name} can be instantiated only once per process "
            f"(canBeInstantiatedOnlyOncePerProcess), and {first} is its instance here; expected one component of it, "
            "and one input of a sweep at a time"
        )

    @property
    def absent_tool(self) -> str:
        """Sentence on the tool that a failed instantiation may lack; empty where none is needed."""
        if not self.needs_tool:
            return ""
        return f"it runs only where {self.tool or 'the tool that made it'} is installed (needsExecutionTool)"


def demands(
    file: Path, tool: str, experiment: Mapping[str, str], flags: Mapping[str, str], is_co_simulation: bool
) -> Demands:
    """Return the demands of an interface from the attributes of its element and of the default experiment."""
    return Demands(
        file,
        tool,
        is_co_simulation and flags.get("canHandleVariableCommunicationStepSize") not in TRUE,
        _positive(flags.get("fixedInternalStepSize")) if is_co_simulation else None,
        flags.get("canBeInstantiatedOnlyOncePerProcess") in TRUE,
        flags.get("needsExecutionTool") in TRUE,
        _positive(experiment.get("tolerance")),
    )


def _positive(text: str | float | None) -> float | None:
    """Return a positive number of the description, `None` for anything else."""
    try:
        number = float(text or 0.0)
    except ValueError:
        return None
    return number if 0 < number < math.inf else None
