"""Build script: compiles the stepping loop, and what stands in for foreign FMUs, where there is a C compiler.

Without one, `cosim/assembly/native_loop.py` and `isolation.py` compile them at first use.
"""

import os
import runpy
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).parent
FOLDER = "cosim/masters/native"
HEADERS = runpy.run_path(str(ROOT / FOLDER / "headers.py"))
PATHS = [file.relative_to(ROOT).as_posix() for file in sorted((ROOT / FOLDER).glob("*.[ch]"))]

# Plain C, loaded with cffi: cosim/masters/native/library.py looks for it by this name, and never takes one of other
# sources.
LOOP = Extension(
    f"hfsa.cosim.masters.native.{HEADERS['library_name']()}",
    [path for path in PATHS if path.endswith(".c")],
    depends=[path for path in PATHS if path.endswith(".h")],
    include_dirs=[FOLDER],
    extra_compile_args=list(HEADERS["FLAGS"]),
    optional=True,
)

FOREIGN = "cosim/fmi/isolation"
STAND_INS = runpy.run_path(str(ROOT / FOREIGN / "sources.py"))
FILES = [file.relative_to(ROOT).as_posix() for file in sorted((ROOT / FOREIGN).glob("*.[ch]"))]

STAND_IN = Extension(
    f"hfsa.cosim.fmi.isolation.{STAND_INS['library_name']()}",
    [path for path in FILES if path.endswith(".c")],
    depends=[path for path in FILES if path.endswith(".h")],
    include_dirs=[FOREIGN],
    libraries=list(STAND_INS["LINKED"]) if sys.platform == "linux" else [],
    extra_compile_args=list(STAND_INS["FLAGS"]),
    optional=True,
)


class Build(build_ext):
    """Compiles the file that is written from the headers as well."""

    def build_extension(self, ext: Extension) -> None:
        """Write the file beside what else is being built."""
        if ext is not LOOP:
            super().build_extension(ext)
            return
        written = Path(self.build_temp, "sizes.c")
        written.parent.mkdir(parents=True, exist_ok=True)
        written.write_text(HEADERS["sources"]()["sizes.c"], encoding="utf-8")
        ext.sources.append(str(written))
        super().build_extension(ext)


setup(ext_modules=[LOOP, STAND_IN] if os.name == "posix" else [LOOP], cmdclass={"build_ext": Build})
