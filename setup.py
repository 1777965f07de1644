"""Build script: compiles the stepping loop at installation where there is a C compiler.

Without one, `cosim/assembly/native_loop.py` compiles it at first use.
"""

import hashlib
from pathlib import Path

from setuptools import Extension, setup

ROOT = Path(__file__).parent
SOURCES = sorted((ROOT / "cosim/masters/native").glob("*.[ch]"))
KEY = hashlib.sha256(b"".join(file.read_bytes() for file in SOURCES)).hexdigest()[:12]
PATHS = [file.relative_to(ROOT).as_posix() for file in SOURCES]

# plain C, loaded with ctypes; cosim/masters/native/stepping.py finds it by this name, which has a hash of the sources
LOOP = Extension(
    f"hfsa.cosim.masters.native._step_{KEY}",
    [path for path in PATHS if path.endswith(".c")],
    depends=[path for path in PATHS if path.endswith(".h")],
    extra_compile_args=["-O2", "-std=c99", "-fvisibility=hidden", "-ffp-contract=off"],
    optional=True,
)

setup(ext_modules=[LOOP])
