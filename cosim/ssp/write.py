"""A scene as a system structure package: SystemStructure.ssd, FMUs and parameter sets under resources/.

    write(Path("sdelta_hfsa.ssp"), "sdelta_hfsa", scene, assembly)

The same scene, FMUs and version give the same bytes. The file appears complete or not at all.
"""

import contextlib
import dataclasses
import os
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.ssp.annotation import annotation_text
from hfsa.cosim.ssp.describe import fmu_of, parameters_xml, structure_xml, values_of
from hfsa.cosim.ssp.element_names import legal_names
from hfsa.cosim.ssp.vocabulary import MAIN
from hfsa.cosim.systems.scene import Scene


def write(file: Path, name: str, scene: Scene, assembly: Assembly) -> dict[str, str]:
    """Write a scene that runs as the assembly; return the element of each component.

    The assembly may have components beside the scene's, such as a source at an input. Names of the scene's variables
    are those before fusing or after it. `OSError` where the file cannot be written.
    """
    elements = legal_names(component.name for component in assembly.system.components)
    packed = dataclasses.replace(
        scene,
        system=assembly.system,
        fuse=(),
        quiet_inputs=True,  # told when it was written
        **{key: [_full(assembly, variable) for variable in getattr(scene, key)] for key in _LISTS},
        scale={_full(assembly, variable): size for variable, size in scene.scale.items()},
    )
    files: dict[str, bytes] = {MAIN: structure_xml(name, packed, assembly, elements, annotation_text(packed, elements))}
    for component in assembly.system.components:
        element = elements[component.name]
        files[fmu_of(element)] = assembly.files[component.name].read_bytes()
        if component.start:
            files[values_of(element)] = parameters_xml(component.start, assembly.connectors[component.name])
    _pack(file, files)
    return elements


_LISTS = ("inputs", "outputs", "recorded")


def _full(assembly: Assembly, variable: str) -> str:
    """Return the full name of a variable in the system that the assembly has."""
    return ".".join(assembly.system.split(variable))


def _pack(file: Path, files: Mapping[str, bytes]) -> None:
    """Write an archive with fixed dates, complete or not at all."""
    real = Path(os.path.realpath(file))
    handle, unfinished = tempfile.mkstemp(prefix=".unfinished-", dir=real.parent)
    try:
        with os.fdopen(handle, "wb") as stream, zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in files.items():
                entry = zipfile.ZipInfo(name)
                entry.compress_type = zipfile.ZIP_DEFLATED
                entry.create_system = 3
                entry.external_attr = 0o644 << 16
                archive.writestr(entry, content)
        os.chmod(unfinished, 0o666 & ~_umask())
        os.replace(unfinished, real)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(unfinished)
        raise


def _umask() -> int:
    """Return the mode bits that this process takes from new files."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
