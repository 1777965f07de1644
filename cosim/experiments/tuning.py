"""Tuned options: the answer of a trade as options of a run or a sweep of the same scene."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hfsa.cosim.assembly.load_scene import load_scene, with_arguments
from hfsa.cosim.results.trade import tuned
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import AUTO, Scene
from hfsa.cosim.systems.scene_file import scene_text


def scene_words(scene: Scene) -> str:
    """Return the text of a scene without what a configuration determines, and without the settings of a run."""
    neutral = {"algorithm": AUTO, "step_size": 1.0, "stop_time": 1.0, "tolerance": 1.0, "fuse": ()}
    return scene_text(dataclasses.replace(scene, **neutral))


def tuned_options(
    file: str | Path, scene: str | Path | Scene, parameters: Mapping[str, Any] | None, given: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the parameters and the options by which a scene is set up as the answer of a trade.

    `given` are options of the user that the answer determines: `StructureError` for one that has a value, for a level
    among the parameters, and where the file is of another scene.
    """
    row, words = tuned(file)
    parameters = dict(parameters or {})
    if conflicts := [f"--{name.replace('_', '-')}" for name, value in given.items() if value]:
        raise StructureError(f"{', '.join(conflicts)} would change the answer of {file}: leave it out, or --tuned")
    loaded = with_arguments(scene, parameters) if isinstance(scene, Scene) else load_scene(str(scene), parameters)
    if scene_words(loaded) != words:
        raise StructureError(
            f"{file} is of another scene, or of the same with other arguments (-p), so that its error is not known "
            "here; run hfsa trade for this scene"
        )
    options: dict[str, Any] = {"step_size": row.step_size, "algorithm": row.algorithm, "fuse": row.groups}
    return {**parameters, **row.arguments}, options
