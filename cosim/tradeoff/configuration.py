"""Configuration of a scene: levels and fused groups of its parts, algorithm, and communication step."""

import dataclasses
from dataclasses import dataclass

from hfsa.cosim.fidelity.levels import with_levels_at
from hfsa.cosim.systems.names import compact
from hfsa.cosim.systems.scene import Scene


@dataclass(frozen=True)
class Composition:
    """What the FMUs of a scene are: levels (component, level) that differ from the reference, and fused groups."""

    levels: tuple[tuple[str, str], ...] = ()
    fuse: tuple[tuple[str, ...], ...] = ()

    def of(self, scene: Scene) -> Scene:
        """Return a scene at reference levels with this composition."""
        return dataclasses.replace(with_levels_at(scene, dict(self.levels)), fuse=self.fuse)

    @property
    def level_words(self) -> str:
        """Levels that differ from the reference, `sensor=planar`; empty without any."""
        by_level: dict[str, list[str]] = {}
        for component, level in self.levels:
            by_level.setdefault(level, []).append(component)
        return ", ".join(f"{name}={level}" for level, names in by_level.items() for name in compact(names))

    @property
    def group_words(self) -> list[str]:
        """Fused groups as typed after `--fuse`."""
        return [",".join(compact(group)) for group in self.fuse]

    def __str__(self) -> str:
        words = [self.level_words, *(f"{group} fused" for group in self.group_words)]
        return "; ".join(filter(None, words)) or "as the scene"


@dataclass(frozen=True)
class Configuration:
    """One way to run a scene.

    Attributes:
        composition: its FMUs.
        algorithm: co-simulation algorithm.
        step_size: communication step size [s].
    """

    composition: Composition
    algorithm: str
    step_size: float

    def of(self, scene: Scene) -> Scene:
        """Return a scene at reference levels with this configuration."""
        return dataclasses.replace(self.composition.of(scene), algorithm=self.algorithm, step_size=self.step_size)

    @property
    def line(self) -> tuple[Composition, str]:
        """What it shares with the same configuration at another step."""
        return self.composition, self.algorithm

    def __str__(self) -> str:
        composed = str(self.composition)
        where = "" if composed == "as the scene" else f", {composed}"
        return f"{self.algorithm} at {self.step_size:.4g} s{where}"


@dataclass(frozen=True)
class Prediction:
    """Predicted effect of a configuration.

    Attributes:
        error: largest relative error, NaN where it is not known, infinite where steps change stability.
        place: where it is, in words.
        unknown: reason why it is not known.
    """

    error: float
    place: str = ""
    unknown: str = ""


@dataclass(frozen=True)
class Counts:
    """Work per simulated second: communication steps, FMI calls, and right-hand sides of the solvers in the FMUs."""

    steps: float
    calls: float
    evaluations: float


@dataclass(frozen=True)
class Measurement:
    """Measured effect of a configuration.

    Attributes:
        error: largest relative error, NaN without a reference; `place`: where it is, in words.
        cost: CPU time [s] per simulated second.
        failure: reason where the configuration does not run, else empty.
    """

    error: float
    place: str = ""
    cost: float = float("nan")
    failure: str = ""


@dataclass(eq=False)
class Candidate:
    """A configuration with what is known of it.

    Attributes:
        predicted, measured: its errors; `measured` is `None` before a verification.
        cost: predicted CPU time [s] per simulated second.
        counts: work per simulated second.
        margin: longest stable step over its own step; NaN where it is not known, infinite where every step is stable.
    """

    configuration: Configuration
    predicted: Prediction
    cost: float
    counts: Counts
    margin: float = float("nan")
    measured: Measurement | None = None

    @property
    def error(self) -> float:
        """Measured error, or the predicted one."""
        return self.predicted.error if self.measured is None else self.measured.error

    @property
    def known_cost(self) -> float:
        """Measured cost, or the predicted one."""
        return self.cost if self.measured is None else self.measured.cost
