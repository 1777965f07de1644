"""Group `/system` of a results file: the scene, its FMU instances, and how levels, order and algorithm were chosen."""

from collections.abc import Mapping

import h5py
import numpy as np

from hfsa.cosim.results.dimensions import dataset_key, members, set_name
from hfsa.cosim.results.hdf5 import Node, create_dataset, create_scale, text, texts
from hfsa.cosim.results.records import AlgorithmChoice, DrivenInput, LevelChoice, OrderChoice, SystemRecord
from hfsa.cosim.systems.names import legible


def write_system(group: Node, system: SystemRecord) -> None:
    """Write the scene, and the FMU, start values and level of each instance."""
    group.attrs["scene"] = legible(system.scene)
    if system.left_out:
        group.attrs["left_out"] = system.left_out
    for record in system.instances:
        instance = group.create_group(dataset_key(record.instance))
        set_name(instance, record.instance)
        for attribute in ("name", "file", "sha256", "fmi_version", "level", "solver"):
            value = getattr(record, attribute)
            instance.attrs[attribute] = legible(value) if isinstance(value, str) else value
        if record.sample_time is not None:
            instance.attrs["sample_time"] = record.sample_time
        # texts are in the scene alone, which has them all
        numbers = {name: value for name, value in record.start.items() if not isinstance(value, str)}
        _write_named(instance, "start", numbers)
        if record.choice is not None:
            _write_choice(instance, record.choice)
    _write_named(group, "operating_point", system.operating_point)
    if system.driven:
        for key in ("name", "signal", "sha256"):
            values = [legible(getattr(one, key)) for one in system.driven]
            group.attrs.create(f"driven_{key}", values, dtype=h5py.string_dtype())
    if system.order is not None:
        _write_order(group, system.order)
    if system.algorithm is not None:
        _write_algorithm(group, system.algorithm)


def read_driven(group: Node) -> list[DrivenInput]:
    """Return the inputs that signals drove from the group `/system`; none where none were driven."""
    if "driven_name" not in group.attrs:
        return []
    columns = ([text(value) for value in group.attrs[f"driven_{key}"]] for key in ("name", "signal", "sha256"))
    return [DrivenInput(*row) for row in zip(*columns, strict=True)]


def _write_named(group: Node, name: str, values: Mapping[str, float]) -> None:
    """Write a group of numbers by name, unless it is empty."""
    if values:
        part = group.create_group(name)
        create_scale(part, "variable", list(values))
        create_dataset(part, "value", ["variable"], np.nan, float)[:] = list(values.values())


def _write_choice(instance: Node, choice: LevelChoice) -> None:
    """Write the choice of a level: attributes `level_...`, and the group `levels` with the error of each level."""
    for key, value in (("error", choice.error), ("error_together", choice.together), ("tolerance", choice.tolerance)):
        instance.attrs[f"level_{key}"] = value
    levels = instance.create_group("levels")
    create_scale(levels, "level", list(choice.errors))
    create_dataset(levels, "error", ["level"], np.nan, float, "1")[:] = list(choice.errors.values())
    refusals = [choice.refusals.get(level, "") for level in choice.errors]
    levels.create_dataset("refusal", data=refusals, dtype=h5py.string_dtype()).dims[0].attach_scale(levels["level"])


def read_choices(group: Node) -> dict[str, LevelChoice]:
    """Return the choices of levels by instance from the group `/system`; empty where the scene names all levels."""
    choices = {}
    for name, instance in members(group).items():
        if "level_error" in instance.attrs:
            levels = instance["levels"]
            known = texts(levels["level"])
            refusals = zip(known, texts(levels["refusal"]), strict=True)
            choices[name] = LevelChoice(
                text(instance.attrs["level"]),
                float(instance.attrs["level_tolerance"]),
                dict(zip(known, levels["error"][:].tolist(), strict=True)),
                {level: refusal for level, refusal in refusals if refusal},
                float(instance.attrs["level_error_together"]),
            )
    return choices


def _write_order(group: Node, choice: OrderChoice) -> None:
    """Write the computed order of steps and its errors: attributes `order_...` beside the scene in that order."""
    names = {"order": list(choice.order), "order_own": list(choice.own)}
    for key, value in names.items():
        group.attrs.create(key, value, dtype=h5py.string_dtype())
    for key in ("about", "error", "own_error", "compared", "is_complete"):
        group.attrs[f"order_{key}"] = getattr(choice, key)


def read_order(group: Node) -> OrderChoice | None:
    """Return the computed order of steps from the group `/system`; `None` where the order is the scene's."""
    if "order" not in group.attrs:
        return None
    attributes = group.attrs
    return OrderChoice(
        tuple(map(text, attributes["order"])),
        tuple(map(text, attributes["order_own"])),
        text(attributes["order_about"]),
        float(attributes["order_error"]),
        float(attributes["order_own_error"]),
        int(attributes["order_compared"]),
        bool(attributes["order_is_complete"]),
    )


def _write_algorithm(group: Node, choice: AlgorithmChoice) -> None:
    """Write the choice of `auto`: attributes `algorithm` and `algorithm_...`, arrays over the compared algorithms."""
    tried = list(dict.fromkeys([*choice.errors, *choice.refusals]))
    group.attrs["algorithm"] = choice.algorithm
    for key in ("step_size", "tolerance", "about", "unknown"):
        group.attrs[f"algorithm_{key}"] = getattr(choice, key)
    group.attrs.create("algorithm_tried", tried, dtype=h5py.string_dtype())
    group.attrs["algorithm_errors"] = [choice.errors.get(name, np.nan) for name in tried]
    refusals = [choice.refusals.get(name, "") for name in tried]
    group.attrs.create("algorithm_refusals", refusals, dtype=h5py.string_dtype())


def read_algorithm(group: Node) -> AlgorithmChoice | None:
    """Return the choice of `auto` from the group `/system`; `None` where the scene names the algorithm."""
    if "algorithm" not in group.attrs:
        return None
    attributes = group.attrs
    tried = list(map(text, attributes["algorithm_tried"]))
    errors = dict(zip(tried, np.atleast_1d(attributes["algorithm_errors"]).tolist(), strict=True))
    refusals = dict(zip(tried, map(text, attributes["algorithm_refusals"]), strict=True))
    return AlgorithmChoice(
        text(attributes["algorithm"]),
        float(attributes["algorithm_step_size"]),
        float(attributes["algorithm_tolerance"]),
        text(attributes["algorithm_about"]),
        {name: error for name, error in errors.items() if not refusals[name]},
        {name: why for name, why in refusals.items() if why},
        text(attributes["algorithm_unknown"]),
    )
