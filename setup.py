"""Build script: compiles the stepping loop at installation where there is a C compiler.

Without one, `cosim/assembly/native_loop.py` compiles it at first use.
"""

import runpy
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


class Build(build_ext):
    """Compiles the file that is written from the headers as well."""

    def build_extension(self, ext: Extension) -> None:
        """Write the file beside what else is being built."""
        written = Path(self.build_temp, "sizes.c")
        written.parent.mkdir(parents=True, exist_ok=True)
        written.write_text(HEADERS["sources"]()["sizes.c"], encoding="utf-8")
        ext.sources.append(str(written))
        super().build_extension(ext)


setup(ext_modules=[LOOP], cmdclass={"build_ext": Build})
