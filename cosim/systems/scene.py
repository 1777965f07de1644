"""Scene: a system with its excitation, outputs, and settings of a measurement."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field

from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.kinds import instance, is_number, is_positive, listed, refuse, table, text, texts
from hfsa.cosim.systems.names import expand
from hfsa.cosim.systems.notebook import summarized, summary
from hfsa.cosim.systems.system import Component, System

AUTO = "auto"
"""Algorithm name for the cheapest one with an error within the tolerance (`analysis/algorithm_choice.py`)."""

MOST_STEPS = 2.0**53
"""Most steps of a run, of which a number of 64 bits can count each."""

SINE_SOURCE, LOCK_IN = "sine_source", "lock_in"
MULTISINE_SOURCE, SAMPLER = "multisine_source", "sampler"
"""Names of the parts that are the instruments of a measurement."""

LINEAR_TRANSFORMATION = "linear_transformation"
"""Name of the part that applies gains, offsets and conversions of units between components."""


@dataclass(frozen=True)
class Scene:
    """System, and the response to measure: of `outputs` to small sines at `inputs`, or to its own motion.

    Attributes:
        system: components and connections, without the measuring instruments.
        inputs: full names of the excited inputs, one at a time; empty where a component generates the motion.
        outputs: full names of the measured outputs.
        band: lowest and highest frequency [Hz].
        amplitude: amplitude of the excitation by unit of the input, `{"m": 1e-5, "rad": 1e-4}`; required with inputs.
        step_size: communication step size [s].
        stop_time: end of a time-domain run [s].
        tolerance: largest relative error of a response due to levels, algorithm and communication step.
        algorithm: name of a co-simulation algorithm, or `AUTO`.
        source: sine source; its argument `unit` is set to the unit of the excited input.
        marks: published frequencies [Hz] by source, shown in Bode plots.
        fuse: groups of components, by name, each compiled into one FMU (`assembly/fuse.py`).
        scale: typical sizes of variables (full names), from travel, bounds, force and torque limits, in their units;
            a run stops where a variable is a thousand times as large (`actions/divergence.py`).
        recorded: full names of further variables that runs record beside the outputs.
        quiet_inputs: whether inputs that nothing feeds are meant so, and not told.
    """

    system: System
    inputs: Sequence[str]
    outputs: Sequence[str]
    _: KW_ONLY
    step_size: float
    stop_time: float
    band: tuple[float, float] = (1.0, 100.0)
    amplitude: Mapping[str, float] = field(default_factory=dict)
    tolerance: float = 1e-3
    algorithm: str = AUTO
    source: Component = field(default_factory=lambda: Component("source", SINE_SOURCE))
    marks: Mapping[str, float] = field(default_factory=dict)
    fuse: Sequence[Sequence[str]] = ()
    scale: Mapping[str, float] = field(default_factory=dict)
    recorded: Sequence[str] = ()
    quiet_inputs: bool = False

    def __post_init__(self):
        instance("system", self.system, System)
        instance("source", self.source, Component)
        text("algorithm", self.algorithm, "the name of an algorithm")
        instance("quiet_inputs", self.quiet_inputs, bool)
        self._check_numbers()
        groups = listed("fuse", self.fuse, "a list of lists of component names")
        fuse = tuple(texts("a group of fuse", group, "a list of component names") for group in groups)
        object.__setattr__(self, "fuse", fuse)
        for label in ("inputs", "outputs", "recorded"):
            given = texts(label, getattr(self, label), "a list of full names")
            names = tuple(member for name in given for member in expand(name))
            for name in names:
                self.system.split(name)
            object.__setattr__(self, label, names)
        if not self.outputs:
            raise StructureError("a scene needs outputs; found none")
        if self.inputs and not self.amplitude:
            raise StructureError("a scene with inputs needs their amplitude, by unit; found none")
        scale = table("scale", self.scale, "a table of numbers")
        object.__setattr__(self, "scale", {n: size for name, size in scale.items() for n in expand(name)})
        for name, size in self.scale.items():
            self.system.split(name)
            if not is_positive(size):
                refuse(f"the scale of {name}", size, "a positive number in its unit")

    @summarized
    def _repr_html_(self) -> str:
        """Return the components, and how they are excited, observed and stepped."""
        low, high = self.band
        facts = {
            "inputs": ", ".join(self.inputs) or "a motion of its own",
            "outputs": ", ".join(self.outputs),
            "band": f"{low:g} to {high:g} Hz",
            "step": f"{self.step_size:g} s",
            "algorithm": self.algorithm,
            "tolerance": f"{100 * self.tolerance:g} %",
        }
        rows = [
            (one.name, one.part, one.level or "", ", ".join(f"{name}={value}" for name, value in one.arguments.items()))
            for one in self.system.components
        ]
        title = f"scene of {len(rows)} components, {len(self.system.connections)} connections"
        return summary(title, facts, ["component", "part", "level", "arguments"], rows)

    def _check_numbers(self) -> None:
        """Raise `StructureError` for a band, step, time, tolerance, amplitude or mark that is no such number."""
        band = listed("band", self.band, "a list of two numbers")
        if len(band) != 2 or not all(map(is_number, band)):
            refuse("band", list(band), "a list of two numbers")
        low, high = map(float, band)
        object.__setattr__(self, "band", (low, high))
        if not 0 < low < high < math.inf:
            raise StructureError(f"band is {low:g} to {high:g} Hz, expected 0 < lowest < highest")
        for label in ("step_size", "stop_time", "tolerance"):
            value = getattr(self, label)
            if not is_number(value):
                refuse(label, value, "a number")
            if not is_positive(value):
                raise StructureError(f"{label} is {value:g}, expected a positive number")
            object.__setattr__(self, label, float(value))
        if not self.stop_time / self.step_size <= MOST_STEPS:
            raise StructureError(
                f"step_size {self.step_size:g} s and stop_time {self.stop_time:g} s make more than {MOST_STEPS:g} "
                "steps, expected fewer"
            )
        for unit, amplitude in table("amplitude", self.amplitude, "a table of numbers by unit").items():
            if not is_number(amplitude):
                refuse(f"the amplitude in {unit}", amplitude, "a number")
        for label, frequency in table("marks", self.marks, "a table of numbers").items():
            if not is_positive(frequency):
                raise StructureError(f"mark {label!r} is at {frequency!r}, expected a frequency in Hz")
