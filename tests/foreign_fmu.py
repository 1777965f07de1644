"""Foreign FMUs for tests: compiled from one C file, with stubs for all functions that it does not define."""

import subprocess
import zipfile
from pathlib import Path

import fmpy
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3Slave

from hfsa.fmus._interfaces import binary_path
from hfsa.fmus.compile import HEADERS, compiler

_KINDS = {2: (FMU2Model, FMU2Slave), 3: (FMU3Model, FMU3Slave)}


def foreign_fmu(folder: Path, version: int, name: str, source: Path, description: str, *flags: str) -> Path:
    """Return the FMU `name`, made in a folder of a source, compiled with VERSION defined, and a description in XML."""
    text = source.read_text()
    functions = {function for kind in _KINDS[version] for function in dir(kind) if function.startswith(f"fmi{version}")}
    missing = sorted(function for function in functions if f" {function}(" not in text)
    stubs = (f"__attribute__((weak)) int {function}(void) {{ return 3; }}\n" for function in missing)
    (folder / "stubs.c").write_text("".join(stubs))
    (folder / "source.c").write_text(text)
    given = ["-std=c99", "-fPIC", "-shared", "-w", f"-DVERSION={version}", f"-I{HEADERS}", *flags]
    subprocess.run([*compiler(), *given, "source.c", "stubs.c", "-o", "binary"], cwd=folder, check=True)
    file = folder / f"{name}.fmu"
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(folder / "binary", binary_path(Path(), version, name).as_posix())
    assert fmpy.read_model_description(str(file), validate=False).modelName == name
    return file
