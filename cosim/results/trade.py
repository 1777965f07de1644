"""Trade of speed for accuracy in HDF5: all configurations of a scene that were evaluated, and the answer.

/         title created tool tool_version git_commit command python platform format_version status
/system   text of the scene at its reference levels
/trade    dimension `configuration`; algorithm, step_size [s], levels, fuse; predicted_error, measured_error, relative,
          with their places; predicted_cost, measured_cost, CPU time [s] per simulated second; steps, calls, evaluations
          per simulated second; stability_margin; failure over it. purpose tolerance answer next_cheaper default
          reference uncertainty sentences (attributes); an index of -1 stands for none
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hfsa.cosim.results import hdf5
from hfsa.cosim.results.hdf5 import Node
from hfsa.cosim.results.records import ResultsError, SystemRecord
from hfsa.cosim.results.store import Store, reading
from hfsa.cosim.signals.prefixes import readable
from hfsa.cosim.systems.notebook import drawn_by, summarized, summary

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_NUMBERS = {
    "step_size": "s",
    "predicted_error": "1",
    "measured_error": "1",
    "predicted_cost": "1",
    "measured_cost": "1",
    "steps": "1/s",
    "calls": "1/s",
    "evaluations": "1/s",
    "stability_margin": "1",
}
_TEXTS = ("algorithm", "levels", "fuse", "predicted_place", "measured_place", "failure")
_INDICES = {"answer": "answer", "next_cheaper": "next_cheaper", "default": "own"}


@dataclass(frozen=True)
class TradeRow:
    """One configuration of a scene.

    Attributes:
        algorithm, step_size: co-simulation algorithm and communication step size [s].
        levels: level of each component that has several, `sensor=planar, drive[1..3]=ideal`.
        fuse: fused groups, separated by spaces, each as after `--fuse`.
        predicted_error, measured_error: largest relative errors, NaN where not known; `..._place`: where they are.
        predicted_cost, measured_cost: CPU time [s] per simulated second, NaN where not known.
        steps, calls, evaluations: communication steps, FMI calls and right-hand sides per simulated second.
        stability_margin: longest stable step over this one; infinite without a limit, NaN where not known.
        failure: reason where it did not run, else empty.
    """

    algorithm: str
    step_size: float
    levels: str = ""
    fuse: str = ""
    predicted_error: float = math.nan
    predicted_place: str = ""
    measured_error: float = math.nan
    measured_place: str = ""
    predicted_cost: float = math.nan
    measured_cost: float = math.nan
    steps: float = math.nan
    calls: float = math.nan
    evaluations: float = math.nan
    stability_margin: float = math.nan
    failure: str = ""

    @property
    def is_measured(self) -> bool:
        """Whether the configuration was run."""
        return not math.isnan(self.measured_cost)

    @property
    def error(self) -> float:
        """Measured error, else the predicted one."""
        return self.predicted_error if math.isnan(self.measured_error) else self.measured_error

    @property
    def cost(self) -> float:
        """Measured cost, else the predicted one."""
        return self.predicted_cost if math.isnan(self.measured_cost) else self.measured_cost

    @property
    def groups(self) -> list[str]:
        """Fused groups, each as after `--fuse`."""
        return self.fuse.split()

    @property
    def arguments(self) -> dict[str, str]:
        """Levels as arguments of the scene, `{"sensor.level": "planar"}`."""
        pairs = (word.rpartition("=") for word in self.levels.split(", ") if word)
        return {f"{component}.level": level for component, _, level in pairs}

    def __str__(self) -> str:
        words = [f"{self.algorithm} at a step of {self.step_size:.4g} s"]
        words += [f"{group} fused" for group in self.groups]
        return ", ".join(words)


@dataclass(frozen=True)
class Trade:
    """Trade of a scene: the cheapest way to run it within a tolerance, and all others that were evaluated.

    Attributes:
        path: results file; `title`: title of the scene.
        purpose: `response` or `motion`.
        tolerance: largest relative error.
        rows: configurations, the cheapest first.
        answer, next_cheaper, own: indices of the answer, of the next cheaper one that misses the tolerance, and of the
            scene's default; `None` without any.
        reference: what measured errors refer to, or why there is none.
        uncertainty: relative difference of two references, NaN without.
        sentences: the answer in words, the first sentence first.
    """

    path: Path
    title: str
    purpose: str
    tolerance: float
    rows: Sequence[TradeRow]
    answer: int | None
    next_cheaper: int | None
    own: int | None
    reference: str
    uncertainty: float
    sentences: Sequence[str]

    @property
    def best(self) -> TradeRow | None:
        """The answer."""
        return None if self.answer is None else self.rows[self.answer]

    @property
    def front(self) -> list[TradeRow]:
        """Measured configurations than which no other is both cheaper and more accurate, the cheapest first."""
        found: list[TradeRow] = []
        measured = (row for row in self.rows if row.is_measured and not math.isnan(row.measured_error))
        for row in sorted(measured, key=lambda row: (row.cost, row.error)):
            if not found or row.error < found[-1].error:
                found.append(row)
        return found

    @property
    def shown(self) -> list[TradeRow]:
        """The front, with the answer and the default, the cheapest first."""
        others = [self.rows[i] for i in (self.answer, self.own) if i is not None]
        return sorted({id(row): row for row in (*self.front, *others)}.values(), key=lambda row: row.cost)

    def plot(self) -> "Figure":
        """Return the figure of error over CPU time."""
        return drawn_by("trade", "trade_figure")(self)

    @summarized
    def _repr_html_(self) -> str:
        """Return the front with the answer and the default, the cheapest first, and the answer in words."""
        facts = {"file": self.path, "tolerance": f"{100 * self.tolerance:g} %", "answer": " ".join(self.sentences[:1])}
        rows = [
            ("answer" if row is self.best else "", str(row), f"{100 * row.error:.2g} %", readable(row.cost, "s"))
            for row in self.shown
        ]
        return summary(self.title, facts, ["", "configuration", ">error", ">CPU time per simulated second"], rows)

    @classmethod
    def read(cls, path: str | Path) -> "Trade":
        """Read a trade; `ResultsError` where the file holds none."""
        path = Path(path)
        with reading(path) as file:
            if "trade" not in file:
                raise ResultsError(f"{path} holds no trade; hfsa trade writes one")
            group = file["trade"]
            facts = hdf5.plain(group.attrs)
            columns = {name: group[name][:].tolist() for name in _NUMBERS}
            columns |= {name: hdf5.texts(group[name]) for name in _TEXTS}
            rows = [TradeRow(**dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)]
            places = {field: facts[name] if facts[name] >= 0 else None for name, field in _INDICES.items()}
            title = hdf5.text(file.attrs["title"])
        return cls(
            path,
            title,
            facts["purpose"],
            facts["tolerance"],
            rows,
            reference=facts["reference"],
            uncertainty=facts["uncertainty"],
            sentences=json.loads(facts["sentences"]),
            **places,
        )


def write_trade(found: Trade, system: SystemRecord, force: bool = False) -> None:
    """Write a trade, completely or not at all; `force` replaces a results file of hfsa. `ResultsError` on failure."""
    store = Store.create(found.path, system, lambda file: _fill(file, found), force)
    hdf5.set_status(store.file, hdf5.COMPLETE)
    store.close()


def tuned(path: str | Path) -> tuple[TradeRow, str]:
    """Return the answer of a trade and the text of its scene; `ResultsError` where the file has no answer."""
    found = Trade.read(path)
    if found.best is None:
        raise ResultsError(f"{path} has no answer: {' '.join(found.sentences[:1])}")
    with reading(Path(path)) as file:
        return found.best, hdf5.text(file["system"].attrs["scene"])


def _fill(file: Node, found: Trade) -> None:
    """Write the rows and the answer."""
    group = file.create_group("trade")
    hdf5.create_scale(group, "configuration", range(len(found.rows)))
    for name, unit in _NUMBERS.items():
        dataset = hdf5.create_dataset(group, name, ["configuration"], math.nan, float, unit)
        dataset[...] = [getattr(row, name) for row in found.rows]
    for name in _TEXTS:
        hdf5.create_texts(group, name, ["configuration"], [getattr(row, name) for row in found.rows])
    facts: Mapping[str, object] = {
        "purpose": found.purpose,
        "tolerance": found.tolerance,
        "reference": found.reference,
        "uncertainty": found.uncertainty,
        "sentences": json.dumps(list(found.sentences)),
    }
    indices = {name: -1 if getattr(found, field) is None else getattr(found, field) for name, field in _INDICES.items()}
    for name, value in {**facts, **indices}.items():
        group.attrs[name] = value
