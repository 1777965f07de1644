"""Origin of a results file of any kind: attributes, FMUs, scene, and what its makers say of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import h5py

from hfsa.cosim.results import hdf5
from hfsa.cosim.results.dimensions import members
from hfsa.cosim.results.records import InstanceRecord
from hfsa.cosim.results.store import reading
from hfsa.cosim.results.system_group import read_algorithm, read_driven, read_order


@dataclass(frozen=True)
class Source:
    """Origin of a results file.

    Attributes:
        attributes: those of the file, as text.
        instances: FMUs by instance; start values are left out.
        scene: text of the scene, or name and arguments of the part.
        sentences: choices of order and algorithm, driven inputs, states left out, warnings of FMUs.
    """

    attributes: Mapping[str, str]
    instances: Sequence[InstanceRecord]
    scene: str
    sentences: Sequence[str]


def read_source(path: str | Path) -> Source:
    """Read the origin of a results file; `ResultsError` where it is none."""
    path = Path(path)
    with reading(path) as file:
        attributes = {name: hdf5.text(value) for name, value in file.attrs.items() if name not in _ELSEWHERE}
        group = file["system"]
        instances = [_instance(name, node) for name, node in members(group).items() if isinstance(node, h5py.Group)]
        scene = hdf5.text(group.attrs.get("scene", ""))
        sentences = [*_sentences(group), *hdf5.warnings_of(file)]
        return Source(attributes, [one for one in instances if one.sha256], scene, sentences)


_ELSEWHERE = ("tool", "format_version", "warnings", "writer")
"""Attributes of a file that say nothing of its origin, or are sentences."""


def _instance(name: str, group: h5py.Group) -> InstanceRecord:
    """Return the FMU of an instance, empty for a group that is none."""
    model, file, sha256, level, solver = (
        hdf5.text(group.attrs.get(key, "")) for key in ("name", "file", "sha256", "level", "solver")
    )
    sample_time = group.attrs.get("sample_time")
    return InstanceRecord(
        name,
        model,
        file,
        sha256,
        int(group.attrs.get("fmi_version", 0)),
        level,
        solver,
        sample_time=None if sample_time is None else float(sample_time),
    )


def _sentences(group: h5py.Group) -> list[str]:
    """Return sentences on the choices, and on what was driven and left out."""
    order, algorithm = read_order(group), read_algorithm(group)
    found = [choice.sentence for choice in (order, algorithm) if choice is not None]
    found += [f"{one.name} driven by {one.signal}" for one in read_driven(group)]
    left_out = hdf5.text(group.attrs.get("left_out", ""))
    return [*found, *([left_out] if left_out else [])]


def groups_of(path: str | Path) -> set[str]:
    """Return the names of groups and datasets of a results file, `bode`, `bode/response`; errors as `read_source`."""
    path = Path(path)
    names: set[str] = set()
    with reading(path) as file:
        file.visit(names.add)
    return names
