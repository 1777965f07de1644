"""Options of a sweep, before the scene and the method give their defaults."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from hfsa.cosim.assembly.assemble import Keep
from hfsa.cosim.assembly.native_loop import BACKENDS
from hfsa.cosim.measurement.task import PREVIOUS, STARTS, Settings
from hfsa.cosim.signals import excitation
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene

GRIDS = ("response", "log", "linear")
"""Spacings of frequencies: even along the curve of the linear response, on a logarithmic axis, or in hertz."""

EVEN = {"log": excitation.logarithmic, "linear": excitation.linear}
"""Frequencies of the spacings that do not depend on the response, from the ends of the band and their number."""

_AROUND = 1e-6
"""Relative width of the band in which levels and orders are judged for a single frequency."""


@dataclass(frozen=True)
class SweepRequest:
    """Options of a sweep; `None` stands for the default of the scene or of the method.

    `inputs` and `outputs` are full or short names; `low` and `high` in Hz; `amplitude` in the unit of each input;
    `jobs` is the number of threads or processes (default: one per processor); `backend` is one of `BACKENDS`. `phases`,
    `seed` and `together` are those of a multisine. `time_limit` is that of a point [s].
    """

    method: Literal["stepped", "multisine", "linear"] = "stepped"
    inputs: Sequence[str] = ()
    outputs: Sequence[str] = ()
    low: float | None = None
    high: float | None = None
    points: int | None = None
    grid: str = GRIDS[0]
    amplitude: float | None = None
    settling_tolerance: float = 1e-3
    settling_time: float = 60.0
    settling_periods: int = 0
    settling_time_min: float = 0.0
    measurement_periods: int | None = None
    jobs: int | None = None
    backend: str = BACKENDS[0]
    start: str = STARTS[0]
    keep: Keep = "needed"
    phases: str | None = None
    seed: int | None = None
    together: bool = False
    time_limit: float | None = None

    def __post_init__(self):
        given = {"phases": self.phases, "seed": self.seed, "inputs together": self.together or None}
        found = [f"--{name}" for name, value in given.items() if value is not None]
        if found and self.method != "multisine":
            raise StructureError(f"{', '.join(found)} would have no effect: it takes --method multisine")
        if self.amplitude == 0 and self.method != "linear":
            raise StructureError(
                f"--amplitude 0 excites nothing that --method {self.method} could measure; expected a positive "
                "amplitude, or --method linear, whose response is that to vanishing sines"
            )
        if self.start == PREVIOUS and self.method != "stepped":
            raise StructureError(
                f"--start {PREVIOUS} takes --method stepped: {self.method} measures no point after another"
            )

    def settings(self, scene: Scene) -> Settings:
        """Return the settings of the measurement of a scene."""
        return Settings(
            self.method,
            scene.algorithm,
            scene.step_size,
            self.settling_tolerance,
            self.measurement_periods or 1,
            self.settling_time,
            self.start,
            self.settling_periods,
            self.settling_time_min,
        )

    def band(self, scene: Scene) -> tuple[float, float]:
        """Return the lowest and the highest frequency [Hz]; a single one is where the band is said to begin."""
        low, high = scene.band
        if self.points == 1 and self.low is not None and self.high is None:
            return self.low, self.low
        return low if self.low is None else self.low, high if self.high is None else self.high

    def judged_band(self, scene: Scene) -> tuple[float, float]:
        """Return the band [Hz] in which levels and orders are judged; a narrow one about a single frequency."""
        low, high = self.band(scene)
        return (low, high * (1 + _AROUND)) if low == high else (low, high)
