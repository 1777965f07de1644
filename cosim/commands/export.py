"""Verb `export`: FMUs of a part, or of the fused groups of a scene."""

from pathlib import Path
from typing import Literal

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json
from hfsa.cosim.commands._options import Arguments, Fuse, Level, Output


def export(
    name: str,
    /,
    *,
    level: Level = None,
    parameter: Arguments = None,
    fuse: Fuse = None,
    fmi: Literal[2, 3] | None = None,
    output: Output = None,
    json: Json = False,
) -> int:
    """Write the FMU of a part, checked and with sources, and print its path.

    Parameters
    ----------
    name
        A component or controller, as in `hfsa list`, or the path of a .py file; with `--fuse` a scene, of whose groups
        the FMUs are written, with the scene's start values.
    fmi
        Version of FMI (default: both).
    output
        Folder (default: `fmus/built` in a checkout, else the working folder). An FMU of the same name is replaced.
    """
    from hfsa.cosim.assembly.fuse import models_to_export
    from hfsa.cosim.commands._scenes import refuse_scene
    from hfsa.cosim.results.target import check_fmu
    from hfsa.cosim.systems.errors import StructureError
    from hfsa.fmus.export import export as export_model
    from hfsa.fmus.export import file_of

    if not fuse:
        refuse_scene(name, "`--fuse NAME,NAME` exports components of it as one FMU, `run` and `sweep` simulate it")
    if output is not None and output.exists() and not output.is_dir():
        raise StructureError(f"-o {output} is a file, expected a folder")
    values = _shell.part_arguments(level, parameter)
    models = models_to_export(name, values.pop("level", None), values, fuse or ())
    folder = output or _export_folder()
    versions: tuple[Literal[2, 3], ...] = (fmi,) if fmi else (2, 3)
    for model in models:
        for version in versions:
            check_fmu(file_of(model, folder, version))
    files = [file for model in models for file in export_model(model, folder, versions)]
    _shell.answer({"files": files}, "\n".join(map(str, files)), json)
    return _shell.DONE


def _export_folder() -> Path:
    """Return `fmus/built` of this checkout, else the working folder, as an installed package is read-only."""
    checkout = Path(__file__).resolve().parents[2]
    return checkout / "fmus" / "built" if (checkout / "pyproject.toml").is_file() else Path()
