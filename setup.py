"""Compile the stepping loop where a C compiler is found; otherwise `hfsa` does so at first use: cosim/_compiled.py."""

import hashlib
from pathlib import Path

from setuptools import Extension, setup

SOURCE = "cosim/runtime/step.c"
KEY = hashlib.sha256((Path(__file__).parent / SOURCE).read_bytes()).hexdigest()[:12]

# Plain C, loaded with ctypes: cosim/stepping.py looks for it by this name, and never takes one of another source.
LOOP = Extension(
    f"hfsa.cosim._step_{KEY}",
    [SOURCE],
    extra_compile_args=["-O2", "-std=c99", "-fvisibility=hidden", "-ffp-contract=off"],
    optional=True,
)

setup(ext_modules=[LOOP])
