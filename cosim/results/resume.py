"""Comparison of a results file with the sweep that resumes it."""

import tomllib
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from hfsa.cosim.results import hdf5
from hfsa.cosim.results.hdf5 import Node
from hfsa.cosim.results.records import Plan, ResultsError, SystemRecord


def check_same(path: Path, file: Node, plan: Plan, system: SystemRecord) -> None:
    """Raise `ResultsError`, with the differences, unless the file has the settings, axes and FMUs of this sweep."""
    if "bode" not in file:
        raise ResultsError(f"{path} holds no sweep to resume; it has {', '.join(file) or 'nothing'}")
    settings = hdf5.plain(file["sweep"].attrs)
    if earlier_version(file):  # which may lack settings of today
        settings = {**plan.settings, **settings}
    differences = [
        *_differences(settings, dict(plan.settings)),
        *_axis_differences(file["bode"], plan),
        *_branch_differences(file["bode"], plan),
        *_system_differences(file["system"], system, is_earlier=bool(earlier_version(file))),
    ]
    if differences:
        raise ResultsError(
            f"{path} belongs to another sweep: {'; '.join(differences)}. --force in place of --resume replaces it, "
            "-o names another file"
        )


def earlier_version(file: Node) -> str:
    """Return the version of hfsa that made a file, empty where it is the present one."""
    found = hdf5.text(file.attrs["tool_version"])
    return "" if found == version("hfsa") else found


def _differences(found: Mapping[str, Any], wanted: Mapping[str, Any], where: str = "") -> list[str]:
    """Return a sentence for each value that differs."""
    names = dict.fromkeys([*found, *wanted])
    return [
        f"{where}{name} is {found.get(name, 'not set')} there and {wanted.get(name, 'not set')} here"
        for name in names
        if found.get(name) != wanted.get(name)
    ]


def _axis_differences(bode: Node, plan: Plan) -> list[str]:
    """Return a sentence for each axis that differs."""
    found = bode["frequency"][:]
    differences = []
    here = plan.frequency
    if len(found) != len(here) or not np.allclose(found, here, rtol=1e-9, atol=0):
        differences.append(
            f"frequency has {len(found)} points from {found[0]:g} to {found[-1]:g} Hz there and {len(here)} from "
            f"{here[0]:g} to {here[-1]:g} Hz here{' at other values' if len(found) == len(here) else ''}"
        )
    for side, signals in (("output", plan.outputs), ("input", plan.inputs)):
        names = [signal.name for signal in signals]
        there = hdf5.texts(bode[side])
        if there != names:
            differences.append(f"{side}s are {', '.join(there)} there and {', '.join(names)} here")
    amplitudes = [signal.amplitude for signal in plan.inputs]
    if not np.array_equal(bode["amplitude"][:], amplitudes, equal_nan=True):
        there, here = (", ".join(f"{a:g}" for a in side) for side in (bode["amplitude"][:], amplitudes))
        differences.append(f"amplitude is {there} there and {here} here")
    return differences


def _branch_differences(bode: Node, plan: Plan) -> list[str]:
    """Return a sentence where only one of the sweeps has a downward one; files of earlier versions have no setting."""
    if ("branches" in bode) == plan.has_branches:
        return []
    return ["it has no downward sweep" if plan.has_branches else "it has a downward sweep too"]


def _system_differences(group: Node, system: SystemRecord, is_earlier: bool) -> list[str]:
    """Return a sentence for each FMU that differs, or one for the scene.

    Another version of hfsa makes other FMUs of the same parts, and its scenes may lack keys: of these files the FMUs of
    other makers and the contents of the scene are compared.
    """
    differences = []
    instances = {name: g for name, g in group.items() if "sha256" in g.attrs}
    for name in dict.fromkeys([*instances, *(record.instance for record in system.instances)]):
        record = next((r for r in system.instances if r.instance == name), None)
        if record is None or name not in instances:
            differences.append(f"instance {name} is only {'there' if record is None else 'here'}")
        elif is_earlier and not record.is_foreign:
            continue
        elif hdf5.text(instances[name].attrs["sha256"]) != record.sha256:
            differences.append(f"the FMU of {name} is another ({record.file})")
    there = hdf5.text(group.attrs["scene"])
    is_same = _same_scene(there, system.scene) if is_earlier else there == system.scene
    return differences if differences or is_same else ["the scene is another"]


def _same_scene(one: str, other: str) -> bool:
    """Whether two texts are one scene, but for keys that only one of them has."""
    try:
        first, second = tomllib.loads(one), tomllib.loads(other)
    except tomllib.TOMLDecodeError:
        return one == other
    common = first.keys() & second.keys()
    return {key: first[key] for key in common} == {key: second[key] for key in common}
