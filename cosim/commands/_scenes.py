"""Names of scenes where a part is expected, and of parts and folders where a scene is."""

from pathlib import Path

from hfsa.components._modelling.loading import is_path, kind_of
from hfsa.cosim.assembly.load_scene import FILES, available_scenes
from hfsa.cosim.assembly.models import available_parts
from hfsa.cosim.systems.errors import StructureError


def refuse_scene(name: str, advice: str) -> None:
    """Raise `StructureError`, with advice, for the name or path of a scene where a part is expected."""
    if is_path(name):
        path = Path(name)
        is_scene = path.is_file() and (path.suffix in FILES or (path.suffix == ".py" and kind_of(path) == "scene"))
    else:
        is_scene = name in available_scenes() and name not in available_parts()
    if is_scene:
        raise StructureError(f"{name} is a scene, expected a part; {advice}")


def refuse_other(name: str) -> None:
    """Raise `StructureError` for the name of a part and for a folder `*.toml` or `*.ssp`, where a scene is expected."""
    if name in available_parts() and name not in available_scenes():
        raise StructureError(f"{name} is a part, expected a scene; `export` and `analyze` take it")
    if name.endswith(FILES) and Path(name).is_dir():
        raise StructureError(f"{name} is a folder, expected the file of a scene")
