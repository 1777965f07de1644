"""The scene: a system with a question to it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field

from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import expand
from hfsa.cosim.systems.system import Component, System

AUTO = "auto"
"""In place of an algorithm: the cheapest whose error is within the tolerance (`analysis/algorithm_choice.py`)."""

SINE_SOURCE, LOCK_IN = "sine_source", "lock_in"
"""Names of the parts that are the instruments of a measurement."""


@dataclass(frozen=True)
class Scene:
    """A system with a question to it: the response of `outputs` to small sines at `inputs`, or to a motion of its own.

    Attributes:
        system: the wiring, without the measuring instruments.
        inputs: full names of the inputs that are excited, one at a time; none where a component gives the motion.
        outputs: full names of the outputs that are measured.
        band: lowest and highest frequency [Hz].
        amplitude: of the excitation, by unit of the input: `{"m": 1e-5, "rad": 1e-4}`; needed where there are inputs.
        step_size: communication step size [s].
        stop_time: end of a time-domain run [s].
        tolerance: relative error of a response that levels, algorithm and communication step may make.
        algorithm: name of a co-simulation algorithm, or `AUTO`.
        source: the sine source; it is given the excited input's unit as argument `unit`.
        marks: frequencies [Hz] that others have found, by who or how; a Bode plot shows them.
        fuse: groups of components that become one FMU each (`assembly/fuse.py`), by name.
        scale: sizes that variables (full names) have in use, from travel, bounds, force and torque limits, in their
            units; a run stops where one is a thousand times as large (`actions/divergence.py`).
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

    def __post_init__(self):
        object.__setattr__(self, "fuse", tuple(tuple(group) for group in self.fuse))
        for label in ("inputs", "outputs"):
            names = tuple(member for name in getattr(self, label) for member in expand(name))
            for name in names:
                self.system.split(name)
            object.__setattr__(self, label, names)
        if not self.outputs:
            raise StructureError("a scene needs outputs; found none")
        if self.inputs and not self.amplitude:
            raise StructureError("a scene with inputs needs their amplitude, by unit; found none")
        low, high = self.band
        object.__setattr__(self, "band", (float(low), float(high)))
        if not 0 < low < high < math.inf:
            raise StructureError(f"band is {low:g} to {high:g} Hz, expected 0 < lowest < highest")
        for label in ("step_size", "stop_time", "tolerance"):
            value = getattr(self, label)
            if not 0 < value < math.inf:
                raise StructureError(f"{label} is {value:g}, expected a positive number")
        for label, frequency in self.marks.items():
            if not (isinstance(frequency, int | float) and 0 < frequency < math.inf):
                raise StructureError(f"mark {label!r} is at {frequency!r}, expected a frequency in Hz")
        object.__setattr__(self, "scale", {n: size for name, size in self.scale.items() for n in expand(name)})
        for name, size in self.scale.items():
            self.system.split(name)
            if isinstance(size, bool) or not (isinstance(size, int | float) and 0 < size < math.inf):
                raise StructureError(f"the scale of {name} is {size!r}, expected a positive number in its unit")
