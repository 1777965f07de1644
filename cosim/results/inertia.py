"""Identified inertia of a rigid body in HDF5: ten parameters with their covariance, and the residuals.

/               title created tool tool_version git_commit command python platform format_version status
/system         text of the scene of the manoeuvre
/identification parameter: dimension scale; unit, value, standard_deviation, model, whole, alone, covariance over it;
                time [s] or point with frequency [Hz] and input, and residual [N.m], [N] over it and `component`;
                source alone_file body of motion regressor condition_number rank unseen torque_noise force_noise
                torque_residual force_residual sentences (attributes)
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.results import hdf5
from hfsa.cosim.results.hdf5 import Node
from hfsa.cosim.results.records import ResultsError, SystemRecord
from hfsa.cosim.results.store import Store, reading
from hfsa.cosim.systems.notebook import summarized, summary

COMPONENTS = ("torque[1]", "torque[2]", "torque[3]", "force[1]", "force[2]", "force[3]")
"""Components of a wrench."""

_FACTS = (
    "source",
    "alone_file",
    "body",
    "of",
    "motion",
    "regressor",
    "condition_number",
    "rank",
    "torque_noise",
    "force_noise",
    "torque_residual",
    "force_residual",
)
_VALUES = ("value", "standard_deviation", "model", "whole", "alone")


@dataclass(frozen=True)
class Residuals:
    """Residuals of the equations, body axes, (rows, 6) in the order of `COMPONENTS`: real of a run, complex of a sweep.

    Attributes:
        time: time of each row of a run [s]; `None` of a sweep.
        frequency, inputs: frequency [Hz] and excited input of each row of a sweep.
    """

    values: NDArray[Any]
    time: NDArray[np.float64] | None = None
    frequency: NDArray[np.float64] | None = None
    inputs: Sequence[str] = ()


@dataclass(frozen=True)
class Identification:
    """Identified inertia about the reference point of the signals, in body axes; arrays are over `parameters`.

    Attributes:
        path: results file; `source`: file of the manoeuvre; `alone_file`: that of the platform alone, empty without.
        body: component whose platform is the body; `of`: `body`, or its `payload`.
        motion: `measured`, `pose` or `commanded`; `regressor`: `full` or `linear`.
        parameters: names and units, (10,).
        value: inertia parameters, (10,); NaN where the manoeuvre does not determine one.
        covariance: their covariance, (10, 10).
        model: parameters of the model of the scene, (10,), NaN where none is known.
        whole, alone: parameters of the body and of the platform alone, (10,); `alone` is NaN for `of` body.
        condition_number: condition number of the scaled equations, infinite below full rank.
        rank: number of combinations that the manoeuvre determines, at most 10.
        unseen: groups of parameters that it does not determine; those of a group in combinations only.
        torque_noise, force_noise: standard deviations of the equations that the covariance refers to [N.m], [N].
        torque_residual, force_residual: root mean squares of the residuals [N.m], [N].
        sentences: what was decided, and what is known of the error.
    """

    path: Path
    source: str
    alone_file: str
    body: str
    of: str
    motion: str
    regressor: str
    parameters: Mapping[str, str]
    value: NDArray[np.float64]
    covariance: NDArray[np.float64]
    model: NDArray[np.float64]
    whole: NDArray[np.float64]
    alone: NDArray[np.float64]
    condition_number: float
    rank: int
    unseen: Sequence[Sequence[str]]
    torque_noise: float
    force_noise: float
    torque_residual: float
    force_residual: float
    residuals: Residuals
    sentences: Sequence[str] = ()

    @property
    def standard_deviation(self) -> NDArray[np.float64]:
        """Standard deviations, (10,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def center(self) -> NDArray[np.float64]:
        """Mass centre from the reference point, body axes, (3,) [m]; NaN without a mass above its uncertainty."""
        mass, deviation = self.value[0], self.standard_deviation[0]
        return self.value[1:4] / mass if abs(mass) > 3 * deviation else np.full(3, np.nan)

    @property
    def is_complete(self) -> bool:
        """Whether the manoeuvre determines all parameters."""
        return self.rank == len(self.parameters)

    @summarized
    def _repr_html_(self) -> str:
        """Return the parameters with their standard deviations, and what the manoeuvre determines of them."""
        columns = zip(self.parameters.items(), self.value, self.standard_deviation, self.model, strict=True)
        rows = [(name, f"{v:.6g}", f"{d:.2g}", f"{m:.6g}", unit) for (name, unit), v, d, m in columns]
        facts = {"file": self.path, "source": self.source, "rank": f"{self.rank} of {len(self.parameters)}"}
        headings = ["parameter", ">value", ">standard deviation", ">model", "unit"]
        return summary(f"inertia of {self.body}", facts, headings, rows)

    @classmethod
    def read(cls, path: str | Path) -> "Identification":
        """Read an identification; `ResultsError` where the file holds none."""
        path = Path(path)
        with reading(path) as file:
            if "identification" not in file:
                raise ResultsError(f"{path} holds no identification; hfsa identify writes one")
            group = file["identification"]
            facts = hdf5.plain(group.attrs)
            values = {name: group[name][:] for name in _VALUES if name != "standard_deviation"}
            parameters = dict(zip(hdf5.texts(group["parameter"]), hdf5.texts(group["unit"]), strict=True))
            if "time" in group:
                residuals = Residuals(group["residual"][:], time=group["time"][:])
            else:
                residuals = Residuals(
                    group["residual"][:], frequency=group["frequency"][:], inputs=hdf5.texts(group["input"])
                )
            return cls(
                path=path,
                parameters=parameters,
                covariance=group["covariance"][:],
                residuals=residuals,
                unseen=json.loads(facts["unseen"]),
                sentences=json.loads(facts["sentences"]),
                **values,
                **{name: facts[name] for name in _FACTS},
            )


def write_identification(found: Identification, system: SystemRecord, force: bool = False) -> None:
    """Write an identification, completely or not at all; `force` replaces a results file. `ResultsError` on failure."""
    store = Store.create(found.path, system, lambda file: _fill(file, found), force)
    hdf5.set_status(store.file, hdf5.COMPLETE)
    store.close()


def _fill(file: Node, found: Identification) -> None:
    """Write parameters, covariance, residuals and facts."""
    group = file.create_group("identification")
    hdf5.create_scale(group, "parameter", list(found.parameters))
    hdf5.create_scale(group, "other_parameter", list(found.parameters))
    hdf5.create_texts(group, "unit", ["parameter"], list(found.parameters.values()))
    for name in _VALUES:
        hdf5.create_dataset(group, name, ["parameter"], np.nan, float)[:] = getattr(found, name)
    covariance = hdf5.create_dataset(group, "covariance", ["parameter", "other_parameter"], np.nan, float)
    covariance[...] = found.covariance
    rows = found.residuals
    hdf5.create_scale(group, "component", COMPONENTS)
    if rows.time is not None:
        axis = "time"
        hdf5.create_scale(group, axis, rows.time, "s")
    else:
        axis = "point"
        hdf5.create_scale(group, axis, range(len(rows.values)))
        hdf5.create_dataset(group, "frequency", [axis], np.nan, float, "Hz")[:] = rows.frequency
        hdf5.create_texts(group, "input", [axis], rows.inputs)
    nothing = rows.values.dtype.type(np.nan)
    hdf5.create_dataset(group, "residual", [axis, "component"], nothing, rows.values.dtype)[...] = rows.values
    for name in _FACTS:
        group.attrs[name] = getattr(found, name)
    group.attrs["unseen"] = json.dumps([list(names) for names in found.unseen])
    group.attrs["sentences"] = json.dumps(list(found.sentences))
