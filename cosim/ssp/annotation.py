"""What a scene has and a system structure has not, as an annotation: settings, order of steps, names of components.

The text is the TOML of the scene's settings, with a table `elements` that gives the component of each element, in the
order of steps:

    algorithm = "jacobi_plain"
    step_size = 5e-05
    elements = { reference = "reference", drive_1 = "drive[1]" }
"""

from collections.abc import Mapping
from typing import Any

from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.scene_file import read_settings, settings_text, toml_line

ELEMENTS = "elements"
"""Key of the table of names."""


def annotation_text(scene: Scene, elements: Mapping[str, str]) -> str:
    """Return the annotation of a scene; `elements` are the names of its components' elements."""
    names = {element: component for component, element in elements.items()}
    return settings_text(scene) + toml_line(ELEMENTS, names)


def read_annotation(text: str, where: str) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the settings of a scene, and the component of each element, in the order of steps.

    `StructureError` for what is no such text; `where` names it.
    """
    table = read_settings(text, where, (ELEMENTS,))
    elements = table.pop(ELEMENTS, {})
    if not isinstance(elements, dict) or not all(isinstance(name, str) for name in elements.values()):
        raise StructureError(f"{where}: elements is {elements!r}, expected a table of component names")
    return table, elements
